"""Fit the 68 landmarks to the points of the face mesh, and print how well they are found.

python benchmarks/face_landmarks.py captures/ --write

Captures need `truth/truth.json` with `landmarks3d`. Each landmark becomes a weighted sum of the
mesh points around it, by least squares over the faces of all captures and their mirror images.
Figures are for heads left out of the fit.
"""

from __future__ import annotations

import argparse
import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from captures_argument import NO_CAPTURES, add_captures
from hairkit_plugins.face_mesh import MODELS, Options, find_face, measure_angles
from hairkit_plugins.face_mesh.crops import find_mesh, refine_crop, wobble
from hairkit_plugins.face_mesh.detector import detect
from hairkit_plugins.face_mesh.landmark_table import (
    MESH_POINTS,
    MIRROR,
    NOISE,
    OBLIQUE_DEG,
    TABLE,
)

from hairkit.nets.model_folder import missing_models
from hairkit.nets.net_process import shared_nets
from hairkit.types.head import LANDMARKS
from hairkit.types.scene import read_cameras

POINTS = 12
"""Mesh points of a landmark. Twice as many change the mean error by 0.2 px of 1080, half by 0.5."""
STIFFNESS = 1e-4
"""Weight that keeps a landmark's weights near those of the three nearest points, crop edges
squared. Ten times more raises the mean error by 0.5 px of 1080, ten times less lowers it by 0.1."""
WIDEST_DEG, BEHIND_DEG = 60.0, 100.0
"""Views up to the first azimuth show a face; what is found beyond the second is none."""
FRONT_DEG = 20.0
HEIGHT = 1080.0
"""Errors are in pixels of a photo of this height."""
EYES, INNER = slice(36, 48), [*range(27, 48), 48, 51, 54, 57, 60, 62, 66]


@dataclass(frozen=True, eq=False)
class Sample:
    """One photo of a face."""

    head: str
    """The same for photos of the same head."""
    azimuth: float
    elevation: float
    meshes: Any
    """(2, 468, 3) median mesh and that of the mirror image, pixels of the photo."""
    landmarks: Any
    """(68, 2) true, pixels of the photo."""
    crop: float
    """Edge of the crop, pixels."""
    height: int


