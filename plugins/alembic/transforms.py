"""Transforms of Alembic objects.

Source: AbcGeom XformSample of Alembic 1.8: a stack of operations on row vectors, the last of which
acts on points first.
"""

from __future__ import annotations

import numpy as np

from hairkit.arrays import Float64Array, Int64Array

from .archive import Object
from .ogawa import Ogawa

_SCALE, _TRANSLATE, _ROTATE, _MATRIX, _ROTATE_X, _ROTATE_Y, _ROTATE_Z = range(7)
_SIZES = {_SCALE: 3, _TRANSLATE: 3, _ROTATE: 4, _MATRIX: 16}
_SIZES |= dict.fromkeys((_ROTATE_X, _ROTATE_Y, _ROTATE_Z), 1)
"""Numbers of each kind of operation; angles are in degrees."""


def compose_transform(world: Float64Array, node: Object) -> Float64Array:
    """Return (4, 4), on row vectors, what takes points under `node` to the world.

    Parameters
    ----------
    world
        (4, 4) the same for the object above.
    node
        An object; anything but a transform changes nothing.

    Raises
    ------
    FormatError
        An operation is unknown, or there are fewer numbers than operations ask for.
    """
    if not node.is_a("AbcGeom_Xform"):
        return world
    transform = node.properties().get(".xform")
    found = transform.properties() if transform else {}
    operations = found[".ops"].integers() if ".ops" in found else None
    numbers = found[".vals"].floats() if ".vals" in found else None
    inherits = found[".inherits"].integers() if ".inherits" in found else None
    own = np.eye(4)
    if operations is not None:
        numbers = np.zeros(0) if numbers is None else numbers.ravel()
        own = _stack(operations.ravel() >> 4, numbers, node.archive.file)
    with np.errstate(over="ignore", invalid="ignore"):
        return own @ world if inherits is None or inherits[0, 0] else own


def _stack(operations: Int64Array, numbers: Float64Array, file: Ogawa) -> Float64Array:
    result, at = np.eye(4), 0
    for operation in operations.tolist():
        size = _SIZES.get(operation, 0)
        if not size or at + size > len(numbers):
            raise file.error(f"transform {operation} with {len(numbers) - at} numbers left")
        with np.errstate(over="ignore", invalid="ignore"):
            result = _matrix(operation, numbers[at : at + size]) @ result
        at += size
    return result


def _matrix(operation: int, numbers: Float64Array) -> Float64Array:
    if operation == _MATRIX:
        return numbers.reshape(4, 4)
    result = np.eye(4)
    if operation == _SCALE:
        result[range(3), range(3)] = numbers
    elif operation == _TRANSLATE:
        result[3, :3] = numbers
    elif operation == _ROTATE:
        result[:3, :3] = _turn(numbers[:3], numbers[3])
    else:
        result[:3, :3] = _turn(np.eye(3)[operation - _ROTATE_X], numbers[0])
    return result


def _turn(axis: Float64Array, angle_deg: float) -> Float64Array:
    """Return (3, 3), on row vectors, a turn about an axis (Rodrigues)."""
    with np.errstate(over="ignore"):
        length = float(np.linalg.norm(axis))
    if not 0 < length < np.inf:
        return np.eye(3)
    x, y, z = axis / length
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    angle = np.radians(angle_deg)
    column = np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross
    result: Float64Array = column.T
    return result
