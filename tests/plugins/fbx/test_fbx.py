"""FBX: a strict parser of the byte layout and an independent reader both find the groom's head."""

from __future__ import annotations

import logging
import struct
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from rich_groom import rich_groom

from hairkit.arrays import Float64Array
from hairkit.errors import InputError
from hairkit.grooming.prepare_export import dense_groom
from hairkit.head_model.skinning import JOINT_NAMES, head_weights
from hairkit.head_model.template import default_head
from hairkit.io.coordinate_space import FileSpace
from hairkit.manager import Manager
from hairkit.testing import ball_head, bristle_groom
from hairkit.types.groom import Groom

SCALARS = {"C": "<?", "I": "<i", "D": "<d", "L": "<q"}
FOOTER = bytes.fromhex("fabcab09d0c8d466b176fb831cf7267e")
LAST = bytes.fromhex("f85a8c6adef5d97eece90ce3758f290b")
AXES = ["y_up_centimetres", "z_up_metres", "unreal"]


@dataclass
class Node:
    """One record as the file has it."""

    name: str
    values: list[Any]
    children: list[Node]

    def one(self, name: str) -> Node:
        """Return the only child of that name."""
        (found,) = [child for child in self.children if child.name == name]
        return found

    def all(self, name: str) -> list[Node]:
        """Return all children of that name."""
        return [child for child in self.children if child.name == name]

    def properties(self) -> dict[str, list[Any]]:
        """Return the values of the block of properties by their names."""
        return {entry.values[0]: entry.values[4:] for entry in self.one("Properties70").children}


class Parser:
    """Reads FBX 7.4 and fails at the first byte that is not as it must be."""

    def __init__(self, data: bytes) -> None:
        self.data = data

    def file(self) -> Node:
        """Return a node with all top records; checks the frame of the file too."""
        assert self.data[:27] == b"Kaydara FBX Binary  \0\x1a\0" + struct.pack("<I", 7400)
        top, at = self.records(27, len(self.data))
        assert self.data[at : at + 16] == FOOTER
        assert self.data[at + 16 : at + 20] == b"\0" * 4
        end = at + 20
        padding = -end % 16 or 16
        rest = b"\0" * padding + struct.pack("<I", 7400) + b"\0" * 120 + LAST
        assert self.data[end:] == rest
        return Node("", [], top)

    def records(self, at: int, limit: int) -> tuple[list[Node], int]:
        """Return the records from `at` to the closing zeros, and the place after those."""
        nodes = []
        while True:
            end, count, size, length = struct.unpack_from("<IIIB", self.data, at)
            if end == 0:
                assert (count, size, length) == (0, 0, 0)
                return nodes, at + 13
            name = self.data[at + 13 : at + 13 + length].decode("ascii")
            at += 13 + length
            values, after = self.values(at, count)
            assert after == at + size
            assert after <= end <= limit
            children: list[Node] = []
            if after < end:
                children, after = self.records(after, end)
            else:
                assert count, f"{name}: neither values nor the closing zeros"
            assert after == end
            nodes.append(Node(name, values, children))
            at = end

    def values(self, at: int, count: int) -> tuple[list[Any], int]:
        """Return the values of a record and the place after them."""
        found: list[Any] = []
        for _ in range(count):
            kind, at = chr(self.data[at]), at + 1
            if kind in SCALARS:
                found.append(struct.unpack_from(SCALARS[kind], self.data, at)[0])
                at += struct.calcsize(SCALARS[kind])
            elif kind in "SR":
                (size,) = struct.unpack_from("<I", self.data, at)
                raw = self.data[at + 4 : at + 4 + size]
                found.append(raw.decode() if kind == "S" else raw)
                at += 4 + size
            else:
                items, encoding, size = struct.unpack_from("<III", self.data, at)
                dtype = {"d": "<f8", "i": "<i4"}[kind]
                assert encoding == 0
                assert size == items * np.dtype(dtype).itemsize
                found.append(np.frombuffer(self.data, dtype, items, at + 12))
                at += 12 + size
        return found, at


