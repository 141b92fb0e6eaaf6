"""Laws of what is computed meanwhile: what a change starts, what it ends, and in which order."""

from __future__ import annotations

import asyncio
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from waiting import run

from hairkit.stages import ORIENTED
from hairkit.studio.project import Project
from hairkit.studio.studio import CHOICES, Studio
from hairkit.types.chosen import ChosenHair

LINE = {"label": "background", "shape_type": "linestrip", "points": [[1, 1], [9, 9]]}
LONGEST_S = 20.0


class Process:
    """A process that only writes down what it is asked; a groom takes as long as `pause_s`."""

    def __init__(self, calls: list[tuple[str, Any]], groom: Path) -> None:
        self.calls, self.groom, self.pause_s = calls, groom, 0.0
        self.looks: list[tuple[str, str]] = []
        """Tasks on single photos, with the photo's file."""

    async def call(self, do: str, limit_s: float, values: Any = None, tell: Any = None) -> Any:
        """Answer as an empty task would."""
        if do == "build":
            self.calls.append((do, None))
        elif do == "draft" and "unseen" not in values["packet"]:
            self.calls.append((do, [*values["touched"], *values["anew"]]))
        if do in ("outline", "follow", "prepare"):
            self.looks.append((do, Path(values["photo"]).name))
        if do == "build":
            try:
                await asyncio.sleep(self.pause_s)
            except asyncio.CancelledError:
                self.calls.append(("ended", None))
                raise
            self.groom.write_bytes(b"groom")
        if do == "draft":
            Path(values["packet"]).write_bytes(b"packet")
        return {"formats": [["native", ".npz"]], "outline": [], "share": 0.5}

    async def idle(self) -> None:
        """Do nothing: no task takes long."""

    def stop(self) -> None:
        """End nothing."""

    def close(self) -> None:
        """End nothing."""


@pytest.fixture
def studio(tmp_path: Path, photos: list[Path]) -> Studio:
    """A studio on eight photos whose processes do nothing."""
    folder = tmp_path / "head"
    (folder / "photos").mkdir(parents=True)
    for photo in photos:
        shutil.copy(photo, folder / "photos")
    made = Studio(Project(folder), 600)
    calls: list[tuple[str, Any]] = []
    for name in ("editor", "builder", "drafter"):
        setattr(made, name, Process(calls, made.project.groom))
    return made


async def until(ready: Callable[[], bool]) -> None:
    """Wait until something holds."""
    async with asyncio.timeout(LONGEST_S):
        while not ready():
            await asyncio.sleep(0.02)


def stroke(studio: Studio, number: int, x: int) -> None:
    """Draw on a photo, as the route does."""
    line = LINE | {"points": [[1, 1], [x, 9]]}
    studio.project.draw(number, {"flags": {"corrects": True}, "shapes": [line]})
    studio.changed(touched=[studio.project.shot(number).file])


def test_a_stroke_is_previewed_before_the_whole_hair_is_made(studio: Studio) -> None:
    """Photos make hair; a stroke makes a preview of its photo first; any other change does not."""
    calls = studio.builder.calls  # type: ignore[attr-defined]
    files = [shot.file for shot in studio.project.shots]

    async def story() -> None:
        await studio.start()
        await until(lambda: studio.build["state"] == "done")
        assert calls == [("build", None)]
        stroke(studio, 2, 20)
        stroke(studio, 4, 30)
        await until(lambda: len(calls) == 3 and studio.build["state"] == "done")
        assert calls[1:] == [("draft", [files[1], files[3]]), ("build", None)]
        assert not studio.summary()["draft"]  # the whole hair took its place
        studio.project.arrange([2, 1, *range(3, len(files) + 1)])
        studio.changed()
        await until(lambda: len(calls) == 4 and studio.build["state"] == "done")
        assert calls[3] == ("build", None)
        await studio.close()

    run(story)


def test_a_choice_is_previewed(studio: Studio) -> None:
    """Another look and a moved head need no photo again; other options need what they are of."""
    calls = studio.builder.calls  # type: ignore[attr-defined]
    chosen = ChosenHair(width_mm=0.2)

    async def story() -> None:
        await studio.start()
        await until(lambda: studio.build["state"] == "done")
        for options, anew in (({}, []), ({"finest_window": 2.5}, [ORIENTED.name])):
            calls.clear()
            studio.project.choose("structure_tensor", options, chosen)
            studio.changed(touched=[CHOICES, *anew])
            await until(lambda: len(calls) == 2 and studio.build["state"] == "done")
            assert calls == [("draft", anew), ("build", None)]
        await studio.close()

    run(story)


