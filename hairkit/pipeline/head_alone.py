"""The head of a person from photos, without hair: fitted, with the skin of the photos."""

from __future__ import annotations

import os
import tempfile
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path

import numpy as np

from hairkit.errors import InputError
from hairkit.head_model.scalp import sample_roots
from hairkit.io.head_reader import write_head_obj
from hairkit.manager import Manager
from hairkit.parallel import one_blas_thread, thread_count
from hairkit.pipeline.findings import Findings
from hairkit.pipeline.recipe import Recipe
from hairkit.pipeline.reconstruct import tell_missing
from hairkit.pipeline.run_log import RunLog
from hairkit.pipeline.stage_runner import StageRunner
from hairkit.pipeline.take_capture import take_with_choices
from hairkit.pipeline.work_folder import WorkFolder
from hairkit.progress import Progress, Silent
from hairkit.types.capture import Capture
from hairkit.types.groom import Groom
from hairkit.types.head import Head
from hairkit.types.scene import Scene
from hairkit.types.strands import Strands

EXPORTERS = {".glb": "gltf", ".fbx": "fbx"}
"""Plugins that write a head without its hair, by the file's ending."""
ENDINGS = (*EXPORTERS, ".obj", ".npz")
"""Endings of files that a head is written to."""
_HEAD_ONLY = {"gltf": {"lines": "none", "hair": "none"}, "fbx": {}}
_STUB = 0.001
"""Metres of a strand that exporters are given, and told not to write."""


@one_blas_thread()
def photograph_head(
    photos: Capture | str | os.PathLike[str],
    recipe: Recipe | str | os.PathLike[str] = "default",
    manager: Manager | None = None,
    *,
    progress: Progress | None = None,
) -> Scene:
    """Return the head fitted to photos, with an albedo map taken from them, and the cameras.

    Parameters
    ----------
    photos
        The folder of a capture, or a capture that was read before.
    recipe
        The name of a recipe, to which the options of the capture are added, or a recipe; its stages
        up to `fit` and `texture` are run.
    manager
        The plugins; the installed ones when None.
    progress
        Receives the progress of the run; None reports nothing.

    Raises
    ------
    HairkitError
        The recipe, the photos or a plugin is at fault; the message is one line.
    """
    manager = manager or Manager.loaded()
    given, chosen = take_with_choices(photos, recipe, manager)
    log = RunLog(progress or Silent())
    with (
        tempfile.TemporaryDirectory(prefix="hairkit-head-") as folder,
        WorkFolder(folder) as work,
        ThreadPoolExecutor(thread_count(), thread_name_prefix="hairkit") as pool,
    ):
        tell_missing(chosen, manager, log)
        findings = Findings(StageRunner(chosen, manager, work, log, pool), given, None)
        scene = findings.scene.value
        return replace(scene, head=replace(scene.head, maps=findings.skin))


def write_head(path: str | os.PathLike[str], head: Head, manager: Manager | None = None) -> None:
    """Write a head as .glb, .fbx, .obj with its material, or .npz; `InputError` for others."""
    file = Path(path)
    suffix = file.suffix.lower()
    if suffix == ".obj":
        write_head_obj(file, head)
    elif suffix == ".npz":
        head.save(file)
    elif suffix in EXPORTERS:
        plugin = EXPORTERS[suffix]
        manager = manager or Manager.loaded()
        options = manager.options(plugin, _HEAD_ONLY[plugin])
        manager.call("export_groom", plugin, options, groom=_bald(head), path=file)
    else:
        raise InputError(f"{file}: a head is written as {', '.join(ENDINGS)}")


def _bald(head: Head) -> Groom:
    """Return the head as a groom of one stub, since exporters refuse grooms without strands."""
    roots = sample_roots(head, 1)
    points = np.concatenate([roots.positions, roots.positions + _STUB * roots.normals])
    strands = Strands(points.astype(np.float32), np.array([0, 2], np.int64))
    return Groom(strands, head, roots.triangle, roots.barycentric)
