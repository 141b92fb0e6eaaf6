"""Laws of HEIC photos: read as a JPEG of the same picture is, refused in one line when damaged."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hairkit.errors import FormatError, MissingExtraError
from hairkit.io.heic import decode_heic, is_heic
from hairkit.io.photos import read_header, read_photo

pillow_heif = pytest.importorskip("pillow_heif", reason="needs the extra heic")


def picture() -> np.ndarray:
    """A smooth picture (40, 60, 3) RGB."""
    row, column = np.mgrid[:40, :60]
    return np.stack([4 * column, 5 * row, 2 * row + column], axis=-1).astype(np.uint8)


@pytest.fixture(scope="module")
def photo(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The picture as HEIC."""
    path = tmp_path_factory.mktemp("heic") / "front.heic"
    image = picture()
    file = pillow_heif.from_bytes(mode="RGB", size=(60, 40), data=image.tobytes())
    file.save(str(path), quality=95)
    return path


def test_a_photo_is_read_as_it_was_taken(photo: Path) -> None:
    """Size, kind and pixels are those of the picture, and it is scaled down like other photos."""
    image, header = read_photo(photo)
    assert (header.kind, header.width, header.height) == ("HEIC", 60, 40)
    assert np.abs(image.astype(float) - picture()).mean() < 4
    small, header = read_photo(photo, 30)
    assert small.shape == (20, 30, 3)
    assert (header.width, header.height) == (60, 40)


@settings(max_examples=30, deadline=None)
@given(share=st.floats(0.05, 0.98))
def test_a_damaged_photo_is_refused(photo: Path, share: float) -> None:
    """Wherever the file is cut, one line names it."""
    cut = photo.with_name("cut.heic")
    cut.write_bytes(photo.read_bytes()[: int(share * photo.stat().st_size)])
    with pytest.raises(FormatError, match=r"cut\.heic: damaged HEIC file"):
        read_photo(cut)


def test_without_the_library_one_line_says_what_to_install(
    photo: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The message names the photo and the pip command."""
    monkeypatch.setitem(sys.modules, "pillow_heif", None)
    with pytest.raises(MissingExtraError, match=r"front.heic: .* pip install 'hairkit\[heic\]'"):
        read_header(photo)
    with pytest.raises(MissingExtraError):
        decode_heic(photo.read_bytes(), "front.heic")


def test_other_files_are_not_heic(photo: Path) -> None:
    """The brand tells: videos and AVIF begin alike."""
    assert is_heic(photo.read_bytes())
    assert not is_heic(b"\0\0\0\x18ftypisom" + bytes(40))
    assert not is_heic(b"")
