"""Read photos: check the header before decoding, apply the EXIF orientation.

Sizes and focal lengths are those of the upright picture, after EXIF rotation.
"""

from __future__ import annotations

import math
import os
import re
import struct
import zlib
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import numpy.typing as npt

from hairkit.arrays import UInt8Array
from hairkit.errors import FormatError, InputError
from hairkit.io.exif import Exif, clear_orientation, read_exif, scan_tiff
from hairkit.io.heic import decode_heic, is_heic, read_heic_header
from hairkit.io.webp import is_webp, scan_webp
from hairkit.storage import read_bytes

MAX_PIXELS = 64_000_000
"""Pictures with more pixels than this are refused before they are decoded."""

MAX_BYTES = 256 * 2**20
"""Files larger than this are refused unread."""

PHOTO_KINDS = ("JPEG", "PNG", "WebP", "TIFF", "HEIC")
"""Kinds of pictures that are read."""

PHOTOS_TAKEN = f"a {', '.join(PHOTO_KINDS[:-1])} or {PHOTO_KINDS[-1]} photo"
"""The same as words of a message."""

FILM_DIAGONAL_MM = math.hypot(36.0, 24.0)
"""Diagonal of the 35 mm film frame, to which equivalent focal lengths refer (CIPA DCG-001)."""

_CROPPED = 0.02
"""Relative change of the aspect ratio since the picture was taken; more means it was cropped."""
_KINDS = {
    b"\xff\xd8\xff": "JPEG",
    b"\x89PNG\r\n\x1a\n": "PNG",
    b"GIF8": "GIF",
    b"BM": "BMP",
    b"II*\0": "TIFF",
    b"MM\0*": "TIFF",
    b"%PDF": "PDF",
}
_FILL, _START_OF_IMAGE, _END_OF_IMAGE, _START_OF_SCAN, _EXIF_SEGMENT = 0xFF, 0xD8, 0xD9, 0xDA, 0xE1
"""Second bytes of JPEG's markers (ITU-T T.81, table B.1); the first is the fill byte."""
_RESTARTS = range(0xD0, 0xD8)
_JPEG_FRAMES = frozenset(range(0xC0, 0xD0)) - {0xC4, 0xC8, 0xCC}
_SEQUENTIAL_FRAMES = (0xC0, 0xC1)
"""Kinds of frame with one scan of Huffman codes for all coefficients of a block."""
_MARKER = re.compile(rb"\xff+[^\x00\xff]")
"""A marker within picture data, where 255 is followed by 0."""
_PADDING = np.random.default_rng(0).integers(0, 255, 64, np.uint8).tobytes()
"""Noise that holds no marker, long enough for the data of several blocks."""
_AS_STORED = cv2.IMREAD_IGNORE_ORIENTATION
_THUMBNAIL = cv2.IMREAD_REDUCED_GRAYSCALE_8
_MID_GREY, _BLOCK = 128, 4
"""Value of blocks without data, and the edge of a block of 8 pixels at half its size."""
_MISSING = "some of its picture data is missing"
_CHANNELS = {0: 1, 2: 3, 3: 1, 4: 2, 6: 4}
"""Samples of a pixel by PNG's colour type."""


@dataclass(frozen=True)
class PhotoHeader:
    """Facts from the header of a picture file."""

    kind: str
    """One of `PHOTO_KINDS`."""
    width: int
    """Width in pixels after EXIF rotation."""
    height: int
    """Height in pixels after EXIF rotation."""
    exif: Exif

    @property
    def focal_px(self) -> float | None:
        """Focal length in pixels of the whole picture, or None when EXIF does not tell."""
        sides = sorted((self.width, self.height))
        taken = sorted(self.exif.pixels) if self.exif.pixels is not None else sides
        if abs(taken[0] * sides[1] - taken[1] * sides[0]) > _CROPPED * taken[1] * sides[1]:
            return None  # cropped after it was taken: the lens's field of view is gone
        if self.exif.focal_35mm is not None:
            return focal_from_equivalent(self.exif.focal_35mm, self.width, self.height)
        if self.exif.focal_mm is not None and self.exif.pixels_per_mm is not None:
            return self.exif.focal_mm * self.exif.pixels_per_mm * sides[1] / taken[1]
        return None


