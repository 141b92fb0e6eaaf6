"""Laws of the refined cameras."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hairkit_plugins.silhouette import Options, estimate_scene
from turntable import Turntable, azimuth_errors, turntable

from hairkit import Camera, Capture, Face, Mask, Scene, View
from hairkit.cameras import camera_search
from hairkit.cameras.camera_search import Evidence, Fit, Search
from hairkit.cameras.outlines import Outlines
from hairkit.cameras.turn_fit import TurnFit
from hairkit.cameras.turntable import LOG_MAGNIFICATION, PER_VIEW, PERSPECTIVE, SHARED

FAST = Options(contour_points=40)
"""Fewer rays along outlines than the default, for half of its time."""


@pytest.fixture(scope="module")
def bust() -> Turntable:
    """A head seen by perspective cameras off the turn."""
    return turntable(np.random.default_rng(11))


@pytest.fixture(scope="module")
def found(bust: Turntable) -> Scene:
    """The scene of `bust`, searched with few rays."""
    return estimate_scene(bust.capture, bust.masks, bust.head, None, FAST)


def _without_landmarks(capture: Capture) -> Capture:
    views = [View(view.name, view.azimuth_deg, view.image, view.focal_px) for view in capture.views]
    return replace(capture, views=tuple(views))


def _pixels_off(found: tuple[Camera, ...], table: Turntable) -> float:
    points = table.head.vertices[::50]
    off = [f.project(points) - t.project(points) for f, t in zip(found, table.cameras, strict=True)]
    return float(np.mean(np.linalg.norm(off, axis=-1)))


def test_cameras_come_nearer_to_the_truth(bust: Turntable, found: Scene) -> None:
    """Landmarks and outlines lessen the nominal azimuth error, and the head is where it is seen."""
    nominal = [Camera.on_turn(45.0 * i, focal=560, width=300, height=400) for i in range(8)]
    start = azimuth_errors(tuple(nominal), bust.cameras).mean()
    assert azimuth_errors(found.cameras, bust.cameras).mean() < 0.85 * start
    assert _pixels_off(found.cameras, bust) < 4
    assert found.cameras[0].model == "perspective"
    assert found.residual_px is not None
    assert found.residual_px < 1.5


def test_a_careless_turn_is_found() -> None:
    """Steps up to 12 degrees off, at distances 15 % off, are found to less than half of that."""
    table = turntable(np.random.default_rng(5), stray=3.0)
    options = replace(FAST, carries=0)
    scene = estimate_scene(table.capture, table.masks, table.head, None, options)
    nominal = [Camera.on_turn(45.0 * i, focal=560, width=300, height=400) for i in range(8)]
    start = azimuth_errors(tuple(nominal), table.cameras).mean()
    assert start > 4
    assert azimuth_errors(scene.cameras, table.cameras).mean() < start / 2


def test_the_views_with_landmarks_are_sharp(bust: Turntable, found: Scene) -> None:
    """Views that show landmarks are found to a degree relative to each other: 0.1 to 0.8 on twelve
    turns, 0.35 on average."""
    seen = [0, 1, 7]
    sharp = tuple(found.cameras[i] for i in seen)
    assert azimuth_errors(sharp, tuple(bust.cameras[i] for i in seen)).max() < 1


def test_pictures_without_perspective_have_cameras_far_away() -> None:
    """Pictures of orthographic cameras on the exact turn give cameras metres away, or theirs.

    Within a degree: the turn's precision is estimated, so an exact turn is not taken for granted.
    """
    table = turntable(np.random.default_rng(2), stray=0.0, model="orthographic")
    scene = estimate_scene(table.capture, table.masks, table.head, None, FAST)
    assert all(np.linalg.norm(camera.position) > 2 for camera in scene.cameras)
    assert azimuth_errors(scene.cameras, table.cameras).max() < 1.0
    told = replace(table.capture, orthographic=True)
    scene = estimate_scene(told, table.masks, table.head, None, FAST)
    assert {camera.model for camera in scene.cameras} == {"orthographic"}
    assert azimuth_errors(scene.cameras, table.cameras).max() < 1.0
    assert scene.cameras[0].focal == pytest.approx(800, rel=0.03)


def test_orthographic_cameras_start_at_their_scale() -> None:
    """Their first place is exact: solved for perspective, the landmarks would be nearer."""
    table = turntable(np.random.default_rng(2), stray=0.0, model="orthographic", noise=0.0)
    problem = TurnFit.of(table.capture, table.masks, table.head, Options())
    exact = np.exp(problem.start(flat=True).vector[LOG_MAGNIFICATION])
    assert exact == pytest.approx(800, rel=0.001)
    assert np.exp(problem.start(flat=False).vector[LOG_MAGNIFICATION]) < 0.97 * exact


def test_the_focal_length_of_a_far_camera_is_found(monkeypatch: pytest.MonkeyPatch) -> None:
    """The search stays near where it begins unless other distances are tried."""
    table = turntable(np.random.default_rng(11), distance=1.4)
    options = replace(FAST, carries=0)

    def focal() -> float:
        scene = estimate_scene(table.capture, table.masks, table.head, None, options)
        return scene.cameras[0].focal / table.cameras[0].focal

    assert focal() == pytest.approx(1, abs=0.15)
    monkeypatch.setattr(camera_search, "MOST_FARTHER", 0)
    monkeypatch.setattr(camera_search, "FAR", 1.0)
    assert focal() < 0.75


def test_opposite_views_that_hold_each_other_are_moved(monkeypatch: pytest.MonkeyPatch) -> None:
    """Views at 45 and 225 degrees are 20 degrees off, each as far as the other's outline asks."""
    azimuths, deep = np.arange(8) * np.pi / 4, np.radians(-20)
    off = np.where(np.arange(8) == 1, 1.0, 0.0) - np.where(np.arange(8) == 5, 1.0, 0.0)
    size = SHARED + PER_VIEW * 8

    def evidence(fit: Fit, coarseness: float) -> Evidence:
        """Two valleys along `off`: a shallow one where the views are, a deep one at `deep`."""
        along = float(fit.vector[SHARED::PER_VIEW] @ off) / 2
        turn = np.pi * along / deep
        misses = np.array([10 * np.sin(turn), 3 * (1 - along / deep)])
        slope = np.array([10 * np.pi / deep * np.cos(turn), -3 / deep])
        rows = np.zeros((2, size))
        rows[:, SHARED::PER_VIEW] = np.outer(slope, off) / 2
        return Evidence(float(misses @ misses), rows.T @ rows, -rows.T @ misses, None)

    def found() -> float:
        start = np.zeros(size)
        search = Search(evidence, np.eye(size), 20, any_distance=False)
        fit = search.find(Fit(start, np.zeros((68, 3)), True, start), azimuths)
        return float(fit.vector[SHARED::PER_VIEW] @ off) / 2

    assert found() == pytest.approx(deep, rel=0.1)
    monkeypatch.setattr(camera_search, "SIDES", 0)
    assert abs(found()) < np.radians(3)


