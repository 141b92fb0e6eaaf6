"""Laws of reading heads: the same head from any format, unit and axis; bad files give one line."""

from __future__ import annotations

import contextlib
import json
import struct
from pathlib import Path

import cv2
import numpy as np
import pytest
import trimesh
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from hairkit.errors import FormatError, HairkitError, InputError
from hairkit.head_model.template import default_head
from hairkit.io.head_reader import read_head, write_head_obj
from hairkit.types.head import Head


@pytest.fixture(scope="module")
def small() -> Head:
    """A coarse ellipsoid with a scalp, landmarks on its first vertices: quick to write and read."""
    model = default_head()
    ball = trimesh.creation.icosphere(subdivisions=3)
    vertices = (ball.vertices * [0.0775, 0.085, 0.09]).astype(np.float32)
    polar, azimuth = (
        np.arccos(ball.vertices[:, 1].clip(-1, 1)),
        np.arctan2(*ball.vertices.T[[0, 2]]),
    )
    uv = 0.5 + 0.5 * (polar / np.pi)[:, None] * np.stack(
        [np.sin(azimuth), -np.cos(azimuth)], axis=1
    )
    scalp = (vertices[:, 1] > 0).astype(np.float32)
    marks = np.arange(68, dtype=np.int32)
    return Head(vertices, ball.faces, uv, scalp, marks, model.joints, model.capsules)


def _ply(head: Head, columns: dict[str, np.ndarray], order: str = "ascii") -> bytes:
    """The head as PLY with further vertex columns; `order` ascii, < or >."""
    kinds = {name: "uchar" if name in ("red", "green", "blue") else "float" for name in columns}
    form = {"ascii": "ascii", "<": "binary_little_endian", ">": "binary_big_endian"}[order]
    lines = ["ply", f"format {form} 1.0", f"element vertex {len(head.vertices)}"]
    lines += [f"property float {axis}" for axis in "xyz"]
    lines += [f"property {kind} {name}" for name, kind in kinds.items()]
    lines += [f"element face {len(head.faces)}", "property list uchar int vertex_indices"]
    header = "\n".join([*lines, "end_header", ""]).encode()
    if order == "ascii":
        rows = [
            " ".join(str(value) for value in (*point, *(columns[name][i] for name in columns)))
            for i, point in enumerate(head.vertices.tolist())
        ]
        rows += [f"3 {a} {b} {c}" for a, b, c in head.faces.tolist()]
        return header + "\n".join(rows).encode()
    code = {"uchar": "u1", "float": order + "f4"}
    kind = np.dtype(
        [(axis, order + "f4") for axis in "xyz"] + [(n, code[kinds[n]]) for n in columns]
    )
    table = np.empty(len(head.vertices), kind)
    for axis, values in zip("xyz", head.vertices.T, strict=True):
        table[axis] = values
    for name, values in columns.items():
        table[name] = values
    faces = np.empty(len(head.faces), np.dtype([("n", "u1"), ("i", order + "i4", 3)]))
    faces["n"], faces["i"] = 3, head.faces
    return header + table.tobytes() + faces.tobytes()


def _same_mesh(found: Head, wanted: Head) -> None:
    np.testing.assert_allclose(found.vertices, wanted.vertices, atol=1e-6)
    order = [np.lexsort(faces.T) for faces in (found.faces, wanted.faces)]
    np.testing.assert_array_equal(found.faces[order[0]], wanted.faces[order[1]])


def test_written_head_reads_back(tmp_path: Path) -> None:
    """Vertices, faces, texture, landmarks and scalp faces of the default head survive OBJ."""
    head = default_head()
    write_head_obj(tmp_path / "head.obj", head)
    found = read_head(tmp_path / "head.obj")
    _same_mesh(found, head)
    np.testing.assert_allclose(found.uv, head.uv, atol=1e-7)
    np.testing.assert_array_equal(found.landmark_vertices, head.landmark_vertices)
    assert ((found.scalp > 0.5) == (head.scalp > 0.5)).mean() > 0.99
    np.testing.assert_allclose(found.joints, head.joints, atol=0.01)


