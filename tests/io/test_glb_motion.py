"""Laws of head motion read from animated glTF files."""

from __future__ import annotations

import contextlib
import json
import struct
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from hairkit.errors import FormatError, HairkitError
from hairkit.io.glb_motion import read_head_motion


def animated(
    path: Path, nodes: list[dict[str, Any]], tracks: list[tuple[int, str, str, Any, Any]]
) -> Path:
    """Write nodes and (node, property, interpolation, times, values) tracks as .glb."""
    views, accessors, binary = [], [], b""
    samplers, channels = [], []
    for node, name, way, times, values in tracks:
        for array in (np.asarray(times, "<f4"), np.asarray(values, "<f4")):
            views.append({"buffer": 0, "byteOffset": len(binary), "byteLength": array.nbytes})
            kind = "SCALAR" if array.ndim == 1 else f"VEC{array.shape[1]}"
            accessors.append(
                {"bufferView": len(views) - 1, "componentType": 5126, "count": len(array),
                 "type": kind}
            )  # fmt: skip
            binary += array.tobytes()
        last = len(accessors) - 1
        samplers.append({"input": last - 1, "output": last, "interpolation": way})
        channels.append({"sampler": len(samplers) - 1, "target": {"node": node, "path": name}})
    document = {
        "asset": {"version": "2.0"},
        "nodes": nodes,
        "animations": [{"samplers": samplers, "channels": channels}],
        "accessors": accessors,
        "bufferViews": views,
        "buffers": [{"byteLength": len(binary)}],
    }
    text = json.dumps(document).encode()
    text += b" " * (-len(text) % 4)
    chunks = struct.pack("<II", len(text), 0x4E4F534A) + text
    chunks += struct.pack("<II", len(binary), 0x004E4942) + binary
    path.write_bytes(struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks)
    return path


def turns(angles: Any) -> np.ndarray:
    """Return quaternions about +Y."""
    return Rotation.from_rotvec(np.outer(angles, [0.0, 1, 0])).as_quat()


def test_a_nod_turns_about_its_joint(tmp_path: Path) -> None:
    """The joint stays where it is; points turn about it at an even speed (slerp)."""
    nodes = [{"name": "Head", "translation": [0, 1.5, 0.1]}]
    file = animated(tmp_path / "a.glb", nodes, [(0, "rotation", "LINEAR", [0, 1], turns([0, 1.2]))])
    times, motion = read_head_motion(file)
    np.testing.assert_allclose(times, np.arange(61) / 60)
    joint = np.array([0, 1.5, 0.1, 1])
    np.testing.assert_allclose(motion @ joint, np.tile(joint, (61, 1)), atol=1e-7)
    want = Rotation.from_rotvec(np.outer(1.2 * times, [0, 1, 0])).as_matrix()
    np.testing.assert_allclose(motion[:, :3, :3], want, atol=1e-6)


def test_what_moves_the_parents_moves_the_head(tmp_path: Path) -> None:
    """A body that walks carries the head; a scaled scene's places are in metres."""
    nodes = [
        {"name": "scene", "scale": [0.01, 0.01, 0.01], "children": [1]},
        {"name": "body", "children": [2]},
        {"name": "head", "translation": [0, 150, 0]},
        {"name": "hand"},
    ]
    tracks = [
        (1, "translation", "LINEAR", [1, 3], [[0, 0, 0], [100, 0, 40]]),
        (3, "translation", "LINEAR", [0, 9], [[0, 0, 0], [1, 1, 1]]),
    ]
    times, motion = read_head_motion(animated(tmp_path / "a.glb", nodes, tracks))
    assert times[-1] == 2
    np.testing.assert_allclose(motion[:, :3, :3], np.tile(np.eye(3), (121, 1, 1)), atol=1e-9)
    np.testing.assert_allclose(motion[:, :3, 3], np.outer(times / 2, [1, 0, 0.4]), atol=1e-7)


