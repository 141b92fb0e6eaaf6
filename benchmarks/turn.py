"""Print how well the turn is found whatever order and position the photos are in.

python benchmarks/turn.py captures/ --photos-alone
python benchmarks/turn.py --seconds turn/     # hairkit synth straight --views 36 -o turn
python benchmarks/turn.py captures/ --cameras # what cameras put right
python benchmarks/turn.py captures/ --scores  # F of whole runs

Faces and persons are those of the capture (landmarks.json, masks/) unless `--photos-alone` asks the
networks (`hairkit models install`). Names of files are ignored. A turn counts as found when no
photo is more than 30 degrees off; the true turn is in truth/. `--cameras` judges turns by their
cameras, as a run does: those of all photos, and of all but one, on photos alone, shuffled.
`--seconds` prints instead what whole runs on 3 to 36 of the photos of one turn take, `--scores` how
well whole runs on the photos alone score in each order.
"""

from __future__ import annotations

import argparse
import hashlib
import resource
import shutil
import tempfile
import time
from collections.abc import Iterable
from dataclasses import dataclass, replace
from pathlib import Path

import cv2
import numpy as np
import numpy.typing as npt
from captures_argument import NO_CAPTURES, add_captures
from hairkit_plugins import auto_matte, face_mesh, landmark_files, mask_files, photo_turn, selfie

from hairkit import Capture, View
from hairkit.errors import InputError
from hairkit.evaluation import evaluate, read_prediction, read_truth
from hairkit.head_model.template import default_head
from hairkit.io.capture_reader import read_capture
from hairkit.options import make_options
from hairkit.pipeline.judge_turn import judge_turn
from hairkit.pipeline.reconstruct import reconstruct
from hairkit.types.face import Face
from hairkit.types.person import Person
from hairkit.types.turnaround import Turnaround

FOUND_DEG = 30.0
"""Error of the worst photo up to which a turn is found."""
SURE = 1.25
"""Margin from which health is green."""
SHUFFLES = 8
"""Random orders tried of each capture."""
COUNTS = (3, 8, 12, 24, 36)
"""Numbers of photos of which runs are timed."""


GUIDES = 8000
"""Strands of the runs that are scored."""
ORDERS = {
    "as taken": lambda count: np.arange(count),
    "other way": lambda count: np.arange(count)[::-1],
    "other first": lambda count: np.roll(np.arange(count), 3),
    "shuffled": lambda count: np.random.default_rng(0).permutation(count),
    "on their side": lambda count: np.arange(count),
}
"""Orders of a capture's photos of which whole runs are scored."""


@dataclass(frozen=True)
class Photo:
    """A photo with what is found in it, and from where it was taken."""

    view: View
    face: Face
    person: Person
    azimuth_deg: float


