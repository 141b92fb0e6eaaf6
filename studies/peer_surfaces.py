"""Peers of functions on meshes: nearest points, signs, distances, depth maps, spread points."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from functools import partial
from typing import Any

import numpy as np
import numpy.typing as npt
from peer_cases import Case, largest, share_differing
from scipy import ndimage

from hairkit.cameras.depth_raster import mesh_depth
from hairkit.field import isosurface
from hairkit.head_model.bvh import build_tree, inside_surface, nearest_on_surface
from hairkit.head_model.signed_distance import BAND, closed_surface, signed_distance
from hairkit.head_model.template import default_head
from hairkit.types.camera import Camera
from hairkit.types.volume import VoxelGrid

Array = npt.NDArray[Any]
Peers = Mapping[str, Callable[[Array], Array]]
NEAR = 0.02
"""Metres from the head's vertices up to which points lie."""
CELL = 0.003
"""Metres of a cell: that of a hull."""
SAME_DEPTH = 1e-4
"""Metres by which depths may differ in one pixel."""
APART = 0.001
"""Metres between points that are spread over the scalp: about 30,000 of them."""


def nearest_points(size: float) -> Iterator[Case]:
    """Distances of points around the head; every function builds its own tree."""
    vertices, faces = closed_surface(default_head())

    def igl_distance(points: Array) -> Array:
        import igl

        return np.sqrt(igl.point_mesh_squared_distance(points, vertices, faces.astype(int))[0])

    def open3d_distance(points: Array) -> Array:
        feet = _open3d_scene(vertices, faces).compute_closest_points(_tensor(points))["points"]
        return np.linalg.norm(feet.numpy() - points, axis=1)

    def trimesh_distance(points: Array) -> Array:
        import rtree  # noqa: F401 - trimesh asks for it when it searches
        import trimesh

        return trimesh.proximity.closest_point(trimesh.Trimesh(vertices, faces), points)[1]

    quick = {
        "`igl.point_mesh_squared_distance`": igl_distance,
        "Open3D `compute_closest_points`": open3d_distance,
    }
    yield from _with_points(
        Case(
            "`nearest_on_surface`",
            f"{len(faces):,} faces",
            lambda points: nearest_on_surface(build_tree(vertices, faces), points)[2],
            {},
            lambda ours, theirs: 1e3 * largest(ours, theirs),
            "mm",
            0.05,
        ),
        _around(vertices, int(50_000 * size)),
        quick,
        {"trimesh `closest_point`": trimesh_distance},
    )


def insides(size: float) -> Iterator[Case]:
    """Whether points around the head lie in it."""
    vertices, faces = closed_surface(default_head())

    def winding(points: Array) -> Array:
        import igl

        numbers = igl.fast_winding_number(vertices, faces.astype(int), points)
        return np.asarray(np.abs(numbers) > 0.5)

    def contains(points: Array) -> Array:
        import rtree  # noqa: F401 - trimesh asks for it when it searches
        import trimesh
        from trimesh.ray.ray_triangle import RayMeshIntersector

        return RayMeshIntersector(trimesh.Trimesh(vertices, faces)).contains_points(points)

    yield from _with_points(
        Case(
            "`inside_surface`",
            f"{len(faces):,} faces",
            lambda points: inside_surface(build_tree(vertices, faces), points),
            {},
            share_differing,
            "% of the points",
            2.0,
        ),
        _around(vertices, int(50_000 * size)),
        {"`igl.fast_winding_number`": winding},
        {"trimesh `contains_points`": contains},
    )


def _with_points(case: Case, points: Array, quick: Peers, slow: Peers) -> Iterator[Case]:
    """Yield the case with points (N, 3) for quick peers, and with a tenth of them for slow ones."""
    for some, peers in ((points, quick), (points[::10], slow)):
        yield case._replace(
            size=f"{len(some):,} points, {case.size}",
            ours=partial(case.ours, some),
            peers={name: partial(peer, some) for name, peer in peers.items()},
        )


