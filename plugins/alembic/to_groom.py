"""A groom of the curves of an Alembic file, in the head frame."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from hairkit.errors import FormatError
from hairkit.grooming.adopt_strands import adopt, plain_widths
from hairkit.grooming.curve_sets import join_sets, strands_of
from hairkit.types.groom import Groom

from .curve_sets import read_curve_sets
from .options import Options

_FARTHEST = 1e6


def read_groom(path: Path, options: Options) -> Groom:
    """Return all curves of a file as one groom, at the first frame.

    Raises
    ------
    FormatError
        The file is damaged or has no curves of two or more points.
    InputError
        The file is missing, or its unit cannot be right.
    """
    found, space = join_sets(read_curve_sets(path)), options.space
    with np.errstate(over="ignore", invalid="ignore"):
        points = space.points_to_head(found.points)
    if not np.abs(points).max(initial=0) < _FARTHEST:
        raise FormatError(f"{path}: points lie farther away than {_FARTHEST:g} m; give its unit")
    widths = found.widths
    if widths is not None:
        widths = plain_widths(widths, space.metres, path)
    strands, _ = strands_of(replace(found, points=points, widths=widths), path)
    return adopt(strands, options, path)
