"""Laws of projects: whatever happens, the folder is one that `hairkit reconstruct` reads."""

from __future__ import annotations

import json
import os
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from hairkit.errors import InputError
from hairkit.io.capture_reader import MOST, NAMES, TURN, read_capture
from hairkit.studio.project import Project


def upload(project: Project, photo: Path) -> Path:
    """Return a photo as an upload that was cleaned."""
    path = project.incoming / f"upload-{photo.name}"
    shutil.copy(photo, path)
    return path


def filled(folder: Path, photos: list[Path], named: bool = True) -> Project:
    """Return a project with photos, named as their files are or not."""
    project = Project(folder)
    for photo in photos:
        view = photo.stem.partition("_")[2] if named else None
        project.add(upload(project, photo), ".jpg", view)
    return project


LINE = {"label": "foreground", "shape_type": "linestrip", "points": [[1, 1], [9, 9]]}


@pytest.mark.parametrize("named", [True, False])
def test_a_project_is_a_capture(tmp_path: Path, photos: list[Path], named: bool) -> None:
    """Photos are read in their order; names of views count where all have one."""
    project = filled(tmp_path / "p", photos, named)
    capture = read_capture(project.folder)
    assert [view.named for view in capture.views] == [named] * len(photos)
    assert [view.photo_path.name for view in capture.views if view.photo_path] == [
        shot.file for shot in project.shots
    ]
    if named:
        assert [view.name for view in capture.views] == list(TURN)


def test_names_are_the_servers_own(tmp_path: Path, photos: list[Path]) -> None:
    """A view's name that hairkit does not know is left out, and files have numbers."""
    project = filled(tmp_path / "p", photos[:3], named=False)
    shot = project.add(upload(project, photos[3]), ".jpg", "../../etc/passwd")
    assert shot.view is None
    assert shot.file == "004.jpg"
    assert all(shot.view is None or shot.view in NAMES for shot in project.shots)


def test_the_order_is_kept_and_read(tmp_path: Path, photos: list[Path]) -> None:
    """The order that was dragged is that of the capture, after opening it again too."""
    project = filled(tmp_path / "p", photos)
    project.arrange([3, 1, 2, *range(4, len(photos) + 1)])
    again = Project(project.folder)
    assert [shot.id for shot in again.shots][:3] == [3, 1, 2]
    names = [view.photo_path.name for view in read_capture(again.folder).views if view.photo_path]
    assert names[:3] == ["003.jpg", "001.jpg", "002.jpg"]
    with pytest.raises(InputError, match="other photos"):
        again.arrange([1, 2])


def test_strokes_and_landmarks_go_with_their_photo(tmp_path: Path, photos: list[Path]) -> None:
    """Removing a photo removes what was drawn on it; the rest is still a capture."""
    project = filled(tmp_path / "p", photos)
    project.draw(2, {"flags": {"corrects": True}, "shapes": [LINE]})
    project.mark(2, [[float(i), 1.0] for i in range(68)])
    assert read_capture(project.folder).views[1].strokes_path is not None
    assert read_capture(project.folder).views[1].landmarks is not None
    project.remove(2)
    capture = read_capture(project.folder)
    assert len(capture.views) == len(photos) - 1
    assert all(view.strokes_path is None and view.landmarks is None for view in capture.views)


@pytest.mark.parametrize("shape", [{"label": "wig"}, {"points": []}, {"shape_type": "spiral"}, 7])
def test_a_drawing_is_checked(tmp_path: Path, photos: list[Path], shape: Any) -> None:
    """What is not a drawing is refused and leaves the file as it was."""
    project = filled(tmp_path / "p", photos[:1])
    good = {"flags": {"corrects": True}, "shapes": [LINE]}
    project.draw(1, good)
    bad = LINE | shape if isinstance(shape, dict) else shape
    with pytest.raises(InputError):
        project.draw(1, {"shapes": [bad]})
    assert json.loads(project.strokes(project.shot(1)).read_text()) == good


