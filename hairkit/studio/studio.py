"""The studio's state: the project, its processes, and what is computed meanwhile.

Whatever changes in the project starts the hair again once the changes have paused; stages whose
inputs did not change are read from the work folder. Nothing has to be asked for.
"""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import Awaitable, Callable, Collection
from pathlib import Path
from typing import Any

from hairkit.errors import HairkitError
from hairkit.io.capture_reader import EDITS
from hairkit.nets.model_folder import model_folder
from hairkit.pipeline.work_folder import AHEAD
from hairkit.stages import EXPORT, OF_NAME, ROWS
from hairkit.studio.events import Events
from hairkit.studio.project import Project, Shot
from hairkit.studio.task_process import TaskError, TaskProcess
from hairkit.version import __version__

CHOICES = "capture.toml"
"""The file of what was chosen."""
QUIET_S = 0.6
"""Seconds without a change before the whole hair is made again; a preview is made at once."""
DRAFT_GUIDES = 300
"""Roots of the quick groom that is shown until the whole one is made."""
MEANWHILE = 6
"""Photos from which the hair is made unasked: fewer are a turn that is still being taken."""
PHOTO_S, BUILD_S, EXPORT_S = 120.0, 3600.0, 900.0
"""Longest times for a photo or an outline, a groom, and a file."""


