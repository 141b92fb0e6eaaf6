"""A folder becomes a capture, or one line says why it cannot."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import cv2
import numpy as np
import pytest
from ball import write_capture, write_grey
from hypothesis import given, settings
from hypothesis import strategies as st

from hairkit.errors import InputError
from hairkit.io.capture_reader import TURN, read_capture, read_files, sample_folder
from hairkit.io.capture_toml import ViewEntry, read_capture_file, write_view_entries
from hairkit.testing import striped_view
from hairkit.types.capture import Capture, focal_from_equivalent

POINTS = np.stack([np.linspace(5, 90, 68), np.linspace(9, 120, 68)], axis=1)


def write_landmarks(folder: Path, points: object, name: str = "0_front") -> None:
    """Write `landmarks.json` for one view."""
    (folder / "landmarks.json").write_text(json.dumps({"views": {name: points}}))


def test_eight_photos_in_file_order_are_the_turn(tmp_path: Path) -> None:
    """Photos without names of views are front, front-left, ... in natural order: 9 before 10."""
    for number in range(8):
        write_grey(tmp_path / f"IMG_{number + 5}.png", np.full((20, 20), 10 * number, np.uint8))
    capture = read_capture(tmp_path)
    assert [view.name for view in capture.views] == list(TURN)
    assert [view.azimuth_deg for view in capture.views] == [45.0 * i for i in range(8)]
    assert [int(view.image[0, 0, 0]) for view in capture.views] == [10 * i for i in range(8)]


def test_names_of_views_come_before_file_order(tmp_path: Path) -> None:
    """Photos named like the views are put in the order of the turn."""
    for index, name in enumerate(TURN):
        write_grey(tmp_path / f"{name.replace('-', '_')}.png", np.full((20, 20), index, np.uint8))
    capture = read_capture(tmp_path)
    assert [int(view.image[0, 0, 0]) for view in capture.views] == list(range(8))


def test_a_cameras_own_name_among_views_leaves_the_turn_to_the_photos(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    """Names may be any: where one tells nothing, none counts, and its mask stays its own."""
    names = ["back", "front", "IMG_9", "left"]
    for index, name in enumerate(names):
        write_grey(tmp_path / f"{name}.png", np.full((20, 20), index, np.uint8))
    (tmp_path / "masks").mkdir()
    write_grey(tmp_path / "masks" / "front.png", np.zeros((20, 20), np.uint8))
    views = read_capture(tmp_path).views
    assert not any(view.named for view in views)
    assert [view.photo_path.stem for view in views if view.photo_path] == names
    assert [view.mask_path is not None for view in views] == [False, True, False, False]
    assert "IMG_9.png: its name tells no view" in caplog.text
    (tmp_path / "IMG_9.png").rename(tmp_path / "rihgt.png")
    with pytest.raises(InputError, match="did you mean 'right'"):
        read_capture(tmp_path)


def test_what_lies_beside_the_photos_is_found_by_name(tmp_path: Path) -> None:
    """Masks, strokes and landmarks go to the view whose photo has their name."""
    folder = write_capture(tmp_path / "c", masks=True)
    (folder / "strokes").mkdir()
    (folder / "strokes" / "2_left.json").write_text("{}")
    write_landmarks(folder, POINTS.tolist(), "0_front")
    views = read_capture(folder).views
    assert all(
        v.mask_path == folder / "masks" / v.photo_path.with_suffix(".png").name for v in views
    )
    assert [v.name for v in views if v.strokes_path is not None] == ["left"]
    assert [v.name for v in views if v.landmarks is not None] == ["front"]
    assert np.array_equal(views[0].landmarks, POINTS)


def test_everything_scales_with_the_photo(tmp_path: Path) -> None:
    """At half the size landmarks and focal length are half as large; the photo's size is kept."""
    folder = write_capture(tmp_path / "c")
    write_landmarks(folder, POINTS.tolist())
    (folder / "capture.toml").write_text("focal_px = 200\n")
    view = read_capture(folder, max_edge=64).views[0]
    assert (view.width, view.height) == (48, 64)
    assert view.photo_size == (96, 128)
    assert view.focal_px == pytest.approx(100)
    assert view.landmarks == pytest.approx(POINTS / 2)


