"""Laws of joining in gradients: one picture stays itself, overlapping ones join without a step."""

from __future__ import annotations

import numpy as np

from hairkit.head_model.gradient_blend import REACH, join_gradients

SIZE = 48


def landscape() -> np.ndarray:
    """Return a smooth picture (48, 48, 3)."""
    row, column = np.mgrid[:SIZE, :SIZE] / SIZE
    layers = [np.sin(5 * row) + column, row * column, np.cos(4 * column - row)]
    return (100 + 20 * np.stack(layers, axis=-1)).astype(np.float32)


def test_one_picture_stays_itself() -> None:
    """A single picture that is its own mean comes back, whatever its share."""
    picture = landscape()
    for share in (0.0, 0.3, 1.0):
        joined = join_gradients(picture, [picture], [np.full((SIZE, SIZE), share, np.float32)])
        np.testing.assert_allclose(joined, picture, atol=1e-3)


def test_two_exposures_join_without_a_step() -> None:
    """Two halves of one picture, one brighter by 20, leave a step of less than half a level."""
    picture = landscape()
    left = np.zeros((SIZE, SIZE), np.float32)
    left[:, : SIZE // 2 + 1] = 1
    right = np.zeros((SIZE, SIZE), np.float32)
    right[:, SIZE // 2 :] = 1
    mean = picture + 20 * (left < 0.5)[..., None]
    joined = join_gradients(mean, [picture, picture + 20], [left, right])
    off = joined - picture
    steps = np.abs(np.diff(off, axis=1)).max()
    assert np.abs(np.diff(mean - picture, axis=1)).max() == 20
    assert steps < 20 / REACH
    assert abs(float(off.mean() - (mean - picture).mean())) < 1e-2


def test_it_solves_the_equation() -> None:
    """The residual of the screened Poisson equation is zero, found by plain differences."""
    random = np.random.default_rng(0)
    mean, picture = (random.normal(size=(9, 7, 1)).astype(np.float32) for _ in range(2))
    joined = join_gradients(mean, [picture], [np.ones((9, 7), np.float32)]).astype(np.float64)
    residual = (joined - mean) / REACH**2
    for axis in (0, 1):
        way = [(0, 0)] * 3
        way[axis] = (1, 1)
        flow = np.diff(joined, axis=axis) - np.diff(picture, axis=axis)
        residual -= np.diff(np.pad(flow, way), axis=axis)
    np.testing.assert_allclose(residual, 0, atol=1e-4)
