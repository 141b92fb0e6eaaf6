"""Laws of the procedural head: closed, human in size, its marks where they belong."""

from __future__ import annotations

import json
import time
from concurrent.futures import ThreadPoolExecutor
from functools import cache
from pathlib import Path

import numpy as np
import pytest
import trimesh

from hairkit.head_model import template
from hairkit.head_model.scalp import bind, evaluate
from hairkit.head_model.template import default_head


def _similarity(source: np.ndarray, target: np.ndarray) -> tuple[float, np.ndarray, np.ndarray]:
    a, b = source - source.mean(axis=0), target - target.mean(axis=0)
    u, _, vt = np.linalg.svd(b.T @ a)
    turn = u @ np.diag([1, 1, np.linalg.det(u @ vt)]) @ vt
    scale = np.trace(turn.T @ (b.T @ a)) / (a**2).sum()
    return scale, turn, target.mean(axis=0) - scale * turn @ source.mean(axis=0)


def test_head_is_closed_and_wound_outward() -> None:
    """Every edge has two faces that run it both ways, and the volume is a head's and positive."""
    head = default_head()
    mesh = trimesh.Trimesh(head.vertices, head.faces, process=False)
    assert mesh.is_watertight
    assert mesh.is_winding_consistent
    assert 0.0035 < mesh.volume < 0.0055


def test_making_the_head_again_gives_the_same_arrays() -> None:
    """The head depends on nothing but the code; asked for twice it is the same object."""
    again = template._make_head.__wrapped__()
    for name in ("vertices", "faces", "uv", "scalp", "landmark_vertices", "joints"):
        np.testing.assert_array_equal(getattr(again, name), getattr(default_head(), name))
    assert default_head() is default_head()


def test_threads_that_ask_at_once_get_one_head(monkeypatch: pytest.MonkeyPatch) -> None:
    """The head is made once, however many threads ask before it is there."""
    made: list[int] = []

    def make() -> object:
        made.append(len(made))
        time.sleep(0.05)
        return object()

    monkeypatch.setattr(template, "_make_head", cache(make))
    with ThreadPoolExecutor(4) as pool:
        heads = [pool.submit(default_head) for _ in range(4)]
    assert len({id(head.result()) for head in heads}) == 1
    assert made == [0]


def test_head_has_human_proportions() -> None:
    """Breadth 155 mm, height from chin to crown and length within two deviations of adults."""
    head = default_head()
    hair = head.vertices[head.scalp > 0.5]
    assert np.ptp(hair[:, 0]) == pytest.approx(0.155, abs=0.0015)
    chin = head.vertices[head.landmark_vertices[8]]
    assert 0.195 < hair[:, 1].max() - chin[1] < 0.25
    forehead = head.vertices[head.landmark_vertices[27]]
    assert 0.175 < forehead[2] - hair[:, 2].min() < 0.205
    assert head.vertices[:, 1].min() == pytest.approx(-0.25, abs=0.002)
    ears = head.vertices[np.abs(head.vertices[:, 0]) > 0.082]
    assert -0.09 < ears[:, 1].min() < ears[:, 1].max() < -0.03


def test_head_is_its_own_mirror_image() -> None:
    """Mirrored in the median plane, its vertices lie on its surface again."""
    head = default_head()
    mirrored = head.vertices * np.float32([-1, 1, 1])
    triangle, weights = bind(mirrored, head)
    apart = np.linalg.norm(evaluate(head, triangle, weights) - mirrored, axis=1)
    assert apart.max() < 0.002
    assert apart.mean() < 1e-4


def test_landmarks_are_in_ibug_order() -> None:
    """Right before left, upper before lower; the tip of the nose is foremost, the chin lowest."""
    head = default_head()
    marks = head.vertices[head.landmark_vertices].astype(np.float64)
    mirror = np.float64([-1, 1, 1])
    pairs = [(0, 16), (4, 12), (17, 26), (21, 22), (31, 35), (36, 45), (39, 42), (37, 44)]
    pairs += [(41, 46), (48, 54), (50, 52), (59, 55), (60, 64)]
    for right, left in pairs:
        assert marks[right, 0] < 0 < marks[left, 0]
        np.testing.assert_allclose(marks[right], marks[left] * mirror, atol=0.0015)
    assert marks[:, 2].argmax() == 30
    assert marks[:, 1].argmin() == 8
    np.testing.assert_allclose(marks[[8, 27, 30, 33, 51, 57], 0], 0, atol=0.001)
    assert marks[37, 1] > marks[41, 1]
    assert marks[51, 1] > marks[57, 1]


def test_scalp_ends_at_a_hairline() -> None:
    """Hair grows on crown and nape, not on the face, the ears or the neck, and fades out."""
    head = default_head()
    x, y, z = head.vertices.T
    assert head.scalp[y > 0.052].min() == 1.0
    assert head.scalp[(z < -0.07) & (y > -0.07)].min() == 1.0
    assert head.scalp[head.landmark_vertices].max() == 0.0
    assert head.scalp[np.abs(x) > 0.081].max() == 0.0
    assert head.scalp[y < -0.105].max() == 0.0
    assert ((head.scalp > 0.2) & (head.scalp < 0.8)).sum() > 50
    corners = head.vertices.astype(np.float64)[head.faces]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    area = 0.5 * np.linalg.norm(normal, axis=1)[head.scalp[head.faces].mean(axis=1) > 0.5].sum()
    assert 0.05 < area < 0.075


def test_texture_coordinates_are_injective() -> None:
    """The skin's faces but those round the pole under the neck keep their orientation in the
    texture."""
    head = default_head()
    assert head.uv.min() >= 0
    assert head.uv.max() <= 1
    faces = head.skin_faces()
    corners = head.uv.astype(np.float64)[faces]
    u, v = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    turned = u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0]
    neck = head.vertices[:, 1][faces].min(axis=1) < -0.24
    assert len(set(np.sign(turned[~neck]))) == 1


@pytest.mark.parametrize("name", ["straight_long", "wavy", "short"])
def test_head_is_near_heads_of_the_captures(name: str, captures: Path) -> None:
    """Fitted by landmarks alone, scalp and roots of three other heads lie within millimetres."""
    truth = captures / name / "truth"
    head = default_head()
    marks = head.vertices[head.landmark_vertices].astype(np.float64)
    target = np.array(json.loads((truth / "truth.json").read_text())["landmarks3d"])
    scale, turn, shift = _similarity(marks, target)
    missed = np.linalg.norm(scale * marks @ turn.T + shift - target, axis=1)
    assert missed.mean() < 0.0025
    strands = np.load(truth / "strands.npz")
    roots = strands["points"][strands["offsets"][:-1]].astype(np.float64)
    local = (roots - shift) @ turn / scale
    triangle, weights = bind(local, head)
    apart = scale * np.linalg.norm(evaluate(head, triangle, weights) - local, axis=1)
    grown = (head.scalp[head.faces[triangle]] * weights).sum(axis=1)
    assert apart.mean() < 0.003
    assert (apart < 0.004).mean() > 0.97
    assert (grown > 0.3).mean() > 0.97
