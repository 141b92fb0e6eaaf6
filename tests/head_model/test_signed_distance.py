"""Laws of the distance to a head: exact at points, near exact on grids, on open meshes too."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import trimesh
from scipy.ndimage import distance_transform_edt

from hairkit.head_model.bvh import build_tree, inside_surface, nearest_on_surface
from hairkit.head_model.signed_distance import (
    BAND,
    _within,
    closed_surface,
    distance_to,
    signed_distance,
)
from hairkit.head_model.template import default_head
from hairkit.types.head import Capsules, Head
from hairkit.types.volume import VoxelGrid

GRID = VoxelGrid.around([-0.14, -0.12, -0.13], [0.14, 0.13, 0.12], 0.005)


def _head(vertices: np.ndarray, faces: np.ndarray) -> Head:
    none = np.zeros((0, 3), np.float32)
    count = len(vertices)
    return Head(
        vertices, faces, np.zeros((count, 2), np.float32), np.ones(count, np.float32), None,
        np.zeros((3, 3), np.float32), Capsules(none, none, none[:, :2]),
    )  # fmt: skip


def _ball(radius: float = 0.08) -> trimesh.Trimesh:
    return trimesh.creation.icosphere(subdivisions=5, radius=radius)


def test_points_see_a_ball_as_its_formula() -> None:
    """Distance to a fine ball is the distance to its centre less its radius."""
    points = np.random.default_rng(1).uniform(-0.15, 0.15, (3000, 3))
    ball = _ball()
    found = distance_to(_head(ball.vertices, ball.faces), points)
    np.testing.assert_allclose(found, np.linalg.norm(points, axis=1) - 0.08, atol=5e-5)


def test_grid_sees_a_ball_as_its_formula() -> None:
    """So does the grid: closely near the surface, within a fraction of a cell far from it."""
    ball = _ball()
    found = signed_distance(_head(ball.vertices, ball.faces), GRID)
    wanted = np.linalg.norm(GRID.centres().astype(np.float64), axis=3) - 0.08
    near = np.abs(wanted) < BAND
    assert np.abs(found - wanted)[near].max() < 1e-4
    assert np.abs(found - wanted)[~near].max() < 2.5e-3
    assert np.array_equal(found < 0, wanted < 0)


def test_grid_agrees_with_points_on_the_head() -> None:
    """Same signs everywhere; exact near the head, nowhere off by a cell."""
    grid = VoxelGrid.around([-0.11, -0.28, -0.12], [0.11, 0.1, 0.14], 0.004)
    head = default_head()
    found = signed_distance(head, grid).reshape(-1)[::7]
    wanted = distance_to(head, grid.centres().reshape(-1, 3)[::7])
    near = np.abs(wanted) < BAND
    assert np.abs(found - wanted)[near].max() < 1e-6
    assert np.abs(found - wanted).max() < 0.0035
    assert np.abs(found - wanted).mean() < 0.0003
    assert (found >= 0).tolist() == (wanted >= 0).tolist()


def test_nearest_points_equal_an_independent_search() -> None:
    """The box tree finds what trimesh's exact search finds, and its weights give that point."""
    head = default_head()
    points = np.random.default_rng(2).uniform(-0.2, 0.2, (300, 3))
    face, weights, distance = nearest_on_surface(build_tree(head.vertices, head.faces), points)
    mesh = trimesh.Trimesh(head.vertices, head.faces, process=False)
    wanted = trimesh.proximity.closest_point(mesh, points)[1]
    np.testing.assert_allclose(distance, wanted, atol=3e-6)
    found = (head.vertices[head.faces[face]] * weights[:, :, None]).sum(axis=1)
    np.testing.assert_allclose(np.linalg.norm(found - points, axis=1), distance, atol=1e-7)


@pytest.mark.parametrize("count", [1, 2, 3, 5, 17])
def test_tree_of_few_triangles_equals_trying_all(count: int) -> None:
    """Filling the leaves up adds no surface."""
    generator = np.random.default_rng(count)
    corners = generator.random((3 * count, 3))
    faces = np.arange(3 * count).reshape(-1, 3)
    points = generator.uniform(-1, 2, (50, 3))
    distance = nearest_on_surface(build_tree(corners, faces), points)[2]
    alone = [nearest_on_surface(build_tree(corners, face[None]), points)[2] for face in faces]
    np.testing.assert_allclose(distance, np.min(alone, axis=0), atol=1e-12)


