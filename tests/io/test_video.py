"""Laws of videos as captures: even steps of the turn, sharp frames, and damage is refused."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import cv2
import numpy as np
import numpy.typing as npt
import pytest

from hairkit.errors import InputError
from hairkit.io import video
from hairkit.io.capture_reader import read_capture
from hairkit.io.video import FRAMES, choose_frames, is_video, read_video

WIDTH, HEIGHT = 192, 256
FRAME_COUNT = 120
BLURRED = range(2, FRAME_COUNT, 3)


def head(turn: float) -> npt.NDArray[np.uint8]:
    """Return a picture (H, W, 3) of a spotted cylinder, turned by that share of a turn."""
    spots = cv2.resize(np.random.default_rng(5).integers(0, 255, (24, 60), np.uint8), (480, HEIGHT))
    across = np.linspace(-0.98, 0.98, WIDTH // 2)
    column = ((np.arcsin(across) / (2 * np.pi) + turn) % 1.0 * 480).astype(int)
    picture = np.full((HEIGHT, WIDTH, 3), 90, np.uint8)
    picture[20:-20, WIDTH // 4 : WIDTH // 4 + WIDTH // 2] = spots[20:-20, column, None]
    return picture


def turns() -> npt.NDArray[np.float64]:
    """Return (N,) shares of the turn at every frame: a stop in the middle, then twice as fast."""
    speed = np.ones(FRAME_COUNT)
    speed[40:60], speed[60:] = 0.0, 2.0
    return np.cumsum(speed) / speed.sum()


def write(path: Path, pictures: list[npt.NDArray[np.uint8]], codec: str = "mp4v") -> Path:
    """Write a video, every third frame of it blurred as by a shaking hand."""
    code = cv2.VideoWriter.fourcc(*codec)
    file = cv2.VideoWriter(str(path), code, 30.0, (WIDTH, HEIGHT))
    if not file.isOpened():
        pytest.skip("this OpenCV writes no videos")
    for index, picture in enumerate(pictures):
        file.write(cv2.GaussianBlur(picture, (0, 0), 2) if index in BLURRED else picture)
    file.release()
    return path


@pytest.fixture(scope="module")
def turn(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A video of an uneven turn."""
    path = tmp_path_factory.mktemp("video") / "turn.mp4"
    return write(path, [head(share) for share in turns()])


def test_frames_are_even_steps_of_the_turn_and_sharp(turn: Path) -> None:
    """However the speed changes, steps are near even ones; blurred frames are left."""
    capture = read_capture(turn)
    assert len(capture.views) == FRAMES
    numbers = [int(str(view.photo_path).rpartition("#")[2]) for view in capture.views]
    assert not set(numbers) & set(BLURRED)
    steps = np.diff(turns()[numbers])
    assert steps.min() > 0.4 / FRAMES
    assert steps.max() < 1.6 / FRAMES
    assert capture.source == turn
    assert not any(view.named for view in capture.views)
    first = capture.views[0]
    assert first.photo_size == (WIDTH, HEIGHT)
    gap = np.abs(first.image.astype(float) - head(turns()[numbers[0]])).mean()
    assert gap < 12  # the codec's


def patched(path: Path, element: bytes, make: Callable[[bytes], bytes]) -> None:
    """Replace one element of a Matroska file, whose size is a single byte, by another as long."""
    data = path.read_bytes()
    begin = data.index(element)
    size_at = begin + len(element)
    end = size_at + 1 + (data[size_at] & 0x7F)
    path.write_bytes(data[:begin] + make(data[begin:end]) + data[end:])


