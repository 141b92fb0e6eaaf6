"""Photos are read upright, and nothing that is no photo does harm."""

from __future__ import annotations

import struct
import zlib
from pathlib import Path

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from PIL import ImageFile

from hairkit.errors import FormatError, InputError
from hairkit.io.photos import read_drawing, read_header, read_photo
from hairkit.types.capture import focal_from_equivalent


def scene_picture() -> np.ndarray:
    """A smooth picture (40, 60, 3) RGB that looks different in every orientation."""
    row, column = np.mgrid[:40, :60]
    return np.stack([4 * column, 5 * row, 2 * row + column], axis=-1).astype(np.uint8)


def exif_block(order: str = "<", **tags: int | tuple[int, int]) -> bytes:
    """A TIFF block with an orientation, and a focal length in the detail directory."""
    start = b"II*\0" if order == "<" else b"MM\0*"
    short = {"orientation": 0x0112, "focal_35mm": 0xA405, "pixels_x": 0xA002, "pixels_y": 0xA003}
    main = [(0x0112, 3, 1, struct.pack(order + "HH", tags.get("orientation", 1), 0))]
    detail = [
        (short[name], 3, 1, struct.pack(order + "HH", value, 0))
        for name, value in tags.items()
        if name != "orientation"
    ]
    place = 8 + 2 + 12 * (len(main) + 1) + 4
    main.append((0x8769, 4, 1, struct.pack(order + "I", place)))

    def directory(entries: list[tuple[int, int, int, bytes]]) -> bytes:
        packed = [struct.pack(order + "HHI", *entry[:3]) + entry[3] for entry in entries]
        return struct.pack(order + "H", len(entries)) + b"".join(packed) + bytes(4)

    return start + struct.pack(order + "I", 8) + directory(main) + directory(detail)


def jpeg(image: np.ndarray, exif: bytes = b"") -> bytes:
    """An RGB picture as JPEG with an EXIF block."""
    data = cv2.imencode(".jpg", image[..., ::-1], [cv2.IMWRITE_JPEG_QUALITY, 98])[1].tobytes()
    if not exif:
        return data
    block = b"Exif\0\0" + exif
    return data[:2] + b"\xff\xe1" + struct.pack(">H", len(block) + 2) + block + data[2:]


def png_claiming(width: int, height: int, packed_pixels: bytes = b"nonsense") -> bytes:
    """A tiny PNG file whose header claims a size."""
    header = struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)
    chunks = [(b"IHDR", header), (b"IDAT", packed_pixels), (b"IEND", b"")]
    packed = [
        struct.pack(">I", len(data)) + name + data + struct.pack(">I", zlib.crc32(name + data))
        for name, data in chunks
    ]
    return b"\x89PNG\r\n\x1a\n" + b"".join(packed)


UNDO = {  # how a camera held this way stores the upright picture
    1: lambda a: a,
    2: lambda a: a[:, ::-1],
    3: lambda a: a[::-1, ::-1],
    4: lambda a: a[::-1],
    5: lambda a: a.swapaxes(0, 1),
    6: lambda a: np.rot90(a, 1),
    7: lambda a: a.swapaxes(0, 1)[::-1, ::-1],
    8: lambda a: np.rot90(a, -1),
}


@pytest.mark.parametrize("order", ["<", ">"])
@pytest.mark.parametrize("orientation", range(1, 9))
def test_a_photo_is_upright_however_the_camera_was_held(
    tmp_path: Path, orientation: int, order: str
) -> None:
    """EXIF rotation is applied to the picture and to the size in the header."""
    stored = np.ascontiguousarray(UNDO[orientation](scene_picture()))
    (tmp_path / "a.jpg").write_bytes(jpeg(stored, exif_block(order, orientation=orientation)))
    image, header = read_photo(tmp_path / "a.jpg")
    assert (header.width, header.height) == (60, 40)
    assert np.abs(image.astype(int) - scene_picture()).mean() < 4


def test_our_rotation_is_opencvs(tmp_path: Path) -> None:
    """The rotation agrees with the one OpenCV applies by itself."""
    for orientation in range(1, 9):
        data = jpeg(scene_picture(), exif_block(orientation=orientation))
        (tmp_path / "a.jpg").write_bytes(data)
        theirs = cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_COLOR)[..., ::-1]
        assert np.array_equal(read_photo(tmp_path / "a.jpg")[0], theirs)


def test_the_equivalent_focal_length_keeps_the_diagonal_angle(tmp_path: Path) -> None:
    """47.83 mm equivalent on 810 x 1080 pixels are 1492.2 px in the sample's photos."""
    assert focal_from_equivalent(47.83, 810, 1080) == pytest.approx(1492.2, abs=0.2)
    (tmp_path / "a.jpg").write_bytes(jpeg(scene_picture(), exif_block(focal_35mm=50)))
    half_angle = np.arctan(np.hypot(60, 40) / 2 / read_header(tmp_path / "a.jpg").focal_px)
    assert half_angle == pytest.approx(np.arctan(np.hypot(36, 24) / 2 / 50))


