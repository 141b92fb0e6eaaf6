"""Laws of the bust under a head."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import trimesh
from clients_gltf import complaints

from hairkit import Camera
from hairkit.head_model.bust import AROUND, Bust, bust_under
from hairkit.head_model.identity import blend_head
from hairkit.head_model.scalp import sample_roots
from hairkit.head_model.signed_distance import distance_to
from hairkit.head_model.template import default_head
from hairkit.head_model.torso import Torso
from hairkit.io.head_reader import read_head
from hairkit.manager import Manager
from hairkit.rendering import draw_views
from hairkit.testing import ball_head
from hairkit.types.groom import Groom
from hairkit.types.strands import Strands

HEADS = {
    "average": default_head(),
    "man": blend_head({"man": 1.0, "neck_breadth": 2.0}),
    "child": blend_head({"child": 1.0}),
}


def hanging(count: int = 400, seed: int = 0) -> Strands:
    """Return straight strands that hang from the height of the ears beside and through a torso."""
    rng = np.random.default_rng(seed)
    angle, radius = rng.uniform(0, 2 * np.pi, count), rng.uniform(0.08, 0.16, count)
    x, z = radius * np.sin(angle), -0.02 + radius * np.cos(angle)
    levels = np.linspace(-0.03, -0.36, 30)
    points = np.stack([np.repeat(x, 30), np.tile(levels, count), np.repeat(z, 30)], axis=1)
    return Strands(points.astype(np.float32), np.arange(count + 1) * 30)


def solid(bust: Bust) -> trimesh.Trimesh:
    """Return the bust with its opening at the neck closed."""
    vertices = np.concatenate([bust.vertices, bust.vertices[:AROUND].mean(axis=0)[None]])
    rim, top = np.arange(AROUND), len(bust.vertices)
    lid = np.stack([rim, np.roll(rim, -1), np.full(AROUND, top)], axis=1)
    return trimesh.Trimesh(vertices, np.concatenate([bust.faces, lid]), process=False)


@pytest.mark.parametrize("name", HEADS)
def test_collar_closes_round_the_neck(name: str) -> None:
    """The collar stands off the neck by its thickness; its inner edge lies in the neck."""
    head = HEADS[name]
    bust = bust_under(head)
    assert bust is not None
    inner, collar = bust.vertices[:AROUND], bust.vertices[AROUND : 2 * AROUND]
    assert distance_to(head, inner).max() < 0.0005
    assert distance_to(head, collar).min() > 0.001
    assert distance_to(head, collar).max() < 0.008
    body = solid(bust)
    assert body.is_watertight
    assert body.volume > 0


def test_a_neck_that_bends_forwards_stays_inside() -> None:
    """Below the collar the shirt covers a throat that lies farther forwards than at the collar."""
    head = default_head()
    vertices = head.vertices.copy()
    lower = np.clip((-0.10 - vertices[:, 1]) / 0.06, 0, 1) * (vertices[:, 2] > 0)
    vertices[:, 2] += np.float32(0.03) * lower
    bust = bust_under(replace(head, vertices=vertices))
    assert bust is not None
    collar, height = bust.vertices[AROUND : 2 * AROUND, 1], vertices[:, 1]
    covered = (height < collar.min() - 0.004) & (height > height.min() + 0.002)
    assert covered.sum() > 40
    assert solid(bust).contains(vertices[covered]).all()


def test_hair_lies_outside() -> None:
    """No strand runs inside of the bust, though some run through the torso it is made of."""
    hair, head = hanging(), default_head()
    bare, given = bust_under(head), bust_under(head, hair)
    assert bare is not None
    assert given is not None
    outer = hair.points[distance_to(head, hair.points) > 0.012]
    assert solid(bare).contains(outer).mean() > 0.1
    assert solid(given).contains(outer).mean() < 0.005


def test_grows_with_the_head() -> None:
    """A head that is scaled and moved takes its bust along."""
    head = default_head()
    shift = np.array([0.02, -0.01, 0.03], np.float32)
    moved = head.carried(lambda points: np.float32(1.1) * points + shift, 1.1)
    bust, other = bust_under(head), bust_under(moved)
    assert bust is not None
    assert other is not None
    np.testing.assert_allclose(other.vertices, 1.1 * bust.vertices + shift, atol=2e-4)


def test_only_under_necks() -> None:
    """A ball, a head without a neck and one with shoulders of its own get no bust."""
    head = default_head()
    vertices, faces = Torso.under(head).mesh()
    whole = replace(
        head,
        vertices=np.concatenate([head.vertices, vertices]),
        faces=np.concatenate([head.faces, faces + len(head.vertices)]),
        uv=np.concatenate([head.uv, np.zeros((len(vertices), 2), np.float32)]),
        scalp=np.concatenate([head.scalp, np.zeros(len(vertices), np.float32)]),
    )
    neckless = replace(head, faces=head.faces[head.vertices[head.faces, 1].min(axis=1) > -0.15])
    used = np.unique(neckless.faces)
    index = np.zeros(len(head.vertices), np.int32)
    index[used] = np.arange(len(used))
    neckless = replace(
        head, vertices=head.vertices[used], faces=index[neckless.faces], uv=head.uv[used],
        scalp=head.scalp[used], landmark_vertices=None, eye_vertices=None,
    )  # fmt: skip
    assert bust_under(ball_head()) is None
    assert bust_under(whole) is None
    assert bust_under(neckless) is None


def test_exported_beside_the_head(tmp_path: Path) -> None:
    """The .glb holds the bust as a mesh of its own on the root joint; the head is read without."""
    head, path = default_head(), tmp_path / "groom.glb"
    roots = sample_roots(head, 5)
    points = np.stack([roots.positions, roots.positions + 0.01 * roots.normals], axis=1)
    strands = Strands(points.reshape(-1, 3).astype(np.float32), np.arange(6) * 2)
    groom = Groom(strands, head, roots.triangle, roots.barycentric)
    manager = Manager.loaded()
    manager.call(
        "export_groom", "gltf", manager.options("gltf", {"hair": "none"}), groom=groom, path=path
    )
    assert complaints([path]) == []
    torso = trimesh.load(path).geometry["torso"]
    bust = bust_under(head, strands)
    assert bust is not None
    np.testing.assert_allclose(torso.vertices, bust.vertices, atol=1e-6)
    np.testing.assert_array_equal(read_head(path).vertices, head.vertices)


def test_drawn_where_asked_for() -> None:
    """The bust is drawn below the chin alone, and only if asked for."""
    head = default_head()
    camera = Camera.on_turn(0, distance=1.2, focal=150.0, width=100, height=120)
    none = Strands(np.empty((0, 3), np.float32), np.zeros(1, np.int64))
    without = draw_views(none, head, [camera])[0].astype(int)
    with_bust = draw_views(none, head, [camera], bust=True)[0].astype(int)
    changed = np.abs(with_bust - without).max(axis=2) > 20
    chin = int(camera.project(np.array([0.0, -0.14, 0.09]))[1])
    assert changed[chin:].mean() > 0.2
    assert not changed[:chin].any()
