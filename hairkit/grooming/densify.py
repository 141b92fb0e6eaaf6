"""Interpolate full hair from guides: each new strand blends the guides around its root.

Courses are blended relative to the root at equal arc-length fractions, only among guides that agree
with the nearest one, so that partings stay clear, and then lie in locks (`hairkit.grooming.locks`).
Detail finer than the guides' overall shape (waves, frizz) is copied from one guide, because waves
out of phase average to nothing.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt
from scipy.spatial import cKDTree

from hairkit.arrays import BoolArray, Float32Array, Float64Array, Int64Array
from hairkit.errors import InputError
from hairkit.grooming.locks import (
    STRAY_WIDTH,
    USUAL_LOCKS,
    LockOptions,
    gather,
    strand_widths,
    turn_about,
    wander,
)
from hairkit.grooming.smooth_curves import smooth_curves
from hairkit.head_model.scalp import roots_at, sample_roots
from hairkit.types.groom import Groom, HairMaterial
from hairkit.types.head import Roots
from hairkit.types.strands import Strands

NEIGHBOURS = 8
"""Guides considered for a new strand."""
MIXED = 4
"""Guides mixed at most, the nearest that agree."""
CHORDS = 4
"""Pieces of a guide whose directions are compared."""
MAX_ANGLE = np.radians(60.0)
"""Guides whose chords differ by more are not mixed."""
MAX_TIP_GAP = 0.5
"""Guides whose tips lie further apart than this share of their length are not mixed."""
COURSE_SIGMA = 0.06
"""Width of the smoothing that parts a guide's course from its waves, in shares of its length."""
NEAR_ENOUGH = 5e-4
"""Metres: guides nearer to a new root than this weigh no more."""
BEYOND_FARTHEST = 1.05
"""Half the distance at which weights fall to 0, in distances of the farthest guide mixed."""
MOST_STRETCH = 1.3
"""Factor by which a mixture, shorter than its guides, is lengthened at most."""
RIM_NEIGHBOURS, RIM_FROM, RIM_AT = 16, 0.25, 0.6
"""Guides around a root, and how far their middle lies off it, in shares of their mean distance,
where the rim of the hair begins and at it."""
MOST_WISPS = 6000
"""Wisps that hair is gathered in at most."""
MAX_POINTS = 128
"""Points a strand at most; longer guides are resampled."""


def densify(
    guides: Groom | Strands,
    count: int,
    seed: int = 0,
    *,
    roots: Roots | npt.ArrayLike | None = None,
    locks: LockOptions | None = USUAL_LOCKS,
    material: HairMaterial | None = None,
) -> Strands:
    """Return `count` strands: the guides first, then hair interpolated between them.

    Parameters
    ----------
    guides
        A groom, whose head gives new roots and whose material gives widths; or bare strands.
    count
        Strands wanted; when there are no more than the guides, the guides come back as they are.
    seed
        Equal seeds give equal hair.
    roots
        Where the new strands start, count - S at least, as `Roots` or positions (N, 3). By
        default those of `roots_between`, or between neighbouring guides of bare strands.
    locks
        How new hair lies in locks and strays from them; None mixes the guides exactly.
    material
        Gives the widths; the groom's by default.
    """
    strands = guides.strands if isinstance(guides, Groom) else guides
    if len(strands) == 0:
        raise InputError("there are no guides to interpolate hair from")
    if count <= len(strands):
        return strands
    if material is None:
        material = guides.material if isinstance(guides, Groom) else HairMaterial()
    generator = np.random.default_rng(seed)
    even = strands.resampled(int(np.clip(strands.counts.max(), 2, MAX_POINTS)))
    bundle = _Bundle.of(even)
    positions, uv = _new_roots(guides, bundle, count - len(strands), roots, seed, generator)
    mix = _choose_guides(bundle, positions)
    colours = None if even.colours is None else mix.of(even.colours.reshape(bundle.course.shape))
    course, nearest = _mix_courses(bundle, mix), mix.guides[:, 0]
    thinned = np.ones(len(positions), np.float32)
    if locks is None:
        new = positions[:, None] + course + bundle.waves[nearest]
    else:
        curly = material.curl_radius > 0  # else the waves are bends, which must stay as they are
        stray = generator.random(len(course)) < locks.stray
        locks = locks if curly else replace(locks, curl=0)
        rim = locks.rim * _nearness_to_rim(bundle, positions)
        course *= (1 - rim * generator.random(len(rim)) ** 2)[:, None, None].astype(np.float32)
        new = _lay_in_locks(bundle, positions[:, None] + course, locks, stray, generator)
        thinned = np.where(stray, STRAY_WIDTH, 1 - rim)
    return _join(even, new, nearest, thinned, uv, colours, material)


def roots_between(guides: Groom, count: int, seed: int = 0) -> Roots:
    """Return `count` roots on the groom's head, only where its strands are near enough."""
    own = roots_at(guides.head, guides.root_triangle, guides.root_barycentric)
    return sample_roots(guides.head, count, seed, first=len(own), guides=own)


