"""EXIF facts are read where they make sense, and nothing in a block does harm."""

from __future__ import annotations

import struct

import pytest
from hypothesis import given
from hypothesis import strategies as st

from hairkit.io.exif import Exif, read_exif


def block(entries: list[tuple[int, int, bytes]], order: str = "<") -> bytes:
    """A TIFF block whose only directory is its own detail directory."""
    entries = [*entries, (0x8769, 4, struct.pack(order + "I", 8))]
    packed = [struct.pack(order + "HHI", tag, kind, 1) + value for tag, kind, value in entries]
    start = b"II*\0" if order == "<" else b"MM\0*"
    return start + struct.pack(order + "IH", 8, len(entries)) + b"".join(packed) + bytes(4)


def test_the_sensor_gives_the_focal_length() -> None:
    """Focal length in mm and pixels on a unit of the sensor are rationals behind the directory."""
    place = 8 + 2 + 12 * 4 + 4
    data = block(
        [
            (0x920A, 5, struct.pack("<I", place)),
            (0xA20E, 5, struct.pack("<I", place + 8)),
            (0xA210, 3, struct.pack("<HH", 3, 0)),
        ]
    )
    exif = read_exif(data + struct.pack("<IIII", 43, 10, 50_000, 1))
    assert exif.focal_mm == pytest.approx(4.3)
    assert exif.pixels_per_mm == pytest.approx(5_000)


@pytest.mark.parametrize("value", [0, 1, 60_000])
def test_a_senseless_focal_length_is_ignored(value: int) -> None:
    """Cameras write 0 for unknown; a pin or a telescope is no lens either."""
    assert read_exif(block([(0xA405, 3, struct.pack("<HH", value, 0))])).focal_35mm is None


@given(st.binary(max_size=200), st.sampled_from([b"II*\0", b"MM\0*", b""]))
def test_no_block_does_harm(data: bytes, start: bytes) -> None:
    """Any bytes give facts in range."""
    exif = read_exif(start + data)
    assert 1 <= exif.orientation <= 8
    assert exif.focal_35mm is None or 8 <= exif.focal_35mm <= 2000


def test_nothing_says_nothing() -> None:
    """A photo without EXIF is upright and has no focal length."""
    assert read_exif(b"") == Exif()
