"""What field and strands are made from: stage results, and what is measured in them."""

from __future__ import annotations

from dataclasses import dataclass

from hairkit.types.mask import Mask
from hairkit.types.orientation import OrientationMap
from hairkit.types.parting import Parting
from hairkit.types.scene import Scene
from hairkit.types.tie import TiedHair
from hairkit.types.volume import Hull, ScalpDistance
from hairkit.types.waves import Waves


@dataclass(frozen=True, eq=False)
class Evidence:
    """The fields have the names of the arguments of `solve_field` and `track`."""

    scene: Scene
    masks: tuple[Mask, ...]
    """Of all views, in the order of the scene's cameras."""
    orientations: tuple[OrientationMap, ...]
    hull: Hull
    waves: Waves
    scalp_distance: ScalpDistance
    parting: Parting
    tied: TiedHair
