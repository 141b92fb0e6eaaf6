"""Read photos: check the header before decoding, apply the EXIF orientation.

Sizes and focal lengths are those of the upright picture, after EXIF rotation.
"""

from __future__ import annotations

import io
import math
import os
import re
import struct
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import numpy.typing as npt
from PIL import Image, ImageFile
from PIL.JpegImagePlugin import JpegImageFile
from PIL.PngImagePlugin import PngImageFile
from PIL.TiffImagePlugin import ImageFileDirectory_v2, TiffImageFile
from PIL.WebPImagePlugin import WebPImageFile

from hairkit.arrays import UInt8Array
from hairkit.errors import FormatError, InputError
from hairkit.io.exif import DAMAGE, Exif, quiet_pillow, read_exif
from hairkit.io.heic import decode_heic, is_heic, read_heic_header
from hairkit.io.png_chunks import SIGNATURE, check_png_data, scan_png
from hairkit.storage import read_bytes
from hairkit.types.capture import focal_from_equivalent

MAX_PIXELS = 64_000_000
"""Pictures with more pixels than this are refused before they are decoded."""
MAX_BYTES = 256 * 2**20
"""Files larger than this are refused unread."""
PHOTO_KINDS = ("JPEG", "PNG", "WebP", "TIFF", "HEIC")
"""Kinds of pictures that are read."""
PHOTOS_TAKEN = f"a {', '.join(PHOTO_KINDS[:-1])} or {PHOTO_KINDS[-1]} photo"
"""The same as words of a message."""
_CROPPED = 0.02
"""Relative change of the aspect ratio since the picture was taken; more means it was cropped."""
_KINDS = {
    b"\xff\xd8\xff": "JPEG",
    SIGNATURE: "PNG",
    b"GIF8": "GIF",
    b"BM": "BMP",
    b"II*\0": "TIFF",
    b"MM\0*": "TIFF",
    b"%PDF": "PDF",
}
_READERS: dict[str, type[ImageFile.ImageFile]] = {
    "JPEG": JpegImageFile,
    "PNG": PngImageFile,
    "WebP": WebPImageFile,
    "TIFF": TiffImageFile,
}
_TURNED = ("HEIC", "TIFF")
"""Kinds whose readers turn the picture by themselves."""
_SIZE, _TILE_EDGES = {256, 257}, (322, 323)
_BITS, _PHOTOMETRIC, _SAMPLE_FORMAT, _DNG_VERSION = 258, 262, 339, 50706
"""Tags of TIFF (TIFF 6.0, 1992)."""
_GREY_AND_RGB = (0, 1, 2)
"""Photometric interpretations: white is zero, black is zero, RGB."""
_FILL, _START_OF_IMAGE, _END_OF_IMAGE, _START_OF_SCAN = 0xFF, 0xD8, 0xD9, 0xDA
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
    image = _decode(data, Path(path), half=scale <= 0.5)
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
    return _decode(data, Path(source))


def read_drawing(path: str | os.PathLike[str]) -> UInt8Array:
    """Return the single channel (H, W) of a drawn PNG, such as a mask, its values untouched.

    A drawing with transparency is its alpha channel; a coloured one is refused with `InputError`.
    """
    data = read_bytes(path, MAX_BYTES)
    if _header(data, Path(path)).kind != "PNG":
        raise InputError(f"{path}: masks must be PNG files, because JPEG smears their labels")
    pixels = _decode(data, Path(path), mode="RGBA")
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
    except Image.DecompressionBombError as error:
        raise InputError(f"{path}: more than {MAX_PIXELS} pixels; scale it down") from error
    except DAMAGE as error:
        raise FormatError(f"{path}: damaged {kind} file; save it again") from error
    if width * height > MAX_PIXELS or not width * height:
        raise InputError(
            f"{path}: {width} x {height} pixels, expected 1 to {MAX_PIXELS} in all; scale it down"
        )
    exif = read_exif(exif_block)
    if kind in _TURNED:
        exif = replace(exif, orientation=1)
    if exif.orientation >= 5:
        width, height = height, width
    return PhotoHeader(kind, width, height, exif)


