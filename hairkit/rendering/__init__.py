"""Offscreen pictures of hair on a head: shaded ones to look at, and plain ones to measure with."""

from __future__ import annotations

from hairkit.rendering.head import Solid
from hairkit.rendering.light import Lights
from hairkit.rendering.measurement import (
    Measured,
    draw_coverage,
    draw_depth,
    draw_directions,
    draw_layers,
    draw_measured,
    points_at_depth,
    visible_points,
)
from hairkit.rendering.picture import draw, draw_views, drawn_width

__all__ = [
    "Lights",
    "Measured",
    "Solid",
    "draw",
    "draw_coverage",
    "draw_depth",
    "draw_directions",
    "draw_layers",
    "draw_measured",
    "draw_views",
    "drawn_width",
    "points_at_depth",
    "visible_points",
]