def focal_from_equivalent(focal_mm: float, width: int, height: int) -> float:
    """Return the focal length in pixels of a 35 mm equivalent one: equal diagonal angle of view.

    >>> round(focal_from_equivalent(47.83, 810, 1080))
    1492
    """
    return focal_mm / FILM_DIAGONAL_MM * math.hypot(width, height)


def read_header(path: str | os.PathLike[str]) -> PhotoHeader:
    """Return what the picture's header says; `InputError` when it is unusable."""
    return _header(read_bytes(path, MAX_BYTES), Path(path))


def read_photo(
    path: str | os.PathLike[str], max_edge: int | None = None
) -> tuple[UInt8Array, PhotoHeader]:
    """Return a photo as RGB, upright, and its header.

    Parameters
    ----------
    path
        A JPEG, PNG, WebP or TIFF file, or a HEIC file where pillow-heif is installed. 16 bits
        become 8, grey becomes RGB, transparency is ignored.
    max_edge
        Larger pictures are scaled down so that their long edge has this many pixels.

    Returns
    -------
    image
        (H, W, 3) uint8 RGB.
    header
        Size and focal length of the photo as it is on disk.

    Raises
    ------
    InputError
        The file is missing, no picture, damaged, or has more than `MAX_PIXELS` pixels.
    """
    data = read_bytes(path, MAX_BYTES)
    header = _header(data, Path(path))
    scale = min(1.0, (max_edge or math.inf) / max(header.width, header.height))
    # a JPEG decoder halves pictures almost for free; never below the size that is wanted
    mode = cv2.IMREAD_REDUCED_COLOR_2 if scale <= 0.5 else cv2.IMREAD_COLOR
    image = _decode(data, mode, Path(path))[..., ::-1]
    upright = _upright(image, header.exif.orientation)
    if scale < 1:
        size = [max(1, round(edge * scale)) for edge in (header.width, header.height)]
        upright = cv2.resize(upright, size, interpolation=cv2.INTER_AREA).astype(
            np.uint8, copy=False
        )
    return upright, header


def decode_picture(data: bytes, source: str | os.PathLike[str]) -> UInt8Array:
    """Return the (H, W, 3) RGB pixels of a picture file's bytes, not turned by its EXIF tags.

    Raises what `read_photo` raises, naming `source`.
    """
    _header(data, Path(source))
    return np.ascontiguousarray(_decode(data, cv2.IMREAD_COLOR, Path(source))[..., ::-1])


def read_drawing(path: str | os.PathLike[str]) -> UInt8Array:
    """Return the single channel (H, W) of a drawn PNG, such as a mask, its values untouched.

    A drawing with transparency is its alpha channel; a coloured one is refused with `InputError`.
    """
    data = read_bytes(path, MAX_BYTES)
    if _header(data, Path(path)).kind != "PNG":
        raise InputError(f"{path}: masks must be PNG files, because JPEG smears their labels")
    pixels = _decode(data, cv2.IMREAD_UNCHANGED, Path(path))
    if pixels.dtype != np.uint8:
        pixels = (pixels >> 8).astype(np.uint8)
    if pixels.ndim == 2:
        return pixels
    if pixels.shape[2] == 4 and (pixels[..., 3] != 255).any():
        return np.ascontiguousarray(pixels[..., 3])
    if (pixels[..., :3] != pixels[..., :1]).any():
        raise InputError(f"{path}: a coloured picture, expected a mask in shades of grey")
    return np.ascontiguousarray(pixels[..., 0])