@dataclass(frozen=True)
class _Bundle:
    """The guides as equal arrays."""

    roots: Float32Array  # (S, 3)
    course: Float32Array  # (S, m, 3) smooth shape relative to the root
    waves: Float32Array  # (S, m, 3) what the course lacks
    lengths: Float64Array  # (S,)
    tree: cKDTree

    @property
    def points(self) -> int:
        return int(self.course.shape[1])

    @classmethod
    def of(cls, even: Strands) -> _Bundle:
        m = int(even.counts[0])
        points = even.points.reshape(-1, m, 3)
        shape = points - points[:, :1]
        course = smooth_curves(shape, COURSE_SIGMA)
        roots = points[:, 0].copy()
        return cls(roots, course, shape - course, even.lengths(), cKDTree(roots))


@dataclass(frozen=True)
class _Mix:
    guides: Int64Array  # (N, MIXED), nearest first
    weights: Float32Array  # (N, MIXED), sum 1

    def of(self, values: Float32Array) -> Float32Array:
        """Return (N, m, 3) mixed of the guides' values (S, m, 3)."""
        mixed = np.zeros((len(self.guides), *values.shape[1:]), np.float32)
        for k in range(self.guides.shape[1]):
            mixed += self.weights[:, k, None, None] * values[self.guides[:, k]]
        return mixed


def _new_roots(
    guides: Groom | Strands,
    bundle: _Bundle,
    count: int,
    roots: Roots | npt.ArrayLike | None,
    seed: int,
    generator: np.random.Generator,
) -> tuple[Float32Array, Float32Array | None]:
    if roots is None and isinstance(guides, Groom):
        roots = roots_between(guides, count, seed)
    if isinstance(roots, Roots):
        positions, uv = roots.positions, roots.uv
    elif roots is not None:
        positions, uv = np.asarray(roots, np.float32).reshape(-1, 3), None
    else:
        positions, uv = _between_guides(bundle, count, generator), None
    if len(positions) < count:
        raise InputError(f"{len(positions)} roots are given, expected at least {count}")
    return positions[:count], None if uv is None else uv[:count]


def _between_guides(bundle: _Bundle, count: int, generator: np.random.Generator) -> Float32Array:
    chosen = generator.integers(len(bundle.roots), size=count)
    near = _neighbours(bundle, bundle.roots[chosen], 4)[1]
    weights = generator.dirichlet(np.ones(near.shape[1]), size=count).astype(np.float32)
    return np.asarray(np.einsum("nk,nkc->nc", weights, bundle.roots[near]))


def _neighbours(
    bundle: _Bundle, positions: Float32Array, k: int
) -> tuple[Float64Array, Int64Array]:
    distance, index = bundle.tree.query(positions, k=min(k, len(bundle.roots)))
    return distance.reshape(len(positions), -1), index.reshape(len(positions), -1)


def _choose_guides(bundle: _Bundle, positions: Float32Array) -> _Mix:
    distance, near = _neighbours(bundle, positions, NEIGHBOURS)
    agrees = _agreement(bundle, near)
    order = np.argsort(~agrees, axis=1, kind="stable")[:, :MIXED]
    near, distance = np.take_along_axis(near, order, 1), np.take_along_axis(distance, order, 1)
    agrees = np.take_along_axis(agrees, order, 1)
    # far guides weigh little, so that hair changes smoothly from root to root
    reach = np.where(agrees, distance, 0).max(axis=1, keepdims=True) * BEYOND_FARTHEST + 1e-6
    weight = np.where(agrees, (1 / np.maximum(distance, NEAR_ENOUGH) - 0.5 / reach) ** 2, 0)
    weight /= weight.sum(axis=1, keepdims=True)
    return _Mix(near, weight.astype(np.float32))


def _nearness_to_rim(bundle: _Bundle, positions: Float32Array) -> Float32Array:
    """Return (N,) 1 at the hairline, where all guides lie to one side, 0 inside of it."""
    if len(bundle.roots) < RIM_NEIGHBOURS:
        return np.zeros(len(positions), np.float32)
    distance, near = _neighbours(bundle, positions, RIM_NEIGHBOURS)
    aside = np.linalg.norm(bundle.roots[near].mean(axis=1) - positions, axis=1)
    share = aside / np.maximum(distance.mean(axis=1), NEAR_ENOUGH)
    return np.asarray(np.clip((share - RIM_FROM) / (RIM_AT - RIM_FROM), 0, 1), np.float32)


