"""Roots on the scalp: sampling, binding to faces, and the growth mesh that joins them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import numpy.typing as npt
from scipy.spatial import Delaunay, QhullError, cKDTree

from hairkit.arrays import BoolArray, Float32Array, Float64Array, Int32Array, Int64Array
from hairkit.errors import InputError
from hairkit.head_model.bvh import build_tree, nearest_on_surface
from hairkit.head_model.free_points import take_free
from hairkit.head_model.reach import Reach
from hairkit.head_model.template import default_head
from hairkit.types.head import Head, Roots

MAX_ROOTS = 200_000
CANDIDATES_PER_ROOT = 12
"""Points tried for each root; with fewer, gaps stay open."""
PACKING = 0.7
"""Roots that dart throwing packs into a square whose edge is their least distance."""
FIRST_CANDIDATES = 64
"""Candidates added to those of the packing, so that large radii have some."""
BATCH = 16_384
"""Candidates made at once where so many are likely to be tried; each takes 0.2 kB while it is
made."""
SHRINK = 0.95
"""Factor from one radius of the dart throwing to the next."""
_LONGEST_EDGE = 3.2
"""Edges of the growth mesh longer than this many root spacings bridge what is not scalp."""
_GOLDEN = 0.5 * (np.sqrt(5.0) - 1)
"""Multiples of it, less their whole parts, are spread evenly over [0, 1) in every run of them."""
_MOST_TIMES = 16
"""Factor by which the sequence is prolonged at most in one go."""
_SPARE = 1.02
"""Roots tried beyond those that should do."""
_STEPS = np.array(
    [15111065706836454659, 12378569675163806722, 10140184033053478359], dtype=np.uint64
)
"""2^64 / g, / g^2 and / g^3 with g^4 = g + 1: steps of Roberts' R3 sequence (2018), in integers."""


def sample_roots(
    head: Head,
    count: int,
    seed: int = 0,
    *,
    first: int = 0,
    rest: Head | None = None,
    guides: Roots | None = None,
) -> Roots:
    """Return `count` roots of a sequence whose every beginning covers the scalp evenly.

    Progressive dart throwing (McCool and Fiume 1992): candidates are taken in turn when no root is
    nearer than a radius; when all have been tried the radius shrinks and there are more candidates.
    So the first 600 of 8,000 roots are those of 600.

    Distances are measured on the head at rest. Triangles and barycentric weights therefore depend
    on its topology and scalp alone: heads fitted to other photos, or by other versions of a
    library, carry their roots at the same places. Where the head's density is below 1 the sequence
    is thinned: each place is taken or left by its own number in [0, 1), however many roots there
    are and wherever else hair grows.

    Parameters
    ----------
    head : Head
    count : int
        1 to 200,000, with `first`.
    seed : int
        Another seed gives another sequence.
    first : int
        Roots of the sequence to leave out, for hair that is added to guides.
    rest : Head, optional
        The head before it was fitted; by default the template where `head` has its faces, else
        `head` itself.
    guides : Roots, optional
        Roots of guides, between which hair is wanted: only where they stand near enough to each
        other (`hairkit.head_model.reach`), on the scalp or off it. None: on all the scalp.

    Raises
    ------
    InputError
        `count` is out of bounds, the scalp has no area, or too little hair grows on it.
    """
    if not (count >= 1 and first >= 0 and first + count <= MAX_ROOTS):
        raise InputError(f"{count} roots asked for, expected 1 to {MAX_ROOTS}")
    at_rest, reach = _at_rest(head, rest), None
    if guides is not None:
        at_rest, reach = _growing_between(at_rest, guides)
    triangle, barycentric = _growing_roots(at_rest, first + count, seed, reach)
    return roots_at(head, triangle[first:], barycentric[first:])


def roots_at(head: Head, triangle: npt.ArrayLike, barycentric: npt.ArrayLike) -> Roots:
    """Return the roots on faces (N,) at barycentric weights (N, 3), with smooth normals."""
    face = np.asarray(triangle, np.int32)
    weights = np.asarray(barycentric, np.float64)
    normals = _interpolate(head, face, weights, head.normals())
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-12)
    positions = evaluate(head, face, weights)
    uv = _interpolate(head, face, weights, head.uv)
    return Roots(
        positions.astype(np.float32),
        normals.astype(np.float32),
        uv.astype(np.float32),
        face,
        weights.astype(np.float32),
    )


def bind(points: npt.ArrayLike, head: Head) -> tuple[Int32Array, Float32Array]:
    """Return the face (N,) nearest to each of points (N, 3) and the barycentric weights (N, 3)."""
    triangle, weights, _ = nearest_on_surface(build_tree(head.vertices, head.faces), points)
    return triangle, weights.astype(np.float32)


def evaluate(head: Head, triangle: npt.ArrayLike, barycentric: npt.ArrayLike) -> Float64Array:
    """Return the positions (N, 3) in metres of faces (N,) at barycentric weights (N, 3)."""
    weights = np.asarray(barycentric, np.float64)
    return _interpolate(head, np.asarray(triangle), weights, head.vertices)


