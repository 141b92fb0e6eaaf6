"""Laws of the head on a scan: known shapes are found, bad scans are refused in one line."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hairkit_plugins.nonrigid_icp import Options, Scan, bend, fit_head, place, read_scan
from scipy.spatial.transform import Rotation

from hairkit import Head
from hairkit.arrays import Float64Array
from hairkit.errors import FormatError, InputError
from hairkit.head_model.signed_distance import distance_to
from hairkit.head_model.template import default_head
from hairkit.io.head_reader import write_head_obj
from hairkit.testing import ball_head, turn_capture, turn_scene

HEAD = ball_head()


def true_head() -> Head:
    """Return the ball head with a nose, and flatter at its sides."""
    points = HEAD.vertices.astype(np.float64)
    reach = float(np.ptp(points[:, 2])) / 2
    away = points - points[points[:, 2].argmax()]
    nose = 0.12 * reach * np.exp(-(away**2).sum(axis=1) / (0.5 * reach) ** 2)
    points = points * [0.95, 1, 1] + np.outer(nose, [0, 0, 1])
    return replace(HEAD, vertices=points.astype(np.float32))


def distance(head: Head) -> float:
    """Return the mean distance of a head's vertices from the true head, metres."""
    return float(np.abs(distance_to(true_head(), head.vertices)).mean())


def dense(head: Head) -> Float64Array:
    """Return points (P, 3) all over a head's faces."""
    weights = np.random.default_rng(0).dirichlet(np.ones(3), (20, len(head.faces)))
    points = np.einsum("nfc,fcx->nfx", weights, head.vertices[head.faces].astype(np.float64))
    return points.reshape(-1, 3)


@pytest.mark.parametrize("method", ["amberg", "sumner"])
@pytest.mark.parametrize("faces", [True, False])
def test_a_known_shape_is_found(method: str, faces: bool) -> None:
    """The head comes to lie on a mesh or a cloud; faces, uv and scalp stay as they were."""
    true = true_head()
    points = dense(true)
    triangles = true.faces.astype(np.int64) if faces else np.empty((0, 3), np.int64)
    scan = Scan(true.vertices.astype(np.float64) if faces else points, triangles, None)
    found = bend(HEAD, scan, Options(method=method))
    assert distance(found) < 0.4 * distance(HEAD)
    for name in ("faces", "uv", "scalp"):
        np.testing.assert_array_equal(getattr(found, name), getattr(HEAD, name))


def test_stiffness_keeps_the_shape() -> None:
    """A stiffer head moves less."""
    points = dense(true_head())
    scan = Scan(points, np.empty((0, 3), np.int64), None)
    soft, stiff = (bend(HEAD, scan, Options(stiffness=s)) for s in (1.0, 50.0))
    assert distance(soft) < distance(stiff)


def test_a_hole_is_bridged() -> None:
    """Where the scan has a hole, vertices follow their neighbours and do not fall into its rim."""
    true = true_head()
    points = dense(true)
    back = points[:, 2] < 0.6 * points[:, 2].min()
    found = bend(HEAD, Scan(points[~back], np.empty((0, 3), np.int64), None), Options())
    over = HEAD.vertices[:, 2] < 0.6 * HEAD.vertices[:, 2].min()
    off = np.linalg.norm(found.vertices[over] - true.vertices[over], axis=1)
    assert off.max() < 0.25 * np.ptp(HEAD.vertices[:, 2])
    assert np.isfinite(found.joints).all()


def test_landmarks_turn_and_scale_the_scan() -> None:
    """A scan in any pose and size comes to lie on the head where both have landmarks."""
    index = np.linspace(0, len(HEAD.vertices) - 1, 68).astype(np.int32)
    head = replace(HEAD, landmark_vertices=index)
    points = dense(head)
    turn = Rotation.from_euler("xyz", [80, 40, -100], degrees=True).as_matrix()
    moved = 1.3 * points @ turn.T + [1.0, 2.0, 3.0]
    marks = 1.3 * head.vertices[index] @ turn.T + [1.0, 2.0, 3.0]
    placed = place(Scan(moved, np.empty((0, 3), np.int64), marks), head)
    np.testing.assert_allclose(placed.points, points, atol=0.004)