@pytest.mark.parametrize(
    ("units", "metres"), [("m", 1), ("cm", 0.01), ("mm", 0.001), ("in", 0.0254)]
)
def test_units_change_nothing_but_numbers(
    tmp_path: Path, small: Head, units: str, metres: float
) -> None:
    """A head written in any unit and read as that unit is the same head, landmarks too."""
    scaled = small.vertices / metres
    body = [f"v {x:.9g} {y:.9g} {z:.9g}" for x, y, z in scaled.tolist()]
    for name, chosen in (("scalp", True), ("rest", False)):
        body.append(f"g {name}")
        mask = (small.scalp[small.faces].mean(axis=1) > 0.5) == chosen
        body += [f"f {a} {b} {c}" for a, b, c in (small.faces[mask] + 1).tolist()]
    (tmp_path / "a.obj").write_text("\n".join(body))
    (tmp_path / "a.landmarks.json").write_text(json.dumps({"landmarks": scaled[:68].tolist()}))
    found = read_head(tmp_path / "a.obj", units=units)
    _same_mesh(found, small)
    np.testing.assert_array_equal(found.landmark_vertices, np.arange(68))


def test_z_up_heads_are_turned(tmp_path: Path, small: Head) -> None:
    """Written with +Z up and the face towards -Y, the head reads the same with up='z'."""
    x, y, z = small.vertices.T
    columns = {"scalp": small.scalp}
    turned = Head(np.stack([x, -z, y], axis=1), small.faces, small.uv, small.scalp, None,
                  small.joints, small.capsules)  # fmt: skip
    (tmp_path / "a.ply").write_bytes(_ply(turned, columns))
    _same_mesh(read_head(tmp_path / "a.ply", up="z"), small)


@pytest.mark.parametrize("order", ["ascii", "<", ">"])
def test_ply_reads_alike_in_every_encoding(tmp_path: Path, small: Head, order: str) -> None:
    """Text, little and big endian: same mesh, and the property `scalp` is the scalp."""
    (tmp_path / "a.ply").write_bytes(_ply(small, {"scalp": small.scalp}, order))
    found = read_head(tmp_path / "a.ply")
    _same_mesh(found, small)
    np.testing.assert_array_equal(found.scalp, small.scalp)


@pytest.mark.parametrize("paint", [(255, 0, 0), (255, 255, 255)])
def test_painted_vertices_are_the_scalp(
    tmp_path: Path, small: Head, paint: tuple[int, int, int]
) -> None:
    """Red on grey skin, or white on black, marks the scalp in PLY, OBJ and GLB."""
    ground = 0 if paint[1] else 120
    painted = small.scalp > 0.5
    colours = np.where(painted[:, None], paint, ground).astype(np.uint8)
    names = dict(zip(("red", "green", "blue"), colours.T, strict=True))
    (tmp_path / "a.ply").write_bytes(_ply(small, names, "<"))
    rows = np.concatenate([small.vertices, colours / 255], axis=1)
    lines = ["v " + " ".join(f"{value:.7g}" for value in row) for row in rows]
    lines += [f"f {a} {b} {c}" for a, b, c in (small.faces + 1).tolist()]
    (tmp_path / "b.obj").write_text("\n".join(lines))
    trimesh.Trimesh(small.vertices, small.faces, vertex_colors=colours, process=False).export(
        tmp_path / "c.glb"
    )
    for name in ("a.ply", "b.obj", "c.glb"):
        found = read_head(tmp_path / name)
        _same_mesh(found, small)
        np.testing.assert_array_equal(found.scalp > 0.5, painted)


def test_mask_picture_marks_the_scalp(tmp_path: Path, small: Head) -> None:
    """A white disc over the crown in the texture is the upper half of the head."""
    write_head_obj(tmp_path / "a.obj", small)
    (tmp_path / "a.obj").write_text(
        (tmp_path / "a.obj").read_text().replace("g scalp", "g one").replace("g head", "g two")
    )
    mask = np.zeros((512, 512), np.uint8)
    cv2.circle(mask, (256, 256), 128, 255, -1)
    cv2.imwrite(str(tmp_path / "crown.png"), mask)
    found = read_head(tmp_path / "a.obj", scalp=str(tmp_path / "crown.png"))
    clear = np.abs(small.vertices[:, 1]) > 0.003
    np.testing.assert_array_equal(found.scalp[clear] > 0.5, small.scalp[clear] > 0.5)
    (tmp_path / "crown.png").rename(tmp_path / "a.scalp.png")
    np.testing.assert_array_equal(read_head(tmp_path / "a.obj").scalp, found.scalp)
    assert (read_head(tmp_path / "a.obj", scalp="one").scalp > 0.5).any()