def written(manager: Manager, groom: Groom, path: Path, **values: Any) -> Node:
    """Return the parsed file that the groom was written to."""
    manager.call("export_groom", "fbx", values, groom=groom, path=path)
    return Parser(path.read_bytes()).file()


def objects(top: Node) -> dict[int, Node]:
    """Return the objects by their ids, which are all different."""
    listed = top.one("Objects").children
    by_id = {node.values[0]: node for node in listed}
    assert len(by_id) == len(listed)
    return by_id


def of_class(top: Node, kind: str, subkind: str) -> list[Node]:
    """Return the objects of a kind and subkind."""
    return [n for n in objects(top).values() if n.name == kind and n.values[2] == subkind]


def file_space(manager: Manager, axis: str) -> FileSpace:
    """Return the space that the exporter writes."""
    space: FileSpace = manager.options("fbx", {"axis": axis}).written_space
    return space


def name_of(node: Node) -> str:
    """Return an object's name without its class."""
    return str(node.values[1]).partition("\0")[0]


@pytest.mark.parametrize("axis", AXES)
def test_the_mesh_is_the_head(manager: Manager, tmp_path: Path, axis: str) -> None:
    """Vertices, triangles, normals, uv and scalp are the groom's; faces look outward."""
    groom = bristle_groom()
    top, space = written(manager, groom, tmp_path / "a.fbx", axis=axis), file_space(manager, axis)
    (mesh,) = of_class(top, "Geometry", "Mesh")
    vertices = mesh.one("Vertices").values[0].reshape(-1, 3)
    head = groom.head
    np.testing.assert_allclose(space.points_to_head(vertices), head.vertices, atol=1e-7)
    corners = mesh.one("PolygonVertexIndex").values[0].reshape(-1, 3).copy()
    assert (corners[:, 2] < 0).all()
    corners[:, 2] = -corners[:, 2] - 1
    assert np.array_equal(corners, head.faces)
    normals = mesh.one("LayerElementNormal").one("Normals").values[0].reshape(-1, 3)
    a, b, c = vertices[corners].transpose(1, 0, 2)
    outward = (np.cross(b - a, c - a) * normals[corners].sum(axis=1)).sum(axis=1)
    assert (outward > 0).all()
    for layer, values, index, wanted in (
        ("UV", "UV", "UVIndex", head.uv),
        ("Color", "Colors", "ColorIndex", head.scalp[:, None]),
    ):
        element = mesh.one(f"LayerElement{layer}")
        rows = element.one(values).values[0].reshape(len(head.vertices), -1)
        assert np.array_equal(rows[:, : wanted.shape[1]], wanted)
        assert np.array_equal(element.one(index).values[0].reshape(-1, 3), corners)


def test_the_unit_and_axes_are_said(manager: Manager, tmp_path: Path) -> None:
    """UnitScaleFactor is centimetres a unit, the up axis 1 for Y and 2 for Z."""
    for axis, unit, up in (("y_up_centimetres", 1, 1), ("z_up_metres", 100, 2), ("unreal", 1, 1)):
        top = written(manager, bristle_groom(), tmp_path / "a.fbx", axis=axis)
        settings = top.one("GlobalSettings").properties()
        assert settings["UnitScaleFactor"] == [unit]
        assert settings["UpAxis"] == [up]


def test_unreal_turns_the_head_to_where_the_groom_is(manager: Manager, tmp_path: Path) -> None:
    """Unreal takes (x, y, z) of a Y-up file as (x, z, y): where `axis=unreal` puts strands."""
    groom = bristle_groom()
    top = written(manager, groom, tmp_path / "a.fbx", axis="unreal")
    (mesh,) = of_class(top, "Geometry", "Mesh")
    imported = mesh.one("Vertices").values[0].reshape(-1, 3)[:, [0, 2, 1]]
    wanted = FileSpace("unreal", 0.01).points_to_file(groom.head.vertices)
    np.testing.assert_allclose(imported, wanted, atol=1e-5)