def _header(data: bytes, path: Path) -> PhotoHeader:
    kind = _kind(data)
    if kind not in PHOTO_KINDS:
        raise FormatError(f"{path}: {kind}, expected {PHOTOS_TAKEN}; save it as one of these")
    try:
        width, height, exif_block = _scan(kind, data, str(path))
    except FormatError:
        raise
    except (struct.error, IndexError, ValueError) as error:
        raise FormatError(f"{path}: damaged {kind} file; save it again") from error
    if width * height > MAX_PIXELS or not width * height:
        raise InputError(
            f"{path}: {width} x {height} pixels, expected 1 to {MAX_PIXELS} in all; scale it down"
        )
    exif = read_exif(exif_block)
    if kind == "HEIC":
        exif = replace(exif, orientation=1)  # the decoder turns the picture by the file's own tag
    if exif.orientation >= 5:
        width, height = height, width
    return PhotoHeader(kind, width, height, exif)


def _scan(kind: str, data: bytes, where: str) -> tuple[int, int, bytes]:
    """Return width and height as stored, and the EXIF block, by the kind of the file."""
    if kind == "HEIC":
        return read_heic_header(data, where)
    if kind == "WebP":
        return scan_webp(data, where)
    if kind == "TIFF":
        return (*scan_tiff(data, where), data)  # EXIF has TIFF's own tags
    return _scan_jpeg(data) if kind == "JPEG" else _scan_png(data)


def _kind(data: bytes) -> str:
    if not data:
        return "an empty file"
    if is_heic(data):
        return "HEIC"
    if data[4:8] == b"ftyp":
        return "AVIF or a video"
    if is_webp(data):
        return "WebP"
    named = (kind for start, kind in _KINDS.items() if data.startswith(start))
    return next(named, "not a picture")


def _scan_jpeg(data: bytes) -> tuple[int, int, bytes]:
    """Return width, height and the EXIF block of a JPEG file; `ValueError` when it is cut short."""
    position, exif, size = 2, b"", (0, 0)
    while True:
        while data[position + 1] == _FILL:
            position += 1
        marker, (length,) = data[position + 1], struct.unpack_from(">H", data, position + 2)
        if data[position] != _FILL or length < 2:
            raise ValueError("no marker")
        block = data[position + 4 : position + 2 + length]
        if marker in _JPEG_FRAMES:
            height, width = struct.unpack_from(">HH", block, 1)
            size = (width, height)
        elif marker == _EXIF_SEGMENT and block.startswith(b"Exif\0\0"):
            exif = exif or block[6:]
        elif marker == _START_OF_SCAN:
            break
        position += 2 + length
    return (*size, exif)


def _loses_data(data: bytes, pixels: npt.NDArray[Any]) -> bool:
    """Return whether some of a sequential JPEG file's picture data is missing.

    Decoders fill what is missing with mid-grey blocks, up to the end of a scan or restart interval.
    Where a picture ends so, or has such blocks in one of many intervals, it is decoded once as it
    is and once with noise after the data of each: a decoder that has all its data ignores what
    follows, one that lacks some uses it. (This is not done to every picture, because the decoder
    prints a warning about the noise.)
    """
    pieces, frame = _jpeg_pieces(data)
    one_run = len(pieces) == 2  # the other one is the end of the file
    grey = (pixels[-1, -1] == _MID_GREY).all() if one_run else _has_grey_block(pixels)
    if frame not in _SEQUENTIAL_FRAMES or not grey:
        return False
    whole, padded = (
        cv2.imdecode(np.frombuffer(each, np.uint8), _THUMBNAIL | _AS_STORED)
        for each in (data, _PADDING.join(pieces))
    )
    return whole is None or padded is None or not np.array_equal(whole, padded)


