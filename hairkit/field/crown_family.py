"""Which way the hair on the crown is combed, from the directions that all views see on the scalp.

A level view sees the crown at a grazing angle: that places a parting only to 2 cm, but it does tell
the families apart. Directions have no sign. Hair that crosses the hairline in front is a fringe if
it covers the forehead below, and else is combed back.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from hairkit.field.parting import FRONT_FADE, comb_from_parting, front_share
from hairkit.field.scalp_sight import LEAST_FACING, ScalpSight, look_at
from hairkit.types.camera import Camera
from hairkit.types.head import Head
from hairkit.types.mask import Mask
from hairkit.types.parting import Parting

CROWN = 0.06
"""Height below the top of the head above which directions count, metres."""
LEAST_AGREEMENT, FULL_AGREEMENT = 0.5, 0.9
"""Mean cosine of twice the angle between the hair and a family's comb from which the family counts
at all and for sure: 0.69 to 0.92 on parted heads, at most 0.15 on others."""
WHORL_MARGIN = 0.2
"""By how much a whorl must agree better than a parting: 0.76 on a whorl, at most 0.08 on partings,
behind whose ends hair runs from a whorl too."""
LEAST_ACROSS = 0.5
"""The same of hair that crosses the hairline in front: 0.73 to 0.92 on fringes and hair that is
combed back, at most 0.17 elsewhere."""
FOREHEAD, FOREHEAD_WIDTH = 0.03, 0.04
"""Height of the forehead below the hairline that a fringe covers, and half its width, metres."""
LEAST_COVERED = 0.5
"""Share of it that is hair below a fringe: 0.95 to 1 there, 0 to 0.33 elsewhere."""
PARTINGS = np.arange(-0.04, 0.041, 0.005)
"""Places of partings that are compared, metres to the subject's left."""
WHORLS = tuple((x, z) for x in np.arange(-0.03, 0.031, 0.01) for z in np.arange(-0.08, 0.021, 0.01))
"""Places x, z of whorls that are compared, metres; one at the back end is a nape, no whorl."""


def choose_family(
    skin: Parting,
    sight: ScalpSight,
    masks: Sequence[Mask],
    cameras: Sequence[Camera],
    head: Head,
) -> Parting:
    """Return how the crown is combed: by the skin that shows a parting, else by directions.

    Hair combed back shows skin too, along its hairline, so directions count first there. From a
    whorl hair runs forward as well.
    """
    across = _across_hairline(sight, head)
    crown = sight.at(sight.places[:, 1] > float(head.vertices[:, 1].max()) - CROWN)
    found, score = (skin, FULL_AGREEMENT) if skin.seen else _best_family(skin, crown, head)
    if across < LEAST_ACROSS or found.whorl is not None:
        return replace(found, sureness=_sureness(score))
    if forehead_covered(masks, cameras, head) < LEAST_COVERED:
        return Parting(swept_back=True, skin_share=skin.skin_share, sureness=_sureness(across))
    return replace(found, fringe=True, sureness=min(_sureness(across), _sureness(score)))


def _best_family(skin: Parting, crown: ScalpSight, head: Head) -> tuple[Parting, float]:
    """Return the parting or the whorl that agrees best, and how well; neither if none does."""
    line, parted = _best([Parting.at(float(x), skin.skin_share) for x in PARTINGS], crown, head)
    whorls = [Parting(whorl=np.array(place), skin_share=skin.skin_share) for place in WHORLS]
    whorl, star = _best(whorls, crown, head)
    at_nape = whorl.whorl is not None and whorl.whorl[1] <= WHORLS[0][1]
    if star > max(parted + WHORL_MARGIN, LEAST_AGREEMENT) and not at_nape:
        return whorl, star
    return (line, parted) if parted >= LEAST_AGREEMENT else (skin, FULL_AGREEMENT)


def _best(family: list[Parting], sight: ScalpSight, head: Head) -> tuple[Parting, float]:
    scores = [_agreement(sight, head, parting) for parting in family]
    best = int(np.argmax(scores))
    return family[best], scores[best]


def _agreement(sight: ScalpSight, head: Head, parting: Parting) -> float:
    return sight.agreement(comb_from_parting(parting, head, sight.places, sight.normals))


def _across_hairline(sight: ScalpSight, head: Head) -> float:
    """Return how well the hair above the forehead agrees with a comb forward (or back)."""
    front = sight.at(front_share(head, sight.places) >= 1)
    return _agreement(front, head, Parting(fringe=True))


def forehead_covered(masks: Sequence[Mask], cameras: Sequence[Camera], head: Head) -> float:
    """Return the share of the forehead below the hairline that the views see as hair."""
    scalp = head.vertices[head.scalp > 0.5]
    foremost = float(scalp[:, 2].max())
    hairline = float(scalp[scalp[:, 2] > foremost - FRONT_FADE, 1].min())
    vertices, normals = head.vertices.astype(np.float64), head.normals()
    below = (vertices[:, 1] < hairline) & (vertices[:, 1] > hairline - FOREHEAD)
    chosen = below & (np.abs(vertices[:, 0]) < FOREHEAD_WIDTH) & (normals[:, 2] > LEAST_FACING)
    hair, seen = 0.0, 0.0
    for mask, camera in zip(masks, cameras, strict=True):
        weight, row, column = look_at(mask, camera, vertices[chosen], normals[chosen], LEAST_FACING)
        hair += float((weight * mask.hair[row, column]).sum())
        seen += float(weight.sum())
    return hair / max(seen, 1e-9)


def _sureness(score: float) -> float:
    """Return 0 at the least agreement, 1 at full agreement."""
    share = (score - LEAST_AGREEMENT) / (FULL_AGREEMENT - LEAST_AGREEMENT)
    return float(np.clip(share, 0.0, 1.0))
