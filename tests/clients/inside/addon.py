"""The add-on, installed in Blender as a user installs it."""

from typing import Any

import bpy
import numpy as np
from contents import objects

_MODULE = "bl_ext.user_default.hairkit"


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
    hair = next(thing for thing in bpy.data.objects if thing.type == "CURVES")
    head = hair.data.surface
    before = _shown(hair)
    places = np.empty(3 * len(head.data.vertices), np.float32)
    head.data.vertices.foreach_get("co", places)
    head.shape_key_add(name="rest")
    moved = head.shape_key_add(name="moved")
    moved.data.foreach_set("co", (places.reshape(-1, 3) + np.array(shift)).ravel())
    moved.value = 1.0
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
    bpy.context.preferences.addons[_MODULE].preferences.python = python


def _names() -> dict:
    return {
        "operators": [name for name in ("import_groom", "reconstruct") if _is_there(name)],
        "menu": hasattr(bpy.types, "VIEW3D_MT_hairkit"),
    }


def _is_there(name: str) -> bool:
    try:
        getattr(bpy.ops.hairkit, name).get_rna_type()
    except KeyError:
        return False
    return True


def _shown(hair: Any) -> np.ndarray:
    bpy.context.view_layer.update()
    curves = hair.evaluated_get(bpy.context.evaluated_depsgraph_get()).data
    places = np.empty(3 * len(curves.points), np.float32)
    curves.attributes["position"].data.foreach_get("vector", places)
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
    nodes = [node for node in material.node_tree.nodes if node.type == "MIX"]
    return [
        list(socket.default_value)[:3]
        for node in nodes
        for socket in node.inputs
        if socket.type == "RGBA" and socket.enabled
    ]
