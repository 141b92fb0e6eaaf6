"""Curves made of helix arcs: fitting them to strands, measuring curls.

Arcs have constant curvature and torsion and join with common tangents. Super-helices start from
them, and trackers may smooth strands by them.

* `arc_between`: the helix arc through two points with given tangents
* `arc_counts`: how many arcs a strand needs
* `arc_length`: strands as smooth curves over arc length
* `curl`: radius, pitch and handedness of curls
* `floating_tangents`: a strand as joined helix arcs
* `helix`: frames along curves of constant curvature and torsion
* `helix_strands`: strands smoothed by arcs, arcs in travelling frames
"""

from __future__ import annotations

from hairkit.helices.arc_between import helix_through
from hairkit.helices.arc_counts import adaptive_counts, patent_counts
from hairkit.helices.curl import Curl, measure_curl
from hairkit.helices.floating_tangents import Arcs, fit_arcs
from hairkit.helices.helix_strands import smooth_strands

__all__ = [
    "Arcs",
    "Curl",
    "adaptive_counts",
    "fit_arcs",
    "helix_through",
    "measure_curl",
    "patent_counts",
    "smooth_strands",
]
