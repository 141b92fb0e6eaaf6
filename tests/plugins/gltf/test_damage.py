"""glTF files of other authors, and files that mean harm."""

from __future__ import annotations

import base64
import contextlib
import copy
import json
import logging
import struct
import tracemalloc
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh
from hairkit_plugins import gltf
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from hairkit.errors import FormatError, HairkitError
from hairkit.testing import bristle_groom
from hairkit.types.strands import Strands

JSON, BINARY = 0x4E4F534A, 0x004E4942


def fans(count: int = 12, points: int = 5) -> np.ndarray:
    """Return strands (S, K, 3) on a scalp of 20 cm."""
    angle = np.linspace(0, 2 * np.pi, count, endpoint=False)[:, None]
    along = np.linspace(0, 0.05, points)
    x, z = 0.1 * np.cos(angle) + 0 * along, 0.1 * np.sin(angle) + 0 * along
    return np.stack([x, 0.05 + along + 0 * angle, z], axis=-1).astype("<f4")


def document_of(
    points: np.ndarray, mode: int, indices: Any = None, **node: Any
) -> tuple[dict, bytes]:
    """Return the document and data of one primitive of points (P, 3)."""
    binary = points.astype("<f4").tobytes()
    primitive: dict[str, Any] = {"attributes": {"POSITION": 0}, "mode": mode}
    document: dict[str, Any] = {
        "asset": {"version": "2.0"},
        "nodes": [{"mesh": 0, **node}],
        "meshes": [{"primitives": [primitive]}],
        "accessors": [
            {"bufferView": 0, "count": len(points), "componentType": 5126, "type": "VEC3"}
        ],
        "bufferViews": [{"buffer": 0, "byteLength": len(binary)}],
    }
    if indices is not None:
        index = np.asarray(indices, "<u4").tobytes()
        document["bufferViews"].append(
            {"buffer": 0, "byteOffset": len(binary), "byteLength": len(index)}
        )
        document["accessors"].append(
            {"bufferView": 1, "count": len(index) // 4, "componentType": 5125, "type": "SCALAR"}
        )
        primitive["indices"] = 1
        binary += index
    document["buffers"] = [{"byteLength": len(binary)}]
    return document, binary


def glb(document: Any, binary: bytes) -> bytes:
    text = document if isinstance(document, bytes) else json.dumps(document).encode()
    text += b" " * (-len(text) % 4)
    chunks = struct.pack("<II", len(text), JSON) + text
    chunks += struct.pack("<II", len(binary), BINARY) + binary
    return struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks


def strands_in(path: Path, **options: Any) -> Strands:
    return gltf.import_groom(path, gltf.Options(**options)).strands


def test_lines_of_any_order_are_strands(tmp_path: Path, rng: np.random.Generator) -> None:
    """Indexed segments, shuffled and half of them backwards, are the same strands."""
    hair = fans()
    number = np.arange(60).reshape(12, 5)
    pairs = np.stack([number[:, :-1], number[:, 1:]], axis=-1).reshape(-1, 2)
    flipped = rng.permutation(pairs)
    flipped[::5] = flipped[::5, ::-1]
    (tmp_path / "a.glb").write_bytes(glb(*document_of(hair.reshape(-1, 3), 1, flipped)))
    found = strands_in(tmp_path / "a.glb")
    assert len(found) == 12
    ends = {tuple(sorted(map(tuple, pair))) for pair in np.stack([found.roots, found.tips], axis=1)}
    want = {tuple(sorted(map(tuple, pair))) for pair in hair[:, [0, -1]]}
    assert ends == want


def test_strips_and_loops_are_strands(tmp_path: Path) -> None:
    """A strip is a strand, its restart index begins the next; a loop ends where it began."""
    points = fans(2).reshape(-1, 3)
    restart = 2**32 - 1
    index = [0, 1, 2, 3, 4, restart, 5, 6, 7]
    (tmp_path / "a.glb").write_bytes(glb(*document_of(points, 3, index)))
    assert strands_in(tmp_path / "a.glb").counts.tolist() == [5, 3]
    (tmp_path / "a.glb").write_bytes(glb(*document_of(points[:4], 2)))
    found = strands_in(tmp_path / "a.glb")
    assert found.counts.tolist() == [5]
    np.testing.assert_array_equal(found.roots, found.tips)


def test_segments_with_points_of_their_own_are_joined(tmp_path: Path) -> None:
    """trimesh writes two points for each segment; they are strands all the same."""
    hair = fans()
    trimesh.Scene([trimesh.load_path(strand) for strand in hair]).export(tmp_path / "a.glb")
    found = strands_in(tmp_path / "a.glb")
    np.testing.assert_allclose(found.points.reshape(hair.shape), hair, atol=1e-7)


def test_nodes_put_lines_in_place(tmp_path: Path) -> None:
    """A turned, scaled and moved node's lines are where the node puts them; `metres` scales all."""
    hair = fans()
    x, y, z = (hair.reshape(-1, 3) - [0.01, 0.02, 0.03]).T
    local = 100 * np.stack([z, y, -x], axis=1)  # a quarter turn about +Y, undone
    half = np.sqrt(0.5)
    node = {"translation": [0.01, 0.02, 0.03], "rotation": [0, -half, 0, half], "scale": [0.01] * 3}
    pairs = np.arange(60).reshape(12, 5)
    index = np.stack([pairs[:, :-1], pairs[:, 1:]], axis=-1)
    (tmp_path / "a.glb").write_bytes(glb(*document_of(local, 1, index, **node)))
    np.testing.assert_allclose(
        strands_in(tmp_path / "a.glb").points, hair.reshape(-1, 3), atol=1e-6
    )
    (tmp_path / "b.glb").write_bytes(glb(*document_of(100 * hair.reshape(-1, 3), 1, index)))
    with pytest.raises(HairkitError, match="metres per unit"):
        strands_in(tmp_path / "b.glb")
    found = strands_in(tmp_path / "b.glb", metres=0.01)
    np.testing.assert_allclose(found.points, hair.reshape(-1, 3), atol=1e-6)


@pytest.mark.parametrize("where", ["embedded", "beside"])
def test_gltf_text_files_are_read(tmp_path: Path, where: str) -> None:
    """Data in a data URI or in a file of the same folder; the name may be percent-encoded."""
    document, binary = document_of(fans(2).reshape(-1, 3), 3)
    uri = "data:application/octet-stream;base64," + base64.b64encode(binary).decode()
    if where == "beside":
        (tmp_path / "my hair.bin").write_bytes(binary)
        uri = "my%20hair.bin"
    document["buffers"][0]["uri"] = uri
    (tmp_path / "a.gltf").write_text(json.dumps(document))
    assert strands_in(tmp_path / "a.gltf").counts.tolist() == [10]


def test_a_file_of_hairkit_is_read_without_its_head(tmp_path: Path, caplog: Any) -> None:
    """Where the head was left out another is put under the strands, and that is said."""
    groom = bristle_groom()
    options = gltf.Options(hair="none", head_mesh=False)
    gltf.export_groom(replace(groom), tmp_path / "a.glb", options)
    with caplog.at_level(logging.WARNING):
        found = strands_in(tmp_path / "a.glb")
    np.testing.assert_array_equal(found.points, groom.strands.points)
    assert "no head" in caplog.text


LINE, DATA = document_of(fans(2).reshape(-1, 3), 3)
HOSTILE: dict[str, tuple[dict[str, Any], str]] = {
    "count": ({"accessors": [LINE["accessors"][0] | {"count": 2**31}]}, "beyond the file"),
    "negative": ({"accessors": [LINE["accessors"][0] | {"count": -4}]}, "negative"),
    "view": ({"bufferViews": [{"buffer": 0, "byteLength": 2**40}]}, "beyond the file"),
    "stride": ({"bufferViews": [LINE["bufferViews"][0] | {"byteStride": 0}]}, "no sense"),
    "claims": ({"buffers": [{"byteLength": 2**31}]}, "it claims 2147483648"),
    "parent folder": ({"buffers": [{"byteLength": 9, "uri": "../b.bin"}]}, "outside"),
    "encoded": ({"buffers": [{"byteLength": 9, "uri": "%2e%2e%2fb.bin"}]}, "outside"),
    "absolute": ({"buffers": [{"byteLength": 9, "uri": "/etc/passwd"}]}, "outside"),
    "web": ({"buffers": [{"byteLength": 9, "uri": "http://a/b.bin"}]}, "outside"),
    "missing": ({"buffers": [{"byteLength": 9, "uri": "b.bin"}]}, "no such file"),
    "base64": ({"buffers": [{"byteLength": 9, "uri": "data:;base64,%%%"}]}, "data URI"),
    "loop": ({"nodes": [{"children": [1]}, {"children": [0], "mesh": 0}],
              "scenes": [{"nodes": [0]}]}, "loop"),
    "types": ({"meshes": [{"primitives": {"attributes": 3}}]}, "not a readable"),
    "sparse": ({"accessors": [{"count": 10**9, "componentType": 5126, "type": "VEC3"}]}, "sparse"),
    "draco": ({"extensionsRequired": ["KHR_draco_mesh_compression"]}, "without compression"),
    "form": ({"extras": {"hairkit": {"version": 99}}}, "form 99"),
    "placed": ({"nodes": [{"mesh": 0, "scale": [1e300] * 3, "translation": [1e300] * 3}]},
               "beyond"),
}  # fmt: skip


@pytest.mark.parametrize("name", HOSTILE)
def test_hostile_documents_are_refused(tmp_path: Path, name: str) -> None:
    """Lying counts, other folders, loops, wrong types: one line that names the file."""
    change, message = HOSTILE[name]
    (tmp_path / "a.glb").write_bytes(glb(LINE | change, DATA))
    tracemalloc.start()
    with pytest.raises(HairkitError, match=message) as caught:
        strands_in(tmp_path / "a.glb")
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert "\n" not in str(caught.value)
    assert peak < 20_000_000


def test_values_that_no_type_takes_name_the_file(tmp_path: Path) -> None:
    """What a type refuses, as a torso of no breadth, is said of the file that holds it."""
    path = tmp_path / "worn.glb"
    groom = bristle_groom()
    gltf.export_groom(groom, path, gltf.Options(strips=8))
    data = path.read_bytes()
    (length,) = struct.unpack_from("<I", data, 12)
    document = json.loads(data[20 : 20 + length])
    document["extras"]["hairkit"]["torso"] = {"breadth": 0.0}
    path.write_bytes(glb(document, data[28 + length :]))
    with pytest.raises(FormatError, match=r"worn\.glb: .*torso breadth is 0"):
        strands_in(path)


@pytest.mark.parametrize("times", ["primitives", "indices"])
def test_small_files_do_not_become_large(tmp_path: Path, times: str) -> None:
    """Data that is used over and over is refused before it takes memory."""
    points = fans(12, 100).reshape(-1, 3)
    document, binary = document_of(points, 3)
    if times == "primitives":
        document["meshes"][0]["primitives"] *= 2000
    else:
        document, binary = document_of(points[:5], 3, np.arange(400_000) % 5)
    (tmp_path / "a.glb").write_bytes(glb(document, binary))
    tracemalloc.start()
    with pytest.raises(FormatError, match="over and over"):
        strands_in(tmp_path / "a.glb")
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 60 * (tmp_path / "a.glb").stat().st_size


@pytest.mark.parametrize(
    "content",
    [
        b"",
        b"glTF",
        b"glTF" + struct.pack("<II", 2, 2**32 - 1),
        b"glTF" + struct.pack("<IIII", 2, 20, 2**32 - 1, JSON),
        glb(b'{"nodes":' + b"[" * 100_000, b""),
        glb(b'{"accessors":[' + b"9" * 10_000 + b"]}", b""),
        glb(b"[]", b""),
        glb(b"\xff\xfe", b""),
    ],
    ids=["empty", "short", "length", "chunk", "deep", "number", "list", "utf-8"],
)
def test_broken_containers_are_refused(tmp_path: Path, content: bytes) -> None:
    """Cut off, lying about lengths, nested without end or no JSON: one line."""
    (tmp_path / "a.glb").write_bytes(content)
    with pytest.raises(FormatError, match=r"a\.glb"):
        strands_in(tmp_path / "a.glb")


def test_not_finite_positions_are_refused(tmp_path: Path) -> None:
    """NaN and infinity are named."""
    for bad in (np.nan, np.inf):
        points = fans(2).reshape(-1, 3)
        points[3, 1] = bad
        (tmp_path / "a.glb").write_bytes(glb(*document_of(points, 3)))
        with pytest.raises(FormatError, match="not finite"):
            strands_in(tmp_path / "a.glb")


VALUES = st.one_of(
    st.none(), st.booleans(), st.integers(-3, 70), st.sampled_from([2**31, -(2**31), 2**63, 1e308]),
    st.floats(allow_nan=False), st.sampled_from(["", "head", "LINEAR", "a.bin"]), st.builds(list),
    st.builds(dict), st.builds(lambda: [0, 0]),
)  # fmt: skip


def places(value: Any) -> list[tuple[Any, Any]]:
    """Return every container of a document with every key in it."""
    found: list[tuple[Any, Any]] = []
    pending = [value]
    while pending:
        item = pending.pop()
        keys = item.keys() if isinstance(item, dict) else range(len(item))
        for key in keys:
            found.append((item, key))
            if isinstance(item[key], (dict, list)):
                pending.append(item[key])
    return found


def damaged(document: dict[str, Any], binary: bytes, data: st.DataObject) -> bytes:
    """Return a .glb with a few values of its document, bytes of its data, or its end changed."""
    document = copy.deepcopy(document)
    for _ in range(data.draw(st.integers(0, 3))):
        choice = places(document)
        holder, key = choice[data.draw(st.integers(0, len(choice) - 1))]
        holder[key] = data.draw(VALUES)
    content = bytearray(glb(document, binary))
    for _ in range(data.draw(st.integers(0, 3))):
        content[data.draw(st.integers(0, len(content) - 1))] = data.draw(st.integers(0, 255))
    end = data.draw(st.integers(0, len(content))) if data.draw(st.booleans()) else len(content)
    return bytes(content[:end])


@pytest.fixture(scope="module")
def own(tmp_path_factory: pytest.TempPathFactory) -> tuple[dict[str, Any], bytes]:
    """Return the document and data of a small file that hairkit wrote."""
    path = tmp_path_factory.mktemp("own") / "own.glb"
    gltf.export_groom(bristle_groom(), path, gltf.Options(hair="none"))
    content = path.read_bytes()
    size = struct.unpack_from("<I", content, 12)[0]
    return json.loads(content[20 : 20 + size]), content[28 + size :]


@settings(max_examples=100, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(data=st.data())
def test_damaged_files_never_crash(
    tmp_path: Path, own: tuple[dict[str, Any], bytes], data: st.DataObject
) -> None:
    """Whatever is changed, in own and foreign files: finite strands or one HairkitError."""
    pairs = [[0, 1], [2, 1], [3, 4], [5, 6], [6, 7]]
    documents = [own, document_of(fans(3).reshape(-1, 3), 1, pairs)]
    document, binary = documents[data.draw(st.integers(0, 1))]
    (tmp_path / "a.glb").write_bytes(damaged(document, binary, data))
    with contextlib.suppress(HairkitError):
        found = gltf.import_groom(tmp_path / "a.glb", gltf.Options())
        assert np.isfinite(found.strands.points).all()
