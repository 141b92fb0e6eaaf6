"""Offscreen pictures of hair on a head: shaded ones to look at, and plain ones to measure with."""

from __future__ import annotations

from hairkit.render.measured import draw_coverage, draw_directions, draw_layers

__all__ = ["draw_coverage", "draw_directions", "draw_layers"]
