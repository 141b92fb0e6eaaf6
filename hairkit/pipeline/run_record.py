"""The record of a run, `run.json`: what went in, what was done, what came out, how good it is."""

from __future__ import annotations

import dataclasses
import hashlib
import json
import os
import platform
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from types import MappingProxyType
from typing import Any, get_args

from hairkit.errors import FormatError
from hairkit.io.capture_reader import BESIDE
from hairkit.io.head_reader import HeadFile
from hairkit.manager import Manager
from hairkit.manager.command_plugin import PluginCommand
from hairkit.pipeline.figure import Figure
from hairkit.pipeline.recipe import Choice, Recipe, Selection, load_recipe, new_table, plugin_code
from hairkit.pipeline.run_log import StageTime
from hairkit.remote import is_url, join, read_bytes
from hairkit.stages import OF_TABLE
from hairkit.storage import read_text, write_text
from hairkit.system import utf8_name
from hairkit.types.capture import Capture
from hairkit.types.parting import Parting, PartingWord
from hairkit.version import __version__

RECORD = "run.json"
"""Name of the record beside the groom."""
VERSION = 1
"""Version of the record's form; it grows when what is in it changes its meaning."""
LIBRARIES = ("numpy", "scipy", "numba", "cv2", "moderngl", "pluggy")
"""Modules whose versions may change a result. OpenCV comes in several distributions."""
_MAX_RECORD_BYTES = 2**24


@dataclass(frozen=True)
class FileRecord:
    """A file and its content."""

    path: str
    """Inputs have absolute paths or URLs, outputs are named within the folder of the record."""
    sha256: str


@dataclass(frozen=True)
class PluginRecord:
    """One plugin of the recipe, with its options as they were resolved."""

    stage: str
    """Table of the recipe: `scene`."""
    plugin: str
    distribution: str
    """Name of the installed distribution, or the absolute path of a plugin file."""
    version: str
    code: str
    """Digest of the plugin's source and of what it imports, see `module_digest`."""
    options: Mapping[str, Any]
    file: str = ""
    """Where it exports to, if not to its usual file."""


@dataclass(frozen=True)
class RunRecord:
    """Everything that a run depends on, and what it gave."""

    hairkit: str
    """Version of hairkit."""
    platform: str
    libraries: Mapping[str, str]
    """Version of Python and of each library by name."""
    photos: str | None
    """What the stage `capture` was asked for: a folder, a video, or a name that its plugin knows;
    None when the photos were not read from anywhere."""
    max_edge: int | None
    """Long edge that photos were scaled down to, pixels."""
    head: HeadFile | None
    """File of the head; None for the default head and for one that was given as an object."""
    head_given: bool
    """True when the head was given as an object, which no file can bring back."""
    guides: int
    seed: int
    recipe: str
    recipe_source: str
    plugins: tuple[PluginRecord, ...]
    inputs: tuple[FileRecord, ...]
    stages: tuple[StageTime, ...] = ()
    health: tuple[Figure, ...] = ()
    outputs: tuple[FileRecord, ...] = ()
    commands: tuple[PluginCommand, ...] = ()
    """Plugins that ran in environments of their own."""
    parting: str | None = None
    """What `--parting` said; None where photos or `capture.toml` did."""

    def write(self, path: Path) -> None:
        """Write the record as JSON."""
        document = {"run_record": VERSION} | dataclasses.asdict(self)
        write_text(path, json.dumps(document, indent=1, default=_plain) + "\n")

    def as_recipe(self) -> Recipe:
        """Return the recipe that was run, every option with its value."""
        stages = []
        for table in OF_TABLE:
            own = [p for p in self.plugins if new_table(p.stage, RECORD) == table]
            choices = tuple(Choice(p.plugin, MappingProxyType({**p.options}), p.file) for p in own)
            if choices:
                stages.append(Selection(table, choices))
        if not stages or stages[0].table != "capture":  # a record from before that stage
            stages[:0] = load_recipe("default").stages[:1]
        source = f"{RECORD} of {self.recipe_source}"
        return Recipe(self.recipe, source, "", tuple(stages), self.commands)

    def plugin_files(self) -> list[Path]:
        """Return the files of plugins that belong to no installed distribution."""
        commands = {command.name for command in self.commands}
        own = [record.distribution for record in self.plugins if record.plugin not in commands]
        return [Path(name) for name in dict.fromkeys(own) if name.endswith(".py")]


def describe_run(
    capture: Capture, head: object, recipe: Recipe, manager: Manager, guides: int, seed: int
) -> RunRecord:
    """Return the record of a run that is about to start.

    Parameters
    ----------
    capture
        The photos as they were read.
    head
        The head as it was given: a `HeadFile`, a `Head`, or None for the default head.
    recipe, manager
        What runs.
    guides, seed
        Of the roots.

    Raises
    ------
    InputError
        The name of an input is not UTF-8, so that no record can hold it.
    """
    head_file = head if isinstance(head, HeadFile) else None
    plugins = _plugins(recipe, manager)
    files = [*input_files(capture), *(head_file.files() if head_file else ()), *_named(plugins)]
    for file in files:
        utf8_name(file)  # names are written into records, which are UTF-8
    return RunRecord(
        hairkit=__version__,
        platform=platform.platform(),
        libraries=library_versions(),
        photos=_photos(capture),
        max_edge=capture.max_edge,
        head=head_file,
        head_given=head is not None and head_file is None,
        guides=guides,
        seed=seed,
        recipe=recipe.name,
        recipe_source=recipe.source,
        plugins=plugins,
        inputs=tuple(hash_file(path.resolve(), _at_url(path, capture)) for path in files),
        commands=recipe.commands,
        parting=_said_parting(capture.parting),
    )


