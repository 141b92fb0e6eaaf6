"""Curves made of helix arcs: fitting them to strands, packing them, and measuring curls by them."""

from __future__ import annotations

from hairkit.geometry.arc_counts import adaptive_counts, patent_counts
from hairkit.geometry.curl import Curl, measure_curl
from hairkit.geometry.floating_tangents import Arcs, fit_arcs
from hairkit.geometry.helix_strands import HelixStrands, smoothed
from hairkit.geometry.pairs import helix_through

__all__ = [
    "Arcs",
    "Curl",
    "HelixStrands",
    "adaptive_counts",
    "fit_arcs",
    "helix_through",
    "measure_curl",
    "patent_counts",
    "smoothed",
]
