"""Pictures that Blender's Cycles makes of imported files, without a further step."""

import os
import sys
import tempfile
from pathlib import Path

import bpy
import numpy as np
from contents import imported

sys.path.append(str(Path(__file__).parents[3] / "benchmarks" / "in_blender"))
from scene_camera import add_camera

SAMPLES = 8


def seen(path: str, operator: str, cameras: list, hidden: list) -> np.ndarray:
    """Return pictures (C, H, W, 4) of what an importer made of a file, under a white sky.

    Linear RGB, premultiplied, and alpha, the upper row first. Objects with one of the words
    `hidden` in their name are left out.
    """
    imported(path, operator)
    for thing in bpy.data.objects:
        thing.hide_render = any(word in thing.name.lower() for word in hidden)
    world = bpy.data.worlds.new("sky")
    world.use_nodes = True
    world.node_tree.nodes["Background"].inputs["Color"].default_value = (1, 1, 1, 1)
    bpy.context.scene.world = world
    return np.stack([_picture(camera) for camera in cameras])


def _picture(camera: dict) -> np.ndarray:
    add_camera(camera)
    scene = bpy.context.scene
    scene.render.engine = "CYCLES"
    scene.cycles.device, scene.cycles.samples, scene.cycles.seed = "CPU", SAMPLES, 0
    scene.cycles.use_denoising = False
    scene.render.threads_mode, scene.render.threads = "FIXED", 1
    scene.render.resolution_x, scene.render.resolution_y = camera["width"], camera["height"]
    scene.render.resolution_percentage = 100
    scene.render.film_transparent = True
    scene.render.image_settings.file_format = "OPEN_EXR"
    scene.render.image_settings.color_mode = "RGBA"
    with tempfile.TemporaryDirectory() as folder:
        scene.render.filepath = os.path.join(folder, "picture.exr")
        bpy.ops.render.render(write_still=True)
        image = bpy.data.images.load(scene.render.filepath)
        pixels = np.empty(4 * camera["width"] * camera["height"], np.float32)
        image.pixels.foreach_get(pixels)
        bpy.data.images.remove(image)
    return pixels.reshape(camera["height"], camera["width"], 4)[::-1].copy()
