"""Offscreen pictures of hair on a head: shaded ones to look at, and plain ones to measure with."""

from __future__ import annotations

from hairkit.render.light import Lights
from hairkit.render.measured import (
    draw_coverage,
    draw_depth,
    draw_directions,
    draw_layers,
    visible_points,
)
from hairkit.render.picture import draw, draw_views

__all__ = [
    "Lights",
    "draw",
    "draw_coverage",
    "draw_depth",
    "draw_directions",
    "draw_layers",
    "draw_views",
    "visible_points",
]
