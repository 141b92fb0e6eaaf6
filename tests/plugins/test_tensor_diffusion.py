"""Laws of the thesis's field: known cells at the surface and the scalp, the rest diffused."""

from __future__ import annotations

from dataclasses import replace

import cv2
import numpy as np
import pytest
from bun import all_hair, bun, depth_in_bun, main_directions, off_deg, seen, turn
from hairkit_plugins.tensor_diffusion import Options, scalp_normals, solve_field

from hairkit.arrays import Float32Array
from hairkit.field.growth_prior import measure_scalp_distance
from hairkit.testing import ball_head
from hairkit.types.camera import Camera
from hairkit.types.head import Head
from hairkit.types.orientation import OrientationMap, wrap_angle
from hairkit.types.scene import Scene
from hairkit.types.volume import OrientationField, symmetric_matrices


def solve(
    options: Options | None = None,
    *,
    cameras: tuple[Camera, ...] | None = None,
    maps: tuple[OrientationMap, ...] | None = None,
    head: Head | None = None,
) -> OrientationField:
    """Solve the bun's field; the head is out of its reach unless one is given."""
    cameras = turn() if cameras is None else cameras
    far = ball_head()
    far = replace(far, vertices=far.vertices - np.float32([0, 1, 0]))
    scene = Scene(tuple("abcdefgh"[: len(cameras)]), cameras, head or far)
    return solve_field(
        scene,
        tuple(all_hair(camera) for camera in cameras),
        tuple(seen(camera) for camera in cameras) if maps is None else maps,
        bun(),
        measure_scalp_distance(ball_head(), bun()),
        options or Options(),
    )


def test_exact_angles_give_the_true_direction_everywhere() -> None:
    """Outer cells are known, and the core, which no view sees, is filled from them."""
    field, hull = solve(), bun()
    depth = depth_in_bun(hull)
    assert (field.confidence[hull.dense & (depth < 0.005)] > 0).mean() > 0.7
    assert field.confidence[hull.dense & (depth > 0.02)].max() == 0
    assert off_deg(main_directions(field.tensor[hull.dense])).max() < 2


def test_known_cells_keep_what_was_fused() -> None:
    """Where views contradict each other, smoothing would change them: they stay as they are."""
    maps = [seen(camera) for camera in turn()]
    maps[2] = OrientationMap(wrap_angle(maps[2].angle + 0.5), maps[2].confidence)
    field = solve(maps=tuple(maps))
    known = field.confidence > 0
    values = np.linalg.eigvalsh(symmetric_matrices(field.tensor[known]))
    assert np.percentile(off_deg(main_directions(field.tensor[known])), 90) > 5
    np.testing.assert_allclose(values[:, 2], 1, atol=0.02)


def test_weights_are_squares_of_box_means() -> None:
    """Of two contradicting views, the one with thrice the confidence has nine times the say.

    A single bad pixel changes little where its neighbours are trusted, and all without the box.
    """
    cameras = (*turn()[:2], turn()[2])
    maps = [seen(camera) for camera in cameras]
    trust = np.full(maps[0].confidence.shape, 1 / 3, np.float32)
    shaken = OrientationMap(wrap_angle(maps[2].angle + 0.4), trust)
    squared = OrientationMap(shaken.angle, trust**2)
    plain = solve(Options(box=1), cameras=cameras, maps=(*maps[:2], shaken))
    boxed = solve(Options(box=5), cameras=cameras, maps=(*maps[:2], shaken))
    np.testing.assert_allclose(plain.tensor, boxed.tensor, atol=1e-3)
    assert (
        np.abs(plain.tensor - solve(cameras=cameras, maps=(*maps[:2], squared)).tensor).max() > 0.01
    )
    noisy = (np.random.default_rng(2).random(trust.shape) > 0.5).astype(np.float32)
    smooth = cv2.blur(noisy, (5, 5), borderType=cv2.BORDER_REPLICATE)
    results = [
        solve(Options(box=box), cameras=cameras, maps=(*maps[:2], OrientationMap(shaken.angle, c)))
        for box, c in ((5, noisy), (1, smooth))
    ]
    np.testing.assert_allclose(results[0].tensor, results[1].tensor, atol=1e-3)


