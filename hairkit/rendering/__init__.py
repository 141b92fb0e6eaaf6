"""Offscreen rendering of hair on a head: shaded pictures, and buffers to measure with.

The viewer shares its OpenGL context, cameras and lights.

* `context`: OpenGL contexts: EGL, else OSMesa
* `fibre`: constants of the look of hair
* `framebuffer`: frame buffers, supersampling, read-back
* `framing`: cameras that show a whole groom
* `gl_camera`: OpenGL matrices of a camera
* `hair`: strands as ribbons on the GPU
* `head`: the head and other meshes on the GPU
* `light`: lights and the volume of their transmittance
* `measurement`: coverage, direction, depth and visibility of hair
* `osmesa`: OSMesa contexts for moderngl
* `picture`: shaded pictures
* `skin_lobe`: the two layers of skin
* `skin_passes`: skin on the GPU
"""

from __future__ import annotations

from hairkit.rendering.head import Solid
from hairkit.rendering.light import Lights
from hairkit.rendering.measurement import (
    Measurements,
    draw_depth,
    draw_layers,
    draw_measurements,
    points_at_depth,
    visible_points,
)
from hairkit.rendering.picture import display_width, draw, draw_views

__all__ = [
    "Lights",
    "Measurements",
    "Solid",
    "display_width",
    "draw",
    "draw_depth",
    "draw_layers",
    "draw_measurements",
    "draw_views",
    "points_at_depth",
    "visible_points",
]
