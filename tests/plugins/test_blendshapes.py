"""Laws of the mixed head: weights of known shapes are found, the average head stays."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hairkit_plugins.blendshapes import Options, fit_head

from hairkit import Camera, Capture, Head, Mask, Scene, View
from hairkit.cameras.depth_raster import head_depth, mesh_depth
from hairkit.errors import InputError
from hairkit.head_model.identity import MODES, identity_modes
from hairkit.head_model.template import default_head
from hairkit.io.head_reader import write_head_obj
from hairkit.testing import ball_head
from hairkit.types.mask import BACKGROUND, HAIR, PERSON

AZIMUTHS = (0, 45, 90, 135, 180, 225, 270, 315)
SEEN = (0, 45, 315)
"""Azimuths of the views that have landmarks."""
WEIGHTS = {"nose_protrusion": 1.5, "jaw_breadth": 1.0, "face_height": -1.2, "eyes_apart": 1.0}


def _mixed(weights: dict[str, float]) -> Head:
    values = np.array([weights.get(name, 0.0) for name in MODES], np.float32)
    head = default_head()
    return replace(head, vertices=head.vertices + np.tensordot(values, identity_modes(), axes=1))


def _photographed(head: Head) -> tuple[Capture, tuple[Mask, ...], tuple[Camera, ...]]:
    """Return views with landmarks, labels and cameras of a head whose scalp is hair."""
    assert head.landmark_vertices is not None
    views, masks, cameras = [], [], []
    hairy = head.faces[(head.scalp[head.faces] > 0.5).all(axis=1)]
    for azimuth in AZIMUTHS:
        camera = Camera.on_turn(
            azimuth, distance=0.9, target=(0, -0.04, 0), focal=900.0, width=300, height=360
        )
        depth = head_depth(head, camera)
        hair = mesh_depth(head.vertices, hairy, camera) <= depth + 1e-4
        labels = np.where(np.isfinite(depth), PERSON, BACKGROUND).astype(np.uint8)
        labels[hair & np.isfinite(depth)] = HAIR
        marks = camera.project(head.vertices[head.landmark_vertices].astype(np.float64))
        blank = np.zeros((360, 300, 3), np.uint8)
        views.append(
            View(str(azimuth), azimuth, blank, landmarks=marks if azimuth in SEEN else None)
        )
        masks.append(Mask(labels, True))
        cameras.append(camera)
    return Capture(tuple(views)), tuple(masks), tuple(cameras)


def _fit(true: Head, options: Options, start: Head | None = None) -> Head:
    capture, masks, cameras = _photographed(true)
    names = tuple(view.name for view in capture.views)
    scene = Scene(names, cameras, start or default_head())
    return fit_head(capture, masks, scene, options).head


def _error(head: Head, true: Head) -> float:
    """Mean distance of the face's vertices, metres."""
    face = (true.vertices[:, 2] > 0.03) & (np.abs(true.vertices[:, 1] + 0.06) < 0.1)
    return float(np.linalg.norm(head.vertices - true.vertices, axis=1)[face].mean())


def test_known_weights_are_found() -> None:
    """A head mixed of four shapes is found from its pictures, to 0.4 of the first error."""
    true = _mixed(WEIGHTS)
    fitted = _fit(true, Options(prior=0.2))
    assert _error(fitted, true) < 0.4 * _error(default_head(), true)
    assert np.array_equal(fitted.faces, true.faces)
    assert np.array_equal(fitted.uv, true.uv)


def test_the_average_head_stays() -> None:
    """Pictures of the average head leave it where it is, within 0.8 mm."""
    assert _error(_fit(default_head(), Options()), default_head()) < 0.0008


def test_a_strong_prior_keeps_the_average() -> None:
    """The stronger the prior, the nearer the head stays to the average."""
    true = _mixed(WEIGHTS)
    moved = [
        _error(_fit(true, Options(prior=p, outlines=False)), default_head())
        for p in (0.2, 5.0, 100.0)
    ]
    assert moved[0] > moved[1] > moved[2]


def test_shapes_come_from_a_folder(tmp_path: Path) -> None:
    """Heads of one topology are shapes: a mixture of them, not among hairkit's, is found."""
    heads = [
        _mixed({"nose_protrusion": a, "jaw_breadth": b})
        for a, b in ((0, 0), (2, 0), (0, 2), (-2, 0), (0, -2))
    ]
    for number, head in enumerate(heads):
        write_head_obj(tmp_path / f"{number}.obj", head)
    true = _mixed({"nose_protrusion": 1.2, "jaw_breadth": -1.0})
    fitted = _fit(true, Options(shapes=tmp_path, prior=0.2, outlines=False))
    assert _error(fitted, true) < 0.4 * _error(default_head(), true)


def test_unfit_shapes_are_one_line(tmp_path: Path) -> None:
    """Too few heads, another topology, and a head of one's own without shapes are refused."""
    true = default_head()
    with pytest.raises(InputError, match=r"0 \.obj heads, expected 3 or more"):
        _fit(true, Options(shapes=tmp_path))
    for number in range(3):
        write_head_obj(tmp_path / f"{number}.obj", ball_head())
    with pytest.raises(InputError, match="all need one topology"):
        _fit(true, Options(shapes=tmp_path))
    with pytest.raises(InputError, match=r"give blendshapes\.shapes"):
        _fit(true, Options(), start=ball_head())
