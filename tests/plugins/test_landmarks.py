"""Laws of cameras from landmarks on the exact turn."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hairkit_plugins.landmarks import Options, estimate_scene
from turntable import turntable

from hairkit import Capture, View
from hairkit.errors import InputError


@pytest.mark.parametrize("model", ["orthographic", "perspective"])
def test_the_exact_turn_is_found_again(model: str) -> None:
    """On the exact turn, points are seen where the true cameras see them."""
    table = turntable(np.random.default_rng(0), stray=0.0, model=model, noise=0.0)
    options = Options(model=model, focal_equivalent=560 / np.hypot(300, 400) * np.hypot(36, 24))
    scene = estimate_scene(table.capture, table.masks, table.head, options)
    points = table.head.vertices[::100]
    for found, true in zip(scene.cameras, table.cameras, strict=True):
        assert np.abs(found.project(points) - true.project(points)).max() < 0.05
    assert scene.residual_px is not None
    assert scene.residual_px < 0.01


def test_views_stay_45_degrees_apart() -> None:
    """Whatever the landmarks say, cameras keep the turn; only the head is placed."""
    table = turntable(np.random.default_rng(5))
    scene = estimate_scene(table.capture, table.masks, table.head, Options())
    forward = np.stack([camera.forward for camera in scene.cameras])
    between = np.degrees(np.arccos(np.sum(forward * np.roll(forward, 1, axis=0), axis=1)))
    assert np.allclose(between, 45)


def test_one_view_with_landmarks_is_too_few() -> None:
    """Landmarks in fewer than two views are one line of error that names the cure."""
    table = turntable(np.random.default_rng(0))
    views = tuple(
        View(view.name, view.azimuth_deg, view.image, landmarks=view.landmarks if not i else None)
        for i, view in enumerate(table.capture.views)
    )
    with pytest.raises(InputError, match=r"in 1 views.*silhouette"):
        estimate_scene(Capture(views), table.masks, table.head, Options())


def test_a_head_without_landmarks_is_refused() -> None:
    """A head that has no landmark vertices cannot be fitted to any."""
    table = turntable(np.random.default_rng(0))
    head = replace(table.head, landmark_vertices=None)
    with pytest.raises(InputError, match="landmark_vertices"):
        estimate_scene(table.capture, table.masks, head, Options())


def test_landmarks_on_a_line_are_refused() -> None:
    """Landmarks that fix no pose are named."""
    table = turntable(np.random.default_rng(0))
    line = np.tile(np.linspace(100, 200, 68)[:, None], (1, 2))
    views = tuple(
        View(view.name, view.azimuth_deg, view.image, landmarks=line * [0, 1] + [150, 0])
        for view in table.capture.views
    )
    with pytest.raises(InputError, match="line"):
        estimate_scene(Capture(views), table.masks, table.head, Options())
