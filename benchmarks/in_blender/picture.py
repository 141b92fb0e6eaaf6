"""Renders an Alembic groom on its head with Cycles; runs in Blender's Python.

python benchmarks/in_blender/picture.py SCENE.json

The scene names the files, the camera and the lights; see benchmarks/blender_picture.py.
"""

import importlib.util
import json
import sys
from pathlib import Path

import bpy
import numpy as np
from mathutils import Vector
from scene_camera import Z_UP, add_camera

ADDON = Path(__file__).parents[2] / "examples" / "hairkit-blender"


def main() -> None:
    """Build the scene and write the picture."""
    scene = json.loads(Path(sys.argv[1]).read_text())
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.ops.wm.alembic_import(filepath=scene["alembic"])
    _dress(bpy.context.selected_objects[0], scene)
    add_camera(scene)
    for light in scene["lights"]:
        _add_sun(light)
    _add_sky(scene["sky"])
    _render(scene)


def _dress(hair: bpy.types.Object, scene: dict) -> None:
    """Give the hair the add-on's material, and the add-on's head below it."""
    addon = _addon()
    groom = addon.groom_file.read_groom(scene["groom"])
    addon.objects.add_head(bpy.context, groom, "head")
    curves = hair.data
    curves.materials.append(addon.materials.hair_material(groom.root_colour, groom.tip_colour))
    radius = np.empty(len(curves.points), np.float32)
    curves.attributes["radius"].data.foreach_get("value", radius)
    curves.attributes["radius"].data.foreach_set("value", radius * scene["wider"])


def _addon():
    """Return the add-on's package, which is not installed here."""
    places = {"submodule_search_locations": [str(ADDON)]}
    spec = importlib.util.spec_from_file_location("addon", ADDON / "__init__.py", **places)
    package = importlib.util.module_from_spec(spec)
    sys.modules["addon"] = package
    spec.loader.exec_module(package)
    for name in ("groom_file", "materials", "objects"):
        importlib.import_module(f"addon.{name}")
    return package


def _add_sun(light: dict) -> None:
    sun = bpy.data.lights.new("sun", "SUN")
    strength = max(light["colour"])
    sun.energy, sun.angle = strength, 0.2
    sun.color = [part / strength for part in light["colour"]]
    thing = bpy.data.objects.new("sun", sun)
    towards = Z_UP @ Vector(light["direction"])
    thing.rotation_mode = "QUATERNION"
    thing.rotation_quaternion = towards.to_track_quat("Z", "Y")
    bpy.context.collection.objects.link(thing)


def _add_sky(colour: list) -> None:
    world = bpy.data.worlds.new("sky")
    world.use_nodes = True
    background = world.node_tree.nodes["Background"]
    background.inputs["Color"].default_value = (*colour, 1.0)
    bpy.context.scene.world = world


def _render(scene: dict) -> None:
    settings = bpy.context.scene
    settings.render.engine = "CYCLES"
    settings.cycles.device = "CPU"
    settings.cycles.samples = scene["samples"]
    settings.cycles.use_denoising = True
    settings.cycles.seed = 0
    settings.render.threads_mode, settings.render.threads = "FIXED", scene["threads"]
    settings.render.resolution_x, settings.render.resolution_y = scene["width"], scene["height"]
    settings.render.resolution_percentage = 100
    settings.render.film_transparent = True
    settings.view_settings.view_transform = "Standard"
    settings.view_settings.exposure = scene["exposure"]
    settings.render.image_settings.file_format = "PNG"
    settings.render.image_settings.color_mode = "RGBA"
    settings.render.filepath = scene["picture"]
    bpy.ops.render.render(write_still=True)


if __name__ == "__main__":
    main()