def test_the_search_also_starts_from_far_away(monkeypatch: pytest.MonkeyPatch) -> None:
    """A shallow valley at 0.7 m and a deep one at 2.8 m: steps of 1.2 lead back into the first."""
    far, size = np.log(4.0), SHARED + PER_VIEW * 8

    def evidence(fit: Fit, coarseness: float) -> Evidence:
        """The two valleys along the logarithm of the distance."""
        along = -np.log(0.7 * fit.vector[PERSPECTIVE])
        turn = np.pi * along / far
        misses = np.array([10 * np.sin(turn), 3 * (1 - along / far)])
        slope = np.array([10 * np.pi * np.cos(turn), -3]) / far
        rows = np.zeros((2, size))
        rows[:, PERSPECTIVE] = -slope / fit.vector[PERSPECTIVE]
        return Evidence(float(misses @ misses), rows.T @ rows, -rows.T @ misses, None)

    def distance() -> float:
        start = np.zeros(size)
        start[PERSPECTIVE] = 1 / 0.7
        search = Search(evidence, 1e-4 * np.eye(size), 20)
        fit = search.find(Fit(start, np.zeros((68, 3)), False, start), np.arange(8) * np.pi / 4)
        return float(1 / fit.vector[PERSPECTIVE])

    assert distance() == pytest.approx(2.8, rel=0.05)
    monkeypatch.setattr(camera_search, "FAR", 1.0)
    assert distance() < 0.9