@pytest.mark.parametrize("axis", AXES)
def test_skeleton_skin_and_bind_pose_agree(manager: Manager, tmp_path: Path, axis: str) -> None:
    """Joints are the head's, clusters hold its weights, and the bind matrices undo each other."""
    groom = replace(bristle_groom(), head=ball_head())
    top, space = written(manager, groom, tmp_path / "a.fbx", axis=axis), file_space(manager, axis)
    joints = space.points_to_file(groom.head.joints).astype(np.float64)
    bones = of_class(top, "Model", "LimbNode")
    assert [name_of(bone) for bone in bones] == list(JOINT_NAMES)
    steps = [bone.properties()["Lcl Translation"] for bone in bones]
    np.testing.assert_allclose(np.cumsum(steps, axis=0), joints, atol=1e-9)
    (pose,) = of_class(top, "Pose", "BindPose")
    poses = {n.one("Node").values[0]: n.one("Matrix").values[0] for n in pose.all("PoseNode")}
    weights = np.zeros((len(groom.head.vertices), 3))
    for column, cluster in enumerate(of_class(top, "Deformer", "Cluster")):
        if cluster.all("Indexes"):
            weights[cluster.one("Indexes").values[0], column] = cluster.one("Weights").values[0]
        link = cluster.one("TransformLink").values[0].reshape(4, 4)
        np.testing.assert_allclose(link[3], [*joints[column], 1])
        mesh_to_bone = cluster.one("Transform").values[0].reshape(4, 4)
        np.testing.assert_allclose(mesh_to_bone @ link, np.eye(4), atol=1e-9)
        assert np.array_equal(poses[bones[column].values[0]], link.ravel())
    assert np.array_equal(weights, head_weights(groom.head))


def test_connections_and_definitions_name_what_is_there(manager: Manager, tmp_path: Path) -> None:
    """Every end of a connection is an object or the scene; every kind is counted."""
    top = written(manager, bristle_groom(), tmp_path / "a.fbx", curves=True)
    known = objects(top)
    ends = [link.values[1:] for link in top.one("Connections").children]
    assert all(child in known and (parent in known or parent == 0) for child, parent in ends)
    free = [node for number, node in known.items() if number not in {child for child, _ in ends}]
    assert [node.name for node in free] == ["Pose"]
    counted = {t.values[0]: t.one("Count").values[0] for t in top.one("Definitions").children[2:]}
    kinds = [node.name for node in known.values()]
    assert counted == {"GlobalSettings": 1} | {kind: kinds.count(kind) for kind in kinds}
    assert top.one("Definitions").one("Count").values == [sum(counted.values())]


@pytest.mark.parametrize("axis", AXES)
def test_curves_are_the_strands(manager: Manager, tmp_path: Path, axis: str) -> None:
    """Each curve of degree 1 goes through its strand's points, below its group."""
    groom = dense_groom(bristle_groom(), 270)
    strands = groom.strands
    groom = replace(groom, strands=replace(strands, guide=np.arange(270) < 264))
    top = written(manager, groom, tmp_path / "a.fbx", curves=True, axis=axis)
    curves, space = of_class(top, "Geometry", "NurbsCurve"), file_space(manager, axis)
    points = np.concatenate([curve.one("Points").values[0].reshape(-1, 4) for curve in curves])
    np.testing.assert_allclose(space.points_to_head(points[:, :3]), strands.points, atol=1e-7)
    assert (points[:, 3] == 1).all()
    for curve in curves:
        knots = curve.one("KnotVector").values[0]
        assert curve.one("Order").values == [2]
        assert len(knots) == len(curve.one("Points").values[0]) // 4 + 2
        assert (np.diff(knots) >= 0).all()
    parents = dict(link.values[1:] for link in top.one("Connections").children)
    models = of_class(top, "Model", "NurbsCurve")
    groups = [name_of(objects(top)[parents[model.values[0]]]) for model in models]
    assert groups == ["guides"] * 264 + ["hair"] * 6


