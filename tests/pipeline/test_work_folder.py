"""The work folder gives back what was kept under the same digest, and nothing else."""

from __future__ import annotations

import errno
import os
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import hairkit.pipeline.work_folder
from hairkit.errors import InputError
from hairkit.pipeline.work_folder import LastRun, WorkFolder, digest_of, stage_file
from hairkit.stages import LABELS, REFINED
from hairkit.testing import ball_mask, striped_view, turn_scene
from hairkit.types.mask import Mask, Masks

MASK = ball_mask(turn_scene().cameras[0])


def test_kept_is_found_again(tmp_path: Path) -> None:
    """What one run puts another gets, equal in every bit, if the digest is the same."""
    with WorkFolder(tmp_path / "work") as work:
        work.put(LABELS, MASK, "d1", "front")
    with WorkFolder(tmp_path / "work") as work:
        found = work.get(LABELS, "d1", "front")
        assert np.array_equal(found.labels, MASK.labels)
        assert found.person_known == MASK.person_known
        assert work.get(LABELS, "d2", "front") is None
        assert work.get(LABELS, "d1", "left") is None
    with WorkFolder(tmp_path / "work", reuse=False) as work:
        assert work.get(LABELS, "d1", "front") is None


NAMES = ("one a", "one_a", "one/a", "One_a", "X", "x", "à", "å", "a" * 300, "a" * 299, "..", "con")


def test_views_share_no_file(tmp_path: Path) -> None:
    """Views of any names have files of their own, where capitals do not count, too; plain names
    stay as they are."""
    files = [stage_file(tmp_path, LABELS, name).name for name in NAMES]
    assert len({file.lower() for file in files}) == len(NAMES)
    for name, file in zip(NAMES, files, strict=True):
        (tmp_path / file).write_text(name)
    assert stage_file(tmp_path, LABELS, "front-left").name == "segment-front-left.npz"


def test_the_last_run_is_read_whatever_it_was_made_from(tmp_path: Path) -> None:
    """A view called `left side` has its result; masks are the mended ones where there are any."""
    views = ("left side", "front")
    last = LastRun(tmp_path)
    assert last.masks(views) is None
    with pytest.raises(InputError, match="run all stages first"):
        last.latest(LABELS, "left side")
    with WorkFolder(tmp_path) as work:
        for view in views:
            work.put(LABELS, MASK, "d", view)
    found = last.masks(views)
    assert found is not None
    assert np.array_equal(found[0].labels, MASK.labels)
    assert last.every(LABELS, (*views, "back")) is None
    mended = Mask(MASK.labels, person_known=False)
    with WorkFolder(tmp_path) as work:
        work.put(REFINED, Masks((mended, mended)), "d")
    found = last.masks(views)
    assert found is not None
    assert not found[0].person_known
    assert not LastRun(None).has(LABELS, "front")


@pytest.mark.parametrize("size", [0, 10, 1000])
def test_a_damaged_file_counts_as_none(tmp_path: Path, size: int) -> None:
    """A stage file cut short is not used."""
    with WorkFolder(tmp_path) as work:
        work.put(LABELS, MASK, "d")
        work.flush()
        file = tmp_path / "segment.npz"
        file.write_bytes(file.read_bytes()[:size])
        assert work.get(LABELS, "d") is None


def test_a_flipped_bit_is_noticed(tmp_path: Path) -> None:
    """Every stage file carries checksums."""
    with WorkFolder(tmp_path) as work:
        work.put(LABELS, MASK, "d")
        work.flush()
        file = tmp_path / "segment.npz"
        data = bytearray(file.read_bytes())
        data[2000] ^= 1
        file.write_bytes(data)
        assert work.get(LABELS, "d") is None


def test_another_kind_of_content_counts_as_none(tmp_path: Path) -> None:
    """A file of another type under the right digest is not used."""
    with WorkFolder(tmp_path) as work:
        work.put(LABELS, turn_scene().cameras[0], "d")  # type: ignore[misc]
        work.flush()
        assert work.get(LABELS, "d") is None


def test_leftovers_of_a_killed_run_are_swept(tmp_path: Path) -> None:
    """Temporary files vanish when the next run begins."""
    (tmp_path / ".segment.npz.abc.part").write_bytes(b"half")
    with WorkFolder(tmp_path):
        assert [p.name for p in tmp_path.iterdir()] == [".lock"]


def test_a_full_disk_is_reported(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """An error of the background writer comes out when the folder is flushed."""

    def full(path: Path, *_: object, **__: object) -> None:
        raise OSError(errno.ENOSPC, "No space left on device", str(path))

    monkeypatch.setattr(hairkit.pipeline.work_folder, "write_npz", full)
    with pytest.raises(OSError, match="No space left"), WorkFolder(tmp_path) as work:
        work.put(LABELS, MASK, "d")


def test_one_run_at_a_time(tmp_path: Path) -> None:
    """A second run waits, says so once, and goes on when the first has ended, even killed."""
    code = (
        "import sys, time; from hairkit.pipeline.work_folder import WorkFolder\n"
        f"with WorkFolder({str(tmp_path)!r}): print('in', flush=True); time.sleep(60)"
    )
    other = subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE, text=True)
    try:
        assert other.stdout is not None
        assert other.stdout.readline() == "in\n"
        told = []

        def waiting() -> None:
            told.append(1)
            other.kill()

        with WorkFolder(tmp_path, waiting=waiting):
            assert told == [1]
    finally:
        other.kill()
        other.communicate()


def test_a_file_in_the_way_is_named(tmp_path: Path) -> None:
    """An output folder that is a file gives one line."""
    (tmp_path / "out").write_text("x")
    with pytest.raises(InputError, match="not a folder"), WorkFolder(tmp_path / "out" / "work"):
        pass


def test_digests_tell_content_apart(tmp_path: Path) -> None:
    """Equal content has equal digests; any change of value, type, shape or nesting another."""
    array = np.arange(6, dtype=np.float32)
    view = striped_view(30.0)
    values = [
        None, 0, 0.0, False, "", "0", (), ("a", "b"), (("a",), "b"), ("ab",), array,
        array.astype(np.float64), array.reshape(2, 3), array + 1, view, striped_view(31.0),
        replace(view, focal_px=1.0), replace(view, landmarks=np.ones((68, 2))),
    ]  # fmt: skip
    digests = [digest_of(value) for value in values]
    assert len(set(digests)) == len(digests)
    assert digest_of(striped_view(30.0)) == digest_of(view)
    assert digest_of("a", "b") != digest_of("ab", "")


def test_a_path_counts_with_its_content(tmp_path: Path) -> None:
    """Moving a file changes nothing; changing it does."""
    for name, text in {"a": "1", "b": "1", "c": "2"}.items():
        (tmp_path / name).write_text(text)
    a, b, c = (digest_of(tmp_path / name) for name in "abc")
    assert a == b != c
    os.utime(tmp_path / "a", (1, 1))
    assert digest_of(tmp_path / "a") == a


def test_what_has_no_digest_is_refused() -> None:
    """An unknown type is never digested by its address."""
    with pytest.raises(TypeError, match="no digest of a object"):
        digest_of(object())