def _has_grey_block(pixels: npt.NDArray[Any]) -> bool:
    """Return whether a block of a picture, which may be decoded at half its size, is mid-grey."""
    rows, columns = (edge // _BLOCK for edge in pixels.shape[:2])
    grey = (pixels[: rows * _BLOCK, : columns * _BLOCK] == _MID_GREY).all(axis=-1)
    return bool(grey.reshape(rows, _BLOCK, columns, _BLOCK).all(axis=(1, 3)).any())


def _jpeg_pieces(data: bytes) -> tuple[list[bytes], int]:
    """Return a JPEG file cut at the end of each run of picture data, and the kind of its frame.

    Raises `ValueError`, `IndexError` or `struct.error` when the file ends before its picture does.
    """
    pieces: list[bytes] = []
    begin, position, frame = 0, 2, 0
    while True:
        while data[position + 1] == _FILL:
            position += 1
        start, marker = data[position : position + 2]
        if start != _FILL or marker == _START_OF_IMAGE:
            raise ValueError("no marker")
        if marker == _END_OF_IMAGE:
            return [*pieces, data[begin:]], frame
        if marker in _JPEG_FRAMES:
            frame = marker
        if marker not in _RESTARTS:
            (length,) = struct.unpack_from(">H", data, position + 2)
            position += length
        position += 2
        if marker == _START_OF_SCAN or marker in _RESTARTS:
            end = _MARKER.search(data, position)
            if end is None:
                raise ValueError("no end marker")
            position = end.start()
            pieces.append(data[begin:position])
            begin = position


def _scan_png(data: bytes) -> tuple[int, int, bytes]:
    """Return width, height and the EXIF block of a PNG file; `ValueError` when it is damaged."""
    if data[12:16] != b"IHDR":
        raise ValueError("no IHDR")
    width, height = struct.unpack_from(">II", data, 16)
    position, exif = 8, b""
    while True:
        (length,) = struct.unpack_from(">I", data, position)
        name, end = data[position + 4 : position + 8], position + 8 + length
        if struct.unpack_from(">I", data, end) != (zlib.crc32(data[position + 4 : end]),):
            raise ValueError("a chunk's checksum is wrong")
        if name == b"eXIf":
            exif = data[position + 8 : end]
        if name == b"IEND":
            return width, height, exif
        position = end + 4


def _decode(data: bytes, mode: int, path: Path) -> UInt8Array:
    kind = _kind(data)
    try:
        if kind == "HEIC":
            return decode_heic(data, str(path))[..., ::-1]
        if kind == "PNG":
            _check_png_data(data)
        if kind == "TIFF":
            data = clear_orientation(data)
        pixels = cv2.imdecode(np.frombuffer(data, np.uint8), mode | _AS_STORED)
        if pixels is None:
            raise ValueError("it cannot be decoded")
        if kind == "JPEG" and _loses_data(data, pixels):
            raise ValueError(_MISSING)
    except (struct.error, IndexError, ValueError, cv2.error) as error:
        reason = str(error).partition("\n")[0]
        raise FormatError(f"{path}: damaged {kind} file ({reason}); save it again") from error
    return pixels  # type: ignore[return-value]  # uint8, or uint16 for IMREAD_UNCHANGED


def _check_png_data(data: bytes) -> None:
    """Raise `ValueError` when a PNG file's packed data is not of the size of its picture."""
    width, height, depth, colour = struct.unpack_from(">IIBB", data, 16)
    interlaced = data[28] != 0
    row = -(-width * depth * _CHANNELS.get(colour, 4) // 8)
    least = height * (row + (not interlaced))  # each row has a filter byte, interlaced ones more
    most = height * (1 + 8 * width) + 8 * (height + 8)  # 16 bit RGBA, a filter byte a row and pass
    inflate, position, found = zlib.decompressobj(), 8, 0
    while data[position + 4 : position + 8] != b"IEND":
        (length,) = struct.unpack_from(">I", data, position)
        if data[position + 4 : position + 8] == b"IDAT":
            packed = data[position + 8 : position + 8 + length]
            try:
                found += len(inflate.decompress(packed, most + 1 - found))
            except zlib.error as error:
                raise ValueError(f"its picture data cannot be unpacked: {error}") from error
            if found > most:
                raise ValueError("it unpacks to more than its picture holds")
        position += 12 + length
    if found < least or not inflate.eof:
        raise ValueError(_MISSING)


def _upright(image: UInt8Array, orientation: int) -> UInt8Array:
    """Undo the camera's rotation; `orientation` is EXIF's 1 to 8."""
    turned = image.swapaxes(0, 1) if orientation >= 5 else image
    flips = {2: (1, -1), 3: (-1, -1), 4: (-1, 1), 6: (1, -1), 7: (-1, -1), 8: (-1, 1)}
    down, across = flips.get(orientation, (1, 1))
    return np.ascontiguousarray(turned[::down, ::across])
