"""EXIF, read and written for what reconstruction needs; invalid entries are ignored (CIPA DC-008).

The entries themselves are Pillow's work.
"""

from __future__ import annotations

import struct
import threading
import warnings
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

from PIL import Image
from PIL.ExifTags import IFD, Base
from PIL.TiffImagePlugin import IFDRational

DAMAGE = (
    OSError, SyntaxError, ValueError, LookupError, TypeError, EOFError, ArithmeticError,
    RuntimeError, struct.error,
)  # fmt: skip
"""What Pillow raises for damaged files."""
_UNIT_MM = {2: 25.4, 3: 10.0, 4: 1.0}
_MILLIMETRE = 4
"""EXIF's FocalPlaneResolutionUnit."""
_FINEST = 1_000_000
"""Largest denominator of a rational."""
_FILTERS = threading.Lock()


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


@contextmanager
def quiet_pillow() -> Iterator[None]:
    """Within, Pillow does not warn of metadata that it cannot read: they are not needed."""
    with _FILTERS, warnings.catch_warnings():  # the filters are those of all threads
        warnings.simplefilter("ignore")
        yield


def read_exif(block: bytes) -> Exif:
    """Return the facts in a TIFF-shaped EXIF block; an empty or damaged one gives the defaults."""
    main, detail = Image.Exif(), {}
    with quiet_pillow():
        try:
            main.load(block)
            detail = main.get_ifd(IFD.Exif)
        except DAMAGE:
            pass  # what was read until then counts
        orientation = _number(main, Base.Orientation, 1, 8)
        per_unit = _number(detail, Base.FocalPlaneXResolution, 1e-3, 1e9)
        unit = _UNIT_MM.get(int(_number(detail, Base.FocalPlaneResolutionUnit, 1, 9) or 2))
        pixels = [
            _number(detail, tag, 1, 2**31) for tag in (Base.ExifImageWidth, Base.ExifImageHeight)
        ]
        return Exif(
            int(orientation or 1),
            _number(detail, Base.FocalLengthIn35mmFilm, 8, 2000),
            _number(detail, Base.FocalLength, 0.5, 2000),
            per_unit / unit if per_unit is not None and unit is not None else None,
            (int(pixels[0]), int(pixels[1])) if pixels[0] and pixels[1] else None,
        )


def _number(tags: Mapping[int, Any], tag: int, low: float, high: float) -> float | None:
    """Return the number of a tag, None where there is none within the range."""
    try:
        value = float(tags[tag])
    except DAMAGE:
        return None
    return value if low <= value <= high else None


def write_exif(exif: Exif) -> bytes:
    """Return a TIFF-shaped EXIF block with what `read_exif` reads."""
    block = Image.Exif()
    block[Base.Orientation] = exif.orientation
    detail = block.get_ifd(IFD.Exif)
    if exif.focal_mm is not None:
        detail[Base.FocalLength] = _rational(exif.focal_mm)
    if exif.pixels is not None:
        detail[Base.ExifImageWidth], detail[Base.ExifImageHeight] = exif.pixels
    if exif.pixels_per_mm is not None:
        detail[Base.FocalPlaneXResolution] = _rational(exif.pixels_per_mm)
        detail[Base.FocalPlaneResolutionUnit] = _MILLIMETRE
    if exif.focal_35mm is not None:
        detail[Base.FocalLengthIn35mmFilm] = round(exif.focal_35mm)
    return block.tobytes().removeprefix(b"Exif\0\0")


def _rational(value: float) -> IFDRational:
    return IFDRational(Fraction(value).limit_denominator(_FINEST))
