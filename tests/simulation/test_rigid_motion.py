"""Laws of the head's motion within a step, and of the torso that follows it."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from hairkit.arrays import Float64Array
from hairkit.simulation import quaternion
from hairkit.simulation.rigid_motion import (
    NECK_REACH,
    follow_head,
    interpolate_motion,
    inverse_motion,
    motion_steps,
)

JOINT = np.array([0.0, -0.25, -0.018])


def about(pivot: Float64Array, axis: Float64Array, angle: float) -> Float64Array:
    """Return the rotation about an axis through a pivot."""
    motion = np.eye(4)
    turn = quaternion.from_axis(axis / np.linalg.norm(axis), angle)
    motion[:3, :3] = quaternion.to_matrix(turn)
    motion[:3, 3] = pivot - motion[:3, :3] @ pivot
    return motion


def random_motion(seed: int, far: float) -> Float64Array:
    """Return a random rigid motion up to `far` metres away."""
    rng = np.random.default_rng(seed)
    motion = about(np.zeros(3), rng.normal(size=3), rng.uniform(0, 3.1))
    motion[:3, 3] = far * rng.normal(size=3)
    return motion


@pytest.mark.parametrize("count", [1, 4])
@given(seed=st.integers(0, 1000), far=st.sampled_from([0.0, 0.1, 1000.0]))
def test_a_course_goes_evenly_from_start_to_end(count: int, seed: int, far: float) -> None:
    """All steps are the same screw; changes of axes map those before a step to those after it."""
    start, end = random_motion(seed, far), random_motion(seed + 1, far)
    before, off, first = start, 1e-11 * (1 + far), None
    for k, (after, change) in enumerate(zip(*motion_steps(start, end, count), strict=True)):
        there = interpolate_motion(start, end, (k + 1) / count)
        np.testing.assert_allclose(after, there, atol=off)
        np.testing.assert_allclose(after @ change, before, atol=off)
        np.testing.assert_allclose(inverse_motion(after) @ before, change, atol=off)
        screw = after @ inverse_motion(before)
        first = screw if first is None else first
        np.testing.assert_allclose(screw, first, atol=100 * off)
        before = after
    assert (before == end).all()
    assert (motion_steps(end, end, 3)[1] == np.eye(4)).all()


def test_a_head_that_turns_keeps_its_pivot() -> None:
    """Within a step too: the pivot of a turn by 100 degrees does not move."""
    turn = about(JOINT, np.array([0.3, 1.0, 0.1]), np.radians(100))
    for share in (0.1, 0.5, 0.9):
        motion = interpolate_motion(np.eye(4), turn, share)
        np.testing.assert_allclose(motion[:3, :3] @ JOINT + motion[:3, 3], JOINT, atol=1e-15)


@given(seed=st.integers(0, 1000), angle=st.floats(0.01, 3.1))
def test_the_torso_stays_until_the_neck_cannot_turn_farther(seed: int, angle: float) -> None:
    """It stays under turns up to the neck's reach, and follows by what is beyond."""
    axis = np.random.default_rng(seed).normal(size=3)
    head = about(JOINT, axis, angle)
    torso = follow_head(np.eye(4), head, JOINT)
    if angle < NECK_REACH:
        np.testing.assert_array_equal(torso, np.eye(4))
    else:
        np.testing.assert_allclose(torso, about(JOINT, axis, angle - NECK_REACH), atol=1e-12)
    np.testing.assert_array_equal(follow_head(torso, head, JOINT), torso)


@given(seed=st.integers(0, 1000))
def test_the_torso_goes_where_the_head_goes(seed: int) -> None:
    """The joint is a point of both, wherever the head is."""
    head, torso = random_motion(seed, 10.0), random_motion(seed + 1, 10.0)
    moved = follow_head(torso, head, JOINT)
    places = [motion[:3, :3] @ JOINT + motion[:3, 3] for motion in (head, moved)]
    np.testing.assert_allclose(*places, atol=1e-12)
