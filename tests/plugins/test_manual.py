"""Laws of the head placed by hand."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hairkit_plugins.manual import estimate_scene
from scipy.spatial.transform import Rotation
from turntable import turntable

from hairkit.cameras.turntable import NominalOptions, Turn
from hairkit.errors import InputError


def test_the_head_is_seen_where_it_was_put() -> None:
    """A point of the head is seen where the nominal camera sees the posed point."""
    table = turntable(np.random.default_rng(0))
    pose = np.eye(4)
    pose[:3, :3] = 1.2 * Rotation.from_rotvec([0.1, 0.2, -0.1]).as_matrix()
    pose[:3, 3] = [0.01, 0.05, -0.02]
    capture = replace(table.capture, head_pose=pose)
    scene = estimate_scene(capture, table.masks, table.head, NominalOptions(distance=0.7))
    focal = 42 / np.hypot(36, 24) * np.hypot(300, 400)
    points = table.head.vertices[::200]
    posed = points @ pose[:3, :3].T + pose[:3, 3]
    nominal = Turn.of(capture).nominal(focal / 0.7, 1 / 0.7)
    for found, camera in zip(scene.cameras, nominal, strict=True):
        assert np.allclose(found.project(points), camera.project(posed), atol=1e-3)


def test_no_pose_is_an_error() -> None:
    """Without a pose the plugin says where to write it."""
    table = turntable(np.random.default_rng(0))
    with pytest.raises(InputError, match=r"capture\.toml"):
        estimate_scene(table.capture, table.masks, table.head, NominalOptions())