def test_the_focal_length_of_a_cropped_photo_is_unknown(tmp_path: Path) -> None:
    """A photo of another shape than when it was taken has lost its angle of view."""
    for sides, known in {(60, 40): True, (40, 60): True, (90, 40): False}.items():
        block = exif_block(focal_35mm=50, pixels_x=sides[0], pixels_y=sides[1])
        (tmp_path / "a.jpg").write_bytes(jpeg(scene_picture(), block))
        assert (read_header(tmp_path / "a.jpg").focal_px is not None) == known


@pytest.mark.parametrize("edge", [15, 20, 30, 59, 60, 100])
def test_a_large_photo_is_scaled_to_the_working_edge(tmp_path: Path, edge: int) -> None:
    """The long edge becomes the one wanted, never larger than it was, and the picture stays."""
    (tmp_path / "a.jpg").write_bytes(jpeg(scene_picture()))
    image, header = read_photo(tmp_path / "a.jpg", edge)
    assert max(image.shape[:2]) == min(edge, 60)
    assert (header.width, header.height) == (60, 40)
    assert np.abs(image.mean(axis=(0, 1)) - scene_picture().mean(axis=(0, 1))).max() < 3


def test_a_bomb_is_refused_before_it_is_decoded(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The size in the header decides; the decoder is never asked."""
    monkeypatch.setattr(ImageFile.ImageFile, "load", lambda *_: pytest.fail("it was decoded"))
    for width, height in [(30_000, 30_000), (2**31 - 1, 2**31 - 1), (0, 5)]:
        (tmp_path / "a.png").write_bytes(png_claiming(width, height))
        with pytest.raises(InputError, match=f"{width} x {height} pixels"):
            read_photo(tmp_path / "a.png")


@pytest.mark.parametrize(
    ("data", "reason"),
    [
        (b"", "an empty file"),
        (b"dear diary", "not a picture"),
        (b"\0\0\0\x18ftypheic" + bytes(40), "HEIC"),
        (b"\0\0\0\x18ftypavif" + bytes(40), "AVIF or a video"),
        (b"RIFF\0\0\0\0WEBPVP8 ", "damaged WebP"),
        (b"II*\0" + bytes(20), "damaged TIFF"),
        (b"GIF89a" + bytes(20), "GIF"),
        (jpeg(scene_picture())[:-200], "damaged JPEG"),
        (jpeg(scene_picture())[:30], "damaged JPEG"),
        (png_claiming(4, 4)[:40], "damaged PNG"),
        (png_claiming(4, 4).replace(b"sense", b"SENSE"), "damaged PNG"),
        (png_claiming(4, 4), "cannot be unpacked"),
    ],
)
def test_what_is_no_photo_is_named(tmp_path: Path, data: bytes, reason: str) -> None:
    """A file that only has a photo's name gives one line that says what it is."""
    (tmp_path / "a.jpg").write_bytes(data)
    with pytest.raises(InputError, match=reason) as caught:
        read_photo(tmp_path / "a.jpg")
    assert "\n" not in str(caught.value)
    assert str(tmp_path / "a.jpg") in str(caught.value)


def test_a_missing_photo_is_named(tmp_path: Path) -> None:
    """A file that does not exist and a folder give one line."""
    for path in (tmp_path / "none.jpg", tmp_path):
        with pytest.raises(InputError, match=r"no such file|is a folder"):
            read_photo(path)


@given(place=st.integers(0, 10_000), value=st.integers(0, 255), kind=st.sampled_from("jp"))
def test_a_damaged_byte_never_does_more_than_an_input_error(
    tmp_path_factory: pytest.TempPathFactory, place: int, value: int, kind: str
) -> None:
    """Whatever byte is wrong, there is a picture or one line."""
    data = bytearray(
        jpeg(scene_picture(), exif_block(orientation=6, focal_35mm=40))
        if kind == "j"
        else cv2.imencode(".png", scene_picture())[1].tobytes()
    )
    data[place % min(len(data), 400)] = value
    path = tmp_path_factory.getbasetemp() / "damaged"
    path.write_bytes(data)
    try:
        image, _ = read_photo(path)
    except InputError as error:
        assert "\n" not in str(error)  # noqa: PT017 - both outcomes are allowed
    else:
        assert image.ndim == 3


def test_a_drawing_keeps_its_values(tmp_path: Path) -> None:
    """A grey PNG comes back as it is; transparency counts as the drawing; colours are refused."""
    grey = scene_picture()[..., 0]
    cv2.imwrite(str(tmp_path / "a.png"), grey)
    assert np.array_equal(read_drawing(tmp_path / "a.png"), grey)
    cv2.imwrite(str(tmp_path / "b.png"), np.dstack([np.full((40, 60, 3), 9, np.uint8), grey]))
    assert np.array_equal(read_drawing(tmp_path / "b.png"), grey)
    cv2.imwrite(str(tmp_path / "c.png"), scene_picture())
    with pytest.raises(InputError, match="coloured"):
        read_drawing(tmp_path / "c.png")
    (tmp_path / "d.png").write_bytes(jpeg(scene_picture()))
    with pytest.raises(InputError, match="must be PNG"):
        read_drawing(tmp_path / "d.png")


def test_data_beyond_the_pictures_size_is_refused(tmp_path: Path) -> None:
    """A small header before gigabytes of packed zeros is a bomb: refused while it is unpacked."""
    data = cv2.imencode(".png", np.zeros((8, 8, 3), np.uint8))[1].tobytes()
    start = data.index(b"IDAT") - 4
    (length,) = struct.unpack_from(">I", data, start)
    packed = zlib.compress(bytes(10**7), 9)
    chunk = b"IDAT" + packed
    bomb = data[:start] + struct.pack(">I", len(packed)) + chunk
    bomb += struct.pack(">I", zlib.crc32(chunk)) + data[start + 12 + length :]
    path = tmp_path / "bomb.png"
    path.write_bytes(bomb)
    with pytest.raises(InputError, match="unpacks to more"):
        read_photo(path)


def _cut(data: bytes, way: str, share: float) -> bytes:
    """Return a picture's file without some of its data."""
    at = int(share * len(data))
    gone = data[: min(at, len(data) - 2)]
    return {
        "end": gone,
        "end, closed": gone + b"\xff\xd9",
        "middle": gone + data[at + len(data) // 8 :],
        "begins again": gone + data,
    }[way]


@pytest.mark.parametrize("share", [0.45, 0.6, 0.75])
@pytest.mark.parametrize("way", ["end", "end, closed", "middle", "begins again"])
@pytest.mark.parametrize("restarts", [0, 3])
def test_a_photo_that_lost_data_is_refused(
    tmp_path: Path, way: str, share: float, restarts: int
) -> None:
    """A JPEG without its end, or without a piece from its middle, is named; nothing is made up."""
    settings = [cv2.IMWRITE_JPEG_RST_INTERVAL, restarts]
    data = cv2.imencode(".jpg", cv2.resize(scene_picture(), (400, 300)), settings)[1].tobytes()
    path = tmp_path / "a.jpg"
    path.write_bytes(data)
    read_photo(path)
    path.write_bytes(_cut(data, way, share))
    with pytest.raises(FormatError, match=r"a\.jpg: damaged JPEG"):
        read_photo(path)


@pytest.mark.parametrize("value", [0, 128, 255])
@pytest.mark.parametrize("settings", [[], [cv2.IMWRITE_JPEG_PROGRESSIVE, 1]])
def test_a_flat_photo_is_whole(tmp_path: Path, value: int, settings: list[int]) -> None:
    """A picture of mid-grey is not taken for one that lost its data."""
    flat = np.full((90, 130, 3), value, np.uint8)
    data = cv2.imencode(".jpg", flat, settings)[1].tobytes()
    (tmp_path / "a.jpg").write_bytes(data)
    assert (read_photo(tmp_path / "a.jpg")[0] == flat).all()


def test_a_good_photo_is_read_in_silence(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    """Areas of mid-grey within a black-and-white photo make no decoder complain."""
    picture = np.repeat(scene_picture()[..., :1], 3, axis=2)
    large = cv2.resize(picture, (400, 300))
    large[100:200, 100:200] = 128
    cv2.imwrite(str(tmp_path / "a.jpg"), large)
    read_photo(tmp_path / "a.jpg")
    assert capfd.readouterr().err == ""


@pytest.mark.parametrize("rows", [0, 20, 39])
def test_a_png_that_lost_rows_is_refused(tmp_path: Path, rows: int) -> None:
    """A PNG with whole chunks but too few rows is named."""
    kept = cv2.imencode(".png", scene_picture()[:rows] if rows else scene_picture()[:1])[1]
    data = kept.tobytes()
    header = b"IHDR" + struct.pack(">II", 60, 40) + data[24:29]
    data = data[:12] + header + struct.pack(">I", zlib.crc32(header)) + data[33:]
    (tmp_path / "a.png").write_bytes(data)
    with pytest.raises(FormatError, match=r"a\.png: damaged PNG"):
        read_photo(tmp_path / "a.png")
