"""Last steps of every tracker: lead the strands to their tie, smooth, wave, push them outside."""

from __future__ import annotations

from dataclasses import dataclass

from hairkit.grooming.head_collision import push_out_of_head
from hairkit.grooming.lead_to_ties import lead_to_ties
from hairkit.grooming.make_room import make_room
from hairkit.grooming.wind_waves import add_waves
from hairkit.helices import smooth_strands
from hairkit.options import option
from hairkit.types.strands import Strands
from hairkit.types.tie import TiedHair
from hairkit.types.volume import Hull, OrientationField
from hairkit.types.waves import Waves


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
    waves: bool = option(True, doc="Wind the strands into the waves measured in the photos.")
    points: int = option(64, low=2, high=255, doc="Points of every strand; equal segments.")


def finish(
    strands: Strands,
    waves: Waves,
    tied: TiedHair,
    hull: Hull,
    field: OrientationField,
    options: FinishOptions,
) -> Strands:
    """Lead strands to their ties, smooth them by helices, wave them, push them out of the head.

    Smoothing and waves only where the options ask for it; `options.points` is used by the tracker.
    """
    strands = lead_to_ties(strands, tied, hull, field)
    if options.helix_tolerance > 0:
        strands = smooth_strands(strands, options.helix_tolerance)
    if options.waves:
        strands = add_waves(make_room(strands, waves, hull), waves)
    return push_out_of_head(strands, hull, options.clearance)
