"""The program that runs COLMAP on the photos of a folder, and writes what it found to `target`.

It uses no OpenCV. The folder has photos/ and masks/.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from hairkit import worker

FIRST_PAIR, FIRST_ANGLE_DEG = 20, 5.0
"""Matches and angle of the pair that begins; COLMAP's 100 and 16 degrees are for buildings."""
MORE, SHARE, MISS_PX = 10, 0.15, 8.0
"""Points that a further photo must share, their share of the matches, and how far they may miss."""
CONTRAST = 0.002
"""Least contrast of a point; COLMAP's own is 0.0067."""
LEAST_MATCHES = 10
"""Matches of a pair that the epipolar geometry explains; COLMAP's 15 break turns of plain skin."""
LEAST_ANGLE_DEG = 1.0
"""Angle of the rays that a point is placed by."""
RATIO = 0.85
"""Distance of the best match over that of the second: hair looks alike everywhere."""


def solve(task: dict[str, Any], _tell: Callable[[Any], None]) -> dict[str, Any]:
    """Find features, match, reconstruct, and write the largest model."""
    import pycolmap

    pycolmap.set_random_seed(0)
    folder = Path(task["folder"])
    database = folder / "database.db"
    _find_features(pycolmap, folder, database, task)
    _match(pycolmap, database, task["neighbours"])
    models = pycolmap.incremental_mapping(
        database, folder / "photos", folder, _mapping(pycolmap, task["known"])
    )
    best = max(models.values(), key=lambda model: model.num_reg_images(), default=None)
    np.savez(task["target"], **_arrays(best, len(task["focals"])))
    return {}


def _find_features(pycolmap: Any, folder: Path, database: Path, task: dict[str, Any]) -> None:
    """Put SIFT points on the person into the database."""
    options = pycolmap.FeatureExtractionOptions()
    options.use_gpu = False
    options.sift.max_num_features = task["features"]
    options.sift.peak_threshold = CONTRAST
    reader = pycolmap.ImageReaderOptions()
    reader.mask_path, reader.camera_model = str(folder / "masks"), "SIMPLE_PINHOLE"
    mode = pycolmap.CameraMode.SINGLE if task["shared"] else pycolmap.CameraMode.PER_IMAGE
    pycolmap.extract_features(
        database,
        folder / "photos",
        camera_mode=mode,
        reader_options=reader,
        extraction_options=options,
        device=pycolmap.Device.cpu,
    )
    with pycolmap.Database.open(database) as opened:
        for image in opened.read_all_images():
            camera = opened.read_camera(image.camera_id)
            number = int(Path(image.name).stem)
            camera.params = [task["focals"][number], *task["centres"][number]]
            camera.has_prior_focal_length = task["known"]
            opened.update_camera(camera)


def _match(pycolmap: Any, database: Path, neighbours: int) -> None:
    """Compare each photo with the next ones, and those at both ends of the turn."""
    options = pycolmap.FeatureMatchingOptions()
    options.use_gpu = False
    options.sift.max_ratio = RATIO
    options.num_threads = 1  # each thread draws random numbers of its own
    options.guided_matching = True  # again along the epipolar lines: many more on hair
    verification = pycolmap.TwoViewGeometryOptions()
    verification.min_num_inliers = LEAST_MATCHES
    with pycolmap.Database.open(database) as opened:
        names = sorted(image.name for image in opened.read_all_images())
    pairs = {
        tuple(sorted((names[i], names[(i + step) % len(names)])))
        for i in range(len(names))
        for step in range(1, neighbours + 1)
    }
    listed = database.with_name("pairs.txt")
    listed.write_text(
        "\n".join(f"{first} {second}" for first, second in sorted(pairs)), encoding="utf-8"
    )
    pairing = pycolmap.ImportedPairingOptions()
    pairing.match_list_path = str(listed)
    pycolmap.match_image_pairs(
        database,
        matching_options=options,
        pairing_options=pairing,
        verification_options=verification,
        device=pycolmap.Device.cpu,
    )


def _mapping(pycolmap: Any, known: bool) -> Any:
    """Return the options of the reconstruction."""
    options = pycolmap.IncrementalPipelineOptions()
    options.min_num_matches, options.num_threads = LEAST_MATCHES, 1
    options.ba_refine_focal_length = not known
    options.mapper.init_min_num_inliers = FIRST_PAIR
    options.mapper.init_min_tri_angle = FIRST_ANGLE_DEG
    options.mapper.abs_pose_min_num_inliers = MORE
    options.mapper.abs_pose_min_inlier_ratio = SHARE
    options.mapper.abs_pose_max_error = MISS_PX
    options.mapper.filter_min_tri_angle = LEAST_ANGLE_DEG
    options.triangulation.min_angle = LEAST_ANGLE_DEG
    return options


def _arrays(model: Any, count: int) -> dict[str, Any]:
    """Return a model as arrays; no photo is joined where there is none."""
    joined, focals = np.zeros(count, bool), np.ones(count)
    poses = np.tile(np.eye(3, 4), (count, 1, 1))
    points, sights, residual = [], [], 0.0
    if model is not None:
        index = {}
        for identity in model.reg_image_ids():
            image = model.images[identity]
            i = index[identity] = int(Path(image.name).stem)
            joined[i] = True
            poses[i] = image.cam_from_world().matrix()
            focals[i] = model.cameras[image.camera_id].focal_length
        for number, point in enumerate(model.points3D.values()):
            points.append(point.xyz)
            for element in point.track.elements:
                seen = model.images[element.image_id].points2D[element.point2D_idx].xy
                sights.append((number, index[element.image_id], *seen))
        residual = model.compute_mean_reprojection_error()
    return {
        "joined": joined,
        "poses": poses,
        "focals": focals,
        "points": np.array(points, np.float64).reshape(-1, 3),
        "sights": np.array(sights, np.float64).reshape(-1, 4),
        "residual_px": np.float64(residual),
    }


if __name__ == "__main__":
    worker.answer_questions({"solve": solve})
