"""Settings of cards."""

from __future__ import annotations

from dataclasses import dataclass

from hairkit.grooming.prepare_export import ExportOptions
from hairkit.options import option


@dataclass(frozen=True)
class Options(ExportOptions):
    """Settings of the exporter of cards."""

    cards: int = option(2000, low=8, high=20_000, doc="Cards of the finest level.")
    levels: int = option(
        4, low=1, high=6, doc="Levels of detail, each with 0.55 of the cards before."
    )
    stations: int = option(10, low=3, high=64, doc="Pairs of vertices along each card.")
    atlas: int = option(2048, low=256, high=16_384, doc="Edge of the atlas.", unit="px")
    bones: int = option(
        0, low=0, high=200, doc="Chains of bones; 0 is none in .glb and 40 in .vrm."
    )
    alpha: str = option("MASK", choices=("MASK", "BLEND"), doc="How the atlas is cut out.")
    head_mesh: bool = option(True, doc="Write the head.")
    author: str = option("unknown", doc="Author named in a .vrm file.")
