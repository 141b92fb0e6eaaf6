"""Laws of WebP and TIFF photos: read as PNG is, and refused in one line before they do harm."""

from __future__ import annotations

import struct
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from PIL import Image, ImageFile

from hairkit.errors import FormatError, InputError
from hairkit.io.photos import MAX_PIXELS, read_header, read_photo

LOSSLESS = {".webp": [cv2.IMWRITE_WEBP_QUALITY, 101], ".tif": [], ".png": []}


def scene_picture() -> np.ndarray:
    """A smooth picture (40, 60, 3) RGB that looks different in every orientation."""
    row, column = np.mgrid[:40, :60]
    return np.stack([4 * column, 5 * row, 2 * row + column], axis=-1).astype(np.uint8)


def encode(ending: str, picture: np.ndarray, settings: list[int] | None = None) -> bytes:
    """A picture's file, without loss unless `settings` say otherwise."""
    chosen = LOSSLESS[ending] if settings is None else settings
    pixels = picture[..., ::-1] if picture.ndim == 3 and picture.shape[2] == 3 else picture
    return cv2.imencode(ending, pixels, chosen)[1].tobytes()


def put(folder: Path, ending: str, data: bytes) -> Path:
    """The bytes as a file."""
    path = folder / f"photo{ending}"
    path.write_bytes(data)
    return path


def webp_with_exif(data: bytes, exif: bytes, size: tuple[int, int] = (60, 40)) -> bytes:
    """A WebP file with an extended header and an EXIF chunk."""
    width, height = ((edge - 1).to_bytes(3, "little") for edge in size)
    head = b"VP8X" + struct.pack("<I", 10) + bytes([8, 0, 0, 0]) + width + height
    tail = b"EXIF" + struct.pack("<I", len(exif)) + exif + bytes(len(exif) % 2)
    body = b"WEBP" + head + data[12:] + tail
    return b"RIFF" + struct.pack("<I", len(body)) + body


def turned_by_exif(orientation: int) -> bytes:
    """A TIFF block with one tag."""
    entry = struct.pack("<HHIHH", 0x0112, 3, 1, orientation, 0)
    return b"II*\0" + struct.pack("<IH", 8, 1) + entry + bytes(4)


def tag_of_tiff(data: bytes, tag: int, value: int) -> bytes:
    """A TIFF file with the first value of a tag replaced."""
    order = "<" if data[:2] == b"II" else ">"
    (start,) = struct.unpack_from(order + "I", data, 4)
    (count,) = struct.unpack_from(order + "H", data, start)
    changed = bytearray(data)
    for place in range(start + 2, start + 2 + 12 * count, 12):
        found, kind, length = struct.unpack_from(order + "HHI", data, place)
        if found == tag:
            size = {3: 2, 4: 4}[kind]
            at = place + 8
            if size * length > 4:
                (at,) = struct.unpack_from(order + "I", data, at)
            changed[at : at + size] = value.to_bytes(size, "little" if order == "<" else "big")
            return bytes(changed)
    raise KeyError(tag)


@pytest.mark.parametrize("ending", LOSSLESS)
@pytest.mark.parametrize("kind", ["rgb", "grey", "alpha", "sixteen bits"])
def test_every_kind_of_picture_is_eight_bit_rgb(tmp_path: Path, ending: str, kind: str) -> None:
    """Grey becomes RGB, alpha is dropped, 16 bits become 8: the same picture from every format."""
    picture = scene_picture()
    stored: np.ndarray = picture
    if kind == "grey":
        stored = picture[..., 0]
        picture = np.dstack([stored] * 3)
    if kind == "alpha":
        stored = np.dstack([picture[..., ::-1], np.full((40, 60), 200, np.uint8)])
    if kind == "sixteen bits":
        if ending == ".webp":
            pytest.skip("WebP has 8 bits")
        stored = picture.astype(np.uint16) * 257
    image, header = read_photo(put(tmp_path, ending, encode(ending, stored)))
    assert image.dtype == np.uint8
    assert np.abs(image.astype(int) - picture).max() <= 1
    assert (header.width, header.height) == (60, 40)


