"""Unit, axes and handedness of an .apx file."""

from __future__ import annotations

import numpy as np

from hairkit.arrays import Float64Array

CENTIMETRES = {"cm": 1.0, "m": 100.0}
"""`sceneUnit` by the name of the unit."""
UP_AXIS = {"y_up": 1, "z_up": 2}
"""`upAxis` by the name of the option."""
RIGHT_HANDED, LEFT_HANDED = 1, 2

_Z_UP = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]])
"""Rotation from the head frame: (x, -z, y)."""
_MIRRORED = np.diag([-1.0, 1.0, 1.0])


def file_from_head(centimetres: float, up_axis: int, handedness: int) -> Float64Array:
    """Return the (3, 3) matrix from metres in the head frame; left-handed files are mirrored."""
    turn = _Z_UP if up_axis == UP_AXIS["z_up"] else np.eye(3)
    turn = turn @ _MIRRORED if handedness == LEFT_HANDED else turn
    return turn * (100.0 / centimetres)