def test_capture_toml_says_what_photos_do_not(tmp_path: Path) -> None:
    """Names, azimuths, focal lengths, projection and the head's pose come from the file."""
    folder = write_capture(tmp_path / "c")
    photos = sorted((folder / "photos").iterdir())
    views = [
        f'[[views]]\nname = "v{i}"\nphoto = "{photos[7 - i].name}"\nazimuth_deg = {10 * i}'
        for i in range(8)
    ]
    views[3] += "\nfocal_px = 321"
    (folder / "capture.toml").write_text(
        "orthographic = true\nfocal_mm_equivalent = 50\nparting = [[0.03, 0.1], [0.02, 0]]\n"
        "[head]\nscale = 2\n"
        "rotation_deg = [0, 90, 0]\ntranslation_m = [1, 2, 3]\n" + "\n".join(views)
    )
    capture = read_capture(folder)
    assert [v.name for v in capture.views] == [f"v{i}" for i in range(8)]
    assert [v.azimuth_deg for v in capture.views] == [10.0 * i for i in range(8)]
    assert [v.photo_path for v in capture.views] == photos[::-1]
    assert capture.orthographic
    assert capture.views[0].focal_px == pytest.approx(focal_from_equivalent(50, 96, 128))
    assert capture.views[3].focal_px == pytest.approx(321)
    assert capture.head_pose @ [0, 0, 0.1, 1] == pytest.approx([1.2, 2, 3, 1])
    assert capture.parting is not None
    assert capture.parting.line == pytest.approx(np.array([[0.03, 0.1], [0.02, 0]]))


def test_a_little_cropping_is_no_harm(tmp_path: Path) -> None:
    """Photos may differ by some pixels; every view has its own size."""
    folder = write_capture(tmp_path / "c")
    write_grey(folder / "photos" / "3_back-left.png", np.zeros((120, 90), np.uint8))
    assert read_capture(folder).views[3].photo_size == (90, 120)


def test_the_sample_ships_complete() -> None:
    """The sample has eight photos with masks and strokes, and three views with landmarks."""
    views = read_capture(sample_folder()).views
    assert [view.name for view in views] == list(TURN)
    assert all(view.mask_path and view.strokes_path for view in views)
    assert sum(view.landmarks is not None for view in views) == 3
    assert "Mitsuba 3" in (sample_folder() / "ORIGIN.md").read_text()


def spoil_photo(folder: Path, content: bytes) -> None:
    (folder / "photos" / "4_back.png").write_bytes(content)


WRONG = {
    "no such file": lambda f: shutil.rmtree(f),
    "4_back.png: no photo '4_back'": lambda f: (f / "photos" / "4_back.png").unlink(),
    "0 photos, expected 1 to 36": lambda f: [p.unlink() for p in (f / "photos").glob("*")],
    "37 photos, expected 1 to 36": lambda f: [
        write_grey(f / "photos" / f"{n}.png", np.zeros((8, 8), np.uint8)) for n in range(10, 39)
    ],
    "4_back.png: not a picture, expected a JPEG, PNG, WebP, TIFF or HEIC": lambda f: spoil_photo(
        f, b"hello"
    ),
    "4_back.png: an empty file": lambda f: spoil_photo(f, b""),
    "4_back.png: 96 x 128 pixels, its photo has 60 x 40": lambda f: write_grey(
        f / "photos" / "4_back.png", np.zeros((40, 60), np.uint8)
    ),
    "no view 'frnt' .did you mean 'front'": lambda f: (f / "photos" / "0_front.png").rename(
        f / "photos" / "0_frnt.png"
    ),
    "two photos of the view 'front'": lambda f: (f / "photos" / "1_front-left.png").rename(
        f / "photos" / "1_front.png"
    ),
    "x.bmp: expected a JPEG, PNG, WebP, TIFF or HEIC": lambda f: (
        f / "photos" / "x.bmp"
    ).write_bytes(b""),
    "4_back.png: 95 x 128 pixels, its photo has 96 x 128": lambda f: write_grey(
        f / "masks" / "4_back.png", np.zeros((128, 95), np.uint8)
    ),
    "no photo '4_bakc' .did you mean '4_back'": lambda f: (f / "masks" / "4_back.png").rename(
        f / "masks" / "4_bakc.png"
    ),
    "landmarks has 1 values that are not finite": lambda f: write_landmarks(
        f, [[float("nan"), 1], *POINTS[1:].tolist()]
    ),
    "5 landmarks, expected the 68 iBUG points": lambda f: write_landmarks(f, POINTS[:5].tolist()),
    "landmarks are no list": lambda f: write_landmarks(f, 7),
    "landmarks are no list of pixel pairs": lambda f: write_landmarks(f, ["a"] * 68),
    "no view '0_bak'": lambda f: write_landmarks(f, POINTS.tolist(), "0_bak"),
    'landmarks.json: expected JSON {"views"': lambda f: (f / "landmarks.json").write_text("{"),
    "capture.toml: not a TOML file": lambda f: (f / "capture.toml").write_text("="),
    "capture.toml: no entry 'focal'": lambda f: (f / "capture.toml").write_text("focal = 3"),
    "focal_px is -3.0, expected": lambda f: (f / "capture.toml").write_text("focal_px = -3.0"),
    "parting: no parting 'lift' .did you mean 'left'": lambda f: (f / "capture.toml").write_text(
        'parting = "lift"'
    ),
    "parting: a parting of 1 points": lambda f: (f / "capture.toml").write_text(
        "parting = [[0.1, 0.2]]"
    ),
    "^[^:]*capture.toml: .hair.: no option 'width'": lambda f: (f / "capture.toml").write_text(
        "[hair]\nwidth = 3"
    ),
    "^[^:]*capture.toml: .hair.: curl_radius_mm needs": lambda f: (f / "capture.toml").write_text(
        "[hair]\ncurl_radius_mm = 3"
    ),
    "views are no tables": lambda f: (f / "capture.toml").write_text("views = 3"),
    "1 views for 8 photos": lambda f: (f / "capture.toml").write_text('[[views]]\nname="a"'),
    "b.png: no such photo": lambda f: (f / "capture.toml").write_text(
        "[[views]]\n" * 7 + '[[views]]\nphoto="b.png"'
    ),
    "no view 'xx'.*or give its azimuth_deg": lambda f: (f / "capture.toml").write_text(
        '[[views]]\nname="xx"\n' + "[[views]]\n" * 7
    ),
    "'0_front.png' is named for two views": lambda f: (f / "capture.toml").write_text(
        "[[views]]\n" * 7 + '[[views]]\nphoto="0_front.png"'
    ),
}