def _agreement(bundle: _Bundle, near: Int64Array) -> npt.NDArray[np.bool_]:
    """Return (N, K) whether each guide agrees in course with the first, nearest one."""
    stops = np.linspace(0, bundle.points - 1, CHORDS + 1).astype(int)
    chords = np.diff(bundle.course[:, stops], axis=1)
    chords /= np.maximum(np.linalg.norm(chords, axis=2, keepdims=True), 1e-9)
    first = near[:, :1]
    cosine = np.einsum("nksc,nksc->nks", chords[near], chords[first]).min(axis=2)
    gap = np.linalg.norm(bundle.course[near, -1] - bundle.course[first, -1], axis=2)
    length = np.maximum(bundle.lengths[near], bundle.lengths[first])
    agrees: npt.NDArray[np.bool_] = (cosine > np.cos(MAX_ANGLE)) & (gap < MAX_TIP_GAP * length)
    agrees[:, 0] = True
    return agrees


def _mix_courses(bundle: _Bundle, mix: _Mix) -> Float32Array:
    """Return (N, m, 3) courses relative to the root, as long as the guides they are mixed from."""
    course = mix.of(bundle.course)
    lengths = _shape_lengths(bundle.course)
    wanted = (mix.weights * lengths[mix.guides]).sum(axis=1)
    stretch = np.clip(wanted / np.maximum(_shape_lengths(course), 1e-9), 1.0, MOST_STRETCH)
    course *= stretch[:, None, None].astype(np.float32)
    return course


def _shape_lengths(shapes: Float32Array) -> Float64Array:
    steps = np.diff(shapes, axis=1)
    return np.asarray(np.sqrt(np.einsum("sic,sic->si", steps, steps)).sum(axis=1))


def _lay_in_locks(
    bundle: _Bundle,
    course: Float32Array,
    locks: LockOptions,
    stray: BoolArray,
    generator: np.random.Generator,
) -> Float32Array:
    """Return hair (N, m, 3) that follows its course (N, m, 3) in wisps, and these in locks."""
    wisps, waves = _wisps(bundle, locks)
    cells = np.floor(bundle.roots / locks.lock).astype(np.int64)
    middles = wisps[np.unique(cells, axis=0, return_index=True)[1]]
    wisps = gather(wisps, middles, locks.lock, np.full(len(wisps), locks.to_lock, np.float32))[0]
    hold = (1 - generator.random(len(course), dtype=np.float32) ** 2) * ~stray
    course = gather(course, middles, locks.lock, locks.to_lock * hold)[0]
    course, which = gather(course, wisps, locks.wisp, locks.to_wisp * hold)
    curl = 1 + locks.curl * generator.uniform(-1, 1, (len(course), 1, 1)).astype(np.float32)
    course += waves[which] * curl
    course += wander(course, locks, stray, generator)
    count, points = course.shape[:2]
    ends = 1 - locks.uneven * generator.random((count, 1)) ** 2
    made = Strands(course.reshape(-1, 3), np.arange(count + 1) * points)
    return made.resampled_at(ends * np.linspace(0, 1, points)).points.reshape(course.shape)


def _wisps(bundle: _Bundle, locks: LockOptions) -> tuple[Float32Array, Float32Array]:
    """Return courses (W, m, 3) and waves (W, m, 3) of wisps: the guides, then others between them.

    They depend on the guides alone, so that hair of any count and seed lies in the same locks.
    Waves of others are those of the nearest guide, turned about their course: locks out of phase.
    """
    guides = bundle.course + bundle.roots[:, None]
    spacing = np.median(_neighbours(bundle, bundle.roots, 2)[0][:, -1])
    more = int(min(len(guides) * ((spacing / locks.wisp) ** 2 - 1), MOST_WISPS - len(guides)))
    if more <= 0:
        return guides, bundle.waves
    generator = np.random.default_rng(len(guides))
    roots = _between_guides(bundle, more, generator)
    mix = _choose_guides(bundle, roots)
    course = _mix_courses(bundle, mix)
    waves = bundle.waves[mix.guides[:, 0]]
    if locks.curl > 0:
        angles = generator.uniform(-np.pi, np.pi, more)
        waves = turn_about(waves, np.gradient(course, axis=1), angles)
    return np.concatenate([guides, course + roots[:, None]]), np.concatenate([bundle.waves, waves])


def _join(
    even: Strands,
    new: Float32Array,
    nearest: Int64Array,
    thinned: Float32Array,
    uv: Float32Array | None,
    colours: Float32Array | None,
    material: HairMaterial,
) -> Strands:
    old, (count, m, _) = len(even), new.shape
    total = old + count
    keep_uv = uv is not None and even.root_uv is not None
    group = None if even.group is None else np.concatenate([even.group, even.group[nearest]])
    widths = strand_widths(total, np.linspace(0, 1, m), material.width)
    widths[old:] *= thinned[:, None]
    return Strands(
        np.concatenate([even.points, new.reshape(-1, 3)]),
        np.arange(total + 1) * m,
        widths.ravel(),
        np.concatenate([even.root_uv, uv]) if keep_uv else None,
        group,
        np.arange(total) < old,
        None if colours is None else np.concatenate([even.colours, colours.reshape(-1, 3)]),
    )