def growth_mesh(roots: Roots, head: Head) -> Int32Array:
    """Return triangles (F, 3) between neighbouring roots, counter-clockwise from outside.

    Delaunay on the stereographic projection of the scalp from its middle (conformal, so that round
    triangles stay round), without those whose longest edge bridges a gap; every root has at least
    one. The vertices are the roots, in their order, as HairWorks wants its growth mesh.

    Raises
    ------
    InputError
        Fewer than three roots, or all on a line.
    """
    if len(roots) < 3:
        raise InputError(f"a growth mesh needs at least 3 roots, got {len(roots)}")
    points = roots.positions.astype(np.float64)
    try:
        faces = Delaunay(_project(points, roots.normals.astype(np.float64))).simplices
    except QhullError as error:
        raise InputError("the roots lie on one line; a growth mesh needs area") from error
    faces = _without_bridges(points, faces)
    a, b, c = (points[faces[:, k]] for k in range(3))
    outward = roots.normals.astype(np.float64)[faces].sum(axis=1)
    inverted = (np.cross(b - a, c - a) * outward).sum(axis=1) < 0
    faces[inverted] = faces[inverted][:, ::-1]
    return faces.astype(np.int32)


def _interpolate(
    head: Head, triangle: npt.NDArray[np.integer], weights: Float64Array, values: npt.ArrayLike
) -> Float64Array:
    corners = np.asarray(values, np.float64)[head.faces[triangle]]
    return np.asarray(np.einsum("nk,nkd->nd", weights, corners))


def _at_rest(head: Head, rest: Head | None) -> Head:
    """Return the head in the shape that it had before it was fitted, as far as that is known."""
    for shape in (rest, default_head()):
        if shape is not None and np.array_equal(shape.faces, head.faces):
            return replace(head, vertices=shape.vertices)
    return head


def _growing_between(head: Head, guides: Roots) -> tuple[Head, Reach]:
    """Return the head with scalp under guides that stand off it, and the reach of all guides."""
    reach = Reach.of(evaluate(head, guides.triangle, guides.barycentric))
    on_scalp = (head.scalp[head.faces[guides.triangle]] * guides.barycentric).sum(axis=1) > 0.5
    if on_scalp.all():
        return head, reach
    off = Reach(cKDTree(reach.tree.data[~on_scalp]), reach.radius[~on_scalp])
    scalp = np.maximum(head.scalp, off.covers(head.vertices))
    scalp[head.faces[guides.triangle[~on_scalp]]] = 1
    return replace(head, scalp=scalp), reach


def _growing_roots(
    head: Head, count: int, seed: int, reach: Reach | None
) -> tuple[Int32Array, Float64Array]:
    """Return the first `count` roots of a seed's sequence that its density keeps."""
    area = _scalp_area(head, reach)
    bearing = np.flatnonzero(area)
    middle = np.full((len(bearing), 3), 1 / 3)
    share = float(np.average(head.density_at(bearing, middle), weights=area[bearing]))
    wanted = _with_spare(count, share)
    while True:
        triangle, barycentric = _progressive_roots(head, area, wanted, seed, reach)
        chance = np.arange(1, wanted + 1) * _GOLDEN % 1.0
        kept = np.flatnonzero(head.density_at(triangle, barycentric) > chance)[:count]
        if len(kept) == count:
            return triangle[kept], barycentric[kept]
        if wanted == MAX_ROOTS:
            raise InputError(
                f"hair grows at {len(kept)} of {MAX_ROOTS} roots, expected {count}; ask for fewer"
            )
        wanted = max(_with_spare(count, len(kept) / wanted), min(2 * wanted, MAX_ROOTS))


def _with_spare(count: int, share: float) -> int:
    """Return how many roots leave `count` when a share of them, at most 1, is kept."""
    if share >= 1:
        return count
    return min(int(count / max(share, 1 / _MOST_TIMES) * _SPARE) + 1, MAX_ROOTS)


def _progressive_roots(
    head: Head, area: Float64Array, count: int, seed: int, reach: Reach | None
) -> tuple[Int32Array, Float64Array]:
    """Return the first `count` roots of a seed's sequence: faces (N,) and weights (N, 3)."""
    shift = np.random.PCG64(seed).random_raw(3)  # raw bits are the same in every NumPy (NEP 19)
    whole = None if reach is None else _covered_faces(head, area, reach, -1.0)
    likely = CANDIDATES_PER_ROOT * count + FIRST_CANDIDATES
    tried = min(likely, BATCH)
    number, point = _candidates(head, area, 0, tried, shift, reach, whole)
    apart = np.full(len(number), np.inf)  # metres to the root that is known to be nearest
    taken, found = np.empty(count, np.int64), 0
    total = float(area.sum())
    radius = np.sqrt(total)
    while found < count:
        radius *= SHRINK
        wanted = int(CANDIDATES_PER_ROOT * PACKING * total / radius**2) + FIRST_CANDIDATES
        if wanted > tried:
            last = max(wanted, min(likely, tried + BATCH))
            later, where = _candidates(head, area, tried, last, shift, reach, whole)
            number, point = np.concatenate([number, later]), np.concatenate([point, where])
            apart = np.concatenate([apart, np.full(len(later), np.inf)])
            tried = last
        now = int(np.searchsorted(number, wanted))
        found = take_free(point[:now], apart[:now], radius, taken, found)
    return even_places(area, number[taken], shift)


