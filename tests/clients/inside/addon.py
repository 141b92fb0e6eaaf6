"""The add-on, installed in Blender as a user installs it."""

import importlib
from typing import Any

import bpy
import numpy as np
from contents import objects

_MODULE = "bl_ext.user_default.hairkit"
_KINDS = ("objects", "hair_curves", "meshes", "armatures", "actions", "materials", "collections")


def installed(package: str) -> dict:
    """Install the zipped extension in Blender's own repository, and enable it."""
    bpy.ops.extensions.package_install_files(
        filepath=package, repo="user_default", enable_on_install=True
    )
    return {"enabled": _MODULE in bpy.context.preferences.addons, **_names()}


def disabled() -> dict:
    """Disable it; say what is left of it."""
    bpy.ops.preferences.addon_disable(module=_MODULE)
    left = _names()
    bpy.ops.preferences.addon_enable(module=_MODULE)
    return left


def imported(path: str, python: str = "", **settings: Any) -> list:
    """Return the scene after the import of a groom into an empty one."""
    _emptied_with(python)
    bpy.ops.hairkit.import_groom(filepath=path, **settings)
    return _with_looks(objects())


def reconstructed(folder: str, out: str, python: str, **settings: Any) -> list:
    """Return the scene after a reconstruction of a folder of photos."""
    _emptied_with(python)
    bpy.ops.hairkit.reconstruct(directory=folder, out=out, **settings)
    return _with_looks(objects())


def grown(path: str, **settings: Any) -> np.ndarray:
    """Return the points (S, P, 3) of the hair that is drawn for a file of guides of P points."""
    imported(path, **settings)
    return _drawn_hair(_hair())


def shaped(path: str, shift: list, **settings: Any) -> dict:
    """Return the drawn hair before and after every vertex of the head is moved."""
    imported(path, **settings)
    before = _drawn_hair(_hair())
    _shift(_hair().data.surface, shift)
    return {"before": before, "after": _drawn_hair(_hair())}


def moving(path: str, python: str, frames: list, **settings: Any) -> dict:
    """Return hair and head in the world at frames, as an animated file is imported."""
    _emptied_with(python)
    known = {kind: len(getattr(bpy.data, kind)) for kind in _KINDS}
    bpy.ops.hairkit.import_groom(filepath=path, **settings)
    added = {kind: len(getattr(bpy.data, kind)) - known[kind] for kind in _KINDS}
    return _at(frames) | {"added": added}


def simulated(path: str, python: str, keys: list, frames: list, edit: float, **words: Any) -> dict:
    """Import a groom, give its head keys (frame, x, degrees about Z), simulate, return `_at`.

    `edit` metres are added to the height of all points but roots before that, as by combing.
    `bone` are keys (frame, degrees about Z) of an armature's bone that all of the head follows.
    """
    imported(path, python, fill=words.pop("fill", 0))
    scene, hair = bpy.context.scene, _hair()
    _follow_bone(hair.parent, words.pop("bone", []))
    scene.frame_start, scene.frame_end, scene.render.fps = frames[0], frames[-1], 24
    for frame, x, degrees in keys:
        hair.parent.location.x = x
        hair.parent.rotation_euler.z = np.radians(degrees)
        hair.parent.keyframe_insert("location", frame=frame)
        hair.parent.keyframe_insert("rotation_euler", frame=frame)
    if edit:
        places = _of(hair.data)
        starts = np.empty(len(hair.data.curves) + 1, np.int32)
        hair.data.curve_offset_data.foreach_get("value", starts)
        free = np.setdiff1d(np.arange(len(places)), starts[:-1])
        places[free, 2] += edit
        hair.data.position_data.foreach_set("vector", places.ravel())
    bpy.context.view_layer.objects.active = hair
    bpy.ops.hairkit.simulate(**words)
    return _at(frames)


def _follow_bone(head: Any, keys: list) -> None:
    """Skin a head to the only bone of an armature, which gets keys; no keys: nothing happens."""
    if not keys:
        return
    frame = bpy.data.objects.new("frame", bpy.data.armatures.new("frame"))
    bpy.context.collection.objects.link(frame)
    bpy.context.view_layer.objects.active = frame
    bpy.ops.object.mode_set(mode="EDIT")
    frame.data.edit_bones.new("head").tail = (0, 0, 0.1)
    bpy.ops.object.mode_set(mode="OBJECT")
    group = head.vertex_groups.new(name="head")
    group.add(list(range(len(head.data.vertices))), 1.0, "REPLACE")
    head.modifiers.new("frame", "ARMATURE").object = frame
    bone = frame.pose.bones["head"]
    bone.rotation_mode = "XYZ"
    for number, degrees in keys:
        bone.rotation_euler.y = np.radians(degrees)  # the bone's own axis, which stands upright
        bone.keyframe_insert("rotation_euler", frame=number)


