"""Laws of cleaned photos: the same picture and focal length, and nothing about the person."""

from __future__ import annotations

import contextlib
import struct
import zlib
from pathlib import Path

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from hairkit.errors import HairkitError
from hairkit.io.exif import Exif, read_exif, write_exif
from hairkit.io.photos import read_header, read_photo
from hairkit.studio.clean_photo import clean_photo

SECRET = b"51 deg 30' N, 0 deg 7' W, phone of Ada"


def picture(kind: str) -> bytes:
    """Return a small encoded picture of noise."""
    pixels = np.random.default_rng(1).integers(0, 255, (40, 30, 3), np.uint8)
    return cv2.imencode(kind, cv2.GaussianBlur(pixels, (0, 0), 2))[1].tobytes()


def with_secrets(exif: Exif) -> bytes:
    """Return a JPEG file with a secret in its EXIF block, a comment, another segment and behind."""
    data = picture(".jpg")
    body = b"Exif\0\0" + write_exif(exif) + SECRET
    segments = b"\xff\xe1" + struct.pack(">H", len(body) + 2) + body
    for marker in (b"\xff\xfe", b"\xff\xed", b"\xff\xe1"):
        segments += marker + struct.pack(">H", len(SECRET) + 2) + SECRET
    return data[:2] + segments + data[2:] + SECRET


@pytest.mark.parametrize("orientation", range(1, 9))
def test_the_picture_stays_and_the_secrets_go(tmp_path: Path, orientation: int) -> None:
    """Pixels, orientation and focal length stay; place, device and comments are gone."""
    exif = Exif(orientation=orientation, focal_35mm=26.0)
    original = with_secrets(exif)
    before, after = tmp_path / "before.jpg", tmp_path / "after.jpg"
    before.write_bytes(original)
    after.write_bytes(clean_photo(original, read_header(before).exif))
    assert SECRET in before.read_bytes()
    assert SECRET not in after.read_bytes()
    assert np.array_equal(read_photo(before)[0], read_photo(after)[0])
    assert read_header(before).focal_px == read_header(after).focal_px
    assert read_header(after).exif == exif


def test_a_png_keeps_its_pixels_alone(tmp_path: Path) -> None:
    """Text chunks of a PNG file go, its picture and focal length stay."""
    data = picture(".png")
    text = b"tEXtComment\0" + SECRET
    chunk = struct.pack(">I", len(text) - 4) + text + struct.pack(">I", zlib.crc32(text))
    dirty = data[:33] + chunk + data[33:] + SECRET
    path = tmp_path / "clean.png"
    path.write_bytes(clean_photo(dirty, Exif(focal_35mm=50.0)))
    assert SECRET not in path.read_bytes()
    assert read_header(path).exif.focal_35mm == 50
    assert np.array_equal(
        read_photo(path)[0][..., ::-1], cv2.imdecode(np.frombuffer(data, np.uint8), 1)
    )


@given(
    st.integers(1, 8),
    st.none() | st.integers(8, 2000),
    st.none() | st.floats(1, 1000),
    st.none() | st.tuples(st.integers(1, 9000), st.integers(1, 9000)),
)
def test_facts_are_read_as_written(
    orientation: int, focal: int | None, length: float | None, pixels: tuple[int, int] | None
) -> None:
    """`read_exif` reads what `write_exif` writes."""
    facts = Exif(orientation, focal, length, None, pixels)
    found = read_exif(write_exif(facts))
    assert found.orientation == orientation
    assert found.focal_35mm == focal
    assert found.pixels == pixels
    assert found.focal_mm == (None if length is None else pytest.approx(length, rel=1e-5))


@given(st.binary(max_size=400), st.sampled_from([b"\xff\xd8\xff", b"\x89PNG\r\n\x1a\n", b""]))
def test_any_bytes_end_in_an_answer_or_one_line(data: bytes, start: bytes) -> None:
    """Garbage is cleaned or refused; it never hangs or raises anything else."""
    with contextlib.suppress(HairkitError):
        clean_photo(start + data, Exif())
