"""The last steps of every tracker: smooth what was grown, wind it into waves, keep it out of the
head."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from hairkit.grooming.head_collision import push_out_of_head
from hairkit.grooming.wind_waves import add_waves
from hairkit.helices import smoothed
from hairkit.imaging.waves import measure_waves
from hairkit.options import option
from hairkit.types.mask import Mask
from hairkit.types.orientation import OrientationMap
from hairkit.types.scene import Scene
from hairkit.types.strands import Strands
from hairkit.types.volume import Hull


@dataclass(frozen=True)
class FinishOptions:
    """Options that trackers share; plugins inherit them."""

    clearance: float = option(0.001, low=0, high=0.02, unit="m", doc="Distance kept from the head.")
    helix_tolerance: float = option(
        0.0,
        low=0,
        high=0.01,
        unit="m",
        doc="Smooth strands by helix arcs within this mean distance; 0: leave them.",
    )
    waves: bool = option(True, doc="Wind the strands as the photos' waves do.")
    points: int = option(64, low=2, high=255, doc="Points of every strand; equal segments.")


def finished(
    strands: Strands,
    scene: Scene,
    masks: Sequence[Mask],
    orientations: Sequence[OrientationMap],
    hull: Hull,
    options: FinishOptions,
) -> Strands:
    """Return the strands smoothed by helices and wound as the photos' waves, where the options ask
    for it, and out of the head; `options.points` are the tracker's own affair."""
    if options.helix_tolerance > 0:
        strands = smoothed(strands, options.helix_tolerance)
    if options.waves:
        strands = add_waves(strands, measure_waves(orientations, masks, scene.cameras))
    return push_out_of_head(strands, hull, options.clearance)
