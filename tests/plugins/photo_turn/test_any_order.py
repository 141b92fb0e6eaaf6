"""Where photos tell the turn, neither their order nor their names change a run."""

from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np
import pytest

from hairkit.io.capture_reader import photo_files, read_capture, sample_folder
from hairkit.nets.model_folder import missing_models
from hairkit.pipeline.reconstruct import reconstruct

NETWORKS = ["face_landmark", "face_detection_short_range", "selfie_segmentation"]
EDGE, GUIDES = 360, 60
"""Small photos and few guides: what is compared does not depend on either."""


def groom_of(photos: list[Path], folder: Path, name: str) -> bytes:
    """Return the groom of a run on copies of the photos, numbered in this order."""
    given = folder / name
    given.mkdir()
    for i, photo in enumerate(photos):
        shutil.copy(photo, given / f"{name}_{i:02}{photo.suffix}")
    out = folder / f"{name}-out"
    reconstruct(read_capture(given, EDGE), out, guides=GUIDES, sheet=False)
    return (out / "groom.npz").read_bytes()


@pytest.mark.skipif(
    bool(missing_models(NETWORKS)),
    reason="networks are not installed: hairkit models install",
)
def test_every_order_of_the_photos_gives_the_same_bytes(tmp_path: Path) -> None:
    """The sample has one groom, whatever its photos are called and however they are sorted."""
    photos = photo_files(sample_folder() / "photos")
    first = groom_of(photos, tmp_path, "a")
    order = np.random.default_rng(0).permutation(len(photos))
    assert groom_of([photos[i] for i in order], tmp_path, "IMG") == first