def test_what_somebody_else_wrote_stays(tmp_path: Path, photos: list[Path]) -> None:
    """A folder of photos with a capture.toml is opened as it is, and keeps its settings."""
    folder = tmp_path / "mine"
    shutil.copytree(photos[0].parent, folder)
    text = "focal_mm_equivalent = 50.0\n\n[head]\nscale = 1.1\n"
    (folder / "capture.toml").write_text(text)
    project = Project(folder)
    assert [shot.view for shot in project.shots] == [p.stem.partition("_")[2] for p in photos]
    project.arrange([2, 1, *range(3, len(photos) + 1)])
    assert (folder / "capture.toml").read_text().startswith(text.rstrip())
    assert read_capture(folder).head_pose is not None


def test_it_is_full_at_the_readers_limit(tmp_path: Path, photos: list[Path]) -> None:
    """No more photos are taken than a capture may have."""
    project = filled(tmp_path / "p", [photos[0]] * MOST, named=False)
    with pytest.raises(InputError, match="most"):
        project.add(upload(project, photos[0]), ".jpg")
    assert len(read_capture(project.folder).views) == MOST


class PowerError(BaseException):
    """The machine stopped."""


def steps_of(change: Callable[[], None], monkeypatch: pytest.MonkeyPatch, last: int) -> bool:
    """Do a change but stop before its file operation number `last`; return whether it was cut."""
    done = 0

    def counted(real: Callable[..., Any]) -> Callable[..., Any]:
        def call(*arguments: Any, **named: Any) -> Any:
            nonlocal done
            done += 1
            if done > last:
                raise PowerError
            return real(*arguments, **named)

        return call

    with monkeypatch.context() as patch:
        patch.setattr(os, "replace", counted(os.replace))
        patch.setattr(os, "unlink", counted(os.unlink))
        try:
            change()
        except PowerError:
            return True
    return False


@pytest.mark.parametrize("what", ["add", "retake", "remove", "arrange", "draw", "mark"])
def test_a_crash_at_any_step_leaves_a_capture(
    tmp_path: Path, photos: list[Path], monkeypatch: pytest.MonkeyPatch, what: str
) -> None:
    """Cut before each of its file operations, every change leaves a folder that is read."""
    for last in range(12):
        project = filled(tmp_path / f"{what}{last}", photos)
        project.draw(2, {"flags": {"corrects": True}, "shapes": [LINE]})
        project.mark(2, [[float(i), 1.0] for i in range(68)])
        new = upload(project, photos[0])
        changes: dict[str, Callable[[], Any]] = {
            "add": lambda p=project, n=new: p.add(n, ".jpg", "top"),
            "retake": lambda p=project, n=new: p.retake(2, n, ".png"),
            "remove": lambda p=project: p.remove(2),
            "arrange": lambda p=project: p.arrange([2, 1, *range(3, len(photos) + 1)]),
            "draw": lambda p=project: p.draw(1, {"shapes": [LINE]}),
            "mark": lambda p=project: p.mark(1, [[float(i), 2.0] for i in range(68)]),
        }
        cut = steps_of(changes[what], monkeypatch, last)
        read_capture(project.folder)
        again = Project(project.folder)
        assert len(again.shots) in {len(photos) - 1, len(photos), len(photos) + 1}
        read_capture(again.folder)
        if not cut:
            return
    raise AssertionError("a change of more than 12 file operations")


@pytest.mark.parametrize("named", [True, False])
def test_photos_that_came_or_went_by_hand_are_found(
    tmp_path: Path, photos: list[Path], named: bool
) -> None:
    """A project whose photos somebody changed in the folder is a capture once it is opened."""
    project = filled(tmp_path / "p", photos, named)
    if not named:
        project.arrange([2, 1, *range(3, len(photos) + 1)])
    (project.photo_folder / "003.jpg").unlink()
    shutil.copy(photos[0], project.photo_folder / "extra.jpg")
    again = Project(project.folder)
    assert [shot.file for shot in again.shots][-1] == "extra.jpg"
    assert len(read_capture(again.folder).views) == len(photos)


def test_hair_of_another_version_is_made_again(
    tmp_path: Path, photos: list[Path], monkeypatch: pytest.MonkeyPatch
) -> None:
    """What pages cannot read is not the hair of the project's photos any more."""
    project = filled(tmp_path / "p", photos[:1])
    project.result.mkdir()
    project.groom.write_bytes(b"hair")
    project.set_built(project.inputs(), {})
    assert project.built == project.inputs()
    monkeypatch.setattr("hairkit.studio.project.PACKET", "HKS1")
    assert project.built != project.inputs()
