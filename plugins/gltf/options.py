"""Settings of .glb files."""

from __future__ import annotations

from dataclasses import dataclass

from hairkit.grooming.adopt_strands import ImportOptions
from hairkit.grooming.prepare_export import AnimationOptions, ExportOptions
from hairkit.options import option


@dataclass(frozen=True)
class Options(ExportOptions, AnimationOptions, ImportOptions):
    """Settings of the .glb exporter and importer."""

    lines: str = option(
        "all",
        choices=("all", "guides", "none"),
        doc="Strands written as lines, the only form that is read back.",
    )
    hair: str = option(
        "ribbons",
        choices=("ribbons", "cards", "none"),
        doc="Triangles: a ribbon for each of some strands, cards for locks of them, or none.",
    )
    strips: int = option(
        0, low=0, high=500_000, doc="Ribbons or cards; 0 makes 4000 ribbons or 800 cards."
    )
    strip_points: int = option(16, low=2, high=128, doc="Points along each ribbon or card.")
    strip_width: float = option(
        0.0, low=0.0, high=0.05, doc="Width of a strip; 0 covers what 100,000 hairs do.", unit="m"
    )
    lods: int = option(
        1,
        low=1,
        high=6,
        doc="Levels of detail, each with half the strips, twice as wide: one scene of the file"
        " each.",
    )
    alpha: str = option(
        "MASK", choices=("OPAQUE", "MASK", "BLEND"), doc="How the strips' texture is cut out."
    )
    head_mesh: bool = option(True, doc="Write the head.")
    bust: bool = option(True, doc="Write a clothed bust under a head that ends at the neck.")
    animation: str = option(
        "morph",
        choices=("morph", "skin", "none"),
        doc="From the cache: the hair's shapes and the head's motion, the head's motion with hair"
        " rigid on it, or nothing.",
    )
    frame_step: int = option(1, low=1, high=1000, doc="Every how manieth frame of the cache.")
    morphs: int = option(
        256,
        low=1,
        high=1000,
        doc="Shapes that the animation is mixed from at most; as many as frames keep it within"
        " 0.1 mm. WebGL 2 promises room for 256.",
    )
    metres: float = option(
        1.0, low=1e-6, high=1e3, doc="Metres in one unit of a file that is read.", unit="m"
    )
