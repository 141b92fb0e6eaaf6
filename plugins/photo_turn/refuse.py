"""What is no turn around one head is refused, each with the photo and the reason."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from hairkit import View
from hairkit.arrays import Float64Array
from hairkit.errors import InputError
from hairkit.imaging.person_outline import Outline

from .appearance import thumbnails_alike
from .arrangement import Placed, wrap

COPIES, TWINS = 0.955, 0.985
"""Correlation of thumbnails: the median over all pairs above which all photos are copies of one,
and that of a pair above which two are. The heads in different photos of 34 turns correlate by 0.06
to 0.81 in the median, those of a dark person with a black bob by 0.92, and by 0.98 at most; copies
with other exposure, cropped by 4 %, by 0.977 to 1. Whole photos of a person before a white wall
correlate by 0.945 in the median."""
BACK_DEG = 100.0
"""Some photo is taken from within this of the back."""
SIDE_ONLY_DEG = 180.0 - BACK_DEG
"""Azimuth of the photos that are not."""
OFF_DEG, NAMED_OFF_DEG = 45.0, 50.0
"""Faces farther than this from where the turn, or a photo's name, has them contradict it."""
FRONTAL_DEG = 50.0
"""Faces are mistaken for others beyond this yaw."""
DISTINCT_MOMENT = 0.02
"""Sideways moment of skin in oblique views, head widths, from which on it tells the back from the
sides; that of bald men does not."""
SIDE_SHARE, SIDE_MOMENT = 0.55, 0.5
"""Photos of the side show at least these shares of the front's skin and of its largest moment."""
CLOTHES_APART, CLOTHES_RATIO, CLOTHES_NOISE = 0.2, 4.5, 0.03
"""Two groups of photos show two people if their clothes differ by the first in log chromaticity,
and by the second times the spread within the groups plus the third. The ratio is 0.1 to 0.9 in ten
turns, 3.6 in one whose masks take in the wall; 30 of 56 mixtures of unlike clothes are beyond."""
CLOTHES_PALER = 0.5
"""Clothes are as pale as this share of their colour where light shines on them."""
FEWEST_OF_ONE = 2
"""A group has at least so many photos: one alone may be badly lit."""


class NoBackError(InputError):
    """No photo shows the back of the head."""


def find_copies(views: Sequence[View], outlines: Sequence[Outline | None]) -> list[tuple[int, int]]:
    """Return pairs of equal photos; `InputError` when all photos are copies of one."""
    alike = thumbnails_alike([view.image for view in views], outlines)
    first, second = np.triu_indices(len(views), 1)
    pairs = alike[first, second]
    if len(pairs) and np.median(pairs) > COPIES:
        i, j = first[pairs.argmax()], second[pairs.argmax()]
        raise InputError(
            f"{views[j].photo_name}: a copy of {views[i].photo_name}, as most of the"
            f" {len(views)} photos are; take photos from all around the head"
        )
    return [(int(first[pair]), int(second[pair])) for pair in np.nonzero(pairs > TWINS)[0]]


def check_one_person(views: Sequence[View], clothes: Float64Array) -> None:
    """Raise `InputError` when the clothes (V, 2) in two groups of photos are of two people."""
    known = np.nonzero(np.isfinite(clothes).all(axis=1))[0]
    if len(known) < 2 * FEWEST_OF_ONE:
        return
    colours = clothes[known] - clothes[known].mean(axis=0)
    along = np.argsort(colours @ np.linalg.svd(colours, full_matrices=False)[2][0])
    for cut in range(FEWEST_OF_ONE, len(known) - FEWEST_OF_ONE + 1):
        groups = along[:cut], along[cut:]
        middles = np.array([colours[group].mean(axis=0) for group in groups])
        pale, full = sorted(middles, key=lambda colour: float(np.linalg.norm(colour)))
        share = np.clip(pale @ full / max(full @ full, 1e-9), CLOTHES_PALER, 1.0)
        apart = float(np.linalg.norm(pale - share * full))
        squares = [((colours[g] - m) ** 2).sum() for g, m in zip(groups, middles, strict=True)]
        within = float(np.sqrt(sum(squares) / len(known)))
        if apart > max(CLOTHES_APART, CLOTHES_RATIO * (within + CLOTHES_NOISE)):
            one, other = sorted(min(views[i].photo_name for i in known[group]) for group in groups)
            raise InputError(
                f"{other}: wears other clothes than {one}; give photos of one person, or name the"
                " views in capture.toml"
            )


def contradicting(yaw_deg: Float64Array, azimuth_deg: Float64Array) -> int | None:
    """Return the photo whose face contradicts its name most plainly, or None."""
    off = np.abs(wrap(np.where(np.abs(yaw_deg) <= FRONTAL_DEG, yaw_deg - azimuth_deg, 0.0)))
    return int(off.argmax()) if off.max() > NAMED_OFF_DEG else None


def check_turn(
    views: Sequence[View], placed: Placed, yaw_deg: Float64Array, skin: Float64Array | None
) -> None:
    """Raise `InputError` when the best arrangement is no turn around one head."""
    _check_back(views, placed)
    if skin is not None:
        _check_sides(views, placed, yaw_deg, np.nan_to_num(skin))
    off = np.where(np.abs(yaw_deg) <= FRONTAL_DEG, np.abs(placed.off_deg), 0.0)
    if off.max() > OFF_DEG:
        worst = int(off.argmax())
        raise InputError(
            f"{views[worst].photo_name}: its face is turned by {yaw_deg[worst]:.0f} degrees, where"
            f" the other photos leave room at {yaw_deg[worst] - placed.off_deg[worst]:.0f};"
            " give photos of one turn around one head"
        )


def _check_back(views: Sequence[View], placed: Placed) -> None:
    """Refuse photos that are all from the front."""
    ring = np.nonzero(~placed.above)[0]
    last = int(ring[np.abs(placed.azimuth_deg[ring]).argmax()])
    if abs(placed.azimuth_deg[last]) < SIDE_ONLY_DEG:
        _refuse_back(views, last, f"at about {abs(placed.azimuth_deg[last]):.0f} degrees")


def _check_sides(
    views: Sequence[View], placed: Placed, yaw_deg: Float64Array, skin: Float64Array
) -> None:
    """Refuse turns whose photos without a face all show as much skin as the side of a head."""
    faces = np.isfinite(yaw_deg) & ~placed.above
    others = ~faces & ~placed.above
    share, moment = skin[:, 0], np.abs(skin[:, 1])
    largest = moment[faces].max()
    if not others.any() or largest < DISTINCT_MOMENT:
        return
    sides = (share > SIDE_SHARE * share[faces].max()) & (moment > SIDE_MOMENT * largest)
    if sides[others].all():
        _refuse_back(views, int(np.nonzero(others)[0][share[others].argmin()]), "from the side")


def _refuse_back(views: Sequence[View], nearest: int, where: str) -> None:
    raise NoBackError(
        f"{views[nearest].photo_name}: of {len(views)} photos this is nearest to the back of the"
        f" head, and it is {where}; add photos from behind"
    )