def test_a_photos_strands_are_found_as_soon_as_its_mask_stands(studio: Studio) -> None:
    """Before any hair is made; a stroke or a tone restarts the photo that it is on, and no
    other."""
    looks, calls = studio.editor.looks, studio.builder.calls  # type: ignore[attr-defined]
    files = [shot.file for shot in studio.project.shots]
    studio.held = True

    async def story() -> None:
        await studio.start()
        await until(lambda: len(looks) == 2 * len(files))
        assert sorted(looks) == sorted((do, f) for do in ("outline", "follow") for f in files)
        assert looks[: len(files)] == [("outline", file) for file in files]  # what is shown first
        assert calls == []
        studio.changed(ask=True)
        await until(lambda: studio.build["state"] == "done")
        looks.clear()
        stroke(studio, 3, 20)
        await studio.outline(studio.project.shot(3))
        await until(lambda: ("draft", [files[2]]) in calls)
        await until(lambda: studio.build["state"] == "done" and len(looks) > 1)
        assert looks == [("outline", files[2]), ("follow", files[2])]
        await studio.close()

    run(story)


def test_photos_are_prepared_while_the_turn_is_taken(studio: Studio) -> None:
    """While no hair may be made the builder does each new photo's own part of it, once."""
    looks = studio.builder.looks  # type: ignore[attr-defined]
    files = [shot.file for shot in studio.project.shots]
    studio.held = True

    async def story() -> None:
        await studio.start()
        await until(lambda: len(looks) == len(files))
        assert looks == [("prepare", file) for file in files]
        studio.changed(ask=True)
        await until(lambda: studio.build["state"] == "done")
        studio.held = True  # somebody takes a photo again
        await until(lambda: studio.builder.looks != looks)  # type: ignore[attr-defined]
        later = studio.builder.looks  # type: ignore[attr-defined]  # processes change places
        new = studio.project.retake(2, copied(studio, files[4]), ".jpg")
        studio.facts[new.id] = {}
        await until(lambda: bool(later))
        await asyncio.sleep(0.5)
        assert later == [("prepare", new.file)]
        await studio.close()

    run(story)


def copied(studio: Studio, file: str) -> Path:
    """An upload with the picture of a photo."""
    path = studio.project.incoming / "upload.bin"
    shutil.copyfile(studio.project.photo_folder / file, path)
    return path


def test_a_change_ends_a_build_that_it_makes_useless(studio: Studio) -> None:
    """The process ends at once; strokes of the build that was ended are previewed again."""
    calls = studio.builder.calls  # type: ignore[attr-defined]
    files = [shot.file for shot in studio.project.shots]

    async def story() -> None:
        await studio.start()
        await until(lambda: studio.build["state"] == "done")
        studio.builder.pause_s = LONGEST_S  # type: ignore[attr-defined]
        stroke(studio, 1, 20)
        await until(lambda: len(calls) == 3)
        assert studio.summary()["draft"]
        studio.builder.pause_s = 0.0  # type: ignore[attr-defined]
        stroke(studio, 2, 20)
        await until(lambda: studio.build["state"] == "done")
        assert calls[3:] == [("ended", None), ("draft", files[:2]), ("build", None)]
        await studio.close()

    run(story)


def test_an_undone_stroke_takes_its_preview_along(studio: Studio) -> None:
    """Where the hair is that of the strokes again, no preview says that hair is being made."""
    calls = studio.builder.calls  # type: ignore[attr-defined]

    async def story() -> None:
        await studio.start()
        await until(lambda: studio.build["state"] == "done")
        studio.builder.pause_s = LONGEST_S  # type: ignore[attr-defined]
        stroke(studio, 1, 20)
        await until(lambda: len(calls) == 3)
        assert studio.summary()["draft"]
        studio.project.draw(1, {"flags": {"corrects": True}, "shapes": []})
        studio.changed(touched=[studio.project.shot(1).file])
        await until(lambda: studio.build["state"] == "done")
        assert not studio.summary()["draft"]
        await studio.close()
        studio.project.draft.write_bytes(b"packet")  # as a studio leaves it that is killed
        again = Studio(studio.project, 600)
        for name in ("editor", "builder", "drafter"):
            setattr(again, name, getattr(studio, name))
        await again.start()
        assert not again.summary()["draft"]
        await again.close()

    run(story)
