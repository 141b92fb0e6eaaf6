"""3D orientation field: planes of all views fused by confidence, the rest filled by diffusion.

A 2D orientation and the ray through its pixel span a plane that holds the strand; with plane
normals N_i the direction D minimises `sum w_i (N_i . D)^2` (Wei et al. 2005; thesis 5.3 with the
weights the right way round). Every view contributes to a cell with a weight that falls with the
cell's depth behind the first hair the view sees ("see-through"). D D^T is diffused with its
certainty (Paris et al. 2008; thesis 5.4); near the scalp, where photos show little, a weak prior
gives the direction in which hair leaves the head. A potential that grows with the distance from the
scalp through the hair later tells a strand's root from its tip.

On the crown, which level photos see at a grazing angle, long hair is combed from its parting
(`hairkit.field.parting`). Photos of tight curls show no strand direction (`hairkit.imaging.waves`):
there the field hangs down along the head (`hairkit.field.hanging_hair`), and the tracker winds the
strands about it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hairkit import (
    Hull,
    Mask,
    OrientationField,
    OrientationMap,
    Parting,
    ScalpDistance,
    Scene,
    Waves,
    hookimpl,
)
from hairkit.field.diffusion import solve_screened
from hairkit.field.growth_prior import ScalpPrior, add_scalp_prior, growth_potential
from hairkit.field.hanging_hair import hang_curls
from hairkit.field.view_fusion import FusionOptions, fuse_views
from hairkit.options import option

HARD_WEIGHT = 1e3
"""Weight against `smoothness` that keeps a cell as it is."""


@dataclass(frozen=True)
class Options(FusionOptions):
    """Settings of fusion and diffusion."""

    min_views: int = option(1, low=1, high=8, doc="Views a cell needs to be fused.")
    smoothness: float = option(0.4, low=1e-4, high=100, doc="Weight of the diffusion.")
    scalp_weight: float = option(
        0.1, low=0, high=100, doc="Weight of the combing prior at the scalp; large values fix it."
    )
    scalp_reach: float = option(
        0.02, low=0, high=0.1, unit="m", doc="Distance from the scalp within which the prior acts."
    )
    scalp: str = option(
        "combed", choices=("combed", "normal"), doc="Direction at the scalp: combed, or its normal."
    )
    hard: bool = option(False, doc="Keep fused cells and the scalp as they are (Dirichlet).")
    scalp_lift: float = option(
        0.6, low=0, high=5, doc="Outward part of the prior against its tangential part."
    )
    parting_weight: float = option(
        0.15, low=0, high=10, doc="Weight of the comb from the parting in the hair on the crown."
    )
    tip_share: float = option(
        0.6,
        low=0.05,
        high=1,
        doc="Cells this far along the longest way from the scalp count as tips.",
    )
    tolerance: float = option(2e-2, low=1e-8, high=0.1, doc="Relative residual of the solver.")


@hookimpl
def solve_field(
    scene: Scene,
    masks: tuple[Mask, ...],
    orientations: tuple[OrientationMap, ...],
    hull: Hull,
    waves: Waves,
    scalp_distance: ScalpDistance,
    parting: Parting,
    options: Options,
) -> OrientationField:
    """Fuse the views, add the scalp prior, diffuse over the loose hull."""
    growth = growth_potential(hull, scalp_distance, options.tip_share)
    if waves.curly:
        return hang_curls(scene.head, hull, growth)
    fused = fuse_views(scene.cameras, masks, orientations, hull, waves, options, options.min_views)
    tensor, certainty = fused.tensor, fused.certainty
    prior = ScalpPrior(
        options.scalp_weight,
        options.scalp_reach,
        options.scalp_lift,
        options.scalp == "normal",
        options.parting_weight,
    )
    data, weight = add_scalp_prior(scene.head, hull, growth, tensor, certainty, prior, parting)
    if options.hard:
        weight = np.where(weight > 0, HARD_WEIGHT, 0).astype(np.float32)
    solved = solve_screened(
        hull.loose, data, weight, options.smoothness, tolerance=options.tolerance
    )
    field = np.zeros((*hull.grid.shape, 6), np.float32)
    field[hull.loose] = solved
    confidence = np.zeros(hull.grid.shape, np.float32)
    confidence[hull.loose] = np.clip(weight, 0, 1)
    return OrientationField(hull.grid, field, confidence, growth)
