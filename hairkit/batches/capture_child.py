"""The process that reconstructs one capture after the other, asked by `run_job`.

It answers `{"do": "capture", "job": {...}, "settings": {...}, "digest": "..."}` by the result, and
tells each stage that begins. It ends when its stdin does, so that nothing is left of a batch that
was killed.
"""

from __future__ import annotations

import errno
import hashlib
import os
import shutil
import time
from collections.abc import Callable, Mapping
from dataclasses import asdict
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

from hairkit import worker
from hairkit.errors import HairkitError, one_line
from hairkit.memory import keep_freed_memory
from hairkit.progress import Silent
from hairkit.system import peak_bytes

if TYPE_CHECKING:
    from hairkit.batches.jobs import Job, Settings
    from hairkit.manager import Manager
    from hairkit.pipeline.recipe import Recipe
    from hairkit.progress import Progress
    from hairkit.types.capture import Capture

THUMBNAIL = "thumbnail.jpg"
THUMBNAIL_EDGE, THUMBNAIL_QUALITY = 320, 80
"""Long edge in pixels and JPEG quality of the picture in the report: about 15 KB."""


def main() -> None:
    """Answer until stdin ends; nothing heavy is loaded before the first question."""
    worker.answer_questions({"capture": capture})


def capture(question: dict[str, Any], tell: Callable[[Any], None]) -> dict[str, Any]:
    """Return the result of one capture as JSON, a failure's, too."""
    from hairkit.batches.jobs import FAILED, Job, Result, Settings

    job, settings = Job(**question["job"]), Settings(**question["settings"])
    began, used = time.perf_counter(), time.process_time()
    try:
        made = _reconstruct(job, settings, tell)
        result = Result(job.name, **made, **_taken(began, used), digest=question["digest"])
        result.write()
    except (HairkitError, OSError, MemoryError) as error:
        line = explain(error)
        result = Result(job.name, FAILED, job.out, error=line, **_taken(began, used))
    return asdict(result)


def explain(error: BaseException) -> str:
    """Return one line about an error that the user can mend."""
    if isinstance(error, MemoryError):
        return "out of memory; give the batch fewer workers or smaller pictures"
    if isinstance(error, OSError) and not isinstance(error, HairkitError):
        named = f"{error.filename}: " if error.filename is not None else ""
        cure = "; free some space and run the batch again" if error.errno == errno.ENOSPC else ""
        return f"{named}{error.strerror or error}{cure}"
    return one_line(error)


def _reconstruct(job: Job, settings: Settings, tell: Callable[[Any], None]) -> dict[str, Any]:
    from hairkit.io.capture_reader import WORKING_EDGE
    from hairkit.pipeline.take_capture import take_with_choices
    from hairkit.pipeline.work_folder import WORK
    from hairkit.remote import forget, is_url, send

    _use_few_threads()
    manager, edge = _manager(settings.plugin_files), settings.max_edge or WORKING_EDGE
    given, recipe = take_with_choices(job.photos, settings.recipe, manager, settings.settings, edge)
    folder = _near(job)
    made = _results(folder, given, recipe, manager, settings, _Told(tell))
    if is_url(job.out):
        send(folder, job.out, without=WORK)
        shutil.rmtree(folder)
    if is_url(job.photos) and given.source is not None:
        forget(given.source)
    return made | {"out": job.out}


def _near(job: Job) -> Path:
    """Return the folder for a job's results on this machine; a second try finds the same one."""
    from hairkit.remote import copies, is_url

    if not is_url(job.out):
        return Path(job.out)
    return copies() / f"results-{hashlib.sha256(job.out.encode()).hexdigest()}"


def _results(
    folder: Path,
    given: Capture,
    recipe: Recipe,
    manager: Manager,
    settings: Settings,
    progress: Progress,
) -> dict[str, Any]:
    """Reconstruct, and return what is said of it."""
    from hairkit.batches.jobs import DONE
    from hairkit.pipeline.reconstruct import reconstruct
    from hairkit.pipeline.run_record import RECORD, read_record
    from hairkit.pipeline.work_folder import drop_work

    groom = reconstruct(
        given,
        folder,
        recipe,
        manager,
        guides=settings.guides,
        seed=settings.seed,
        progress=progress,
        sheet=settings.sheet,
    )
    record = read_record(folder / RECORD)
    scores = _scores(folder, given.source) if settings.scores else {}
    if settings.drop_work:
        drop_work(folder)
    return {
        "state": DONE,
        "strands": len(groom.strands),
        "thumbnail": _draw_thumbnail(folder, given.views[0].image),
        "stages": {stage.stage: stage.seconds for stage in record.stages if not stage.reused},
        "health": tuple(asdict(figure) for figure in record.health),
        "scores": scores,
    }


def _taken(began: float, used: float) -> dict[str, Any]:
    return {
        "seconds": round(time.perf_counter() - began, 3),
        "processor_seconds": round(time.process_time() - used, 3),
        "peak_bytes": peak_bytes(),
    }


@cache
def _manager(plugin_files: tuple[str, ...]) -> Manager:
    from hairkit.manager import Manager

    return Manager.loaded(plugin_files)


def _use_few_threads() -> None:
    """Let OpenCV use as many threads as Numba, which reads its number from the environment."""
    import cv2

    from hairkit.parallel import thread_count

    cv2.setNumThreads(thread_count())


def _draw_thumbnail(folder: Path, photo: Any) -> str:
    """Write a small picture: of the contact sheet, else of the first photo; return its name."""
    import cv2

    from hairkit.imaging.picture_file import write_picture
    from hairkit.pipeline.reconstruct import SHEET
    from hairkit.storage import read_bytes

    sheet = folder / SHEET
    picture = photo
    if sheet.is_file():
        import numpy as np

        data = np.frombuffer(read_bytes(sheet), np.uint8)
        decoded: Any = cv2.imdecode(data, cv2.IMREAD_COLOR)
        picture = decoded[..., ::-1]
    scale = THUMBNAIL_EDGE / max(picture.shape[:2])
    small = cv2.resize(picture, None, fx=scale, fy=scale, interpolation=cv2.INTER_AREA)
    write_picture(folder / THUMBNAIL, small, THUMBNAIL_QUALITY)
    return THUMBNAIL


def _scores(folder: Path, photos: Path | None) -> Mapping[str, float]:
    """Return F of all strands at each threshold, where the truth is known."""
    if photos is None or not (photos / "truth").is_dir():
        return {}
    from hairkit.evaluation import evaluate, read_prediction, read_truth

    found = evaluate(read_prediction(folder), read_truth(photos / "truth"))
    values = {f"F {s.distance_mm:g} mm/{s.angle_deg:g} deg": s.f for s in found.scores.all}
    return {name: round(float(value), 4) for name, value in values.items()}


class _Told(Silent):
    """Progress that tells the parent which stage has begun."""

    def __init__(self, tell: Callable[[Any], None]) -> None:
        self._tell = tell

    def started(self, stage: str, steps: int) -> None:
        self._tell(stage)


if __name__ == "__main__":
    os.environ.setdefault("OPENCV_LOG_LEVEL", "SILENT")
    keep_freed_memory()
    main()
