"""Laws of the head's motion by hand."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from hairkit.viewer.head_motion import AXES, HeadMotion, Shake

PIVOT = np.array([0.0, -0.1, -0.02])


def moved(motion: HeadMotion, seconds: float, steps: int) -> np.ndarray:
    """Return the matrix after so long, in so many steps."""
    for _ in range(steps):
        motion.advance(seconds / steps)
    return motion.matrix()


def test_a_head_left_alone_is_at_rest() -> None:
    """Without shakes and turns the matrix is the identity."""
    assert np.array_equal(moved(HeadMotion(PIVOT), 1.0, 10), np.eye(4))


@given(st.sampled_from(sorted(AXES)), st.floats(0.01, 1.0), st.floats(0.01, 1.9))
def test_a_shake_is_rigid_about_the_neck_within_its_amplitude(
    axis: str, amplitude: float, when: float
) -> None:
    """The pivot stays, lengths stay, the angle is at most the amplitude."""
    motion = HeadMotion(PIVOT, [Shake(axis, amplitude, 1.5, 2.0)])
    matrix = moved(motion, when, 3)
    turn = matrix[:3, :3]
    np.testing.assert_allclose(turn @ turn.T, np.eye(3), atol=1e-12)
    np.testing.assert_allclose(turn @ PIVOT + matrix[:3, 3], PIVOT, atol=1e-12)
    angle = np.arccos(np.clip((np.trace(turn) - 1) / 2, -1, 1))
    assert angle <= amplitude + 1e-6


def test_a_shake_ends() -> None:
    """After its time the head is back at rest."""
    motion = HeadMotion(PIVOT, [Shake("yaw", 0.5, 2.0, 1.0)])
    assert np.array_equal(moved(motion, 1.1, 30), np.eye(4))


@given(st.floats(-1.0, 1.0))
def test_a_turn_glides_to_its_goal_whatever_the_frame_rate(goal: float) -> None:
    """The way does not depend on the steps, does not overshoot, and ends at the goal."""
    coarse, fine = HeadMotion(PIVOT), HeadMotion(PIVOT)
    coarse.turn["yaw"] = fine.turn["yaw"] = goal
    np.testing.assert_allclose(moved(coarse, 0.1, 2), moved(fine, 0.1, 50), atol=1e-9)
    assert abs(np.arcsin(coarse.matrix()[0, 2])) <= abs(goal) + 1e-9
    end = moved(coarse, 3.0, 10)
    assert np.arctan2(end[0, 2], end[0, 0]) == pytest.approx(goal, abs=1e-4)