def progress(lines: list) -> list:
    """Return the share of a stage that each line of hairkit's progress tells."""
    return [importlib.import_module(f"{_MODULE}.background").share(line) for line in lines]


def refusal(operator: str, python: str = "", **arguments: Any) -> str:
    """Return the text of the error that a command of the add-on reports."""
    _emptied_with(python)
    try:
        getattr(bpy.ops.hairkit, operator)(**arguments)
    except RuntimeError as error:
        return str(error).strip()
    return ""


def followed(path: str, shift: list) -> dict:
    """Return the hair's points before and after every vertex of the head is moved."""
    imported(path)
    hair = _hair()
    before = _shown(hair)
    _shift(hair.data.surface, shift)
    return {"before": before, "after": _shown(hair)}


def menus() -> dict:
    """Return the names of the menus that show the add-on."""
    functions = {"bar": bpy.types.VIEW3D_MT_editor_menus, "file": bpy.types.TOPBAR_MT_file_import}
    return {
        key: [f.__name__ for f in menu.draw._draw_funcs if f.__module__.startswith(_MODULE)]
        for key, menu in functions.items()
    }


def _emptied_with(python: str) -> None:
    """Empty the scene by hand: factory settings would disable the add-on."""
    for thing in list(bpy.data.objects):
        bpy.data.objects.remove(thing)
    bpy.context.scene.frame_start, bpy.context.scene.frame_end = 1, 250
    bpy.context.preferences.addons[_MODULE].preferences.python = python


def _names() -> dict:
    return {
        "operators": [
            name for name in ("import_groom", "reconstruct", "simulate") if _is_there(name)
        ],
        "menu": hasattr(bpy.types, "VIEW3D_MT_hairkit"),
    }


def _is_there(name: str) -> bool:
    try:
        getattr(bpy.ops.hairkit, name).get_rna_type()
    except KeyError:
        return False
    return True


def _hair() -> Any:
    return next(thing for thing in bpy.data.objects if thing.type == "CURVES")


def _shift(head: Any, shift: list) -> None:
    """Move every vertex of a head by a shape key."""
    places = np.empty(3 * len(head.data.vertices), np.float32)
    head.data.vertices.foreach_get("co", places)
    head.shape_key_add(name="rest")
    moved = head.shape_key_add(name="moved")
    moved.data.foreach_set("co", (places.reshape(-1, 3) + np.array(shift)).ravel())
    moved.value = 1.0


def _at(frames: list) -> dict:
    """Return hair (T, P, 3), head (T, V, 3) in the world and the scene's range."""
    scene = bpy.context.scene
    hair, head = _hair(), _hair().parent
    found: dict = {"range": [scene.frame_start, scene.frame_end], "hair": [], "head": []}
    for frame in frames:
        scene.frame_set(frame)
        for name, thing in (("hair", hair), ("head", head)):
            whole = thing.evaluated_get(bpy.context.evaluated_depsgraph_get())
            matrix = np.array(whole.matrix_world)
            found[name].append(_of(whole.data) @ matrix[:3, :3].T + matrix[:3, 3])
    return found | {name: np.array(found[name]) for name in ("hair", "head")}


def _shown(hair: Any) -> np.ndarray:
    bpy.context.view_layer.update()
    return _of(hair.evaluated_get(bpy.context.evaluated_depsgraph_get()).data)


def _drawn_hair(hair: Any) -> np.ndarray:
    return _shown(hair).reshape(-1, len(hair.data.points) // len(hair.data.curves), 3)


def _of(data: Any) -> np.ndarray:
    places = np.empty(3 * len(data.attributes["position"].data), np.float32)
    data.attributes["position"].data.foreach_get("vector", places)
    return places.reshape(-1, 3)


def _with_looks(found: list) -> list:
    for thing in found:
        real = bpy.data.objects[thing["name"]]
        thing["ends"] = [_mixed(slot.material) for slot in real.material_slots]
        if real.type == "CURVES":
            thing["surface"] = real.data.surface.name
            thing["surface_uv_map"] = real.data.surface_uv_map
    return found


def _mixed(material: Any) -> list:
    nodes = [node for node in material.node_tree.nodes if node.type == "MIX"][:1]  # root to tip
    return [
        list(socket.default_value)[:3]
        for node in nodes
        for socket in node.inputs
        if socket.type == "RGBA" and socket.enabled
    ]