@pytest.mark.parametrize("beyond", [np.nan, np.inf])
def test_steps_to_no_finite_cost_are_taken_back(beyond: float) -> None:
    """The least cost lies where there is none: the search ends before it."""
    size = SHARED + PER_VIEW * 8

    def evidence(fit: Fit, coarseness: float) -> Evidence:
        """A valley at 2, of which nothing is known from 1 on."""
        misses, rows = fit.vector[:1] - 2, np.eye(1, size)
        cost = float(misses @ misses) if fit.vector[0] < 1 else beyond
        return Evidence(cost, rows.T @ rows, -rows.T @ misses, None)

    start = np.zeros(size)
    search = Search(evidence, 1e-4 * np.eye(size), 20)
    fit, _ = search.descend(Fit(start, np.zeros((68, 3)), True, start), 1.0, 20)
    assert 0.5 < fit.vector[0] < 1
    assert np.isfinite(fit.cost)


def test_no_camera_lies_in_the_head(bust: Turntable) -> None:
    """A turn of 15 cm costs more than anything; one of 30 cm does not."""
    problem = TurnFit.of(bust.capture, bust.masks, bust.head, FAST)
    start = problem.start(flat=False)
    costs = []
    for distance in (0.15, 0.3):
        vector = start.vector.copy()
        vector[PERSPECTIVE] = 1 / distance
        costs.append(problem.evidence(replace(start, vector=vector), 1.0).cost)
    assert np.isfinite(costs).tolist() == [False, True]


def test_nothing_is_evaluated_twice(bust: Turntable, monkeypatch: pytest.MonkeyPatch) -> None:
    """A place where the evidence is known is not looked at again with another precision."""
    asked: list[tuple[bytes, bytes, float]] = []
    evidence = TurnFit.evidence

    def ask(self: TurnFit, fit: Fit, coarseness: float) -> Evidence:
        asked.append((fit.vector.tobytes(), fit.offset.tobytes(), coarseness))
        return evidence(self, fit, coarseness)

    monkeypatch.setattr(TurnFit, "evidence", ask)
    options = replace(FAST, carries=0)
    estimate_scene(bust.capture, bust.masks, bust.head, None, options)
    assert len(asked) > 10
    assert len(asked) - len(set(asked)) <= 2  # steps may be too small to move anything


def test_options_say_how_sure_landmarks_of_files_are(bust: Turntable) -> None:
    """A detector's noise counts; where it tells none, `landmark_px` does."""
    tight, loose = (replace(FAST, landmark_px=px, iterations=2, carries=0) for px in (1.0, 30.0))

    def residual(noise: float, options: Options) -> float | None:
        views = tuple(
            view
            if view.landmarks is None
            else replace(
                view, face=Face(1.0, view.landmarks, np.full(68, noise), view.azimuth_deg, 0.0, 0.0)
            )
            for view in bust.capture.views
        )
        capture = replace(bust.capture, views=views)
        return estimate_scene(capture, bust.masks, bust.head, None, options).residual_px

    assert residual(0.0, loose) != residual(0.0, tight)
    assert residual(2.0, loose) == residual(2.0, tight)


def test_landmarks_that_are_not_trusted_hardly_count_as_misfit(bust: Turntable) -> None:
    """A face whose landmarks are off, and said to be unsure, leaves the residual small."""
    faces = [i for i, view in enumerate(bust.capture.views) if view.landmarks is not None]

    def residual(noise: float) -> float:
        views = list(bust.capture.views)
        for i in faces:
            marks, wrong = views[i].landmarks, i == faces[-1]
            assert marks is not None
            marks = marks + wrong * np.random.default_rng(0).normal(0, 15, (68, 2))
            each = np.full(68, noise if wrong else 1.0)
            yaw = (views[i].azimuth_deg + 180) % 360 - 180
            face = Face(1.0, marks, each, yaw, 0.0, 0.0)
            views[i] = replace(views[i], face=face, landmarks=marks)
        capture = replace(bust.capture, views=tuple(views))
        found = estimate_scene(
            capture, bust.masks, bust.head, None, replace(FAST, iterations=3, carries=0)
        )
        assert found.residual_px is not None
        return float(found.residual_px)

    assert residual(60.0) < 3 < residual(1.0)