def main() -> None:
    """Find the turn of every capture that has truth, in its order and in others."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    add_captures(parser)
    parser.add_argument("--photos-alone", action="store_true", help="faces and persons by networks")
    parser.add_argument("--seconds", type=Path, metavar="FOLDER", help="capture of runs to time")
    parser.add_argument("--cameras", action="store_true", help="turns that cameras put right")
    parser.add_argument("--scores", action="store_true", help="F of whole runs in each order")
    parser.add_argument("--guides", type=int, default=GUIDES, help="strands of a scored run")
    arguments = parser.parse_args()
    if arguments.seconds is not None:
        print_seconds(arguments.seconds)
        return
    if arguments.captures is None:
        print(NO_CAPTURES)
        return
    if arguments.cameras:
        print_judged(arguments.captures)
        return
    if arguments.scores:
        print_scores(arguments.captures, arguments.guides)
        return
    print(
        "| capture | azimuth | worst | margin | turned about | on its side | shuffled | one out |"
    )
    print("|---|---|---|---|---|---|---|---|")
    for folder in sorted(path.parent for path in arguments.captures.glob("*/truth")):
        print(_row(folder.name, _photos(folder, arguments.photos_alone)))


def print_judged(captures: Path) -> None:
    """Print how many turns, whole and with a photo left out, are in order, and with cameras.

    Photos are given in random orders, since files in that of the turn are evidence.

    "Silent" ones are wrong after all, with a margin of 1.25 and more. Seconds are the processor's.
    """
    matte = make_options(auto_matte.Options, {}, "auto_matte")
    generator = np.random.default_rng(0)
    print("| capture | turns | in order | with cameras | silent | margin | with cameras | s each |")
    print("|---|---|---|---|---|---|---|---|")
    for folder in sorted(path.parent for path in captures.glob("*/truth")):
        photos, cells, spent = _photos(folder, True), [], 0.0
        for out in range(-1, len(photos)):
            chosen = [photos[k] for k in generator.permutation(len(photos)) if k != out]
            _, turn = _errors(chosen)
            if turn is None:
                continue
            seen = tuple(photo.view.with_findings(photo.face, photo.person) for photo in chosen)
            began = _processor_seconds()
            masks = tuple(auto_matte.segment(view, matte) for view in seen) if turn.others else ()
            judged = judge_turn(Capture(seen), masks, default_head(), turn)
            spent += _processor_seconds() - began
            before, after = (_in_order(each, chosen) for each in (turn, judged))
            silent = not after and judged.margin >= SURE
            cells.append((before, after, silent, turn.margin, judged.margin))
        found, right, silent, first, then = zip(*cells, strict=True)
        counts = f"{len(cells)} | {sum(found)} | {sum(right)} | {sum(silent)}"
        margins = f"{first[0]:.2f} | {then[0]:.2f}"
        print(f"| {folder.name} | {counts} | {margins} | {spent / len(cells):.1f} |", flush=True)


def print_seconds(folder: Path) -> None:
    """Print seconds of whole runs on some of the photos of a capture, without masks or landmarks.

    The first run loads and compiles; it is not printed. Processor time includes child processes.
    """
    photos = sorted(path for path in (folder / "photos").iterdir() if path.is_file())
    print("| photos | seconds | processor s | processor s a photo more |")
    print("|---|---|---|---|")
    before: tuple[int, float] | None = None
    _time_run(photos[:: max(1, len(photos) // COUNTS[0])])
    for count in (count for count in COUNTS if count <= len(photos)):
        chosen = [photos[round(i * len(photos) / count)] for i in range(count)]
        seconds, spent = _time_run(chosen)
        more = "" if before is None else f"{(spent - before[1]) / (count - before[0]):.2f}"
        print(f"| {count} | {seconds:.1f} | {spent:.1f} | {more} |", flush=True)
        before = (count, spent)


def print_scores(captures: Path, guides: int) -> None:
    """Print F 4 mm/40 (2 mm/20) of runs on photos of neutral names in every order of `ORDERS`.

    "=" marks a groom that is the first order's, byte for byte. The last columns are processor
    seconds of the first run, and of one with the capture's own masks and landmarks.
    """
    print("| capture | " + " | ".join(ORDERS) + " | photos alone, s | with masks, s |")
    print("|---|" + "---|" * (len(ORDERS) + 2))
    for folder in sorted(path.parent for path in captures.glob("*/truth")):
        cells: list[str] = []
        seconds: list[float] = []
        first = ""
        with tempfile.TemporaryDirectory() as place:
            began = _processor_seconds()
            reconstruct(folder, Path(place, "out"), guides=guides, sheet=False)
            given = _processor_seconds() - began
        for name, order in ORDERS.items():
            photos = sorted(path for path in (folder / "photos").iterdir() if path.is_file())
            chosen = [photos[i] for i in order(len(photos))]
            score, groom, spent = _score_run(folder, chosen, name == "on their side", guides)
            cells.append(score + (" =" if groom == first else ""))
            first, seconds = first or groom, [*seconds, spent]
        print(f"| {folder.name} | " + " | ".join(cells), end="")
        print(f" | {seconds[0]:.1f} | {given:.1f} |", flush=True)


def _score_run(
    folder: Path, photos: list[Path], lying: bool, guides: int
) -> tuple[str, str, float]:
    """Return a run's scores on renamed copies of the photos, its groom's SHA-256, and seconds."""
    with tempfile.TemporaryDirectory() as place:
        given, out = Path(place, "photos"), Path(place, "out")
        given.mkdir()
        for i, photo in enumerate(photos):
            if lying:
                picture = cv2.rotate(cv2.imread(str(photo)), cv2.ROTATE_90_CLOCKWISE)
                cv2.imwrite(str(given / f"{i:02}.png"), picture)
            else:
                shutil.copy(photo, given / f"{i:02}{photo.suffix}")
        began = _processor_seconds()
        try:
            reconstruct(given, out, guides=guides, sheet=False)
        except InputError as error:
            return f"refused: {error}", "", 0.0
        spent = _processor_seconds() - began
        result = evaluate(read_prediction(out), read_truth(folder / "truth"))
        f2, _, f4 = (100 * score.f for score in result.scores.all)
        digest = hashlib.sha256((out / "groom.npz").read_bytes()).hexdigest()
        return f"{f4:.1f} ({f2:.1f})", digest, spent


def _time_run(photos: list[Path]) -> tuple[float, float]:
    """Return wall and processor seconds of a run on copies of the photos."""
    with tempfile.TemporaryDirectory() as place:
        given = Path(place, "photos")
        given.mkdir()
        for photo in photos:
            shutil.copy(photo, given)
        began, spent = time.perf_counter(), _processor_seconds()
        reconstruct(given, Path(place, "out"), sheet=False)
        return time.perf_counter() - began, _processor_seconds() - spent


def _processor_seconds() -> float:
    """Return the processor time of this process and of its children that have ended."""
    usage = [resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)]
    return sum(each.ru_utime + each.ru_stime for each in usage)


def _photos(folder: Path, photos_alone: bool) -> list[Photo]:
    """Return the photos of a capture with all that `find_turn` is given."""
    capture, truth = read_capture(folder), read_truth(folder / "truth")
    true = [camera.azimuth_deg for camera in truth.cameras]
    named = dict(zip(truth.names, true, strict=True))
    photos = []
    for view, azimuth in zip(capture.views, true, strict=True):  # unnamed photos: by their files
        if photos_alone:
            mesh = make_options(face_mesh.Options, {}, "face_mesh")
            face = face_mesh.detect_landmarks(view, mesh)
            person = selfie.segment_person(view, make_options(selfie.Options, {}, "selfie"))
        else:
            face = landmark_files.detect_landmarks(view)
            mask = mask_files.segment(view)
            person = Person(np.where(mask.person, 255, 0).astype(np.uint8)) if mask else None
        photos.append(
            Photo(
                replace(view, named=False, landmarks=None),
                face or Face.absent(),
                person or Person.absent(),
                named[view.name] if view.named else azimuth,
            )
        )
    return photos


def _row(name: str, photos: list[Photo]) -> str:
    """Return one line of the table."""
    count = len(photos)
    errors, turn = _errors(photos)
    if turn is None:
        return f"| {name} | refused | | | | | | |"
    about = [np.roll(np.arange(count), first)[::step] for first in range(count) for step in (1, -1)]
    generator = np.random.default_rng(0)
    shuffled = [generator.permutation(count) for _ in range(SHUFFLES)]
    missing = [np.delete(np.arange(count), out) for out in range(count)]
    cells = [
        f"{errors.mean():.1f}",
        f"{errors.max():.1f}",
        f"{turn.margin:.2f}",
        _share(photos, about),
        _share([_lying(photo) for photo in photos], [np.arange(count)]),
        _share(photos, shuffled),
        _share(photos, missing),
    ]
    return f"| {name} | " + " | ".join(cells) + " |"


def _share(photos: list[Photo], orders: Iterable[npt.NDArray[np.int64]]) -> str:
    """Return how many of the orders give the true turn."""
    worst = [_errors([photos[i] for i in order])[0].max() for order in orders]
    return f"{np.count_nonzero(np.array(worst) < FOUND_DEG)} of {len(worst)}"


def _errors(photos: list[Photo]) -> tuple[npt.NDArray[np.float64], Turnaround | None]:
    """Return each photo's error in degrees, all 180 for a turn that is refused."""
    views = tuple(replace(p.view, name=f"view-{i}") for i, p in enumerate(photos))
    faces, persons = tuple(p.face for p in photos), tuple(p.person for p in photos)
    try:
        turn = photo_turn.find_turn(Capture(views), faces, persons)
    except InputError:
        return np.full(len(photos), 180.0), None
    true = np.array([photo.azimuth_deg for photo in photos])
    return np.abs((turn.azimuth_deg - true + 180) % 360 - 180), turn


def _in_order(turn: Turnaround, photos: list[Photo]) -> bool:
    """Return whether level photos have the order in which they lie around the head."""
    true = np.array([photo.azimuth_deg for photo in photos])[turn.order]
    steps = np.diff(true, append=true[0]) % 360
    return not turn.above.any() and bool(np.isclose(steps.sum(), 360))


def _lying(photo: Photo) -> Photo:
    """Return the photo on its right side."""
    face = photo.face.turned(1, photo.view.width, photo.view.height)
    person = Person(np.rot90(photo.person.alpha, -1))
    return Photo(photo.view.turned(1), face, person, photo.azimuth_deg)


if __name__ == "__main__":
    main()
