"""Print errors of 2D orientation against ground truth, in all pixels and in the confident half.

python benchmarks/orientation.py captures/ --pictures orientation/

Errors are mean degrees over true hair, the mask eroded by 4 pixels, where the truth is coherent
(`hairkit.imaging.masked_filters.coherent_truth`); guessing gives 45. `sure half` takes the pixels
with confidence above the view's median. Masks are the true ones; OpenCV runs on one thread.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import numpy.typing as npt
from captures_argument import NO_CAPTURES, add_captures
from hairkit_plugins import gabor, structure_tensor

from hairkit.evaluation.images import truth_angle
from hairkit.imaging.masked_filters import coherent_truth, fill_beyond, luminance
from hairkit.types.capture import View
from hairkit.types.mask import HAIR, Mask
from hairkit.types.orientation import OrientationMap, angle_between, wrap_angle

EDGE_PX = 4
Orient = Callable[[View, Mask], OrientationMap]


@dataclass(frozen=True)
class Sample:
    """One view with its truth."""

    view: View
    mask: Mask
    angle: npt.NDArray[np.float64]
    known: npt.NDArray[np.bool_]
    scored: npt.NDArray[np.bool_]


def main() -> None:
    """Print a table of methods by captures."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    add_captures(parser)
    parser.add_argument("--pictures", type=Path, help="folder for photos beside maps by hue")
    parser.add_argument("--only", action="append", help="name of a method; may be repeated")
    arguments = parser.parse_args()
    if arguments.captures is None:
        print(NO_CAPTURES)
        return
    cv2.setNumThreads(1)
    folders = sorted(path.parents[1] for path in arguments.captures.glob("*/truth/orientation"))
    captures = {folder.name: read_samples(folder) for folder in folders}
    methods = {n: m for n, m in METHODS.items() if not arguments.only or n in arguments.only}

    print("| method | " + " | ".join(captures) + " | mean | sure half | ms a view | time ratio |")
    print("|" + "---|" * (len(captures) + 5))
    naive_ms = None
    for name, orient in methods.items():
        scores = np.array([score(orient, samples) for samples in captures.values()])
        mean, sure, spent_ms = scores.mean(axis=0)
        naive_ms = naive_ms or spent_ms
        cells = [f"{row[0]:.1f} / {row[1]:.1f}" for row in scores]
        cells += [f"{mean:.2f}", f"{sure:.2f}", f"{spent_ms:.0f}", f"{spent_ms / naive_ms:.1f}"]
        print(f"| {name} | " + " | ".join(cells) + " |", flush=True)
        if arguments.pictures:
            write_pictures(arguments.pictures, name, orient, captures)


def read_samples(folder: Path) -> list[Sample]:
    """Return the views of a capture that have a mask and a true orientation."""
    samples = []
    for path in sorted((folder / "truth" / "orientation").glob("*.png")):
        photo: Any = cv2.imread(str(next((folder / "photos").glob(path.stem + ".*"))))
        labels: Any = cv2.imread(str(folder / "masks" / path.name), cv2.IMREAD_GRAYSCALE)
        truth: Any = cv2.imread(str(path), cv2.IMREAD_GRAYSCALE)
        view = View(path.stem, 0.0, np.ascontiguousarray(photo[..., ::-1]))
        edge = np.ones((2 * EDGE_PX + 1, 2 * EDGE_PX + 1), np.uint8)
        inner = cv2.erode((labels == HAIR).astype(np.uint8), edge) > 0
        angle, known = truth_angle(truth), truth > 0
        scored = inner & coherent_truth(angle.astype(np.float32), known)
        samples.append(Sample(view, Mask(labels, True), angle, known, scored))
    return samples


def score(orient: Orient, samples: list[Sample]) -> tuple[float, float, float]:
    """Return mean error, mean error of the sure half (degrees) and median CPU ms over the views."""
    errors, sure_errors, times = [], [], []
    for sample in samples:
        start = time.process_time()
        found = orient(sample.view, sample.mask)
        times.append(1000 * (time.process_time() - start))
        error = np.degrees(angle_between(found.angle, sample.angle))[sample.scored]
        confidence = found.confidence[sample.scored]
        errors.append(error.mean())
        sure_errors.append(error[confidence >= np.median(confidence)].mean())
    return float(np.mean(errors)), float(np.mean(sure_errors)), float(np.median(times))


