"""The motion of a head in an animated glTF file, sampled at even times.

Khronos glTF 2.0, section 3.11 (animations) and appendix C (interpolation).
"""

from __future__ import annotations

import os
from typing import Any

import numpy as np
from scipy.interpolate import BPoly, make_interp_spline
from scipy.spatial.transform import Rotation, Slerp

from hairkit.arrays import Float64Array
from hairkit.io.glb_file import GlbFile, node_matrix, readable

RATE = 60.0
"""Samples a second."""
LONGEST = 3600.0
"""Animations of more seconds are refused."""
_DEEPEST = 100
_WIDTHS = {"translation": 3, "rotation": 4, "scale": 3}
_REST = {"translation": (0.0, 0.0, 0.0), "rotation": (0.0, 0.0, 0.0, 1.0), "scale": (1.0, 1.0, 1.0)}


def read_head_motion(path: str | os.PathLike[str]) -> tuple[Float64Array, Float64Array]:
    """Return the times (T,) in seconds from 0 and head_from_rest (T, 4, 4) of a .glb or .gltf file.

    The first animation is taken, of the node named `head` (in any case), or else of the only node
    that is animated. What moves the nodes above it moves it too. Rest is the place that the file
    gives the nodes without animation; scaling is left out. Points in metres, as column vectors.

    Raises
    ------
    FormatError
        The file is damaged, has no animation, or does not tell which node is the head.
    """
    with readable(path, "animated glTF head"):
        file = GlbFile(path)
        animations = file.document.get("animations", [])
        if not animations:
            raise ValueError("it has no animation")
        tracks = _tracks(file, animations[0])
        way = _way_to(file, _head_node(file, tracks))
        used = [tracks[node][name][0] for node in way for name in tracks.get(node, {})]
        if not used:
            raise ValueError("its animation does not move the head")
        start, end = min(keys[0] for keys in used), max(keys[-1] for keys in used)
        if not end - start <= LONGEST:
            raise ValueError(f"its animation lasts {end - start:.4g} s, expected up to {LONGEST:g}")
        times = np.arange(int(np.floor((end - start) * RATE + 1e-6)) + 1) / RATE
        rest = _chain_transforms(file, way, {}, np.zeros(1))[0]
        return times, _rigid(_chain_transforms(file, way, tracks, times + start), rest)


_Tracks = dict[int, dict[str, tuple[Float64Array, Float64Array, str]]]


def _tracks(file: GlbFile, animation: dict[str, Any]) -> _Tracks:
    """Return key times, values and interpolation of every animated property of every node."""
    tracks: _Tracks = {}
    for channel in animation["channels"]:
        target = channel["target"]
        if "node" not in target or target["path"] not in _WIDTHS:
            continue
        sampler = animation["samplers"][channel["sampler"]]
        keys = file.numbers(sampler["input"])[:, 0]
        values = file.numbers(sampler["output"])
        way = sampler.get("interpolation", "LINEAR")
        wanted = (len(keys) * (3 if way == "CUBICSPLINE" else 1), _WIDTHS[target["path"]])
        if values.shape != wanted or way not in ("LINEAR", "STEP", "CUBICSPLINE"):
            raise ValueError(f"a track of {len(keys)} keys has {len(values)} values, way {way!r}")
        if not (
            np.isfinite(keys).all() and np.isfinite(values).all() and (np.diff(keys) > 0).all()
        ):
            raise ValueError("the keys of its animation do not ascend, or are not finite")
        tracks.setdefault(int(target["node"]), {})[target["path"]] = (keys, values, way)
    return tracks


def _head_node(file: GlbFile, tracks: _Tracks) -> int:
    nodes = file.document["nodes"]
    named = [n for n, node in enumerate(nodes) if str(node.get("name", "")).lower() == "head"]
    if named:
        return named[0]
    if len(tracks) == 1:
        return next(iter(tracks))
    names = ", ".join(str(nodes[n].get("name", n))[:30] for n in list(tracks)[:8]) or "none"
    raise ValueError(f"no node is named head; animated nodes: {names}")


def _way_to(file: GlbFile, node: int) -> list[int]:
    """Return the nodes from the root down to `node`."""
    above = {
        child: number
        for number, parent in enumerate(file.document["nodes"])
        for child in parent.get("children", [])
    }
    way = [node]
    while way[0] in above:
        way.insert(0, above[way[0]])
        if len(way) > _DEEPEST:
            raise ValueError(f"the head lies below more than {_DEEPEST} nodes, or a loop of nodes")
    return way


def _chain_transforms(
    file: GlbFile, way: list[int], tracks: _Tracks, times: Float64Array
) -> Float64Array:
    """Return scene_from_node (T, 4, 4) of the last node of the way."""
    result = np.tile(np.eye(4), (len(times), 1, 1))
    for number in way:
        result = result @ _local(file.document["nodes"][number], tracks.get(number, {}), times)
    return result


def _local(
    node: dict[str, Any],
    tracks: dict[str, tuple[Float64Array, Float64Array, str]],
    times: Float64Array,
) -> Float64Array:
    if not tracks:
        return np.tile(node_matrix(node), (len(times), 1, 1))
    parts = {
        name: _sample(*tracks[name], times, turning=name == "rotation")
        if name in tracks
        else np.tile(np.array(node.get(name, rest), np.float64), (len(times), 1))
        for name, rest in _REST.items()
    }
    matrices = np.tile(np.eye(4), (len(times), 1, 1))
    turns = Rotation.from_quat(parts["rotation"]).as_matrix()
    matrices[:, :3, :3] = turns * parts["scale"][:, None]
    matrices[:, :3, 3] = parts["translation"]
    return matrices


def _sample(
    keys: Float64Array, values: Float64Array, way: str, times: Float64Array, *, turning: bool
) -> Float64Array:
    """Return (T, width) values at the times, those of the ends beyond the keys.

    Quaternions are of any length, but not 0.
    """
    times = np.clip(times, keys[0], keys[-1])
    if way == "CUBICSPLINE":
        arriving, values, leaving = values.reshape(len(keys), 3, -1).swapaxes(0, 1)
    result: Float64Array
    if way == "STEP" or len(keys) == 1:
        result = values[np.searchsorted(keys, times, side="right") - 1]
    elif way == "CUBICSPLINE":
        third = np.diff(keys)[:, None] / 3
        inner = values[:-1] + third * leaving[:-1], values[1:] - third * arriving[1:]
        result = BPoly(np.stack([values[:-1], *inner, values[1:]]), keys)(times)
    elif turning:
        result = Slerp(keys, Rotation.from_quat(values))(times).as_quat()
    else:
        result = make_interp_spline(keys, values, k=1)(times)
    return result


def _rigid(placed: Float64Array, rest: Float64Array) -> Float64Array:
    """Return the rigid motions (T, 4, 4) from rest: turned about the node's origin, then moved."""
    if (
        min(abs(np.linalg.det(rest[:3, :3])), np.abs(np.linalg.det(placed[:, :3, :3])).min())
        < 1e-12
    ):
        raise ValueError("the head is scaled to nothing")
    u, _, v = np.linalg.svd(placed[:, :3, :3] @ np.linalg.inv(rest[:3, :3]))
    turn = u @ v
    if (np.linalg.det(turn) < 0).any():
        raise ValueError("the head is mirrored")
    result = np.tile(np.eye(4), (len(placed), 1, 1))
    result[:, :3, :3] = turn
    result[:, :3, 3] = placed[:, :3, 3] - turn @ rest[:3, 3]
    if not np.isfinite(result).all():
        raise ValueError("its motion is not finite")
    return result
