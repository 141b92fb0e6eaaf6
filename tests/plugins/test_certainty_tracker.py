"""Laws of the thesis's tracker: its seven rules, first directions, smoothing and trimming."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hairkit_plugins import certainty_tracker
from hairkit_plugins.certainty_tracker import (
    Options,
    Rules,
    Volumes,
    bent_normals,
    smooth_strands,
    track,
    track_strand,
    trim_u_turns,
)

from hairkit import parallel
from hairkit.arrays import BoolArray, Float32Array, Float64Array, Int64Array
from hairkit.testing import scalp_roots, turn_scene
from hairkit.types.head import Roots
from hairkit.types.volume import (
    Hull,
    OrientationField,
    VoxelGrid,
    outer_products,
    symmetric_matrices,
)

SPACING = 0.01
GRID = VoxelGrid.around(np.full(3, -0.27), np.full(3, 0.27), SPACING)
CENTRES = GRID.centres().astype(np.float64)
DISTANCE = np.linalg.norm(CENTRES, axis=-1) - 0.1
"""To a ball of a head."""
UP = np.array([0.0, 1.0, 0.0])
FREE = Options(u_share=1.0, smoothing=0, bend_deg=0.0, max_length=0.13)
"""Nothing but the walk through the field."""


def filled(hair: BoolArray | None = None) -> Hull:
    """Hair everywhere outside of the head, or where it is told."""
    outside = DISTANCE > -SPACING
    dense = outside if hair is None else hair & outside
    return Hull(GRID, dense, outside, DISTANCE.astype(np.float32))


def constant(direction: Float64Array) -> OrientationField:
    """One direction everywhere."""
    tensor = np.broadcast_to(outer_products(direction), (*GRID.shape, 6)).astype(np.float32)
    still = np.zeros(GRID.shape, np.float32)
    return OrientationField(GRID, tensor, still + 1, still)


def crown() -> Roots:
    """Roots at the top of the head."""
    roots = scalp_roots(turn_scene().head)
    top = np.flatnonzero(roots.normals[:, 1] > 0.93)
    at = 0.1 * roots.normals[top]
    return Roots(at, roots.normals[top], roots.uv[top], roots.triangle[top], roots.barycentric[top])


def tilted(degrees: float) -> Float64Array:
    return np.array([np.sin(np.radians(degrees)), np.cos(np.radians(degrees)), 0.0])


def test_in_a_constant_field_strands_run_along_it() -> None:
    """Whatever the sign of the tensor: the first direction decides it. Lengths are the limit."""
    strands = track(filled(), constant(tilted(30)), crown(), FREE)
    steps = np.diff(strands.points.reshape(len(strands), -1, 3), axis=1)
    steps /= np.linalg.norm(steps, axis=2, keepdims=True)
    assert (steps[:, 8:] @ tilted(30) > 0.999).all()
    np.testing.assert_allclose(strands.lengths(), FREE.max_length, atol=0.75 * SPACING)


@pytest.mark.parametrize(("max_score", "crosses"), [(2, False), (3, False), (6, True)])
def test_a_gap_is_crossed_by_one_step_less_than_the_score(max_score: int, crosses: bool) -> None:
    """Three cells of gap are four steps: with a score of 4, three uncertain ones, a strand ends."""
    y = CENTRES[..., 1]
    hull = filled((y < 0.16) | (y > 0.19))
    strands = track(hull, constant(UP), crown(), replace(FREE, max_score=max_score))
    tops = strands.tips[:, 1]
    assert (tops > 0.2).all() if crosses else (tops < 0.19).all()


def test_sharp_turns_are_uncertain() -> None:
    """The field bends by 70 degrees at a plane: followed when allowed, else the strand ends."""
    above = CENTRES[..., 1] > 0.16
    field = constant(UP)
    bent = np.where(above[..., None], outer_products(tilted(70)), field.tensor)
    field = replace(field, tensor=bent.astype(np.float32))
    kind, strict = (
        track(filled(), field, crown(), replace(FREE, max_turn_deg=limit)) for limit in (90, 25)
    )
    assert (kind.tips - kind.roots)[:, 0].min() > 0.02
    assert strict.tips[:, 1].max() < 0.2
    assert (strict.lengths() < 0.8 * kind.lengths()).all()


def swirl(seed: int) -> Volumes:
    """A field that turns about an axis and rises, in a ball of hair."""
    axis = np.random.default_rng(seed).normal(size=3)
    axis /= np.linalg.norm(axis)
    along = np.cross(axis, CENTRES) + 0.05 * axis
    along /= np.linalg.norm(along, axis=-1, keepdims=True)
    inside = np.linalg.norm(CENTRES, axis=-1) < 0.1
    tensor = (outer_products(along) * inside[..., None]).astype(np.float32)
    return Volumes(np.asarray(GRID.origin, np.float64), SPACING, tensor, inside)


def walk(volumes: Volumes, rules: Rules, p: Float64Array, d: Float64Array) -> Float64Array:
    """The seven rules of section 6.1, one after the other."""
    points, score, certain = [p], rules.max_score, True
    while len(points) < 60:
        cell = tuple(np.floor((p - GRID.origin) / SPACING).astype(int))
        outside = not volumes.inside[cell]
        certain = certain and not outside  # 1
        found = d
        if not outside:
            tensor = symmetric_matrices(GRID.sample(volumes.tensors, p[None]))[0]
            found = np.linalg.eigh(tensor)[1][:, 2]
            found = -found if found @ d < 0 else found  # 2
            certain = bool(found @ d >= rules.min_cosine)  # 3 and 4
        if certain:  # 5
            score, d = rules.max_score, found
        p = p + rules.step * d  # 5 and 6
        points.append(p)
        score -= 1  # 7
        if score == 0:
            break
    return np.array(points)


@pytest.mark.parametrize("seed", range(12))
def test_the_walk_equals_its_readable_twin(seed: int) -> None:
    """The same points within a hundredth of a cell, and as many of them."""
    volumes, rules = swirl(seed), Rules(0.75 * SPACING, np.cos(np.pi / 3.7), 4)
    start = np.random.default_rng(100 + seed).normal(size=3)
    start *= 0.042 / np.linalg.norm(start)
    way = start / np.linalg.norm(start)
    points = np.zeros((60, 3), np.float32)
    count = track_strand(volumes, rules, start, way, points)
    expected = walk(volumes, rules, start, way)
    assert count == len(expected)
    np.testing.assert_allclose(points[:count], expected, atol=1e-2 * SPACING)


@pytest.mark.parametrize("bend_deg", [0.0, 30.0, 50.0])
def test_bent_normals_lean_down_by_the_bend(bend_deg: float) -> None:
    """The start is the normal turned towards the ground in the vertical plane that holds it."""
    normals = np.array([[1.0, 0, 0], [0, 0, -1], [0.6, 0.8, 0], [0.48, 0.6, 0.64]], np.float32)
    start = bent_normals(normals, bend_deg)
    cosine = np.sum(start * normals, axis=1)
    np.testing.assert_allclose(cosine, np.cos(np.radians(bend_deg)), atol=1e-6)
    np.testing.assert_allclose(np.cross(normals, start) @ UP, 0, atol=1e-6)
    assert (start[:, 1] < normals[:, 1] - 0.05).all() or bend_deg == 0
    for height in (1.0, -1.0):
        vertical = (height * UP[None]).astype(np.float32)
        np.testing.assert_array_equal(bent_normals(vertical, bend_deg), vertical)


def heights(steps: list[float]) -> tuple[Float32Array, Int64Array]:
    """One strand whose heights change by these steps, padded with a point that is not its own."""
    points = np.zeros((1, len(steps) + 2, 3), np.float32)
    points[0, :, 1] = np.concatenate([[0.0], np.cumsum(steps), [1e3]])
    return points, np.array([len(steps) + 1])


def trimmed_twin(steps: list[float], mu: float) -> int:
    """The rule of section 6.2 in its own words and numbering; the number of points that stay."""
    n = len(steps) + 1
    rise = dict(zip(range(2, n + 1), steps, strict=True))  # of point k over point k - 1
    i = next((k for k in range(2, n + 1) if rise[k] < 0), None)
    if i is None or sum(rise[k] > 0 for k in range(i + 1, n + 1)) <= mu * (n - i - 1):
        return n
    return next((j for j in range(i + 1, n) if rise[j + 1] > 0), n)


@pytest.mark.parametrize("share", [0.0, 0.3, 0.6])
def test_trimming_follows_the_rule_of_the_thesis(share: float) -> None:
    """Random strands, up first or down first, have as many points left as the rule says."""
    rng = np.random.default_rng(6)
    for _ in range(60):
        steps = rng.choice([-1.0, -1.0, 0.0, 1.0], rng.integers(2, 25)).tolist()
        points, counts = heights(steps)
        assert trim_u_turns(points, counts, share).tolist() == [trimmed_twin(steps, share)]


def test_a_u_is_cut_near_its_bottom_and_an_arch_is_not() -> None:
    """Ten steps down and ten up leave the way down; up then down, and a small hook, stay."""
    assert trim_u_turns(*heights([-1] * 10 + [1] * 10), 0.3).tolist() == [11]
    for steps in ([1] * 8, [-1] * 8, [1, 1, 1, -1, -1, -1], [-1] * 9 + [1, 1], [0, 0, 0]):
        assert trim_u_turns(*heights(steps), 0.3).tolist() == [len(steps) + 1]
    assert trim_u_turns(*heights([-1, 1, 1, 1]), 1.0).tolist() == [5]


def test_smoothing_is_the_recursion_of_iben() -> None:
    """Edge by edge against the printed formula, in two passes; the root stays."""
    points = np.cumsum(np.random.default_rng(7).normal(size=(4, 20, 3)), axis=1)
    edges, b = np.diff(points, axis=1), 1 - np.exp(-0.004 / 0.003)
    for _ in range(2):
        done = [edges[:, 0], edges[:, 0]]
        for k in range(edges.shape[1]):
            done.append(2 * (1 - b) * done[-1] - (1 - b) ** 2 * done[-2] + b * b * edges[:, k])
        edges = np.stack(done[2:], axis=1)
    expected = np.concatenate([points[:, :1], points[:, :1] + np.cumsum(edges, axis=1)], axis=1)
    smooth = smooth_strands(points.astype(np.float32), 0.004, 0.003, 2)
    np.testing.assert_allclose(smooth, expected, atol=1e-4)


def test_smoothing_leaves_straight_strands_and_takes_off_the_zigzag() -> None:
    """A line stays within rounding; angles between edges shrink, more with each pass."""
    line = np.linspace([0, 0, 0], [0, -0.1, 0], 30, dtype=np.float32)[None]
    np.testing.assert_allclose(smooth_strands(line, 0.003, 0.003, 5), line, atol=1e-6)
    zigzag = line.copy()
    zigzag[0, ::2, 0] += 0.002
    bends = [
        np.abs(np.diff(smooth_strands(zigzag, 0.003, 0.006, n)[0, :, 0], 2)).max() for n in range(3)
    ]
    assert bends[0] > 2 * bends[1] > 4 * bends[2]


def test_whole_tracks_are_smoothed_then_trimmed_then_resampled() -> None:
    """In a field that circles strands end below, outside of the head, with as many points."""
    x, y = CENTRES[..., 0] - 0.1, CENTRES[..., 1] - 0.1
    circle = np.stack([y, -x, 0 * x], axis=-1)
    circle /= np.maximum(np.linalg.norm(circle, axis=-1, keepdims=True), 1e-9)
    field = replace(constant(UP), tensor=outer_products(circle).astype(np.float32))
    strands = track(filled(), field, crown(), Options(max_length=0.7, max_turn_deg=80, u_share=0.1))
    whole = track(filled(), field, crown(), Options(max_length=0.7, max_turn_deg=80, u_share=1))
    assert (strands.lengths() < whole.lengths() - 0.01).any()
    assert (np.diff(strands.offsets) == Options().points).all()
    assert np.linalg.norm(strands.points, axis=1).min() > 0.098


@pytest.mark.parametrize("threads", [1, 3])
def test_the_number_of_threads_does_not_change_a_byte(
    monkeypatch: pytest.MonkeyPatch, threads: int
) -> None:
    """One thread and several give the strands of this machine's number of threads."""
    roots = scalp_roots(turn_scene().head)
    assert len(roots) > 3 * certainty_tracker.MIN_STRANDS
    expected = track(filled(), constant(-UP), roots, Options()).points.tobytes()
    monkeypatch.setattr(parallel, "thread_count", lambda: threads)
    assert track(filled(), constant(-UP), roots, Options()).points.tobytes() == expected