def naive(gradient_sigma: float, window_sigma: float) -> Orient:
    """Return the plain structure tensor that the captures' baselines were taken with."""

    def orient(view: View, mask: Mask) -> OrientationMap:
        hair = mask.hair
        grey = cv2.GaussianBlur(
            fill_beyond(luminance(view.image), hair, 6.0), (0, 0), gradient_sigma
        )
        along_x, along_y = (cv2.Scharr(grey, cv2.CV_32F, *axis) * hair for axis in ((1, 0), (0, 1)))
        products = (along_x * along_x, along_y * along_y, along_x * along_y)
        xx, yy, xy = (cv2.GaussianBlur(p, (0, 0), window_sigma) for p in products)
        confidence = np.hypot(yy - xx, 2 * xy) / np.maximum(xx + yy, 1e-9)
        angle = wrap_angle(0.5 * np.arctan2(-2 * xy, yy - xx))
        return OrientationMap(angle, np.clip(confidence * hair, 0, 1))

    return orient


def plugin(module: Any, **options: Any) -> Orient:
    """Return a shipped orienter with some of its options set."""
    chosen = module.Options(**options)
    return lambda view, mask: module.orient(view, mask, chosen)


METHODS: dict[str, Orient] = {
    "naive structure tensor 2/12": naive(2.0, 12.0),
    "naive structure tensor 2/6": naive(2.0, 6.0),
    "structure_tensor": plugin(structure_tensor),
    "gabor": plugin(gabor),
    "gabor, not refined": plugin(gabor, iterations=0),
    "gabor, printed mean": plugin(gabor, iterations=0, zero_mean=False),
    "gabor, printed carrier": plugin(gabor, iterations=0, zero_mean=False, carrier="as_printed"),
    "gabor, quadrature": plugin(gabor, iterations=0, quadrature=True),
    "gabor, long quadrature": plugin(
        gabor,
        iterations=0,
        quadrature=True,
        difference_of_gaussians=True,
        kernel_size=15,
        sigma_v=5.0,
    ),
}


def write_pictures(
    folder: Path, name: str, orient: Orient, captures: dict[str, list[Sample]]
) -> None:
    """Write one picture a capture: photo, truth, found and confidence of three views."""
    folder.mkdir(parents=True, exist_ok=True)
    for capture, samples in captures.items():
        rows = [_row(sample, orient(sample.view, sample.mask)) for sample in samples[::3]]
        width = max(row.shape[1] for row in rows)
        sheet = [np.pad(row, ((0, 0), (0, width - row.shape[1]), (0, 0))) for row in rows]
        stem = name.replace(" ", "_").replace(",", "").replace("/", "-")
        cv2.imwrite(str(folder / f"{capture}-{stem}.png"), np.vstack(sheet))


def _row(sample: Sample, found: OrientationMap) -> npt.NDArray[np.uint8]:
    hair = sample.mask.hair
    rows, columns = np.flatnonzero(hair.any(axis=1)), np.flatnonzero(hair.any(axis=0))
    box = np.s_[rows[0] : rows[-1] + 1, columns[0] : columns[-1] + 1]
    grey = np.repeat((255 * found.confidence).astype(np.uint8)[..., None], 3, axis=2)
    parts = [sample.view.image, _hue(sample.angle, sample.known), _hue(found.angle, hair), grey]
    height = 420
    width = round((columns[-1] + 1 - columns[0]) * height / (rows[-1] + 1 - rows[0]))
    resized = [cv2.resize(p[box], (width, height), interpolation=cv2.INTER_AREA) for p in parts]
    return np.asarray(np.hstack(resized)[..., ::-1], np.uint8)


def _hue(angle: npt.NDArray[Any], shown: npt.NDArray[np.bool_]) -> npt.NDArray[np.uint8]:
    """Return RGB with half a turn of angle round the circle of hues, black where not shown."""
    hue = (angle / np.pi * 180).astype(np.uint8) % 180
    coded = np.dstack([hue, np.full_like(hue, 220), np.where(shown, 255, 0).astype(np.uint8)])
    return np.asarray(cv2.cvtColor(coded, cv2.COLOR_HSV2RGB), np.uint8)


if __name__ == "__main__":
    main()
