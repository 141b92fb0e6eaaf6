"""The camera of a picture, for programs that run in Blender's Python."""

import math

import bpy
from mathutils import Matrix, Vector

Z_UP = Matrix(((1, 0, 0), (0, 0, -1), (0, 1, 0)))
"""Head frame to Blender."""


def add_camera(scene: dict) -> None:
    """Look through a camera: its `height` and `focal` in pixels, `rotation` and `position`.

    OpenCV axes (y down, z ahead) become Blender's (y up, z back).
    """
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