def _scan(kind: str, data: bytes, where: str) -> tuple[int, int, bytes]:
    """Return width and height as they are decoded, and the EXIF block, by the kind of the file."""
    if kind == "HEIC":
        return read_heic_header(data, where)
    if kind == "PNG":
        return scan_png(data)
    if kind == "TIFF":
        _check_tiff(data, where)
    with quiet_pillow():
        picture = _READERS[kind](io.BytesIO(data))
    if getattr(picture, "is_animated", False):
        raise FormatError(f"{where}: an animation, expected a photo")
    exif = data if kind == "TIFF" else picture.info.get("exif", b"")  # EXIF has TIFF's own tags
    return (*picture.size, exif)


def _check_tiff(data: bytes, where: str) -> None:
    """Raise `FormatError` for a raw photo, and for samples that are not 8 or 16 bit grey or RGB."""
    tags, file = ImageFileDirectory_v2(data[:8]), io.BytesIO(data)
    file.seek(tags.next)
    with quiet_pillow():
        tags.load(file)
    if not tags.keys() >= _SIZE:
        raise ValueError("no size")
    if _DNG_VERSION in tags:
        raise FormatError(f"{where}: a raw photo, expected a developed one; save it as JPEG or PNG")
    bits, kind = set(tags.get(_BITS, (1,))), tags.get(_PHOTOMETRIC, 0)
    if (
        bits not in ({8}, {16})
        or set(tags.get(_SAMPLE_FORMAT, (1,))) != {1}
        or kind not in _GREY_AND_RGB
    ):
        raise FormatError(
            f"{where}: TIFF of {max(bits)} bits a sample, photometric interpretation {kind};"
            " expected 8 or 16 bits of grey or RGB; save it as JPEG or PNG"
        )
    if math.prod(tags.get(edge, 1) for edge in _TILE_EDGES) > MAX_PIXELS:
        raise ValueError("tiles of an unusual size")


def _kind(data: bytes) -> str:
    if not data:
        return "an empty file"
    if is_heic(data):
        return "HEIC"
    if data[4:8] == b"ftyp":
        return "AVIF or a video"
    if data[:4] == b"RIFF" and data[8:12] == b"WEBP":
        return "WebP"
    named = (kind for start, kind in _KINDS.items() if data.startswith(start))
    return next(named, "not a picture")


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


def _decode(data: bytes, path: Path, half: bool = False, mode: str = "RGB") -> UInt8Array:
    """Return the pixels (H, W, 3 or 4) of a file, RGB or RGBA; of a JPEG maybe at half its size."""
    kind = _kind(data)
    try:
        if kind == "HEIC":
            return decode_heic(data, str(path))
        if kind == "PNG":
            check_png_data(data)
        with quiet_pillow():
            picture = _READERS[kind](io.BytesIO(data))
            if kind == "TIFF":
                picture.load()  # reads metadata again
        if half:  # a JPEG decoder halves pictures almost for free
            picture.draft("RGB", (max(picture.width // 2, 1), max(picture.height // 2, 1)))
        if picture.mode.startswith("I"):  # 16 bits of grey
            pixels = np.repeat((np.asarray(picture) >> 8).astype(np.uint8)[..., None], 3, axis=2)
        else:
            pixels = np.asarray(picture if picture.mode == mode else picture.convert(mode))
        if kind == "JPEG" and _loses_data(data, pixels):
            raise ValueError("some of its picture data is missing")
    except DAMAGE as error:
        reason = str(error).partition("\n")[0]
        raise FormatError(f"{path}: damaged {kind} file ({reason}); save it again") from error
    return pixels


def _upright(image: UInt8Array, orientation: int) -> UInt8Array:
    """Undo the camera's rotation; `orientation` is EXIF's 1 to 8."""
    turned = image.swapaxes(0, 1) if orientation >= 5 else image
    flips = {2: (1, -1), 3: (-1, -1), 4: (-1, 1), 6: (1, -1), 7: (-1, -1), 8: (-1, 1)}
    down, across = flips.get(orientation, (1, 1))
    return np.ascontiguousarray(turned[::down, ::across])
