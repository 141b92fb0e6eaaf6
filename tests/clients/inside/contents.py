"""What is in a Blender scene, as arrays: what an importer made of a file."""

from typing import Any

import bpy
import numpy as np

_KINDS = {
    "FLOAT": ("value", np.float32, ()),
    "INT": ("value", np.int32, ()),
    "INT8": ("value", np.int32, ()),
    "BOOLEAN": ("value", np.bool_, ()),
    "FLOAT2": ("vector", np.float32, (2,)),
    "FLOAT_VECTOR": ("vector", np.float32, (3,)),
    "FLOAT_COLOR": ("color", np.float32, (4,)),
    "BYTE_COLOR": ("color", np.float32, (4,)),
}


def emptied() -> None:
    """Start with a scene without objects."""
    bpy.ops.wm.read_factory_settings(use_empty=True)


def imported(path: str, operator: str, options: dict | None = None, frames: Any = ()) -> list:
    """Return the objects that Blender's import operator makes of a file.

    `operator` is its name, as `wm.alembic_import`; with `frames` the positions at these frames are
    in `frames` of each object, an array (T, P, 3).
    """
    emptied()
    room, name = operator.split(".")
    done = getattr(getattr(bpy.ops, room), name)(filepath=path, **(options or {}))
    if done != {"FINISHED"}:
        raise RuntimeError(f"{operator} said {done}")
    return objects(frames)


def objects(frames: Any = ()) -> list:
    """Return every object of the scene; positions are in the world, modifiers not applied."""
    bpy.context.view_layer.update()
    found = [_object(thing) for thing in bpy.data.objects]
    for index, thing in enumerate(bpy.data.objects):
        if len(frames) and thing.type in ("MESH", "CURVES"):
            found[index]["frames"] = np.stack([_evaluated(thing, frame) for frame in frames])
    return found


def _object(thing: Any) -> dict:
    matrix = np.array(thing.matrix_world)
    made = {
        "name": thing.name,
        "type": thing.type,
        "matrix": matrix,
        "parent": thing.parent.name if thing.parent else None,
        "modifiers": [modifier.type for modifier in thing.modifiers],
        "materials": [slot.material.name for slot in thing.material_slots if slot.material],
    }
    reader = {"MESH": _mesh, "CURVES": _curves, "CURVE": _splines, "ARMATURE": _bones}
    if thing.type in reader:
        made |= reader[thing.type](thing)
    return made


def _mesh(thing: Any) -> dict:
    mesh = thing.data
    edges = np.empty(2 * len(mesh.edges), np.int32)
    mesh.edges.foreach_get("vertices", edges)
    corners = np.empty(len(mesh.loops), np.int32)
    mesh.loops.foreach_get("vertex_index", corners)
    sizes = np.empty(len(mesh.polygons), np.int32)
    mesh.polygons.foreach_get("loop_total", sizes)
    weights = np.zeros((len(mesh.vertices), len(thing.vertex_groups)), np.float32)
    for vertex in mesh.vertices:
        for entry in vertex.groups:
            weights[vertex.index, entry.group] = entry.weight
    return {
        "positions": _in_world(thing, _attribute(mesh.attributes["position"])),
        "edges": edges.reshape(-1, 2),
        "corners": corners,
        "sizes": sizes,
        "uv": [_attribute(mesh.attributes[layer.name]) for layer in mesh.uv_layers],
        "attributes": _attributes(mesh),
        "groups": [group.name for group in thing.vertex_groups],
        "weights": weights,
    }


def _curves(thing: Any) -> dict:
    curves = thing.data
    offsets = np.empty(len(curves.curves) + 1, np.int32)
    curves.curve_offset_data.foreach_get("value", offsets)
    return {
        "positions": _in_world(thing, _attribute(curves.attributes["position"])),
        "offsets": offsets,
        "attributes": _attributes(curves),
    }


def _splines(thing: Any) -> dict:
    rows = [
        np.array([point.co[:3] for point in (spline.bezier_points or spline.points)])
        for spline in thing.data.splines
    ]
    offsets = np.cumsum([0, *(len(row) for row in rows)])
    return {"positions": _in_world(thing, np.concatenate(rows)), "offsets": offsets}


def _bones(thing: Any) -> dict:
    bones = thing.data.bones
    return {
        "bones": [bone.name for bone in bones],
        "parents": [bone.parent.name if bone.parent else None for bone in bones],
        "heads": _in_world(thing, np.array([bone.head_local for bone in bones])),
    }


def _attributes(data: Any) -> dict:
    return {a.name: _attribute(a) for a in data.attributes if a.data_type in _KINDS}


def _attribute(attribute: Any) -> np.ndarray:
    name, dtype, shape = _KINDS[attribute.data_type]
    values = np.empty(len(attribute.data) * max(1, *shape, 1), dtype)
    attribute.data.foreach_get(name, values)
    return values.reshape(-1, *shape)


def _in_world(thing: Any, points: np.ndarray) -> np.ndarray:
    matrix = np.array(thing.matrix_world)
    return points @ matrix[:3, :3].T + matrix[:3, 3]


def _evaluated(thing: Any, frame: float) -> np.ndarray:
    """Return the positions in the world at a frame, with modifiers, shapes and armatures."""
    bpy.context.scene.frame_set(int(frame), subframe=float(frame) % 1)
    whole = thing.evaluated_get(bpy.context.evaluated_depsgraph_get())
    return _in_world(whole, _attribute(whole.data.attributes["position"]))