def _said_parting(given: Parting | None) -> str | None:
    """Return the word of a parting that came with the command, not with the photos."""
    if given is None or given.source != "option":
        return None
    for word in get_args(PartingWord):
        parting = Parting.named(word)
        lines = [[] if each.line is None else each.line.tolist() for each in (given, parting)]
        if given.swept_back == parting.swept_back and lines[0] == lines[1]:
            return str(word)
    return None


def _photos(capture: Capture) -> str | None:
    """Return what the stage `capture` can be asked for again."""
    source = None if capture.source is None else str(capture.source.resolve())
    return capture.asked or source


def finish_record(
    record: RunRecord,
    outputs: Sequence[Path],
    stages: Sequence[StageTime],
    health: Sequence[Figure],
) -> RunRecord:
    """Return the record with what the run gave; outputs are named in the folder of the first."""
    folder = outputs[0].parent
    return dataclasses.replace(
        record,
        stages=tuple(stages),
        health=tuple(health),
        outputs=tuple(
            hash_file(path, path.relative_to(folder).as_posix())
            for path in outputs
            if path.is_file()
        ),
    )


def read_record(path: str | os.PathLike[str]) -> RunRecord:
    """Read a `run.json`; `InputError` when it is missing, `FormatError` when it is none."""
    try:
        document = json.loads(read_text(path, _MAX_RECORD_BYTES))
        if document.pop("run_record") != VERSION:
            raise FormatError(f"{path}: a record of another version, this hairkit reads {VERSION}")
        head = document["head"]
        return RunRecord(
            **document
            | {
                "head": None if head is None else HeadFile(**head),
                "plugins": tuple(PluginRecord(**each) for each in document["plugins"]),
                "inputs": tuple(FileRecord(**each) for each in document["inputs"]),
                "stages": tuple(StageTime(**each) for each in document["stages"]),
                "health": tuple(Figure(**each) for each in document["health"]),
                "outputs": tuple(FileRecord(**each) for each in document["outputs"]),
                "commands": tuple(_command(each) for each in document.get("commands", ())),
            }
        )
    except FormatError:
        raise
    except (ValueError, KeyError, TypeError, AttributeError, RecursionError) as error:
        raise FormatError(f"{path}: not the record of a run ({error})") from error


def input_files(capture: Capture) -> list[Path]:
    """Return the files that a capture was read from, those that exist, each once."""
    views = capture.views
    named = [path for v in views for path in (v.photo_path, v.mask_path, v.strokes_path)]
    source = capture.source
    if source is not None:
        named += [source, *(source / name for name in BESIDE)]
    return [path for path in dict.fromkeys(named) if path is not None and path.is_file()]


def _at_url(path: Path, capture: Capture) -> str | None:
    """Return where a file was fetched from; None for one that lies where it is."""
    asked, source = capture.asked, capture.source
    if asked is None or not is_url(asked) or source is None or not path.is_relative_to(source):
        return None
    return join(asked, *path.relative_to(source).parts)


def hash_file(path: str | os.PathLike[str], name: str | None = None) -> FileRecord:
    """Return the SHA-256 of a file at a path or a URL, under that or under another name."""
    return FileRecord(name or str(path), hashlib.sha256(read_bytes(path)).hexdigest())


def library_versions() -> dict[str, str]:
    """Return the versions of Python and of the libraries that compute results."""
    versions = {name: str(import_module(name).__version__) for name in LIBRARIES}
    return {"python": platform.python_version()} | versions


def _plugins(recipe: Recipe, manager: Manager) -> tuple[PluginRecord, ...]:
    records = []
    for stage in recipe.stages:
        for choice in stage.choices:
            options = manager.options(choice.plugin, choice.options)
            values = {} if options is None else dataclasses.asdict(options)
            info = manager.info(choice.plugin)
            code = plugin_code(info)
            file = Path(info.distribution)
            origin = str(file.resolve()) if file.is_file() else info.distribution
            records.append(
                PluginRecord(
                    stage.table, choice.plugin, origin, info.version, code, values, choice.file
                )
            )
    return tuple(records)


def _command(values: dict[str, Any]) -> PluginCommand:
    return PluginCommand(**values | {"command": tuple(values["command"])})


def _named(plugins: Sequence[PluginRecord]) -> list[Path]:
    """Return the files of plugins and those that their options name, each once."""
    values = [value for record in plugins for value in record.options.values()]
    files = [value for value in values if isinstance(value, Path)]
    files += [Path(record.distribution) for record in plugins]
    return [path for path in dict.fromkeys(files) if path.is_file()]


def _plain(value: Any) -> str:
    if isinstance(value, Path):
        return str(value)
    raise TypeError(f"a record cannot hold {type(value).__name__}")
