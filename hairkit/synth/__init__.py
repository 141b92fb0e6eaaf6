"""Procedural grooms and photos of them with their truth: for tests, and where photos lack."""

from __future__ import annotations

from hairkit.synth.growth import STYLES, Style, StyleName, grow
from hairkit.synth.photographs import photograph

__all__ = ["STYLES", "Style", "StyleName", "grow", "photograph"]
