"""Settings of segments, fields and their weights."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from hairkit.field.view_fusion import FusionOptions
from hairkit.options import option


@dataclass(frozen=True)
class Options(FusionOptions):
    """Settings of segments, fields and their weights."""

    segments: Path | None = option(
        None, doc="A .ply or .npz with 3D segments in metres, to use instead of the photos' lines."
    )
    longest: float = option(
        0.06, low=0.005, high=0.5, unit="m", doc="Length of the longest segment."
    )
    ribbon: float = option(
        0.004, low=0, high=0.05, unit="m", doc="How far a ribbon reaches to either side."
    )
    strand_weight: float = option(
        0.05, low=0, high=1000, doc="Weight of strand cells in V; large values fix them."
    )
    scalp_weight: float = option(
        0.1, low=0, high=100, doc="Weight of the combing prior at the scalp in V."
    )
    parting_weight: float = option(
        0.15, low=0, high=10, doc="Weight of the comb from the parting in the hair on the crown."
    )
    surface: float = option(0.5, low=0, high=10, doc="Largest weight of S, on strand cells.")
    surface_reach: float = option(
        0.004, low=1e-4, high=0.1, unit="m", doc="Distance from strands at which S falls to 1/e."
    )
    outward: float = option(0.2, low=0, high=10, doc="Largest weight of grad(I), at the scalp.")
    signed: float = option(0.1, low=0, high=10, doc="Weight of O.")
    tolerance: float = option(2e-2, low=1e-8, high=0.1, doc="Relative residual of the solvers.")