@pytest.mark.parametrize("ending", [".mkv", ".webm"])
def test_frames_of_a_varying_rate_are_all_there(ending: str, tmp_path: Path) -> None:
    """A file without a count of frames is whole where they last as long as it claims."""
    path = write(tmp_path / f"turn{ending}", [head(share) for share in turns()], "VP80")
    duration = b"\x23\xe3\x83"  # of one frame, in nanoseconds: half as long, so twice as many
    patched(path, duration, lambda old: old[:4] + (int.from_bytes(old[4:]) // 2).to_bytes(4))
    claimed = cv2.VideoCapture(str(path)).get(cv2.CAP_PROP_FRAME_COUNT)
    assert claimed > 1.9 * FRAME_COUNT
    assert len(read_capture(path).views) == FRAMES


def test_a_file_that_ends_early_is_refused(tmp_path: Path) -> None:
    """Half the frames of a Matroska file are not taken for the whole turn."""
    path = write(tmp_path / "turn.mkv", [head(share) for share in turns()], "VP80")
    path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])
    with pytest.raises(InputError, match=r"only \d\.\d of 4\.\d s can be read"):
        read_video(path, 256)


def test_recordings_without_a_duration_are_looked_at_to_their_end(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """What a browser records claims no length; frames are then left out as it goes on."""
    monkeypatch.setattr(video, "MOST_SCANNED", 20)
    path = write(tmp_path / "turn.webm", [head(share) for share in turns()], "VP80")
    patched(path, b"\x44\x89\x88", lambda old: b"\xec" + bytes([0x80 | len(old) - 2]) + old[2:])
    capture = read_capture(path)
    numbers = [int(str(view.photo_path).rpartition("#")[2]) for view in capture.views]
    assert numbers[-1] > 0.9 * FRAME_COUNT


def test_frames_are_scaled_to_the_working_size(turn: Path) -> None:
    """The longer edge is that asked for; the size on disk stays known."""
    view = read_capture(turn, 128).views[3]
    assert (view.width, view.height) == (96, 128)
    assert view.photo_size == (WIDTH, HEIGHT)


def test_what_is_no_turn_is_refused_in_one_line(tmp_path: Path, turn: Path) -> None:
    """Damage, single frames, stills and other files name the video and say what is wrong."""
    whole = turn.read_bytes()
    still = [head(0.0)] * 40
    cases = {
        "not a readable video": (lambda p: p.write_bytes(whole[: len(whole) // 2])),
        "OpenCV cannot open it": (lambda p: p.write_text("hello")),
        "1 frames, expected a turn of at least": (lambda p: write(p, [head(0.0)])),
        "hardly anything moves": (lambda p: write(p, still)),
    }
    for reason, make in cases.items():
        path = tmp_path / "bad.mp4"
        make(path)
        with pytest.raises(InputError, match=reason) as caught:
            read_video(path, 256)
        assert str(path) in str(caught.value)
        assert "\n" not in str(caught.value)


def test_only_files_with_a_videos_ending_are_videos(tmp_path: Path) -> None:
    """Folders and photos are none, whatever their name."""
    (tmp_path / "turn.mp4").mkdir()
    (tmp_path / "TURN.MOV").touch()
    (tmp_path / "front.jpg").touch()
    assert [is_video(path) for path in sorted(tmp_path.iterdir())] == [True, False, False]


def test_the_sharpest_frame_near_each_place_is_chosen() -> None:
    """Frames are ascending, one a step, and none nearby is sharper."""
    rng = np.random.default_rng(2)
    motion, sharp = np.cumsum(rng.uniform(0.0, 2.0, 400)), rng.uniform(0.0, 1.0, 400)
    chosen = choose_frames(motion, sharp, 12)
    step = motion[-1] / 12
    assert (np.diff(chosen) > 0).all()
    for index, place in zip(chosen, (np.arange(12) + 0.5) * step, strict=True):
        near = np.abs(motion - place) <= 0.3 * step
        assert sharp[index] == sharp[near].max()


def test_a_turn_of_too_few_frames_is_refused() -> None:
    """Where one frame would have to stand for two places, the turn was too fast."""
    motion = np.array([0.0, 1.0, 2.0, 60.0, 61.0, 62.0, 63.0, 64.0])
    with pytest.raises(InputError, match="too fast"):
        choose_frames(motion, np.ones(8), 6)
