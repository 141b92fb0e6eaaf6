"""Laws of the helix through a co-helical pair."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from hairkit.helices import helix_through
from hairkit.helices.helix import along_arc

Array = npt.NDArray[np.float64]


def random_helices(
    rng: np.random.Generator, count: int, low: float, high: float
) -> tuple[Array, Array, Array, Array]:
    """Return start points, tangents, Darboux vectors and lengths of arcs turning low to high."""
    axis, tangent = (v / np.linalg.norm(v, axis=1)[:, None] for v in rng.normal(size=(2, count, 3)))
    length = 10 ** rng.uniform(-3, 0, count)
    rate = rng.uniform(low, high, count) / length
    return rng.normal(size=(count, 3)) * 0.1, tangent, axis * rate[:, None], length


def test_random_helices_are_recovered(rng: np.random.Generator) -> None:
    """10,000 helices turning under half a turn come back to 1e-9: vector, length and curve."""
    point, tangent, darboux, length = random_helices(rng, 10_000, 0.05, 0.999 * np.pi)
    end, last = along_arc(0 * point, tangent, darboux, length)
    found, found_length = helix_through(0 * point, tangent, end, last)
    size = np.linalg.norm(darboux, axis=1)
    assert (np.linalg.norm(found - darboux, axis=1) <= 1e-9 * size).all()
    np.testing.assert_allclose(found_length, length, rtol=1e-9)
    curve, _ = along_arc(0 * point, tangent, darboux, length / 2)
    again, _ = along_arc(0 * point, tangent, found, found_length / 2)
    assert (np.linalg.norm(curve - again, axis=1) <= 1e-9 * length).all()


def test_the_smallest_turns_give_the_curve(rng: np.random.Generator) -> None:
    """Nearly straight pieces, whose torsion rounding hides, are still met in between."""
    _, tangent, darboux, length = random_helices(rng, 2_000, 1e-9, 1e-3)
    end, last = along_arc(np.zeros(3), tangent, darboux, length)
    found, found_length = helix_through(np.zeros(3), tangent, end, last)
    curve, _ = along_arc(np.zeros(3), tangent, darboux, length / 2)
    again, _ = along_arc(np.zeros(3), tangent, found, found_length / 2)
    assert (np.linalg.norm(curve - again, axis=1) <= 1e-9 * length).all()


def test_turns_up_to_a_whole_turn_are_recovered_too(rng: np.random.Generator) -> None:
    """The one root goes on beyond half a turn."""
    _, tangent, darboux, length = random_helices(rng, 2_000, np.pi, 6.2)
    end, last = along_arc(np.zeros(3), tangent, darboux, length)
    found, _ = helix_through(np.zeros(3), tangent, end, last)
    size = np.linalg.norm(darboux, axis=1)
    assert (np.linalg.norm(found - darboux, axis=1) <= 1e-9 * size).all()


def test_a_straight_pair_is_straight() -> None:
    """Equal tangents along the chord: no turn, the chord's length."""
    darboux, length = helix_through(np.zeros(3), [0.0, 0, 1], [0.0, 0, 0.2], [0.0, 0, 1])
    np.testing.assert_array_equal(darboux, 0)
    assert length == 0.2


def test_a_plane_pair_is_a_circle() -> None:
    """A quarter of a circle has its curvature and no torsion."""
    darboux, length = helix_through([1.0, 0, 0], [0.0, 1, 0], [0.0, 1, 0], [-1.0, 0, 0])
    np.testing.assert_allclose(darboux, [0, 0, 1], rtol=0, atol=1e-14)
    np.testing.assert_allclose(length, np.pi / 2)


def test_reversing_the_pair_reverses_the_arc(rng: np.random.Generator) -> None:
    """The helix from the end back has the opposite Darboux vector."""
    _, tangent, darboux, length = random_helices(rng, 100, 0.1, 3.0)
    end, last = along_arc(np.zeros(3), tangent, darboux, length)
    found, _ = helix_through(end, -last, np.zeros_like(end), -tangent)
    np.testing.assert_allclose(found, -darboux, rtol=1e-7, atol=1e-7)
