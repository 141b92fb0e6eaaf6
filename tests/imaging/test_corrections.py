"""Laws of strokes on a mask: an edge brush ends at edges, and strokes decide under themselves."""

from __future__ import annotations

import numpy as np
import pytest

from hairkit.imaging.corrections import BRUSHED, Corrections, paint_to_edges, pull_prior
from hairkit.imaging.geodesic import edge_costs

HEIGHT, WIDTH = 80, 120


def halves(edge: int, seed: int = 0) -> np.ndarray:  # type: ignore[type-arg]
    """Return a noisy picture that is dark left of a column and light right of it."""
    picture = np.full((HEIGHT, WIDTH, 3), 60.0)
    picture[:, edge:] = 170
    picture += np.random.default_rng(seed).normal(0, 6, picture.shape)
    return np.clip(picture, 0, 255).astype(np.uint8)


def line(column: int) -> np.ndarray:  # type: ignore[type-arg]
    """Return an upright line of three pixels' width."""
    drawn = np.zeros((HEIGHT, WIDTH), np.bool_)
    drawn[20:60, column - 1 : column + 2] = True
    return drawn


@pytest.mark.parametrize("away", [4, 8, 12])
def test_a_brush_paints_up_to_the_edge(away: int) -> None:
    """What lies between line and edge is painted, what lies behind the edge is not."""
    picture, drawn = halves(60), line(60 - away)
    painted = paint_to_edges(picture, drawn, 20.0)
    assert painted[30:50, 60 - away : 57].mean() > 0.95
    assert painted[:, 63:].mean() < 0.02
    assert (painted | ~drawn).all()


def test_a_brush_paints_no_farther_than_its_radius() -> None:
    """Where there is no edge, the rim ends it."""
    painted = paint_to_edges(halves(WIDTH), line(50), 9.0)
    columns = np.flatnonzero(painted.any(axis=0))
    assert columns.min() >= 50 - 12
    assert columns.max() <= 50 + 12


def test_strokes_decide_under_themselves() -> None:
    """Hair strokes make hair likely, others unlikely; a brush persuades where it painted."""
    prior = np.full((HEIGHT, WIDTH, 3), 1 / 3, np.float32)
    costs = edge_costs(halves(60).astype(np.float32), 0.02, 0.25)
    brushed = np.where(line(90), np.float32(BRUSHED), np.float32(0))
    pulled = pull_prior(prior, costs, Corrections(line(30), line(70), brushed))
    share = pulled[..., 0] / pulled.sum(axis=-1)
    assert share[line(30)].min() > 0.99
    assert share[line(70)].max() < 0.01
    assert share[line(90)].min() > 0.9
    assert share[:, 58].min() >= 1 / 3 - 1e-6  # an edge lies between it and the other stroke
