"""Read the EXIF tags that reconstruction needs: orientation, focal length, sensor size.

EXIF is a TIFF directory (CIPA DC-008); invalid entries are ignored.
"""

from __future__ import annotations

import math
import struct
from dataclasses import dataclass

_ORIENTATION, _EXIF_POINTER = 0x0112, 0x8769
_FOCAL, _FOCAL_35MM = 0x920A, 0xA405
_PIXELS_X, _PIXELS_Y = 0xA002, 0xA003
_PLANE_X, _PLANE_UNIT = 0xA20E, 0xA210
_FORMATS = {3: "H", 4: "I", 5: "II"}
"""TIFF types that are read: short, long, rational."""
_UNIT_MM = {2: 25.4, 3: 10.0, 4: 1.0}
_MAX_ENTRIES = 512


@dataclass(frozen=True)
class Exif:
    """Values of a photo's EXIF block; None where a value is missing or unusable."""

    orientation: int = 1
    """1 to 8; 1 is upright."""
    focal_35mm: float | None = None
    """35 mm equivalent focal length in mm."""
    focal_mm: float | None = None
    """True focal length in mm."""
    pixels_per_mm: float | None = None
    """Pixels on one millimetre of the sensor."""
    pixels: tuple[int, int] | None = None
    """Width and height when the photo was taken."""


def read_exif(block: bytes) -> Exif:
    """Return the facts in a TIFF-shaped EXIF block; an empty or damaged one gives the defaults."""
    order = {b"II*\0": "<", b"MM\0*": ">"}.get(block[:4])
    if order is None:
        return Exif()
    main = _directory(block, order, _number(block, order, 4))
    detail = _directory(block, order, int(main.get(_EXIF_POINTER, 0)))
    orientation = int(main.get(_ORIENTATION, 1))
    per_unit = _within(detail.get(_PLANE_X), 1e-3, 1e9)
    unit = _UNIT_MM.get(int(detail.get(_PLANE_UNIT, 2)))
    pixels = int(detail.get(_PIXELS_X, 0)), int(detail.get(_PIXELS_Y, 0))
    return Exif(
        orientation if 1 <= orientation <= 8 else 1,
        _within(detail.get(_FOCAL_35MM), 8, 2000),
        _within(detail.get(_FOCAL), 0.5, 2000),
        per_unit / unit if per_unit is not None and unit is not None else None,
        pixels if min(pixels) > 0 else None,
    )


def _directory(block: bytes, order: str, start: int) -> dict[int, float]:
    """Return the first number of every entry of the TIFF directory at `start`, by tag."""
    if not 8 <= start <= len(block) - 2:
        return {}
    (count,) = struct.unpack_from(order + "H", block, start)
    values: dict[int, float] = {}
    for index in range(min(count, _MAX_ENTRIES)):
        entry = start + 2 + 12 * index
        if entry + 12 > len(block):
            break
        tag, kind, _ = struct.unpack_from(order + "HHI", block, entry)
        if kind not in _FORMATS:
            continue
        place = _number(block, order, entry + 8) if kind == 5 else entry + 8
        size = struct.calcsize(order + _FORMATS[kind])
        if place + size > len(block):
            continue
        numbers = struct.unpack_from(order + _FORMATS[kind], block, place)
        value = numbers[0] / (numbers[1] or math.inf) if kind == 5 else numbers[0]
        values.setdefault(tag, value)
    return values


def _number(block: bytes, order: str, place: int) -> int:
    return int(struct.unpack_from(order + "I", block, place)[0]) if place + 4 <= len(block) else 0


def _within(value: float | None, low: float, high: float) -> float | None:
    return value if value is not None and low <= value <= high else None
