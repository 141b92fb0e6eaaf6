"""Laws of strands made of helix arcs."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from hairkit.errors import InputError
from hairkit.helices import (
    Arcs,
    adaptive_counts,
    fit_arcs,
    patent_counts,
    smooth_strands,
)
from hairkit.helices.arc_counts import FEWEST, MOST, mean_error
from hairkit.helices.arc_length import Path as Curve
from hairkit.types.strands import Strands


def wandering(rng: np.random.Generator, count: int = 40, points: int = 80) -> Strands:
    """Return smooth random strands of 5 to 60 cm."""
    s = np.linspace(0, 1, points)[:, None]
    made = []
    for length in rng.uniform(0.05, 0.6, count):
        waves = [rng.normal(size=3) * np.sin(k * 3 * s + rng.normal(size=3)) / k for k in (1, 2, 3)]
        made.append(length * (rng.normal(size=3) * s + 0.3 * sum(waves)))
    return Strands.from_list(made)


def ends(arcs: Arcs) -> tuple[np.ndarray, np.ndarray]:
    """Return points and tangents at the arcs' ends."""
    return arcs.at(np.arange(len(arcs.lengths)), np.ones(len(arcs.lengths)))


@pytest.mark.parametrize("turning", [True, False])
def test_arcs_join_with_common_tangents(turning: bool, rng: np.random.Generator) -> None:
    """Where an arc ends, the next begins, in the same direction: G1 to rounding."""
    strands = wandering(rng)
    arcs = fit_arcs(strands, patent_counts(strands), turning=turning)
    inner = np.setdiff1d(np.arange(1, len(arcs.lengths)), arcs.offsets)
    points, tangents = ends(arcs)
    np.testing.assert_allclose(points[inner - 1], arcs.points[inner], rtol=0, atol=1e-10)
    np.testing.assert_allclose(tangents[inner - 1], arcs.tangents[inner], rtol=0, atol=1e-9)


def test_roots_stay(rng: np.random.Generator) -> None:
    """Only the root is no floating point."""
    strands = wandering(rng)
    arcs = fit_arcs(strands, patent_counts(strands))
    np.testing.assert_array_equal(arcs.points[arcs.offsets[:-1]], strands.roots)


def test_the_paper_keeps_the_tangents(rng: np.random.Generator) -> None:
    """Without turning, the arcs have the strands' tangents at equal lengths."""
    strands = wandering(rng, 5)
    arcs = fit_arcs(strands, np.full(5, 6), turning=False)
    path = Curve.of(strands)
    strand = np.repeat(np.arange(5), 6)
    _, tangents = path.at(strand, np.tile(np.arange(6) / 6, 5) * path.lengths[strand])
    np.testing.assert_array_equal(arcs.tangents, tangents)


def test_moves_are_the_smallest(rng: np.random.Generator) -> None:
    """The released points are those of the constrained least-squares problem, solved densely."""
    strands = wandering(rng, 1)
    arcs = fit_arcs(strands, np.array([5]), turning=False)
    path = Curve.of(strands)
    points, tangents = path.at(np.zeros(6, int), np.arange(6) / 5 * path.lengths[0])
    rows = np.zeros((5, 6, 3))
    for i in range(5):
        rows[i, i + 1], rows[i, i] = tangents[i + 1] - tangents[i], tangents[i] - tangents[i + 1]
    gap = (rows * points).sum((1, 2))
    free = rows[:, 1:].reshape(5, -1)
    expected = points[1:] - (np.linalg.pinv(free) @ gap).reshape(-1, 3)
    np.testing.assert_allclose(ends(arcs)[0], expected, rtol=0, atol=1e-10)


def test_no_arc_turns_more_than_half(rng: np.random.Generator) -> None:
    """Alike tangents beside a chord that points elsewhere do not make loops."""
    noisy = wandering(rng)
    points = noisy.points + rng.normal(0, 0.0004, noisy.points.shape).astype(np.float32)
    strands = Strands(points, noisy.offsets)
    arcs = fit_arcs(strands, patent_counts(strands))
    turns = np.linalg.norm(arcs.darboux, axis=1) * arcs.lengths
    assert np.quantile(turns, 0.99) <= np.pi + 1e-6
    assert turns.max() < 2 * np.pi