def test_glb_nodes_are_put_in_place(tmp_path: Path, small: Head) -> None:
    """A node's matrix moves its mesh; a node named scalp is the scalp."""
    upper = small.faces[small.scalp[small.faces].mean(axis=1) > 0.5]
    lower = small.faces[small.scalp[small.faces].mean(axis=1) <= 0.5]
    scene = trimesh.Scene()
    shift = np.eye(4)
    shift[:3, 3] = [0.3, -0.2, 0.5]
    shift[:3, :3] *= 2
    for name, faces in (("scalp", upper), ("face", lower)):
        local = (small.vertices - shift[:3, 3]) / 2
        mesh = trimesh.Trimesh(local, faces, process=False)
        scene.add_geometry(mesh, node_name=name, geom_name=name, transform=shift)
    scene.export(tmp_path / "a.glb")
    found = read_head(tmp_path / "a.glb")
    used = found.vertices[np.unique(found.faces)]
    np.testing.assert_allclose(used.min(axis=0), small.vertices.min(axis=0), atol=1e-5)
    np.testing.assert_allclose(used.max(axis=0), small.vertices.max(axis=0), atol=1e-5)
    assert found.vertices[found.scalp > 0.5][:, 1].min() > -0.012


def test_far_and_inverted_heads_are_put_right(tmp_path: Path, small: Head) -> None:
    """A head half a metre off comes to the origin; inward faces are turned outward."""
    away = Head(small.vertices + np.float32(0.5), small.faces[:, ::-1], small.uv, small.scalp, None,
                small.joints, small.capsules)  # fmt: skip
    (tmp_path / "a.ply").write_bytes(_ply(away, {"scalp": small.scalp}))
    found = read_head(tmp_path / "a.ply")
    assert np.abs(found.vertices.mean(axis=0)).max() < 0.02
    outward = (found.normals() * found.vertices).sum(axis=1)
    assert (outward > 0).all()


def test_polygons_and_texture_seams_are_kept_whole(tmp_path: Path) -> None:
    """A cube of quads whose faces have their own texture corners keeps numbers of the file."""
    corners = [(x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]
    quads = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    lines = [f"v {x} {y} {z}" for x, y, z in corners]
    lines += ["vt 0 0", "vt 1 0", "vt 1 1", "vt 0 1", "o scalp"]
    lines += ["f " + " ".join(f"{v - 8}/{t - 4}" for t, v in enumerate(quad)) for quad in quads]
    (tmp_path / "a.obj").write_text("\n".join(lines))
    head = read_head(tmp_path / "a.obj", units="in")
    assert len(head.faces) == 12
    np.testing.assert_allclose(head.vertices[:8], np.array(corners) * 0.0254, atol=1e-6)
    mesh = trimesh.Trimesh(head.vertices, head.faces, process=False)
    assert mesh.volume == pytest.approx((2 * 0.0254) ** 3, rel=1e-5)
    in_texture = head.uv[head.faces].astype(np.float64)
    u, v = in_texture[:, 1] - in_texture[:, 0], in_texture[:, 2] - in_texture[:, 0]
    np.testing.assert_allclose(np.abs(u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0]), 1)


@pytest.mark.parametrize(
    ("name", "text", "message"),
    [
        ("a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3", "has no scalp: mark it"),
        ("a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 nan\ng scalp\nf 1 2 3", "not finite"),
        ("a.obj", "v 0 0 0\nv 1 0 0\nf 1 2 3", "line 3 is not OBJ"),
        ("a.obj", "v 0 0 0\nv 1 0 zero", "line 2 is not OBJ"),
        ("a.obj", "hello", "0 vertices"),
        ("a.obj", "v 0 0 0\nv 17 0 0\nv 0 1 0\ng scalp\nf 1 2 3", "give the file's units"),
        ("a.obj", "v 0 0 0\nv .1 0 0\nv 0 .1 0\ng scalp\nf 1 1 3", "every face is collapsed"),
        ("a.ply", "hello", "not a readable PLY"),
        (
            "a.ply",
            "ply\nformat ascii 1.0\nelement vertex 999999999\nend_header\n",
            "not a readable PLY",
        ),
        ("a.glb", "hello", "not a readable GLB"),
        ("a.stl", "solid", "must be an .obj"),
    ],
)
def test_unusable_heads_give_one_line(tmp_path: Path, name: str, text: str, message: str) -> None:
    """What is wrong and what to do, on one line that names the file."""
    (tmp_path / name).write_text(text)
    with pytest.raises(InputError, match=message) as caught:
        read_head(tmp_path / name)
    assert "\n" not in str(caught.value)
    assert name in str(caught.value)