def test_exif_turns_webp_and_tiff(tmp_path: Path) -> None:
    """The orientation in a WebP's EXIF chunk and in a TIFF's own directory is applied once."""
    stored = np.ascontiguousarray(np.rot90(scene_picture(), 1))
    exif = turned_by_exif(6)
    webp = webp_with_exif(encode(".webp", stored), exif, (40, 60))
    tiff = _with_orientation(encode(".tif", stored), 6)
    for ending, data in ((".webp", webp), (".tif", tiff)):
        image, header = read_photo(put(tmp_path, ending, data))
        assert (header.width, header.height) == (60, 40)
        assert np.abs(image.astype(int) - scene_picture()).max() <= 1


def _with_orientation(data: bytes, value: int) -> bytes:
    """A little-endian TIFF file with one more entry, its directory moved to the end."""
    (start,) = struct.unpack_from("<I", data, 4)
    (count,) = struct.unpack_from("<H", data, start)
    entries = [data[start + 2 + 12 * i : start + 14 + 12 * i] for i in range(count)]
    entries = [e for e in entries if e[:2] != struct.pack("<H", 274)]
    entries.append(struct.pack("<HHIHH", 274, 3, 1, value, 0))
    entries.sort(key=lambda entry: struct.unpack_from("<H", entry))
    directory = struct.pack("<H", len(entries)) + b"".join(entries) + bytes(4)
    data = data + bytes(len(data) % 2)
    return data[:4] + struct.pack("<I", len(data)) + data[8:] + directory


def test_a_bomb_is_refused_before_it_is_decoded(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The size in the header decides; the decoder is never asked."""
    monkeypatch.setattr(ImageFile.ImageFile, "load", lambda *_: pytest.fail("it was decoded"))
    tiff = encode(".tif", scene_picture())
    webp = webp_with_exif(encode(".webp", scene_picture()), b"", (2**24, 2**24))
    large = tag_of_tiff(tag_of_tiff(tiff, 256, 60_000), 257, 60_000)
    assert MAX_PIXELS < 60_000**2
    for ending, data in ((".tif", large), (".webp", webp)):
        with pytest.raises(InputError, match="pixels"):
            read_header(put(tmp_path, ending, data))


DAMAGED_TIFF: dict[str, Any] = {
    "damaged TIFF": lambda data: data[: len(data) // 2],
    "damaged TIFF file": lambda data: tag_of_tiff(data, 273, 2**31),
    "of 32 bits": lambda data: cv2.imencode(".tif", np.zeros((4, 4), np.float32))[1].tobytes(),
    "photometric interpretation 6": lambda data: tag_of_tiff(data, 262, 6),
}


@pytest.mark.parametrize("reason", DAMAGED_TIFF)
def test_what_is_no_plain_tiff_is_named(tmp_path: Path, reason: str) -> None:
    """Cut files, strips outside of the file and other kinds of samples give one line."""
    path = put(tmp_path, ".tif", DAMAGED_TIFF[reason](encode(".tif", scene_picture())))
    with pytest.raises(FormatError, match=rf"photo\.tif: .*{reason}|{reason}") as caught:
        read_photo(path)
    assert "\n" not in str(caught.value)


def test_cut_and_animated_webp_is_named(tmp_path: Path) -> None:
    """A WebP file without its end and an animation give one line."""
    data = encode(".webp", scene_picture(), [cv2.IMWRITE_WEBP_QUALITY, 90])
    with pytest.raises(FormatError, match="damaged WebP"):
        read_photo(put(tmp_path, ".webp", data[:-20]))
    frames = [Image.fromarray(picture) for picture in (scene_picture(), 255 - scene_picture())]
    frames[0].save(tmp_path / "moving.webp", save_all=True, append_images=frames[1:])
    with pytest.raises(FormatError, match="an animation"):
        read_photo(tmp_path / "moving.webp")


@given(
    place=st.integers(0, 10_000),
    value=st.integers(0, 255),
    ending=st.sampled_from([".webp", ".tif"]),
    lossless=st.booleans(),
)
def test_a_damaged_byte_never_does_more_than_an_input_error(
    tmp_path_factory: pytest.TempPathFactory, place: int, value: int, ending: str, lossless: bool
) -> None:
    """Whatever byte is wrong, there is a picture of the header's size or one line."""
    data = bytearray(encode(ending, scene_picture(), None if lossless else []))
    where = place % len(data)
    data[where if place % 2 else where % 200] = value
    path = put(tmp_path_factory.getbasetemp(), ending, bytes(data))
    try:
        image, header = read_photo(path)
    except InputError as error:
        assert "\n" not in str(error)  # noqa: PT017 - both outcomes are allowed
    else:
        assert image.shape == (header.height, header.width, 3)