def main() -> None:
    """Print the table; with --write, store weights and noise in the plugin."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    add_captures(parser)
    parser.add_argument("--write", action="store_true", help="store the fit in the plugin")
    arguments = parser.parse_args()
    if arguments.captures is None:
        print(NO_CAPTURES)
        return
    if missing_models(MODELS):
        print("no networks; run hairkit models install")
        return
    samples = [sample for folder in _folders(arguments.captures) for sample in _samples(folder)]
    errors, angles = measure_left_out(samples)
    _print_errors(samples, errors, angles)
    print(f"surest face where there is none: {_false_presence(arguments.captures):.2f}")
    if arguments.write:
        _write_table(fit_weights(samples))
        _write_noise(samples, errors)


def _folders(captures: Path) -> list[Path]:
    truths = sorted(captures.glob("*/truth/truth.json"))
    return [path.parents[1] for path in truths if "landmarks3d" in json.loads(path.read_text())]


def _samples(folder: Path) -> list[Sample]:
    """Return the photos of a capture that show a face."""
    truth = folder / "truth" / "truth.json"
    points = np.array(json.loads(truth.read_text())["landmarks3d"])
    samples = []
    photos = sorted((folder / "photos").iterdir())
    for photo, camera in zip(photos, read_cameras(truth)[1], strict=True):
        azimuth, elevation = _direction(camera)
        if abs(azimuth) > WIDEST_DEG:
            continue
        image, nets = _read(photo), shared_nets()
        crop = detect(image, [0], 0.0, nets)[0].crop()
        crop = refine_crop(image, refine_crop(image, crop, nets), nets)
        meshes, _ = find_mesh(image, wobble(crop, Options().crops), nets)
        halves = np.median(np.array(np.split(meshes, 2)), axis=1)
        seen = camera.project(points)
        head = f"{points[:, 2].sum():.9f}"
        samples.append(Sample(head, azimuth, elevation, halves, seen, crop.size, len(image)))
    return samples


def _direction(camera: Any) -> tuple[float, float]:
    """Return azimuth and elevation of a camera in degrees."""
    back = -np.asarray(camera.forward)
    return float(np.degrees(np.arctan2(back[0], back[2]))), float(np.degrees(np.arcsin(back[1])))


def _read(photo: Path) -> Any:
    pixels: Any = cv2.imread(str(photo))
    return np.ascontiguousarray(pixels[..., ::-1])


def fit_weights(samples: list[Sample]) -> Any:
    """Return weights (68, 468) of mesh points; those of a landmark sum to one."""
    meshes = np.concatenate([sample.meshes[..., :2] / sample.crop for sample in samples])
    truths = np.concatenate(
        [np.stack([s.landmarks, s.landmarks[MIRROR]]) / s.crop for s in samples]
    )
    apart = np.linalg.norm(truths[:, :, None] - meshes[:, None], axis=-1).mean(axis=0)
    weights = np.zeros((LANDMARKS, MESH_POINTS))
    for landmark, order in enumerate(apart.argsort(axis=1)[:, :POINTS]):
        seen = (meshes[:, order] - truths[:, landmark, None]).transpose(0, 2, 1).reshape(-1, POINTS)
        near = np.where(np.arange(POINTS) < 3, 1 / 3, 0.0)
        normal = np.ones((POINTS + 1, POINTS + 1))
        normal[:POINTS, :POINTS] = seen.T @ seen / len(meshes) + STIFFNESS * np.eye(POINTS)
        normal[POINTS, POINTS] = 0.0
        right = np.append(STIFFNESS * near, 1.0)
        weights[landmark, order] = np.linalg.solve(normal, right)[:POINTS]
    return weights


def _landmarks(sample: Sample, weights: Any) -> Any:
    """Return landmarks (68, 3) of both meshes, averaged."""
    plain, mirrored = np.einsum("lm,cmx->clx", weights, sample.meshes)
    return (plain + mirrored[MIRROR]) / 2


def measure_left_out(samples: list[Sample]) -> tuple[Any, Any]:
    """Return errors (S, 68, 2) in pixels, yaw and pitch errors (S, 2), by fits without the head."""
    errors, angles = [], []
    for sample in samples:
        weights = fit_weights([other for other in samples if other.head != sample.head])
        found = _landmarks(sample, weights)
        errors.append(found[:, :2] - sample.landmarks)
        yaw, pitch, _ = measure_angles(found)
        angles.append((yaw - sample.azimuth, pitch - sample.elevation))
    return np.array(errors), np.array(angles)


def _print_errors(samples: list[Sample], errors: Any, angles: Any) -> None:
    scale = np.array([HEIGHT / sample.height for sample in samples])
    size = np.linalg.norm(errors, axis=-1) * scale[:, None]
    azimuth = np.abs([sample.azimuth for sample in samples])
    print("| views | photos | eyes px | 28 inner px | all px | yaw mean / worst | pitch |")
    print("|---|---|---|---|---|---|---|")
    for name, chosen in (("front", azimuth < FRONT_DEG), ("oblique", azimuth >= FRONT_DEG)):
        turned = np.abs(angles[chosen])
        print(
            f"| {name} | {chosen.sum()} | {size[chosen, EYES].mean():.1f}"
            f" | {size[chosen][:, INNER].mean():.1f} | {size[chosen].mean():.1f}"
            f" | {turned[:, 0].mean():.1f} / {turned[:, 0].max():.1f} | {turned[:, 1].mean():.1f} |"
        )


def _false_presence(captures: Path) -> float:
    """Return the largest presence of a face in photos from behind."""
    largest = 0.0
    for folder in _folders(captures):
        photos = sorted((folder / "photos").iterdir())
        cameras = read_cameras(folder / "truth" / "truth.json")[1]
        for photo, camera in zip(photos, cameras, strict=True):
            if abs(_direction(camera)[0]) > BEHIND_DEG:
                face = find_face(_read(photo), Options(), shared_nets())
                largest = max(largest, face.presence)
    return largest


def _write_table(weights: Any) -> None:
    rows = [f"{i},{k},{weights[i, k]:.5f}" for i, k in zip(*weights.nonzero(), strict=True)]
    TABLE.write_text("\n".join(["landmark,mesh_point,weight", *rows]) + "\n")


def _write_noise(samples: list[Sample], errors: Any) -> None:
    """Write the standard deviation of a coordinate at yaw 0 and 45, mirror images pooled."""
    share = errors / np.array([sample.crop for sample in samples])[:, None, None]
    squares = np.square(share).mean(axis=2)
    squares = (squares + squares[:, MIRROR]) / 2
    azimuth = np.abs([sample.azimuth for sample in samples])
    columns = [
        np.sqrt(squares[chosen].mean(axis=0))
        for chosen in (azimuth < FRONT_DEG, azimuth >= FRONT_DEG)
    ]
    rows = [
        f"{i},{front:.5f},{side:.5f}" for i, (front, side) in enumerate(zip(*columns, strict=True))
    ]
    heading = f"landmark,front,yaw_{OBLIQUE_DEG:.0f}"
    NOISE.write_text("\n".join([heading, *rows]) + "\n")


if __name__ == "__main__":
    main()