class Studio:
    """One project being worked on."""

    def __init__(self, project: Project, guides: int) -> None:
        self.project = project
        self.guides = guides
        self.events = Events()
        self.editor, self.builder, self.drafter = TaskProcess(), TaskProcess(), TaskProcess()
        """For masks, for the hair, and for what must not wait for them: previews, and pictures of
        a camera that somebody holds."""
        self.change = asyncio.Lock()
        self.facts: dict[int, dict[str, Any]] = {}
        """What is known of each photo: size, feedback, outline."""
        self.build: dict[str, Any] = {"state": "none"}
        """`none`, `waiting`, `running`, `done` or `failed`, with progress or a reason."""
        self.held = False
        """True while somebody takes photos: nothing is built until that ends."""
        self.formats: list[list[str]] = []
        self._wanted = asyncio.Event()
        self._asked = False
        self._warm = False
        self._touched: set[str] | None = None
        """What changed since the last whole run, as of `changed`."""
        self._tasks: list[asyncio.Task[None]] = []
        self._shares: dict[str, tuple[int, int]] = {}

    async def start(self) -> None:
        """Begin to work on what is in the project."""
        self._tasks = [asyncio.create_task(self._look()), asyncio.create_task(self._build_always())]
        self.build = self._standing()
        if self.build["state"] == "done":
            self.project.draft.unlink(missing_ok=True)  # left by a studio that was killed
            self._touched = set()
            self._tasks.append(asyncio.create_task(self._warm_up()))
        else:
            self.changed()

    async def close(self) -> None:
        """End all processes; what is done is kept."""
        for task in self._tasks:
            task.cancel()
        self.events.close()
        for process in (self.editor, self.builder, self.drafter):
            process.close()
        await asyncio.gather(*self._tasks, return_exceptions=True)

    def changed(self, ask: bool = False, touched: Collection[str] | None = None) -> None:
        """Say that the project changed, or that somebody asks for the hair.

        `touched` are the files that changed, where previews follow that: photos that were drawn on,
        `EDITS`, `CHOICES`; and stages to be run otherwise. None is any other change.
        """
        if ask:
            self.held = False
            self._asked = True
        elif touched is None or self._touched is None:
            self._touched = None
        else:
            self._touched |= set(touched)
        self._wanted.set()
        if self._due():
            self.build = {"state": "waiting"}
        self._tell()

    def _tell(self) -> None:
        """Say to all pages how the project stands."""
        self.events.send("project", **self.summary())

    def _due(self) -> bool:
        """Return whether hair is to be made that has not been."""
        project = self.project
        fewest = 0 if self._asked else MEANWHILE
        ready = project.enough and len(project.shots) >= fewest and not self.held
        return ready and project.built != project.inputs()

    def _standing(self) -> dict[str, Any]:
        """Return what is said of the hair while none is made."""
        project = self.project
        if project.shots and project.built == project.inputs():
            return {"state": "done", **project.made}
        return {"state": "none"}

    def summary(self) -> dict[str, Any]:
        """Return the state of the project for pages."""
        project = self.project
        photos = [
            {
                "id": shot.id,
                "view": shot.view,
                "file": shot.file,
                "drawn": project.strokes(shot).is_file(),
                "tone": [shot.brightness, shot.contrast],
                "version": _version(project.photo(shot)),
                **{k: v for k, v in self.facts.get(shot.id, {}).items() if k not in _LARGE},
            }
            for shot in project.shots
        ]
        return {
            "name": project.folder.resolve().name,
            "photos": photos,
            "build": self.build,
            "result": _version(project.groom),
            "draft": _version(project.draft),
            "formats": self.formats,
        }

    async def add_photo(self, incoming: Path, view: str | None, number: int | None = None) -> Shot:
        """Take an upload into the project, as a new photo or in the place of one."""
        pictures = {size: str(incoming) + f".{size}" for size in ("small", "large")}
        try:
            values = {"incoming": str(incoming), **pictures}
            done = await self.drafter.call("accept", PHOTO_S, values)
            async with self.change:
                if number is None:
                    shot = self.project.add(incoming, done["suffix"], view)
                else:
                    shot = self.project.retake(number, incoming, done["suffix"])
                for size, path in pictures.items():
                    Path(path).replace(self.project.picture(shot, size))
        finally:
            for path in (str(incoming), *pictures.values()):
                Path(path).unlink(missing_ok=True)
        self.facts[shot.id] = done
        self.changed()
        return shot

    async def outline(self, shot: Shot) -> dict[str, Any]:
        """Return the outline of the hair in a photo, with what is drawn on it."""
        project = self.project
        facts = self.facts.setdefault(shot.id, {})
        files = [project.photo(shot), project.strokes(shot), project.mask(shot) or Path()]
        key = "/".join([__version__, *map(_version, files), *_models()])
        if facts.get("outline_of") != key:
            found = project.outline(shot, key)
            if found is None:
                try:
                    found = await self.editor.call("outline", PHOTO_S, self.drawn(shot))
                    project.keep_outline(shot, key, found)
                    facts.pop("problem", None)
                except TaskError as error:
                    found = {"outline": [], "share": 0.0}
                    facts["problem"] = str(error)
            facts.update(found, outline_of=key)
        return facts

    def drawn(self, shot: Shot) -> dict[str, Any]:
        """Return the files of a photo as tasks take them."""
        project, stem = self.project, Path(shot.file).stem
        strokes, mask = project.strokes(shot), project.mask(shot)
        return {
            "photo": str(project.photo(shot)),
            "strokes": str(strokes) if strokes.is_file() else None,
            "mask": None if mask is None else str(mask),
            "landmarks": project.landmarks().get(stem),
            "tone": [shot.brightness, shot.contrast],
            "project": str(project.folder),
            "seen": str(project.seen(shot)),
            "ahead": str(project.result / "work" / AHEAD / stem),
        }

    async def _look(self) -> None:
        """Find what is not known yet of the photos, one after the other."""
        while True:
            with contextlib.suppress(TaskError):
                if not self.formats:
                    self.formats = (await self.editor.call("formats", PHOTO_S))["formats"]
                    self._tell()
            for step in (self._look_at, self._follow, self._prepare):
                if await self._on_first(step):
                    break
            else:
                await asyncio.sleep(QUIET_S / 6)

    async def _on_first(self, step: Callable[[Shot], Awaitable[bool]]) -> bool:
        """Do something with the first photo that needs it; return whether one does."""
        for shot in list(self.project.shots):
            with contextlib.suppress(HairkitError, OSError, KeyError):  # it may go
                if await step(shot):
                    return True
        return False

    async def _look_at(self, shot: Shot) -> bool:
        """Draw the pictures of a photo and find its mask."""
        if not self.project.picture(shot, "large").is_file():
            await self.draw_pictures(shot)
        if "outline_of" in self.facts.setdefault(shot.id, {}):
            return False
        await self.outline(shot)
        self._tell()
        return True

    async def _follow(self, shot: Shot) -> bool:
        """Find the strands of a photo as soon as its mask stands, for previews."""
        facts, settings = self.facts[shot.id], self.project.folder / "capture.toml"
        key = f"{facts['outline_of']}/{_version(settings)}"
        if facts.get("strands_of") == key or "problem" in facts:
            return False
        facts["strands_of"] = key
        await self.editor.call("follow", PHOTO_S, self.drawn(shot))
        return True

    async def _prepare(self, shot: Shot) -> bool:
        """Do what a whole run will do with a photo alone, while the turn is still being taken."""
        facts, project = self.facts[shot.id], self.project
        early = self.held or len(project.shots) < MEANWHILE
        if not early or facts.get("prepared") == facts["outline_of"] or project.has_built(shot):
            return False
        facts["prepared"] = facts["outline_of"]
        await self.builder.call("prepare", PHOTO_S, self.drawn(shot))
        return True

    async def draw_pictures(self, shot: Shot) -> None:
        """Draw the pictures of a photo that pages show."""
        pictures = {size: str(self.project.picture(shot, size)) for size in ("small", "large")}
        photo = str(self.project.photo(shot))
        drawn = await self.editor.call("pictures", PHOTO_S, {"photo": photo, **pictures})
        self.facts.setdefault(shot.id, {}).update(drawn)

    async def _build_always(self) -> None:
        """Make the hair whenever the project has changed and the changes have paused."""
        while True:
            await self._wanted.wait()
            self._wanted.clear()
            if self._touched is not None and self._due() and self.project.groom.is_file():
                await self._draft(sorted(self._touched))
            with contextlib.suppress(TimeoutError):
                await asyncio.wait_for(self._wanted.wait(), QUIET_S)
                continue  # it changed again
            if not self._due():
                if self.project.built == self.project.inputs():  # a change was undone
                    self.project.draft.unlink(missing_ok=True)
                    self._tell()
                self._set_build(**self._standing())
                continue
            await self._while_unchanged(asyncio.create_task(self._build()))
            if self.build["state"] == "done" and not self._warm:
                self.builder, self.drafter = self.drafter, self.builder  # its kernels are loaded
                self._warm = True

    async def _while_unchanged(self, build: asyncio.Task[None]) -> None:
        """Wait for a build, or for a change, which ends it: its process is started anew."""
        change = asyncio.create_task(self._wanted.wait())
        try:
            await asyncio.wait({build, change}, return_when=asyncio.FIRST_COMPLETED)
        finally:
            change.cancel()
            build.cancel()
            await asyncio.gather(build, return_exceptions=True)

    async def _draft(self, touched: list[str]) -> None:
        """Make a quick groom of what a hand changed, unless the next change comes before."""
        self._set_build(state="running", share=0.0, words="a quick preview")
        await self.editor.idle()  # masks that are being found are not looked for twice
        if self._wanted.is_set():
            return
        change = asyncio.create_task(self._stop_on_change())
        try:
            done = await self._call_drafter(touched, self.project.draft)
            self.build |= {"astray": done.get("astray", [])}
            self._tell()
        except TaskError:
            pass  # the whole run follows, and says what is wrong
        finally:
            change.cancel()

    async def _warm_up(self) -> None:
        """Let the process for previews load its kernels, once, by a preview that nobody sees."""
        self._warm = True
        unseen = self.project.incoming / "unseen.bin"
        with contextlib.suppress(TaskError):
            await self._call_drafter([], unseen)
        unseen.unlink(missing_ok=True)

    async def _call_drafter(self, touched: list[str], packet: Path) -> Any:
        values = {
            "folder": str(self.project.folder),
            "packet": str(packet),
            "touched": {
                shot.file: str(self.project.seen(shot))
                for shot in self.project.shots
                if shot.file in touched
            },
            "guides": min(DRAFT_GUIDES, self.guides),
        }
        values["anew"] = [name for name in touched if name in OF_NAME]
        task = "edit" if touched == [EDITS] else "draft"
        return await self.drafter.call(task, BUILD_S, values)

    async def _stop_on_change(self) -> None:
        await self._wanted.wait()
        self.drafter.stop()

    async def _build(self) -> None:
        project, inputs = self.project, self.project.inputs()
        touched, self._touched = self._touched, set()
        self._shares = {}
        self._set_build(state="running", share=0.0)
        project.result.mkdir(exist_ok=True)
        try:
            done = await self.builder.call(
                "build",
                BUILD_S,
                {
                    "folder": str(project.folder),
                    "result": str(project.result),
                    "packet": str(project.result / "studio-hair.bin"),
                    "guides": self.guides,
                },
                self._hear,
            )
            project.set_built(inputs, done)
            touched = set()
            self._set_build(state="done", **done)
            self._tell()
        except (TaskError, OSError) as error:
            self._set_build(state="failed", reason=str(error))
        except asyncio.CancelledError:
            self._set_build(state="waiting")
            raise
        finally:
            both = (touched, self._touched)
            self._touched = None if None in both else set().union(*filter(None, both))

    def _hear(self, event: dict[str, Any]) -> None:
        """Pass the progress of a build on to the pages."""
        stage, shares = event.get("stage", ""), self._shares
        if event["event"] == "started":
            shares[stage] = (0, event["steps"])
        elif event["event"] == "stepped":
            shares[stage] = (shares[stage][0] + 1, shares[stage][1])
        elif event["event"] == "finished":
            shares[stage] = (1, 1)
        else:
            self._set_build(**self.build | {"message": event["text"]})
            return
        rows = {name: OF_NAME.get(name, EXPORT) for name in shares}  # exports go by plugin
        done = sum(rows[name].share * a / b for name, (a, b) in shares.items() if b)
        share = round(min(done / sum(row.share for row in ROWS), 1), 3)
        self._set_build(**self.build | {"share": share, "words": rows[stage].words})

    def _set_build(self, **values: Any) -> None:
        self.build = values
        self.events.send("build", **values)


_LARGE = ("outline", "landmarks", "outline_of", "strands_of", "prepared")


def _models() -> list[str]:
    """Return the names of the networks that are installed: outlines depend on them."""
    folder = model_folder()
    return sorted(path.name for path in folder.iterdir()) if folder.is_dir() else []


def _version(path: Path) -> str:
    """Return a text that changes when a file does, empty where there is none."""
    return str(path.stat().st_mtime_ns) if path.is_file() else ""