@pytest.mark.parametrize("reason", WRONG)
def test_wrong_input_gets_one_line(tmp_path: Path, reason: str) -> None:
    """Whatever is wrong with a capture, one line says what and where."""
    folder = write_capture(tmp_path / "c", masks=True)
    WRONG[reason](folder)
    with pytest.raises(InputError, match=reason) as caught:
        read_capture(folder)
    assert "\n" not in str(caught.value)


def test_one_photo_is_a_capture(tmp_path: Path) -> None:
    """A photo may stand for its folder: one view, named if its file is; other files are refused."""
    for name in ("me.png", "back.png"):
        write_grey(tmp_path / name, np.zeros((30, 20), np.uint8))
    capture = read_capture(tmp_path / "me.png")
    assert [view.named for view in capture.views] == [False]
    assert capture.source == tmp_path / "me.png"
    assert read_capture(tmp_path / "back.png").views[0].azimuth_deg == 180
    (tmp_path / "notes.txt").write_text("hello")
    with pytest.raises(InputError, match=r"notes\.txt: expected a JPEG"):
        read_capture(tmp_path / "notes.txt")


def test_photos_that_lie_anywhere_are_a_capture(tmp_path: Path) -> None:
    """Files that are given one by one are views in their order, or as their names say."""
    for folder, grey in (("a", 1), ("b", 2)):
        (tmp_path / folder).mkdir()
        write_grey(tmp_path / folder / "IMG_1.png", np.full((30, 20), grey, np.uint8))
        write_grey(tmp_path / folder / "left.png", np.full((30, 20), grey, np.uint8))
    capture = read_files([tmp_path / "b" / "IMG_1.png", tmp_path / "a" / "IMG_1.png"])
    assert [int(view.image[0, 0, 0]) for view in capture.views] == [2, 1]
    assert len({view.name for view in capture.views}) == 2
    assert read_files([tmp_path / "b" / "left.png"]).views[0].azimuth_deg == 90
    for wrong, words in (
        ([tmp_path / "b" / "left.png", tmp_path / "a" / "left.png"], "two photos of the view"),
        ([tmp_path / "b" / "left.png", tmp_path / "b"], "no such photo"),
        ([tmp_path / "a" / "IMG_1.png"] * 37, "expected 1 to 36"),
    ):
        with pytest.raises(InputError, match=words):
            read_files(wrong)


