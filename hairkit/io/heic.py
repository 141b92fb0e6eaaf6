"""HEIC photos, by the optional library pillow-heif: `pip install 'hairkit[heic]'`."""

from __future__ import annotations

from typing import Any

import numpy as np

from hairkit.arrays import UInt8Array
from hairkit.errors import MissingExtraError

BRANDS = (b"heic", b"heix", b"heim", b"heis", b"hevc", b"hevx", b"mif1", b"msf1")
"""Major brands of HEIF files that hold a still picture coded by HEVC (ISO/IEC 23008-12)."""
_EXIF = b"Exif\0\0"


def is_heic(data: bytes) -> bool:
    """Return whether a file begins as HEIC files do."""
    return data[4:8] == b"ftyp" and data[8:12] in BRANDS


def read_heic_header(data: bytes, where: str) -> tuple[int, int, bytes]:
    """Return width and height of the upright picture, and its EXIF block (TIFF), maybe empty.

    The rotation of the EXIF block does not hold for HEIC: the file's own, which the decoder
    applies, does.

    Raises
    ------
    MissingExtraError
        pillow-heif is not installed; the message begins with `where`.
    ValueError
        The file is damaged.
    """
    picture = _open(data, where)
    exif = picture.info.get("exif") or b""
    return (*picture.size, exif.removeprefix(_EXIF))


def decode_heic(data: bytes, where: str) -> UInt8Array:
    """Return the upright picture (H, W, 3) uint8 RGB; raises as `read_heic_header`."""
    picture = _open(data, where)
    try:
        pixels = np.asarray(picture)  # decodes it
    except (OSError, RuntimeError, SyntaxError) as error:
        raise ValueError(str(error)) from error
    return np.ascontiguousarray(pixels[..., :3])


def _open(data: bytes, where: str) -> Any:
    try:
        import pillow_heif
    except ImportError as error:
        raise MissingExtraError(
            f"{where}: HEIC photos need pillow-heif: pip install 'hairkit[heic]', or save as JPEG"
        ) from error
    try:
        return pillow_heif.open_heif(data, convert_hdr_to_8bit=True)
    except (OSError, RuntimeError, SyntaxError, EOFError) as error:
        raise ValueError(str(error)) from error