def test_the_points_of_a_scene_are_a_scan() -> None:
    """What cameras found on the head bends it; points of the room behind it do not."""
    rng = np.random.default_rng(1)
    on_head = rng.permutation(dense(true_head()))[:3000]
    room = rng.uniform((-1, -1, -4), (1, 1, -2), (500, 3))
    scene = replace(turn_scene(), points=np.concatenate([on_head, room]).astype(np.float32))
    found = fit_head(turn_capture(), (), scene, Options()).head
    assert distance(found) < 0.5 * distance(HEAD)
    assert np.abs(found.vertices).max() < 1.3 * np.abs(HEAD.vertices).max()
    few = replace(scene, points=scene.points[-500:])
    with pytest.raises(InputError, match="there are 0"):
        fit_head(turn_capture(), (), few, Options())
    with pytest.raises(InputError, match="there are 0"):
        fit_head(turn_capture(), (), turn_scene(), Options())


def write_cloud(path: Path, points: Float64Array) -> Path:
    """Write points as a PLY file without faces."""
    header = f"ply\nformat ascii 1.0\nelement vertex {len(points)}\n"
    header += "".join(f"property float {axis}\n" for axis in "xyz") + "end_header\n"
    path.write_text(header + "\n".join(" ".join(f"{v:.6f}" for v in p) for p in points) + "\n")
    return path


def test_files_are_read_in_their_unit(tmp_path: Path) -> None:
    """Points of a PLY cloud and landmarks beside it come in metres."""
    points = dense(HEAD)[:2000]
    path = write_cloud(tmp_path / "scan.ply", 1000 * points)
    (tmp_path / "scan.landmarks.json").write_text(json.dumps((1000 * points[:68]).tolist()))
    scan = read_scan(path, "mm")
    np.testing.assert_allclose(scan.points, points, atol=1e-6)
    assert scan.landmarks is not None
    np.testing.assert_allclose(scan.landmarks, points[:68], atol=1e-6)


def test_landmarks_of_a_written_head_are_read(tmp_path: Path) -> None:
    """What `hairkit head -o x.obj` writes beside the mesh, numbers of vertices, marks a scan."""
    head = default_head()
    write_head_obj(tmp_path / "x.obj", head)
    scan = read_scan(tmp_path / "x.obj")
    assert scan.landmarks is not None
    assert head.landmark_vertices is not None
    np.testing.assert_allclose(scan.landmarks, head.vertices[head.landmark_vertices], atol=1e-6)


def test_bad_scans_are_refused(tmp_path: Path) -> None:
    """Wrong units, few points, no overlap and damage give one line."""
    points = dense(HEAD)[:2000]
    path = write_cloud(tmp_path / "scan.ply", 1000 * points)
    with pytest.raises(InputError, match=r"m across in the unit 'm'.*units"):
        read_scan(path)
    with pytest.raises(InputError, match="20 points, expected"):
        read_scan(write_cloud(tmp_path / "few.ply", points[:20]))
    path.write_bytes(path.read_bytes()[:2000])
    with pytest.raises(FormatError, match=r"scan\.ply"):
        read_scan(path, "mm")
    with pytest.raises(FormatError, match="must be"):
        read_scan(tmp_path / "scan.stl")
    small = Scan(points[points[:, 2] > 0.9 * points[:, 2].max()], np.empty((0, 3), np.int64), None)
    with pytest.raises(InputError, match="covers"):
        place(small, HEAD)
    (tmp_path / "bad.landmarks.json").write_text("[[1, 2]]")
    with pytest.raises(FormatError, match="expected 68"):
        read_scan(write_cloud(tmp_path / "bad.ply", points))