@pytest.mark.parametrize("count", [1, 2, 3, 5, 12, 36])
def test_photos_without_names_are_an_even_turn_in_file_order(tmp_path: Path, count: int) -> None:
    """1 to 36 photos are read; their views are marked as not named, each has a name of its own."""
    for number in range(count):
        write_grey(tmp_path / f"IMG_{number + 5}.png", np.full((20, 20), number, np.uint8))
    views = read_capture(tmp_path).views
    assert [view.azimuth_deg for view in views] == [360.0 * i / count for i in range(count)]
    assert [int(view.image[0, 0, 0]) for view in views] == list(range(count))
    assert not any(view.named for view in views)
    assert len({view.name for view in views}) == count


def test_names_of_some_views_are_enough(tmp_path: Path) -> None:
    """Named photos may be fewer than eight; `top` is seen from above; all are marked as named."""
    for name in ("left", "right", "back", "top", "front"):
        write_grey(tmp_path / f"{name}.png", np.zeros((20, 20), np.uint8))
    views = read_capture(tmp_path).views
    assert [view.name for view in views] == ["front", "left", "back", "right", "top"]
    assert [view.elevation_deg for view in views] == [0, 0, 0, 0, 60]
    assert all(view.named for view in views)


def test_capture_toml_names_what_it_says(tmp_path: Path) -> None:
    """A table with an azimuth names its view, and tells the elevation; an empty one names none."""
    for number in range(3):
        write_grey(tmp_path / f"{number}.png", np.zeros((20, 20), np.uint8))
    tables = "[[views]]\nazimuth_deg = 70\nelevation_deg = 20\n[[views]]\n[[views]]\nname='back'"
    (tmp_path / "capture.toml").write_text(tables)
    views = read_capture(tmp_path).views
    assert [view.named for view in views] == [True, False, True]
    assert (views[0].azimuth_deg, views[0].elevation_deg) == (70, 20)
    assert views[2].azimuth_deg == 180


@given(sizes=st.lists(st.tuples(st.integers(8, 90), st.integers(8, 90)), min_size=3, max_size=9))
@settings(max_examples=20)
def test_every_photo_has_a_size_of_its_own(
    tmp_path_factory: pytest.TempPathFactory, sizes: list[tuple[int, int]]
) -> None:
    """Photos of any sizes, upright and lying, are read as they are."""
    folder = tmp_path_factory.mktemp("sizes")
    for number, (width, height) in enumerate(sizes):
        write_grey(folder / f"b{number}.png", np.zeros((height, width), np.uint8))
    assert [view.photo_size for view in read_capture(folder).views] == sizes


def test_a_head_pose_is_a_similarity() -> None:
    """A matrix that bends or mirrors the head is refused."""
    for matrix in (np.ones((4, 4)), np.diag([1.0, 1.0, -1.0, 1.0]), np.diag([1.0, 2.0, 1.0, 1.0])):
        with pytest.raises(InputError, match="no similarity"):
            Capture((striped_view(0.0),), head_pose=matrix)


def test_an_image_bomb_is_refused(tmp_path: Path) -> None:
    """A photo of 30,000 pixels is not decoded, however small its file is."""
    folder = write_capture(tmp_path / "c")
    data = bytearray(cv2.imencode(".jpg", np.zeros((16, 16), np.uint8))[1].tobytes())
    frame = data.index(b"\xff\xc0")
    data[frame + 5 : frame + 9] = (30_000).to_bytes(2, "big") * 2
    spoil_photo(folder, bytes(data))
    with pytest.raises(InputError, match="30000 x 30000 pixels"):
        read_capture(folder)


def test_views_are_written_as_they_are_read(tmp_path: Path) -> None:
    """Tables of views are replaced, all else in capture.toml stays; an empty file goes."""
    path = tmp_path / "capture.toml"
    entries = (
        ViewEntry("front", 'Ä "b".jpg', 10.5, None, 900.0),
        ViewEntry(photo="c\\d.jpg", elevation_deg=60.0),
    )
    write_view_entries(path, entries)
    assert read_capture_file(path).views == entries
    path.write_text("orthographic = true\n\n" + path.read_text() + "\n[head]\nscale = 2.0\n")
    write_view_entries(path, entries[1:])
    found = read_capture_file(path)
    assert found.views == entries[1:]
    assert found.orthographic
    assert found.head_pose is not None
    write_view_entries(path, ())
    assert path.read_text() == "orthographic = true\n\n[head]\nscale = 2.0\n"
    path.write_text("")
    write_view_entries(path, ())
    assert not path.exists()