def test_an_independent_reader_finds_the_same(manager: Manager, tmp_path: Path) -> None:
    """Pyufbx reads the default head's mesh, uv, joints and as many weights as were written."""
    ufbx = pytest.importorskip("ufbx", reason="pyufbx is not installed")
    groom = replace(bristle_groom(), head=default_head())
    path = tmp_path / "a.fbx"
    written(manager, groom, path)
    scene, head = ufbx.load_file(str(path)), groom.head
    assert scene.settings.unit_meters == 0.01
    (mesh,) = scene.meshes
    assert (mesh.num_vertices, mesh.num_faces) == (len(head.vertices), len(head.faces))
    agree(mesh.vertex_positions, head.vertices * 100.0)
    agree(mesh.vertex_normals, head.normals())
    assert np.array_equal(np.asarray(mesh.indices), head.faces.ravel())
    bones = {node.name: np.asarray(node.node_to_world) for node in scene.nodes}
    for name, joint in zip(JOINT_NAMES, head.joints, strict=True):
        np.testing.assert_allclose(bones[name].reshape(-1)[12:15], 100.0 * joint, atol=1e-5)
    (skin,) = mesh.skin_deformers
    counts = {cluster.name: cluster.num_weights for cluster in skin.clusters}
    weights = head_weights(head)
    assert counts == {name: int((weights[:, k] > 0).sum()) for k, name in enumerate(JOINT_NAMES)}


def agree(found: Any, wanted: Float64Array) -> None:
    """Check values of pyufbx; 0.0.7 shows half of the memory of doubles, as if floats."""
    values = np.ascontiguousarray(found)
    if values.dtype == np.float32 and not np.allclose(values, wanted, atol=1e-4):
        values = values.reshape(-1).view(np.float64)
    flat = values.reshape(-1)
    np.testing.assert_allclose(flat, wanted.reshape(-1)[: len(flat)], atol=1e-5)


def test_equal_grooms_are_equal_files(manager: Manager, tmp_path: Path) -> None:
    """Writing twice gives the same bytes."""
    for name in "ab":
        written(manager, bristle_groom(), tmp_path / name, curves=True)
    assert (tmp_path / "a").read_bytes() == (tmp_path / "b").read_bytes()


def test_strands_without_length_are_left_out(
    manager: Manager, tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    """They are counted in a warning; the head is written all the same."""
    groom = bristle_groom()
    points = groom.strands.points.copy()
    points[5:10] = points[5]
    groom = replace(groom, strands=replace(groom.strands, points=points))
    with caplog.at_level(logging.WARNING, "hairkit"):
        top = written(manager, groom, tmp_path / "a.fbx", curves=True)
    assert "1 strands without length" in caplog.text
    assert len(of_class(top, "Geometry", "NurbsCurve")) == len(groom.strands) - 1


def test_a_failed_export_leaves_no_file(
    manager: Manager, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Neither half a file nor a temporary one, whatever fails."""
    with pytest.raises(InputError, match="no strands to write"):
        written(manager, bristle_groom(), tmp_path / "a.fbx", curves=True, strands="hair")

    def interrupted(source: object, target: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("os.replace", interrupted)
    with pytest.raises(KeyboardInterrupt):
        written(manager, bristle_groom(), tmp_path / "a.fbx")
    assert list(tmp_path.iterdir()) == []


def test_ufbx_finds_maps_and_blendshapes(manager: Manager, tmp_path: Path) -> None:
    """The file holds the four pictures, joined to the material, and a channel for each shape."""
    ufbx = pytest.importorskip("ufbx", reason="pyufbx is not installed")
    groom = rich_groom()
    assert groom.head.maps is not None
    path = tmp_path / "a.fbx"
    written(manager, groom, path)
    scene = ufbx.load_file(str(path))
    sizes = {texture.name: len(texture.content) for texture in scene.textures}
    assert sizes == {name: len(each.data) for name, each in groom.head.maps.present().items()}
    (material,) = scene.materials
    assert len(material.textures) == 4
    (deformer,) = scene.meshes[0].blend_deformers
    assert [channel.name for channel in deformer.channels] == ["smile", "jaw_open"]
