"""Laws of the strips that hair is drawn with."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hairkit_plugins.gltf.ribbons import Ribbons, frames, gather_locks, make_ribbons, outward

from hairkit.errors import InputError
from hairkit.testing import ball_head, bristle_groom
from hairkit.types.strands import Strands


def waves(rng: np.random.Generator, count: int = 20, points: int = 9) -> np.ndarray:
    """Return lines (N, K, 3) that fall from a ball and wave."""
    start = rng.normal(size=(count, 1, 3)) * [0.05, 0.02, 0.05] + [0, 0.1, 0]
    steps = rng.normal([0.002, -0.01, 0.004], 0.004, (count, points, 3))
    return (start + np.cumsum(steps, axis=1)).astype(np.float32)


def made(lines: np.ndarray, turn: np.ndarray | None = None) -> Ribbons:
    out = outward(lines, ball_head())
    width = np.linspace(0.003, 0.001, lines.shape[1], dtype=np.float32)
    turn = np.eye(3, dtype=np.float32) if turn is None else turn.astype(np.float32)
    return make_ribbons(lines @ turn.T, out @ turn.T, np.tile(width, (len(lines), 1)))


def test_strips_have_their_width_about_their_line(rng: np.random.Generator) -> None:
    """The two vertices of a point lie half the width to each side of it."""
    lines = waves(rng)
    left, right = made(lines).vertices.reshape(-1, 2, 3).swapaxes(0, 1)
    np.testing.assert_allclose((left + right) / 2, lines.reshape(-1, 3), atol=1e-7)
    want = np.tile(np.linspace(0.003, 0.001, 9), 20)
    np.testing.assert_allclose(np.linalg.norm(right - left, axis=1), want, rtol=1e-3)


def test_triangles_face_their_normals(rng: np.random.Generator) -> None:
    """Counter-clockwise seen from outside; normals and tangents are unit and perpendicular."""
    found = made(waves(rng))
    a, b, c = found.vertices[found.faces].astype(np.float64).swapaxes(0, 1)
    facing = (np.cross(b - a, c - a) * found.normals[found.faces[:, 0]]).sum(axis=1)
    assert (facing > 0).mean() > 0.95  # a strip that turns sharply in its plane may fold over
    tangents = found.tangents[:, :3]
    for vectors in (found.normals, tangents):
        np.testing.assert_allclose(np.linalg.norm(vectors, axis=1), 1, atol=1e-6)
    np.testing.assert_allclose((found.normals * tangents).sum(axis=1), 0, atol=1e-6)


def test_directions_out_of_the_head_are_those_at_every_point() -> None:
    """Between points that are looked up normals are off by 9 degrees at most, on a coarse ball."""
    head = ball_head()
    angle = np.linspace(0.2, 1.8, 16)
    arc = np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)
    lines = (0.1 * np.stack([arc, arc[:, [2, 1, 0]]])).astype(np.float32)
    each = np.stack([outward(lines[:, k : k + 1], head)[:, 0] for k in range(16)], axis=1)
    assert (outward(lines, head) * each).sum(axis=-1).min() > np.cos(np.radians(9))


def test_strips_lie_on_the_head() -> None:
    """Hair combed down the side of a ball shows its flat side outward, u to the right."""
    angle = np.linspace(0.6, 1.5, 12)
    line = 0.105 * np.stack([0 * angle, np.cos(angle), np.sin(angle)], axis=1)[None]
    out = line / np.linalg.norm(line, axis=-1, keepdims=True)
    found = make_ribbons(
        line.astype(np.float32), out.astype(np.float32), np.full((1, 12), 0.002, np.float32)
    )
    np.testing.assert_allclose(found.normals[::2], out[0], atol=0.05)  # half a step at the ends
    np.testing.assert_allclose(found.tangents, np.tile([1, 0, 0, 1], (24, 1)), atol=1e-4)
    np.testing.assert_array_equal(found.uv[:2], [[0, 0], [1, 0]])
    np.testing.assert_array_equal(found.uv[-2:], [[0, 1], [1, 1]])


def test_turning_the_hair_turns_the_strips(rng: np.random.Generator) -> None:
    """Nothing depends on the axes or on a camera."""
    lines = waves(rng)
    turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    turn *= np.linalg.det(turn)
    np.testing.assert_allclose(made(lines, turn).vertices, made(lines).vertices @ turn.T, atol=1e-6)


def test_strips_do_not_twist(rng: np.random.Generator) -> None:
    """From one point to the next a strip turns by less than a quarter, even through the normal."""
    lines = waves(rng, 100)
    across = frames(lines, outward(lines, ball_head()))[1]
    assert ((across[:, 1:] * across[:, :-1]).sum(axis=-1) > 0).mean() > 0.99


def test_bristles_have_strips() -> None:
    """Hair that stands straight up has finite unit frames, and so have still points."""
    strands = bristle_groom().strands
    lines = strands.points.reshape(-1, 5, 3)
    out = np.repeat(lines[:, 1:2] - lines[:, :1], 5, axis=1)
    for case in (lines, np.repeat(lines[:, :1], 5, axis=1)):
        for vectors in frames(case, out / np.linalg.norm(out, axis=-1, keepdims=True)):
            np.testing.assert_allclose(np.linalg.norm(vectors, axis=-1), 1, atol=1e-6)


@pytest.mark.parametrize("mean", [False, True])
@pytest.mark.parametrize("count", [1, 7, 1000])
def test_locks_are_of_the_strands(count: int, mean: bool) -> None:
    """No more lines than asked for or than strands; weights of each point sum to one."""
    strands = bristle_groom().strands
    locks = gather_locks(strands, count, 6, mean=mean)
    assert 1 <= len(locks.strand) <= min(count, len(strands))
    np.testing.assert_allclose(np.asarray(locks.from_points.sum(axis=1)).ravel(), 1, atol=1e-9)
    lines = locks.moved(strands.points)
    assert lines.shape == (len(locks.strand), 6, 3)
    if not mean or count == 1000:
        np.testing.assert_allclose(
            lines.reshape(-1, 3), strands.select(locks.strand).resampled(6).points, atol=1e-6
        )
        assert not locks.spread.any()


def test_lines_go_with_their_strands(rng: np.random.Generator) -> None:
    """Moving all hair moves the lines alike; the mean of a lock stays within its strands."""
    strands = bristle_groom().strands
    locks = gather_locks(strands, 10, 4, mean=True)
    shift = np.float32([0.1, -0.2, 0.3])
    np.testing.assert_allclose(
        locks.moved(strands.points + shift), locks.moved(strands.points) + shift, atol=1e-6
    )
    assert locks.spread.max() < 0.1
    assert (locks.spread[:, 0].max(axis=1) > 0).all()


def test_uneven_strands_are_evened() -> None:
    """A strand whose points crowd at the root gives points at equal arc length."""
    strand = np.zeros((5, 3), np.float32)
    strand[:, 1] = [0, 0.001, 0.002, 0.003, 0.1]
    strands = replace(Strands.from_list([strand, strand[:2]]), root_uv=None)
    lines = gather_locks(strands, 2, 6, mean=False).moved(strands.points)
    np.testing.assert_allclose(lines[0, :, 1], np.linspace(0, 0.1, 6), atol=1e-7)


def test_senseless_sizes_are_refused() -> None:
    """No strips, or strips of one point, cannot be made."""
    with pytest.raises(InputError, match="0 strips"):
        gather_locks(bristle_groom().strands, 0, 4, mean=True)
