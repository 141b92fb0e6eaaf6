"""Laws of where hair is drawn between moved guides."""

from __future__ import annotations

import numpy as np
import pytest
from frame_pictures import LOOK, inputs, picture, twin
from scipy.spatial.transform import Rotation

from hairkit.arrays import Float32Array
from hairkit.rendering.context import renderer
from hairkit.viewer.draw.frame import FrameRenderer
from hairkit.viewer.draw.hair_data import HairBody


def placed(frame_renderer: FrameRenderer, rows: Float32Array) -> Float32Array:
    """Return where hair is drawn with guides (G, m, 3)."""
    with renderer():
        picture(frame_renderer, inputs(guide_rows=rows))
        places = frame_renderer.hair.places()
        if not frame_renderer.soft:
            places = np.frombuffer(places.read(), np.float32).reshape(LOOK.hairs, -1, 3)
        result: Float32Array = places.copy()
        picture(frame_renderer, inputs())
    return result


def parted(body: HairBody, seed: int) -> Float32Array:
    """Return guides (G, m, 3) of the same lengths, each turned and bent in a way of its own."""
    edges, random = np.diff(body.guide_rest.astype(float), axis=1), np.random.default_rng(seed)
    for k in range(edges.shape[1]):
        angles = random.normal(0.0, 0.5, (len(edges), 3)) * (k + 1) / edges.shape[1]
        edges[:, k:] = np.einsum(
            "gij,gkj->gki", Rotation.from_rotvec(angles).as_matrix(), edges[:, k:]
        )
    return np.cumsum(np.concatenate([body.guide_rest[:, :1], edges], axis=1), axis=1, dtype="f4")


@pytest.mark.parametrize("seed", [1, 2])
def test_hair_is_placed_as_its_twin_says(frame_renderer: FrameRenderer, seed: int) -> None:
    """Segments turn as the guides' frames, of which those that part from the nearest are left."""
    rows = parted(frame_renderer.body, seed)
    off = np.abs(placed(frame_renderer, rows) - twin(frame_renderer.body, rows)).max(axis=(1, 2))
    assert np.quantile(off, 0.99) < 1e-4
    assert off.max() < 2e-3  # near a half turn roundings decide the way round


@pytest.mark.parametrize("seed", [3, 4])
def test_hair_keeps_its_lengths_where_guides_part(frame_renderer: FrameRenderer, seed: int) -> None:
    """No segment is stretched or folded up, and guides are drawn where they are."""
    body = frame_renderer.body
    rows = parted(body, seed)
    hair, rest = placed(frame_renderer, rows), placed(frame_renderer, body.guide_rest)
    now, was = (np.linalg.norm(np.diff(h, axis=1), axis=2) for h in (hair, rest))
    np.testing.assert_allclose(now, was, rtol=5e-3, atol=1e-6)
    np.testing.assert_allclose(hair[: len(rows)], rows, atol=5e-5)


def test_hair_shows_the_stretch_of_its_nearest_guide(frame_renderer: FrameRenderer) -> None:
    """Guides drawn to another length take the hair along."""
    body = frame_renderer.body
    rows = body.guide_rest[:, :1] + 1.3 * (body.guide_rest - body.guide_rest[:, :1])
    hair, rest = placed(frame_renderer, rows), placed(frame_renderer, body.guide_rest)
    now, was = (np.linalg.norm(np.diff(h, axis=1), axis=2) for h in (hair, rest))
    np.testing.assert_allclose(now, 1.3 * was, rtol=5e-3, atol=1e-6)


def test_hair_turns_with_guides_that_stay_together(frame_renderer: FrameRenderer) -> None:
    """Guides turned as one carry the hair between them along; only twist about them is unknown."""
    body = frame_renderer.body
    turn = Rotation.from_rotvec([0.1, -0.2, 0.15]).as_matrix()
    rows = np.asarray(body.guide_rest @ turn.T, np.float32)
    hair, rest = placed(frame_renderer, rows), placed(frame_renderer, body.guide_rest)
    edges = np.diff(rest, axis=1) @ turn.T
    off = np.linalg.norm(np.diff(hair, axis=1) - edges, axis=2)
    assert np.quantile(off / np.linalg.norm(edges, axis=2), 0.99) < 0.06