def face_areas(head: Head) -> Float64Array:
    """Return the areas (F,) of a head's faces, square metres."""
    a, b, c = head.vertices.astype(np.float64)[head.faces.T]
    return np.asarray(0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1))


def _scalp_area(head: Head, reach: Reach | None) -> Float64Array:
    """Return the area (F,) of each face, 0 of those that bear no hair."""
    area: Float64Array = face_areas(head) * (head.scalp[head.faces].max(axis=1) > 0.5)
    if reach is not None:
        area *= _covered_faces(head, area, reach, 1.0)
    if not area.sum() > 0:
        raise InputError("the head's scalp has no area: mark whole faces, not single vertices")
    return area


def _covered_faces(head: Head, area: Float64Array, reach: Reach, sign: float) -> BoolArray:
    """Return the faces (F,) of some area that guides reach: wholly for -1, nearly or more for 1."""
    covered = np.zeros(len(area), bool)
    some = np.flatnonzero(area)
    corners = head.vertices.astype(np.float64)[head.faces[some]]
    middle = corners.mean(axis=1)
    size = np.linalg.norm(corners - middle[:, None], axis=2).max(axis=1)
    covered[some] = reach.covers(middle, sign * size)
    return covered


def _candidates(
    head: Head,
    area: Float64Array,
    first: int,
    last: int,
    shift: npt.NDArray[np.uint64],
    reach: Reach | None,
    whole: BoolArray | None,
) -> tuple[Int64Array, Float64Array]:
    """Return the numbers (N,) and points (N, 3) of `first` to `last` that lie on the scalp.

    `whole` (F,) are the faces that lie within the reach.
    """
    number = np.arange(first, last)
    face, weight = even_places(area, number, shift)
    on_scalp = (head.scalp[head.faces[face]] * weight).sum(axis=1) > 0.5
    number, face = number[on_scalp], face[on_scalp]
    point = evaluate(head, face, weight[on_scalp])
    if reach is None or whole is None:
        return number, point
    kept = whole[face]
    kept[~kept] = reach.covers(point[~kept])
    return number[kept], point[kept]


def even_places(
    area: Float64Array, number: Int64Array, shift: npt.NDArray[np.uint64]
) -> tuple[Int32Array, Float64Array]:
    """Return the faces (N,), weights (N, 3) at numbers (N,) of an even sequence on areas (F,)."""
    index = number.astype(np.uint64)[:, None]
    along, root, share = ((index * _STEPS + shift) >> np.uint64(11)).T * 2.0**-53
    total = np.cumsum(area)
    face = np.minimum(np.searchsorted(total, along * total[-1], side="right"), len(area) - 1)
    root = np.sqrt(root)
    weight = np.stack([1 - root, root * (1 - share), root * share], axis=1)
    return face.astype(np.int32), weight


def _project(points: Float64Array, normals: Float64Array) -> Float64Array:
    """Project points (N, 3) stereographically to (N, 2), about their mean normal."""
    pole = normals.mean(axis=0)
    pole /= max(float(np.linalg.norm(pole)), 1e-12)
    helper = np.eye(3)[np.abs(pole).argmin()]
    right = np.cross(helper, pole)
    right /= np.linalg.norm(right)
    middle = 0.5 * (points.min(axis=0) + points.max(axis=0))
    middle -= 0.25 * np.ptp(points @ pole) * pole
    direction = points - middle
    direction /= np.maximum(np.linalg.norm(direction, axis=1, keepdims=True), 1e-12)
    plane = np.stack([direction @ right, direction @ np.cross(pole, right)], axis=1)
    return np.asarray(plane / np.maximum(1 + direction @ pole, 1e-3)[:, None])


def _without_bridges(points: Float64Array, faces: Int32Array) -> Int32Array:
    """Return the faces that bridge no gap; a root that would lose all keeps its smallest."""
    edges = np.stack([points[faces[:, k]] - points[faces[:, k - 1]] for k in range(3)])
    longest = np.linalg.norm(edges, axis=2).max(axis=0)
    spacing = np.median(cKDTree(points).query(points, k=2)[0][:, 1])
    keep = longest <= _LONGEST_EDGE * max(float(spacing), 1e-9)
    order = np.argsort(longest, kind="stable")
    used = np.zeros(len(points), bool)
    used[faces[keep]] = True
    for face in order[~keep[order]]:
        if not used[faces[face]].all():
            keep[face] = True
            used[faces[face]] = True
    return np.asarray(faces[keep])