def test_rest_is_the_place_without_animation(tmp_path: Path) -> None:
    """An animation that holds the head still elsewhere is a constant motion from rest."""
    nodes = [{"name": "head", "translation": [0, 1, 0], "rotation": turns([0.3])[0].tolist()}]
    tracks = [
        (0, "translation", "STEP", [0, 0.5], [[0, 1, 0.2], [0, 1, 0.2]]),
        (0, "rotation", "STEP", [0, 0.5], turns([0.3, 0.3])),
    ]
    _, motion = read_head_motion(animated(tmp_path / "a.glb", nodes, tracks))
    want = np.eye(4)
    want[2, 3] = 0.2
    np.testing.assert_allclose(motion, np.tile(want, (31, 1, 1)), atol=1e-6)


def test_the_only_animated_node_is_the_head(tmp_path: Path) -> None:
    """A node of another name will do where no other moves; steps hold until the next key."""
    tracks = [(0, "translation", "STEP", [0, 1], [[0, 0, 0], [0, 2, 0]])]
    times, motion = read_head_motion(animated(tmp_path / "a.glb", [{"name": "x"}], tracks))
    np.testing.assert_allclose(motion[:, 1, 3], np.where(times < 1, 0, 2))


def test_cubic_splines_keep_their_slopes(tmp_path: Path) -> None:
    """Hermite tangents of a parabola's derivative give the parabola (appendix C)."""
    key = np.array([0.0, 1.0, 2.0])
    value, slope = np.outer(key**2, [1, 0, 0]), np.outer(2 * key, [1, 0, 0])
    values = np.stack([slope, value, slope], axis=1).reshape(-1, 3)
    file = animated(tmp_path / "a.glb", [{}], [(0, "translation", "CUBICSPLINE", key, values)])
    times, motion = read_head_motion(file)
    np.testing.assert_allclose(motion[:, 0, 3], times**2, atol=1e-6)


@pytest.mark.parametrize(
    ("nodes", "tracks", "message"),
    [
        ([{}], [], "does not tell|no node is named head"),
        ([{"name": "head"}], [], "does not move the head"),
        ([{}, {}], [(0, "scale", "STEP", [0], [[1, 1, 1]]),
                    (1, "scale", "STEP", [0], [[1, 1, 1]])], "no node is named head"),
        ([{}], [(0, "translation", "LINEAR", [0, 1e9], [[0, 0, 0]] * 2)], "lasts 1e"),
        ([{}], [(0, "translation", "LINEAR", [1, 0], [[0, 0, 0]] * 2)], "do not ascend"),
        ([{}], [(0, "rotation", "LINEAR", [0, 1], [[0, 0, 0, 0]] * 2)], "zero norm"),
        ([{}], [(0, "scale", "LINEAR", [0, 1], [[0, 0, 0]] * 2)], "scaled to nothing"),
        ([{"children": [1]}, {"children": [0]}],
         [(0, "scale", "LINEAR", [0, 1], [[1, 1, 1]] * 2)], "loop"),
    ],
)  # fmt: skip
def test_unusable_animations_give_one_line(
    tmp_path: Path, nodes: list[dict[str, Any]], tracks: list[Any], message: str
) -> None:
    """What is wrong is said in one line that names the file."""
    file = animated(tmp_path / "a.glb", nodes, tracks)
    with pytest.raises(FormatError, match=message) as caught:
        read_head_motion(file)
    assert "\n" not in str(caught.value)
    assert "a.glb" in str(caught.value)


@settings(max_examples=60, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(data=st.data())
def test_damaged_animations_never_crash(tmp_path: Path, data: st.DataObject) -> None:
    """Any few bytes changed or cut off: a finite motion or a HairkitError."""
    tracks = [(0, "rotation", "LINEAR", [0, 0.5, 1], turns([0, 1, 2]))]
    file = animated(tmp_path / "a.glb", [{"name": "head"}], tracks)
    content = bytearray(file.read_bytes())
    for _ in range(data.draw(st.integers(1, 3))):
        content[data.draw(st.integers(0, len(content) - 1))] = data.draw(st.integers(0, 255))
    file.write_bytes(content[: data.draw(st.integers(0, len(content)))] if data.draw(
        st.booleans()) else content)  # fmt: skip
    with contextlib.suppress(HairkitError):
        assert np.isfinite(read_head_motion(file)[1]).all()
