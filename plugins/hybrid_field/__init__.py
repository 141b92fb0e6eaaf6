"""Hybrid field: surface structure, internal direction, internal distance and growth direction.

The patent's first stage, on the cells of the hull: `H = a_s S + a_v V + a_i grad(I) + a_o O`.

1. Oriented 3D segments: lines followed in each photo and lifted onto the hull, and lines followed
   through the confident outer cells of the fused field. Neighbouring segments vote on their signs.
2. S, surface structure: segments widened to ribbons, spread by diffusion.
3. V, internal direction: the tensor v v^T, fixed at strands and roots, elsewhere weighted by the
   certainty of the fused views, diffused; its sign comes from O.
4. I, internal distance: 0 in the head, 1 on strands, 1 plus the distance to them at the border,
   harmonic in between; its gradient points outward.
5. O, growth direction: the signed tangents of segments and the scalp prior, diffused.

Weights differ from cell to cell: S counts near strands, V away from them, grad(I) at the scalp.
Tight curls show no direction; theirs hang down along the head, and the coils of type 4 hair stand
off it (`hairkit.field.hanging_hair`).

* `four_fields`: the four fields and their weighted sum
* `given_segments`: oriented 3D segments from a file
* `options`: settings of segments, fields and their weights
* `photo_lines`: lines through orientation maps, lifted onto the hull
* `ribbons`: segments widened along the surface
* `segments`: oriented 3D segments
"""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor

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
from hairkit.arrays import read_only
from hairkit.field.diffusion import CellGraph
from hairkit.field.growth_prior import (
    ScalpPrior,
    add_scalp_prior,
    comb_cells,
    growth_potential,
    long_share,
)
from hairkit.field.hanging_hair import hang_curls, stand_coils
from hairkit.field.scalp_comb import fringe_share
from hairkit.field.unseen import add_flow
from hairkit.field.view_fusion import fuse_views
from hairkit.parallel import thread_count

from .four_fields import (
    Fields,
    blend,
    growth_direction,
    internal_direction,
    internal_distance,
    surface_structure,
)
from .given_segments import read_segments, segments_in_hair
from .options import Options
from .ribbons import ribbons
from .segments import Way, find_segments, orient_segments

__all__ = ["Options", "blend", "find_segments", "internal_distance", "ribbons"]


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
    """Return the blended field with its signs and the internal distance."""
    growth = growth_potential(hull, scalp_distance)
    if waves.curly and not waves.coiled:
        return hang_curls(scene.head, hull, growth)
    length = scalp_distance.hair_length
    way = Way(growth, scene.head, parting, length)
    part = scene.one_sided
    lies = max(long_share(length), fringe_share(masks, scene.cameras, scene.head))
    surface = part * lies  # other short hair stands off, and its ends make the surface
    fused = fuse_views(scene.cameras, masks, orientations, hull, waves, options, surface=surface)
    if waves.coiled:
        return stand_coils(hull, scalp_distance, growth, fused.tensor, fused.certainty)
    if options.segments is None:
        segments = find_segments(scene.cameras, masks, fused, hull, way, options)
    else:
        given = segments_in_hair(read_segments(options.segments), hull, options.segments)
        segments = orient_segments(given, hull, way)
    band = ribbons(segments, hull, options.ribbon)
    comb = comb_cells(scene.head, hull, growth, parting, length)
    prior = ScalpPrior(options.scalp_weight, options.parting_weight)
    seen = fused.tensor, fused.certainty
    seen = add_flow(scene.head, hull, growth, long_share(length), *seen) if part else seen
    wanted, weight = add_scalp_prior(scene.head, hull, *seen, comb, prior, parting, length)
    cells = CellGraph.of(hull.loose)
    with ThreadPoolExecutor(thread_count()) as pool:
        parts = (
            pool.submit(surface_structure, cells, band, options.tolerance),
            pool.submit(internal_direction, cells, wanted, weight, band, options),
            pool.submit(internal_distance, hull, segments, options.tolerance, part),
            pool.submit(growth_direction, cells, band, comb, options.tolerance),
        )
        fields = Fields(*(part.result() for part in parts))
    direction, distance = blend(hull, band, fields, options), read_only(fields.distance)
    confidence = np.zeros(hull.grid.shape, np.float32)
    confidence[hull.loose] = np.clip(weight, 0, 1)
    return OrientationField(
        hull.grid, None, read_only(confidence), read_only(growth), direction, distance
    )
