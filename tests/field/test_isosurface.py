"""The surface of a volume is closed, in place, and faces outwards."""

from __future__ import annotations

import numpy as np
import pytest

from hairkit.field.isosurface import volume_surface
from hairkit.types.volume import VoxelGrid

GRID = VoxelGrid(np.array([-0.1, -0.08, -0.12]), 0.005, (40, 36, 44))


def ball(radius: float) -> np.ndarray:
    """Cells of the grid within `radius` of the origin of the head frame."""
    return np.asarray(np.linalg.norm(GRID.centres(), axis=-1) < radius)


@pytest.mark.parametrize(("radius", "step"), [(0.03, 1), (0.06, 1), (0.06, 2)])
def test_the_surface_of_a_ball_is_a_sphere(radius: float, step: int) -> None:
    """Vertices lie on the sphere to a cell; normals point along the radius."""
    vertices, _, normals = volume_surface(GRID, ball(radius), step)
    distance = np.linalg.norm(vertices, axis=1)
    assert distance == pytest.approx(radius, abs=GRID.spacing)
    assert (np.einsum("vc,vc->v", vertices, normals) / distance).min() > 0.9
    assert np.linalg.norm(normals, axis=1) == pytest.approx(1, abs=1e-5)


def test_every_edge_has_two_faces_and_they_face_outwards() -> None:
    """The mesh is closed, and its volume is positive: that of the ball, a little blown up."""
    vertices, faces, _ = volume_surface(GRID, ball(0.06))
    edges = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
    directed = {tuple(edge) for edge in edges.tolist()}
    assert len(directed) == len(edges)
    assert directed == {(b, a) for a, b in directed}
    corners = vertices[faces].astype(np.float64)
    enclosed = np.linalg.det(corners).sum() / 6
    assert enclosed == pytest.approx(4 / 3 * np.pi * 0.06**3, rel=0.1)


def test_a_sheet_of_one_cell_stays() -> None:
    """Hair as thin as one cell, at the very edge of the grid, has a surface."""
    sheet = np.zeros(GRID.shape, np.bool_)
    sheet[0, 5:30, 5:30] = True
    vertices, faces, _ = volume_surface(GRID, sheet)
    assert len(faces) > 1000
    assert np.abs(vertices[:, 0] - (GRID.origin[0] + GRID.spacing / 2)).max() < GRID.spacing