def test_lines_through_vertices_and_edges_count_once() -> None:
    """On a cube whose corners, edges and diagonals lie on the grid of points, signs are exact."""
    cube = trimesh.creation.box(extents=(2, 2, 2))
    axis = np.arange(-1.5, 1.6, 0.5)
    points = np.stack(np.meshgrid(axis, axis, axis, indexing="ij"), axis=-1).reshape(-1, 3)
    clear = np.abs(np.abs(points).max(axis=1) - 1) > 1e-9
    inside = inside_surface(build_tree(cube.vertices, cube.faces), points[clear])
    np.testing.assert_array_equal(inside, np.abs(points[clear]).max(axis=1) < 1)


def test_holes_and_seams_do_not_change_sides() -> None:
    """A ball cut open, with every face's corners its own, or turned inside out, stays a body."""
    ball = _ball()
    points = np.random.default_rng(5).uniform(-0.1, 0.1, (2000, 3))
    points = points[points[:, 1] > -0.04]
    wanted = np.linalg.norm(points, axis=1) < 0.08
    clear = np.abs(np.linalg.norm(points, axis=1) - 0.08) > 1e-4
    kept = ball.faces[ball.triangles_center[:, 1] > -0.06]
    eyes = np.linalg.norm(ball.triangles_center - [0.03, 0, 0.074], axis=1)
    two_holes = ball.faces[(ball.triangles_center[:, 1] > -0.06) & (eyes > 0.01)]
    soup = (ball.vertices[kept].reshape(-1, 3), np.arange(3 * len(kept)).reshape(-1, 3))
    for vertices, faces in [
        (ball.vertices, kept),
        (ball.vertices, two_holes),
        (ball.vertices, kept[:, ::-1]),
        soup,
    ]:
        head = _head(vertices, faces)
        shallow = np.linalg.norm(points - [0.03, 0, 0.074], axis=1) > 0.015
        check = clear & shallow
        assert np.array_equal((distance_to(head, points) < 0)[check], wanted[check])
        mesh = trimesh.Trimesh(*closed_surface(head), process=False)
        assert mesh.is_watertight


def test_a_body_in_the_body_makes_no_hole() -> None:
    """Eyeballs modelled as balls of their own inside the head leave the head solid."""
    ball, eye = _ball(), trimesh.creation.icosphere(subdivisions=3, radius=0.012)
    vertices = np.concatenate([ball.vertices, eye.vertices + np.array([0.02, 0, 0.06])])
    head = _head(vertices, np.concatenate([ball.faces, eye.faces + len(ball.vertices)]))
    found = signed_distance(head, GRID)
    wanted = np.linalg.norm(GRID.centres().astype(np.float64), axis=3) - 0.08
    assert np.array_equal(found < 0, wanted < 0)


def test_grids_away_from_the_surface_are_still_measured() -> None:
    """Wholly outside, wholly inside, or cutting only a part of the head."""
    ball = _ball()
    head = _head(ball.vertices, ball.faces)
    for low, high in [((0.2, 0.2, 0.2), (0.23, 0.23, 0.23)), ((-0.02,) * 3, (0.02,) * 3)]:
        grid = VoxelGrid.around(low, high, 0.01)
        wanted = np.linalg.norm(grid.centres().astype(np.float64), axis=3) - 0.08
        np.testing.assert_allclose(signed_distance(head, grid), wanted, atol=1e-4)


@pytest.mark.parametrize("squared", [1.0, 5.0, 13.8, 16.0])
def test_cells_near_others_equal_a_distance_transform(
    squared: float, rng: np.random.Generator
) -> None:
    """Cells are near those that hold surface as SciPy's distances say, at the borders too."""
    for shape in ((20, 17, 9), (3, 4, 5), (40, 1, 30)):
        cells = rng.random(shape) < 0.01
        cells.flat[0] = True
        steps = np.rint(distance_transform_edt(~cells) ** 2)
        np.testing.assert_array_equal(_within(cells, squared), steps < squared)


def test_distance_is_the_same_every_time() -> None:
    """Equal input gives byte-identical output."""
    first, second = signed_distance(default_head(), GRID), signed_distance(default_head(), GRID)
    assert first.tobytes() == second.tobytes()


@pytest.mark.parametrize("name", ["straight_long", "wavy", "short"])
def test_true_roots_lie_on_the_outside_of_open_heads(name: str, captures: Path) -> None:
    """4 mm along the normal every true root is outside, 4 mm against it inside."""
    truth = captures / name / "truth"
    mesh = trimesh.load(truth / "head.obj", process=False)
    head = _head(mesh.vertices, mesh.faces)
    strands = np.load(truth / "strands.npz")
    roots = strands["points"][strands["offsets"][:-1]].astype(np.float64)
    face = nearest_on_surface(build_tree(head.vertices, head.faces), roots)[0]
    normals = head.normals()[head.faces[face, 0]]
    assert distance_to(head, roots + 0.004 * normals).min() > 0
    assert distance_to(head, roots - 0.004 * normals).max() < 0