def test_a_known_focal_length_is_kept(bust: Turntable) -> None:
    """Photos that tell their focal length get cameras with it, to a few per cent."""
    views = tuple(replace(view, focal_px=560.0) for view in bust.capture.views)
    capture = replace(bust.capture, views=views)
    scene = estimate_scene(capture, bust.masks, bust.head, None, FAST)
    assert scene.cameras[0].focal == pytest.approx(560, rel=0.06)


@pytest.mark.parametrize("person_known", [True, False])
def test_without_landmarks_the_head_stands_under_its_hair(
    bust: Turntable, person_known: bool
) -> None:
    """Masks alone, even of hair only, put the head's crown near the top of the silhouettes."""
    masks = bust.masks
    if not person_known:
        masks = tuple(Mask(np.where(mask.hair, 255, 0), False) for mask in masks)
    scene = estimate_scene(_without_landmarks(bust.capture), masks, bust.head, None, FAST)
    for camera, mask in zip(scene.cameras, masks, strict=True):
        top = np.nonzero(mask.hair.any(1))[0][0]
        crown = camera.project(scene.head.vertices)[:, 1].min()
        assert abs(crown - top) < (30 if person_known else 60)


def test_equal_input_gives_equal_cameras(bust: Turntable) -> None:
    """Two runs give the same bytes."""
    options = replace(FAST, iterations=2, carries=1)
    one, two = (
        estimate_scene(bust.capture, bust.masks, bust.head, None, options) for _ in range(2)
    )
    for first, second in zip(one.cameras, two.cameras, strict=True):
        assert first.camera_from_head.tobytes() == second.camera_from_head.tobytes()


def test_a_start_is_searched_from_and_keeps_its_kind(bust: Turntable) -> None:
    """Orthographic cameras stay so, near, and fit no worse, where a search from nothing ends with
    perspective ones."""
    given, few = (bust.capture, bust.masks, bust.head), replace(FAST, iterations=15, carries=0)
    start = estimate_scene(replace(bust.capture, orthographic=True), *given[1:], None, few)
    again = estimate_scene(*given, start, replace(few, iterations=1))
    assert {camera.model for camera in again.cameras} == {"orthographic"}
    assert start.residual_px is not None
    assert again.residual_px is not None
    assert again.residual_px < 1.05 * start.residual_px
    assert azimuth_errors(again.cameras, start.cameras).mean() < 2


def test_zooms_and_distances_of_orthographic_views_are_the_same(bust: Turntable) -> None:
    """At 100 m a camera 5 m nearer sees what one with a lens 5 % longer sees: so do its rays."""
    problem = TurnFit.of(bust.capture, bust.masks, bust.head, Options())
    vector = problem.start(True).vector
    nearer = vector.copy()
    nearer[SHARED + 3 :: PER_VIEW] = distances = np.linspace(-0.05, 0.05, 8)
    rotation, translation, focal, centre = problem.cameras(vector)
    longer = (rotation, translation, focal * np.exp(-distances), centre)
    by_distance, _ = problem._coherence(nearer, problem.cameras(nearer), 3.0)
    by_lens, _ = problem._coherence(vector, longer, 3.0)
    assert np.abs(by_distance - by_lens).mean() < 0.1


def test_cameras_of_cropped_photos_aim_at_the_heads_of_the_masks(bust: Turntable) -> None:
    """A wrong middle, found before hair was, moves them nowhere; whole photos keep theirs."""
    given = TurnFit.of(bust.capture, bust.masks, bust.head, Options()).turn.aims
    views = [replace(v, cropped=v.frame, head=(20.0, 390.0)) for v in bust.capture.views[:3]]
    capture = replace(bust.capture, views=(*views, *bust.capture.views[3:]))
    aims = TurnFit.of(capture, bust.masks, bust.head, Options()).turn.aims
    heads = Outlines.of(bust.masks, 30).heads
    assert np.allclose(aims[:3, 0], heads[:3, 1])
    assert (aims[:3, 1] > heads[:3, 0] + 0.5 * heads[:3, 2]).all()
    assert (aims[:3, 1] < heads[:3, 0] + 0.7 * heads[:3, 2]).all()
    assert np.array_equal(aims[3:], given[3:])