def test_wrong_arguments_give_one_line(tmp_path: Path, small: Head) -> None:
    """Unknown units, axis, group or file are named."""
    write_head_obj(tmp_path / "a.obj", small)
    for keywords, message in [
        ({"units": "ft"}, "expected one of m, cm"),
        ({"up": "x"}, "expected y or z"),
        ({"scalp": "hat"}, "groups: head, scalp"),
    ]:
        with pytest.raises(InputError, match=message):
            read_head(tmp_path / "a.obj", **keywords)
    with pytest.raises(InputError, match="no such file"):
        read_head(tmp_path / "none.obj")


@pytest.mark.parametrize(
    "text", ["[1, 2]", "{}", "nonsense", "[" + "1e9," * 67 + "1]", "[" + "NaN," * 67 + "1]"]
)
def test_unusable_landmarks_are_refused(tmp_path: Path, small: Head, text: str) -> None:
    """Too few, absent, not JSON, out of range or not finite: the landmark file is named."""
    write_head_obj(tmp_path / "a.obj", small)
    (tmp_path / "a.landmarks.json").write_text(text)
    with pytest.raises(FormatError, match=r"a\.landmarks\.json"):
        read_head(tmp_path / "a.obj")


def _glb(document: object, binary: bytes) -> bytes:
    text = json.dumps(document).encode()
    text += b" " * (-len(text) % 4)
    chunks = struct.pack("<II", len(text), 0x4E4F534A) + text
    chunks += struct.pack("<II", len(binary), 0x004E4942) + binary
    return struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks


@pytest.mark.parametrize(
    "change",
    [
        {"nodes": [{"children": [0, 0]}]},
        {"nodes": [{"mesh": 7}]},
        {"nodes": 3},
        {"accessors": [{"bufferView": 0, "count": 10**9, "componentType": 5126, "type": "VEC3"}]},
        {"accessors": [{"count": 10**12, "componentType": 5126, "type": "VEC3"}]},
        {"buffers": [{"byteLength": 36, "uri": "../secret.bin"}]},
        {"bufferViews": [{"buffer": 0, "byteOffset": -8, "byteLength": 36}]},
    ],
)
def test_hostile_glb_is_refused(tmp_path: Path, change: dict[str, object]) -> None:
    """Loops of nodes, wild counts and offsets, and data in other files end in one line."""
    document: dict[str, object] = {
        "nodes": [{"mesh": 0, "name": "scalp"}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
        "accessors": [{"bufferView": 0, "count": 3, "componentType": 5126, "type": "VEC3"}],
        "bufferViews": [{"buffer": 0, "byteLength": 36}],
        "buffers": [{"byteLength": 36}],
    }
    binary = np.array([[-0.1, 0, 0], [0.1, 0, 0], [0, 0.1, 0]], "<f4").tobytes()
    (tmp_path / "a.glb").write_bytes(_glb(document, binary))
    assert len(read_head(tmp_path / "a.glb").faces) == 1
    (tmp_path / "a.glb").write_bytes(_glb(document | change, binary))
    with pytest.raises(FormatError, match="not a readable GLB"):
        read_head(tmp_path / "a.glb")


@settings(max_examples=60, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(data=st.data())
def test_damaged_files_never_crash(tmp_path: Path, data: st.DataObject) -> None:
    """Any few bytes changed or cut off: a head or a HairkitError, nothing else."""
    ball = trimesh.creation.icosphere(subdivisions=1, radius=0.09)
    name = data.draw(st.sampled_from(["a.obj", "a.ply", "b.ply", "a.glb"]))
    painted = np.where(ball.vertices[:, 1:2] > 0, [255, 0, 0, 255], [90, 90, 90, 255])
    mesh = trimesh.Trimesh(ball.vertices, ball.faces, vertex_colors=painted, process=False)
    mesh.export(tmp_path / name, encoding="ascii") if name == "b.ply" else mesh.export(
        tmp_path / name
    )
    content = bytearray((tmp_path / name).read_bytes())
    for _ in range(data.draw(st.integers(1, 4))):
        content[data.draw(st.integers(0, len(content) - 1))] = data.draw(st.integers(0, 255))
    end = data.draw(st.integers(0, len(content))) if data.draw(st.booleans()) else len(content)
    (tmp_path / name).write_bytes(bytes(content[:end]))
    with contextlib.suppress(HairkitError):
        assert np.isfinite(read_head(tmp_path / name).vertices).all()