def distances(size: float) -> Iterator[Case]:
    """The distance in every cell of a grid, compared up to `BAND` from the surface."""
    head = default_head()
    vertices, faces = closed_surface(head)
    grid = VoxelGrid.around([-0.12, -0.2, -0.13], [0.12, 0.13, 0.15], CELL / size ** (1 / 3))
    centres = grid.centres().reshape(-1, 3).astype(np.float64)

    def igl_distance() -> Array:
        import igl

        corners = faces.astype(int)
        far = np.sqrt(igl.point_mesh_squared_distance(centres, vertices, corners)[0])
        inside = np.abs(igl.fast_winding_number(vertices, corners, centres)) > 0.5
        return np.where(inside, -far, far).reshape(grid.shape)

    def apart(ours: Array, theirs: Array) -> float:
        near = np.abs(theirs) < BAND
        return 1e3 * largest(ours[near], theirs[near])

    yield Case(
        "`signed_distance`",
        f"{np.prod(grid.shape):,} cells of {1e3 * grid.spacing:.2g} mm",
        lambda: signed_distance(head, grid),
        {
            "`igl.point_mesh_squared_distance`, `fast_winding_number`": igl_distance,
        },
        apart,
        f"mm up to {1e3 * BAND:.0f} mm away",
        0.3e3 * grid.spacing,
    )


def depth_maps(size: float) -> Iterator[Case]:
    """The depth of the head in every pixel of a photo."""
    head = default_head()
    height = int(1440 * size**0.5)
    camera = Camera.on_turn(
        30.0, distance=1.0, target=(0.0, 0.0, 0.0), focal=2.5 * height, width=height * 3 // 4,
        height=height,
    )  # fmt: skip

    def rays() -> Array:
        row, column = np.mgrid[:height, : camera.width] + 0.5
        way = np.stack(
            [
                (column - camera.centre[0]) / camera.focal,
                (row - camera.centre[1]) / camera.focal,
                np.ones_like(row),
            ],
            axis=-1,
        )
        turn, shift = camera.camera_from_head[:3, :3], camera.camera_from_head[:3, 3]
        start = np.broadcast_to(-turn.T @ shift, way.shape)
        scene = _open3d_scene(head.vertices, head.faces)
        lines = np.concatenate([start, way @ turn], axis=-1)
        return np.asarray(scene.cast_rays(_tensor(lines))["t_hit"].numpy())

    def apart(ours: Array, theirs: Array) -> float:
        empty = np.isinf(ours) & np.isinf(theirs)
        with np.errstate(invalid="ignore"):
            return 100 * float(np.mean(~empty & ~(np.abs(ours - theirs) < SAME_DEPTH)))

    yield Case(
        "`mesh_depth`",
        f"{camera.width} x {height} pixels, {len(head.faces):,} faces",
        lambda: mesh_depth(head.vertices, head.faces, camera),
        {"Open3D `cast_rays`": rays},
        apart,
        "% of the pixels by 0.1 mm",
        0.1,
    )


def isosurfaces(size: float) -> Iterator[Case]:
    """The smooth surface of a volume of cells; vertices of ours to the other mesh."""
    grid = VoxelGrid.around([-0.12, -0.2, -0.13], [0.12, 0.13, 0.15], CELL / size ** (1 / 3))
    inside = signed_distance(default_head(), grid) < 0
    blur, level = isosurface.BLUR, isosurface.LEVEL

    def cubes() -> tuple[Array, Array]:
        from skimage.measure import marching_cubes

        smooth = ndimage.gaussian_filter(np.pad(inside, 4).astype(np.float32), blur, truncate=3.0)
        vertices, faces, _, _ = marching_cubes(smooth, level)
        return grid.origin + (vertices - 3.5) * grid.spacing, faces

    def apart(ours: tuple[Array, ...], theirs: tuple[Array, Array]) -> float:
        return float(nearest_on_surface(build_tree(*theirs), ours[0])[2].max()) / grid.spacing

    yield Case(
        "`volume_surface`",
        f"{np.prod(grid.shape):,} cells",
        lambda: isosurface.volume_surface(grid, inside),
        {"scikit-image `marching_cubes`": cubes},
        apart,
        "cells",
        0.5,
    )


def _around(vertices: Array, count: int) -> Array:
    """Return points (N, 3) around the vertices, neighbours near each other."""
    rng = np.random.default_rng(0)
    at = vertices[np.sort(rng.integers(0, len(vertices), count))]
    return at + rng.uniform(-NEAR, NEAR, (count, 3))


def _open3d_scene(vertices: Array, faces: Array) -> Any:
    import open3d

    scene = open3d.t.geometry.RaycastingScene()
    scene.add_triangles(_tensor(vertices), open3d.core.Tensor(faces.astype(np.uint32)))
    return scene


def _tensor(values: Array) -> Any:
    import open3d

    return open3d.core.Tensor(np.ascontiguousarray(values, np.float32))


CASES: list[Callable[[float], Iterator[Case]]] = [
    nearest_points,
    insides,
    distances,
    depth_maps,
    isosurfaces,
]
"""Functions of the size of the input, 1 for the usual one."""