def test_a_coil_is_exact() -> None:
    """A helix cut anywhere is made of its own arcs."""
    angle = np.linspace(0, 4 * np.pi, 400)
    coil = np.column_stack([0.01 * np.cos(angle), 0.01 * np.sin(angle), 0.004 * angle])
    strands = Strands.from_list([coil])
    for turning in (True, False):
        arcs = fit_arcs(strands, np.array([9]), turning=turning)
        assert mean_error(Curve.of(strands), arcs)[0] < 2e-5


def test_more_arcs_are_closer(rng: np.random.Generator) -> None:
    """Doubling the arcs at least halves the error of smooth strands."""
    strands = wandering(rng)
    path = Curve.of(strands)
    errors = [
        mean_error(path, fit_arcs(path, np.full(len(strands), n))).mean() for n in (6, 12, 24)
    ]
    assert errors[1] < errors[0] / 2
    assert errors[2] < errors[1] / 2


def test_the_adaptive_count_keeps_its_tolerance(rng: np.random.Generator) -> None:
    """Strands stay within the tolerance on average; tighter tolerances take more arcs."""
    strands = wandering(rng)
    path = Curve.of(strands)
    loose, tight = adaptive_counts(strands, 2e-3), adaptive_counts(strands, 2e-4)
    assert mean_error(path, fit_arcs(path, tight)).mean() < 2e-4
    assert mean_error(path, fit_arcs(path, loose)).mean() < 2e-3
    assert loose.sum() < tight.sum()


def test_the_patents_counts() -> None:
    """Few arcs for short and for straight strands, many for long and winding ones."""
    straight = [np.linspace(0, 1, 9)[:, None] * [0, -length, 0] for length in (0.02, 0.4, 0.9)]
    angle = np.linspace(0, 60, 300)[:, None]
    coil = np.hstack([0.02 * np.cos(angle), 0.02 * np.sin(angle), 0.002 * angle])
    counts = patent_counts(Strands.from_list([*straight, coil[:100]]))
    assert list(counts[:3]) == [FEWEST, FEWEST, MOST]
    assert counts[3] > 10


def test_bad_tolerances_are_refused(rng: np.random.Generator) -> None:
    """A tolerance is a length."""
    with pytest.raises(InputError, match="above 0"):
        adaptive_counts(wandering(rng, 2), 0.0)


def test_smoothing_takes_noise_off(rng: np.random.Generator) -> None:
    """Point counts and roots stay; noisy strands come closer to what they were."""
    clean = wandering(rng)
    noise = rng.normal(0, 0.001, clean.points.shape).astype(np.float32)
    noise[clean.offsets[:-1]] = 0
    smooth = smooth_strands(Strands(clean.points + noise, clean.offsets), 0.002)
    np.testing.assert_array_equal(smooth.offsets, clean.offsets)
    np.testing.assert_array_equal(smooth.roots, clean.roots)

    def bends(strands: Strands) -> float:
        tangents = strands.tangents()
        return float(np.linalg.norm(np.diff(tangents, axis=0), axis=1).mean())

    assert bends(smooth) < 0.5 * bends(Strands(clean.points + noise, clean.offsets))


@pytest.mark.parametrize(("capture", "allowed"), [("straight_long", 5e-4), ("wavy", 1e-3)])
def test_true_hair_is_kept(captures: Path, capture: str, allowed: float) -> None:
    """Mean distances on true strands, with the adaptive count, stay within the promise."""
    with np.load(captures / capture / "truth" / "strands.npz") as data:
        strands = Strands(data["points"], data["offsets"]).select(np.arange(0, 10_000, 250))
    path = Curve.of(strands)
    assert mean_error(path, fit_arcs(path, adaptive_counts(strands))).mean() <= allowed
