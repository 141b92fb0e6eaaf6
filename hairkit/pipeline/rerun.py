"""Run a reconstruction again from its record, and compare what comes out."""

from __future__ import annotations

import dataclasses
import os
from pathlib import Path

from hairkit.errors import InputError
from hairkit.io.capture_reader import WORKING_EDGE
from hairkit.manager import Manager
from hairkit.pipeline.reconstruct import SHEET, reconstruct
from hairkit.pipeline.run_record import RECORD, RunRecord, hash_file, library_versions, read_record
from hairkit.pipeline.take_capture import take_capture
from hairkit.progress import Progress
from hairkit.remote import exists
from hairkit.types.groom import Groom
from hairkit.types.parting import Parting
from hairkit.version import __version__


@dataclasses.dataclass(frozen=True, eq=False)
class Rerun:
    """A run that was done again."""

    groom: Groom
    same: tuple[str, ...]
    """Names of the files with the bytes of the first run."""
    different: tuple[str, ...]
    """Names of the files with other bytes, and of those that only one of the runs has."""


def rerun(
    record: str | os.PathLike[str],
    out: str | os.PathLike[str],
    *,
    force: bool = False,
    progress: Progress | None = None,
) -> Rerun:
    """Run a recorded reconstruction again, every stage of it: `rerun("out/run.json", "again/")`.

    Parameters
    ----------
    record
        The `run.json` that `reconstruct` wrote.
    out
        Folder for the results.
    force
        Use photos and other inputs that have changed since.
    progress
        Receives the progress of the run, and a line when versions differ from those of the record.

    Raises
    ------
    InputError
        An input is missing or has changed since, or was never a file.
    """
    old = read_record(record)
    _check_inputs(old, Path(record), force)
    manager = Manager.loaded(old.plugin_files())
    old.as_recipe().check(manager)
    if progress is not None:
        for line in changed_versions(old, manager):
            progress.message(line)
    recipe = old.as_recipe()
    capture = take_capture(str(old.photos), recipe, manager, old.max_edge or WORKING_EDGE)
    if old.parting is not None:
        capture = dataclasses.replace(capture, parting=Parting.named(old.parting))
    groom = reconstruct(
        capture,
        out,
        recipe,
        manager,
        head=old.head,
        guides=old.guides,
        seed=old.seed,
        progress=progress,
        reuse=False,
        sheet=SHEET in {file.path for file in old.outputs},
    )
    return Rerun(groom, *compare_outputs(old, read_record(Path(out) / RECORD)))


def compare_outputs(old: RunRecord, new: RunRecord) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Return the names of the files that two runs wrote alike, and of all others."""
    first, second = ({f.path: f.sha256 for f in record.outputs} for record in (old, new))
    names = list(dict.fromkeys([*first, *second]))
    same = tuple(name for name in names if first.get(name) == second.get(name))
    return same, tuple(name for name in names if name not in same)


def changed_versions(old: RunRecord, manager: Manager) -> list[str]:
    """Return a line for each version that is not that of the record: results may differ."""
    now = {"hairkit": __version__, **library_versions()}
    then = {"hairkit": old.hairkit, **old.libraries}
    for record in old.plugins:
        info = manager.info(record.plugin)
        then[f"plugin {record.plugin}"] = f"{record.distribution} {record.version}".strip()
        now[f"plugin {record.plugin}"] = info.origin
    return [
        f"{name}: {now.get(name, 'missing')}, the record was made with {wanted}"
        for name, wanted in then.items()
        if now.get(name) != wanted
    ]


def _check_inputs(record: RunRecord, path: Path, force: bool) -> None:
    """Raise `InputError` naming the first input that cannot be used again."""
    if record.photos is None or record.head_given:
        what = "photos" if record.photos is None else "head"
        raise InputError(f"{path}: the {what} of this run were given as objects, not as files")
    for file in record.inputs:
        if not exists(file.path):
            raise InputError(f"{file.path}: no such file; {path} names it as an input")
        if not force and hash_file(file.path).sha256 != file.sha256:
            raise InputError(
                f"{file.path}: changed since {path} was written; --force runs with it as it is now"
            )
