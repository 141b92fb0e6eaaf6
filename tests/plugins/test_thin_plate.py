"""Laws of the bent head."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hairkit_plugins.thin_plate import Options, fit_head
from turntable import NAMES, Turntable, bald_masks, turntable

from hairkit import Head, Scene


@pytest.fixture(scope="module")
def bust() -> Turntable:
    """A head and its pictures, cameras known."""
    return turntable(np.random.default_rng(6), noise=0.0)


def _scene(bust: Turntable, head: Head) -> Scene:
    return Scene(NAMES, bust.cameras, head)


def _stretched(head: Head, factor: tuple[float, float, float]) -> Head:
    return replace(head, vertices=head.vertices * np.array(factor, np.float32))


def _error(head: Head, bust: Turntable) -> np.ndarray:
    return np.linalg.norm(head.vertices - bust.head.vertices, axis=1)


def test_the_true_head_stays(bust: Turntable) -> None:
    """A head that fits already is not moved by more than a fraction of a millimetre."""
    fitted = fit_head(bust.capture, bust.masks, _scene(bust, bust.head), Options(margin=0.0)).head
    assert np.percentile(_error(fitted, bust), 95) < 0.0012


def test_a_face_is_pulled_to_its_landmarks(bust: Turntable) -> None:
    """A head 6 % too narrow and flat comes to the landmarks within half of its error."""
    wrong = _stretched(bust.head, (0.94, 1.0, 0.94))
    fitted = fit_head(bust.capture, bust.masks, _scene(bust, wrong), Options()).head
    marks = bust.head.landmark_vertices
    assert _error(fitted, bust)[marks].mean() < 0.5 * _error(wrong, bust)[marks].mean()


def test_one_photo_bends_the_face_across_its_rays(bust: Turntable) -> None:
    """The face comes to the landmarks of the only photo there; depths, and the back, stay."""
    wrong = _stretched(bust.head, (0.94, 0.96, 1.0))
    one = replace(bust.capture, views=bust.capture.views[:1])
    scene = Scene(NAMES[:1], bust.cameras[:1], wrong)
    fitted = fit_head(one, bust.masks[:1], scene, Options(rounds=0)).head
    marks, camera = bust.head.landmark_vertices, bust.cameras[0]
    seen = camera.project(bust.head.vertices[marks])
    before, after = (
        np.linalg.norm(camera.project(h.vertices[marks]) - seen, axis=1).mean()
        for h in (wrong, fitted)
    )
    assert after < 0.3 * before
    assert (
        np.abs(camera.depth(fitted.vertices[marks]) - camera.depth(wrong.vertices[marks])).max()
        < 0.001
    )
    back = np.argmin(wrong.vertices[:, 2])
    assert np.linalg.norm(fitted.vertices[back] - wrong.vertices[back]) < 0.002


def test_a_head_too_big_is_pushed_into_the_silhouettes(bust: Turntable) -> None:
    """A cranium that sticks out of the silhouettes ends up closer to the true one."""
    wrong = _stretched(bust.head, (1.08, 1.08, 1.08))
    without = fit_head(bust.capture, bust.masks, _scene(bust, wrong), Options(rounds=0)).head
    fitted = fit_head(bust.capture, bust.masks, _scene(bust, wrong), Options()).head
    scalp = bust.head.scalp > 0.5
    assert _error(fitted, bust)[scalp].mean() < 0.8 * _error(without, bust)[scalp].mean()


def test_a_small_cranium_comes_to_bare_outlines(bust: Turntable) -> None:
    """A skull 15 % too low grows to that of a bald person to 1 mm, hardly to another's."""
    vertices = bust.head.vertices.copy()
    assert bust.head.landmark_vertices is not None
    brows = vertices[bust.head.landmark_vertices[17:27], 1].max()
    vertices[:, 1] -= 0.15 * np.maximum(vertices[:, 1] - brows, 0)
    scene = _scene(bust, replace(bust.head, vertices=vertices))
    hairy = fit_head(bust.capture, bust.masks, scene, Options()).head
    bald = fit_head(bust.capture, bald_masks(bust.masks), scene, Options()).head
    crown = bust.head.vertices[:, 1].max()
    assert abs(bald.vertices[:, 1].max() - crown) < 0.001
    assert crown - hairy.vertices[:, 1].max() > 0.005


def test_joints_and_capsules_move_along(bust: Turntable) -> None:
    """The skeleton is carried by the same bend; topology and scalp stay."""
    wrong = _stretched(bust.head, (1.08, 1.08, 1.08))
    fitted = fit_head(bust.capture, bust.masks, _scene(bust, wrong), Options()).head
    assert np.array_equal(fitted.faces, wrong.faces)
    assert np.array_equal(fitted.scalp, wrong.scalp)
    assert not np.allclose(fitted.joints, wrong.joints, atol=1e-4)
