"""Offscreen pictures of hair on a head: shaded ones to look at, and plain ones to measure with."""

from __future__ import annotations

from hairkit.rendering.head import Solid
from hairkit.rendering.light import Lights
from hairkit.rendering.measurement import (
    Measurements,
    draw_coverage,
    draw_depth,
    draw_directions,
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
    "draw_coverage",
    "draw_depth",
    "draw_directions",
    "draw_layers",
    "draw_measurements",
    "draw_views",
    "points_at_depth",
    "visible_points",
]
