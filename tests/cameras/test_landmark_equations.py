"""Laws of landmarks as evidence: marginalising the shape equals solving for it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from turntable import Turntable, bald_masks, turntable

from hairkit import Capture, Mask, View
from hairkit.arrays import Float64Array
from hairkit.cameras.landmark_equations import (
    LandmarkFit,
    Sights,
    shape_precision,
    steepness,
)
from hairkit.cameras.outlines import Outlines
from hairkit.cameras.turntable import Turn
from hairkit.head_model.cranium import Cranium
from hairkit.types.face import Face
from hairkit.types.mask import HAIR, PERSON
from hairkit.types.person import Person


@pytest.fixture(scope="module")
def bust() -> Turntable:
    """A head seen by cameras off the turn."""
    return turntable(np.random.default_rng(4))


@pytest.fixture(scope="module")
def fit(bust: Turntable) -> LandmarkFit:
    """Its landmarks."""
    places = bust.head.vertices[bust.head.landmark_vertices].astype(np.float64)
    outlines = Outlines.of(bust.masks, 10)
    sights = Sights.of(bust.capture, bust.masks, 1.0)
    side = np.array([2, 6])
    return LandmarkFit(
        places, shape_precision(places), sights, outlines.fields, outlines.scale, side, 3.0
    )


def _start(bust: Turntable) -> tuple[Turn, Float64Array]:
    turn = Turn.of(bust.capture)
    vector = np.zeros(turn.size)
    vector[4], vector[6], vector[7] = -0.06, np.log(800), 1 / 0.7
    return turn, vector


def test_landmarks_under_hair_and_of_the_jaw_count_less(bust: Turntable) -> None:
    """A covered landmark is trusted a third as much as an open one, a jaw point half as much."""
    sights = Sights.of(bust.capture, bust.masks, 1.0)
    bald = tuple(
        Mask(np.where(np.arange(mask.labels.size) == 0, 255, 128).reshape(mask.labels.shape), True)
        for mask in bust.masks
    )
    open_air = Sights.of(bust.capture, bald, 1.0)
    assert set(open_air.noise[open_air.point < 17]) == {2.0}
    assert set(open_air.noise[open_air.point >= 17]) == {1.0}
    assert set(sights.noise / open_air.noise) <= {1.0, 3.0}


def faces_at(*seen: tuple[float, float]) -> tuple[View, ...]:
    """Return views at azimuths with faces found at yaws, degrees."""
    points, unknown = np.full((68, 2), 5.0), np.zeros(68)
    return tuple(
        View(str(k), azimuth, np.zeros((9, 9, 3), np.uint8)).with_findings(
            Face(1.0, points, unknown, yaw, 0.0, 0.0), Person.absent()
        )
        for k, (azimuth, yaw) in enumerate(seen)
    )


def test_steep_faces_count_less() -> None:
    """Landmarks of faces turned by 49 degrees are a third as sure, by 51 a fifth."""
    views = faces_at((-51, -51), (-20, -20), (0, 0), (20, 20), (49, 49))
    masks = (Mask(np.where(np.eye(9) > 0, 128, 255).astype(np.uint8), True),) * 5
    noise = Sights.of(Capture(views), masks, 1.0).noise.reshape(5, 68)
    assert np.allclose(noise[4], 3 * noise[1])
    assert np.allclose(noise[0], 5 * noise[1])
    assert steepness(views).tolist() == [4, 0, 0, 0, 2]


def test_a_face_is_as_steep_as_the_turn_has_it() -> None:
    """An oblique one seen from farther aside is hardly relied on; others are."""
    assert steepness(faces_at((45, 48), (62, 45), (290, -44), (0, 0))).tolist() == [1, 9, 18, 0]
    assert steepness(faces_at((30, 10), (180, 39))).tolist() == [0, 0]
    assert len(steepness([])) == 0
    unseen = replace(faces_at((90, 0))[0], face=None)
    assert steepness([unseen]).tolist() == [0]


def test_the_pull_of_the_true_cameras_is_weak(bust: Turntable, fit: LandmarkFit) -> None:
    """With a head of the true shape, landmarks fit the true cameras to their noise."""
    arrays = (
        np.stack([camera.rotation for camera in bust.cameras]),
        np.stack([camera.translation for camera in bust.cameras]),
        np.array([camera.focal for camera in bust.cameras]),
        np.stack([camera.centre for camera in bust.cameras]),
    )
    assert fit.misfit(np.zeros((68, 3)), arrays).mean() < 0.5


def test_marginalising_equals_solving_for_the_shape(fit: LandmarkFit) -> None:
    """Step, shape and cost are those of the linear system with the shape among the unknowns."""
    rng = np.random.default_rng(1)
    count, unknowns = 400, 9
    rows, by_shape = rng.normal(size=(count, unknowns)), 1e3 * rng.normal(size=(count, 3))
    residual, point = rng.normal(size=count), rng.integers(0, 68, count)
    found = fit._marginalised(rows, by_shape, residual, point, np.zeros((68, 3)))
    wide = np.zeros((count, 68, 3))
    wide[np.arange(count), point] = by_shape
    whole = np.hstack([rows, wide.reshape(count, -1)])
    normal = whole.T @ whole
    normal[unknowns:, unknowns:] += fit.precision
    solution = np.linalg.solve(normal, whole.T @ residual)
    move = np.linalg.solve(found.normal, found.right)
    assert np.allclose(move, solution[:unknowns], rtol=1e-6, atol=1e-9)
    assert np.allclose(found.offsets(move).ravel(), solution[unknowns:], rtol=1e-6, atol=1e-9)
    bend = np.linalg.solve(normal[unknowns:, unknowns:], whole[:, unknowns:].T @ residual)
    left = residual - whole[:, unknowns:] @ bend
    assert found.cost == pytest.approx(left @ left + bend @ fit.precision @ bend)


def test_rows_are_derivatives(bust: Turntable, fit: LandmarkFit) -> None:
    """A small step of the cameras changes the projections as `project` says."""
    turn, vector = _start(bust)
    cameras, tangents = (*turn.unpack(vector), turn.centres), turn.tangents(vector)
    point, view, offset = fit.sights.point, fit.sights.view, np.zeros((68, 3))
    pixels, by_camera, by_point = fit.project(point, view, offset, cameras)
    rng = np.random.default_rng(2)
    step, bend = rng.normal(0, 1e-6, turn.size), rng.normal(0, 1e-6, (68, 3))
    moved = (*turn.unpack(vector + step), turn.centres)
    got = fit.project(point, view, bend, moved)[0] - pixels
    want = np.einsum("nik,nk->ni", by_camera, tangents[view] @ step)
    want += np.einsum("nik,nk->ni", by_point, bend[point])
    assert np.allclose(got, want, atol=0.01 * np.abs(want).max())


def test_a_view_whose_face_is_behind_hair_is_no_profile(bust: Turntable, fit: LandmarkFit) -> None:
    """A photo from behind that is taken for one from the side pulls no nose on to its outline."""
    turn, vector = _start(bust)
    cameras, tangents = (*turn.unpack(vector), turn.centres), turn.tangents(vector)
    bald = bald_masks(bust.masks)
    whole = np.where(bald[2].labels == PERSON, HAIR, bald[2].labels).astype(np.uint8)
    from_behind = (*bald[:2], Mask(whole, True), *bald[3:])
    pulled = []
    for masks in (bald, from_behind):
        cranium = Cranium.of(bust.head, masks, fit.scale).select(np.zeros(0, np.int64))
        rows, *_ = replace(fit, cranium=cranium)._outline_rows(np.zeros((68, 3)), cameras, tangents)
        pulled.append(np.abs(rows).reshape(2, -1).sum(axis=1) > 0)
    assert [side.tolist() for side in pulled] == [[True, True], [False, True]]
