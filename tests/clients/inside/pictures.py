"""Pictures that Blender's Cycles makes of imported files, without a further step."""

import math
import os
import tempfile

import bpy
import numpy as np
from contents import imported
from mathutils import Matrix, Vector

SAMPLES = 8
Z_UP = Matrix(((1, 0, 0), (0, 0, -1), (0, 1, 0)))
"""Head frame to Blender."""


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
    _add_camera(camera)
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


def _add_camera(scene: dict) -> None:
    """OpenCV axes (y down, z ahead) become Blender's (y up, z back)."""
    camera = bpy.data.cameras.new("camera")
    camera.sensor_fit = "VERTICAL"
    camera.angle_y = 2 * math.atan(scene["height"] / 2 / scene["focal"])
    camera.clip_start = 0.01
    thing = bpy.data.objects.new("camera", camera)
    rotation = Z_UP @ Matrix(scene["rotation"]).transposed()
    turned = rotation @ Matrix.Diagonal((1, -1, -1))
    thing.matrix_world = Matrix.Translation(Z_UP @ Vector(scene["position"])) @ turned.to_4x4()
    bpy.context.collection.objects.link(thing)
    bpy.context.scene.camera = thing
