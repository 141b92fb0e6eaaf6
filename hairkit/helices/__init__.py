"""Curves made of helix arcs: fitting them to strands, packing them, and measuring curls by them."""

from __future__ import annotations

from hairkit.helices.arc_between import helix_through
from hairkit.helices.arc_counts import adaptive_counts, patent_counts
from hairkit.helices.curl import Curl, measure_curl
from hairkit.helices.floating_tangents import Arcs, fit_arcs
from hairkit.helices.helix_strands import HelixStrands, smoothed

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
