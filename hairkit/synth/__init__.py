"""Procedural grooms, and photos of them with ground truth.

For tests and benchmarks, and to try hairkit without photos.

* `bust`: shoulders under a head
* `grow_ponytails`: strands that run through a tie
* `growth`: strands grown from the scalp in six styles
* `photographs`: photos, masks, landmarks and truth of a groom
"""

from __future__ import annotations

from hairkit.synth.growth import STYLES, Style, StyleName, grow
from hairkit.synth.photographs import photograph

__all__ = ["STYLES", "Style", "StyleName", "grow", "photograph"]