def test_one_view_is_too_few() -> None:
    """Cells that one view sees alone are left to the diffusion."""
    two, four = (solve(Options(min_views=n)).confidence for n in (2, 4))
    assert (four <= two).all()
    assert np.count_nonzero(four) < np.count_nonzero(two)


def test_the_scalp_gives_its_normals_to_the_cells_that_it_cuts() -> None:
    """Within 3 degrees of the ball's radius, in cells around whose centre it passes."""
    head, grid = ball_head(), bun().grid
    points = grid.centres().reshape(-1, 3)
    normals = scalp_normals(head, points, grid.spacing).reshape(*grid.shape, 3)
    distance = np.linalg.norm(points, axis=1).reshape(grid.shape)
    cut = normals.any(axis=-1)
    radius = np.linalg.norm(head.vertices[head.scalp > 0.5], axis=1).mean()
    assert np.abs(distance[cut] - radius).max() < grid.spacing * np.sqrt(0.75)
    near = (np.abs(distance - radius) < 0.3 * grid.spacing) & (grid.centres()[..., 1] > 0.09)
    assert cut[near].all()
    radial = grid.centres()[cut] / distance[cut][:, None]
    assert np.degrees(np.arccos(np.clip((radial * normals[cut]).sum(axis=1), -1, 1))).max() < 3


def test_hair_leaves_the_scalp_along_its_normals() -> None:
    """The field of the bun turns to the normal where the scalp cuts it."""
    hull = bun()
    head = ball_head()
    bare, rooted = solve(), solve(head=replace(head, vertices=1.05 * head.vertices))
    moved = np.abs(bare.tensor - rooted.tensor).max(axis=-1)
    near = hull.dense & (hull.head_distance < 2 * hull.grid.spacing)
    assert moved[near].max() > 0.2 > moved[hull.dense & (hull.head_distance > 0.06)].max()


def quarter_turned(six: Float32Array, times: int) -> Float32Array:
    """Turn a field (X, Y, Z, 6) about the vertical axis, the tensors with it."""
    angle = np.pi / 2 * times
    c, s = np.round([np.cos(angle), np.sin(angle)])
    rotation = np.array([[c, 0, s], [0, 1, 0], [-s, 0, c]])
    turned = np.rot90(six, times, axes=(2, 0))
    matrices = rotation @ symmetric_matrices(turned) @ rotation.T
    pick = ([0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2])
    return matrices[..., pick[0], pick[1]].astype(np.float32)


@pytest.mark.parametrize("times", [1, 3])
def test_turning_the_whole_scene_turns_the_field(times: int) -> None:
    """Cameras and hull turned by quarter turns: the field turns with them."""
    angle = np.pi / 2 * times
    c, s = np.cos(angle), np.sin(angle)
    rotation = np.array([[c, 0, s], [0, 1, 0], [-s, 0, c]])
    hull, cameras = bun(), turn()
    turned_cameras, maps = [], [seen(camera) for camera in cameras]
    for camera in cameras:
        matrix = camera.camera_from_head.copy()
        matrix[:3, :3] = camera.rotation @ rotation.T
        turned_cameras.append(replace(camera, camera_from_head=matrix))
    maps[1] = OrientationMap(wrap_angle(maps[1].angle + 0.5), maps[1].confidence)
    options = Options(tolerance=1e-6)
    straight = solve(options, cameras=cameras, maps=tuple(maps))
    turned = solve(options, cameras=tuple(turned_cameras), maps=tuple(maps))
    wanted = quarter_turned(straight.tensor, times)
    close = np.abs(turned.tensor - wanted).max(axis=-1)[hull.dense] < 0.02
    assert close.mean() > 0.98  # a cell may fall on the other side of a pixel's edge
    assert np.abs(wanted - straight.tensor).max() > 0.3


def test_fields_are_finite_and_zero_outside_the_hair() -> None:
    """Tensors live in the loose hull; trace is near 1, confidence in [0, 1]."""
    field, hull = solve(), bun()
    assert not field.tensor[~hull.loose].any()
    assert not field.confidence[~hull.loose].any()
    np.testing.assert_allclose(field.tensor[hull.loose][:, :3].sum(axis=1), 1, atol=0.05)
    assert field.confidence.min() >= 0
    assert field.confidence.max() <= 1
