"""Laws of similarity fits, triangulation and the turn's cameras."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from hairkit import Camera, Capture, View
from hairkit.arrays import Float64Array
from hairkit.cameras.similarity import Similarity, fit_similarity, triangulate
from hairkit.cameras.turntable import MIN_PERSPECTIVE, PERSPECTIVE, Turn
from hairkit.errors import InputError

numbers = st.floats(-3, 3)


def _turn(count: int = 8) -> Turn:
    sizes = np.tile([[300, 400]], (count, 1))
    axes = np.tile([[150.0, 200.0]], (count, 1))
    return Turn(np.arange(count) * np.pi / 4, sizes, np.ones(count), np.zeros(count), axes, axes)


def test_cameras_beside_the_lens_axis_are_found_again(rng: np.random.Generator) -> None:
    """Cameras whose pictures are parts of photos are those of whole ones, turned to the head; the
    vector of such cameras gives them again."""
    whole, axes = _turn(), rng.uniform(-500, 900, (8, 2))
    part = replace(whole, centres=axes)
    vector = _vector(whole, rng)
    focal = whole.unpack(vector)[2]
    for camera, middle, axis, f in zip(
        part.cameras(vector), whole.cameras(vector), axes, focal, strict=True
    ):
        assert np.allclose(camera.centre, axis)
        seen = camera.project(middle.position + middle.forward)
        assert np.allclose(seen, part.aims[0], atol=1e-6)  # the ray to the head is the same
        assert np.allclose(camera.position, middle.position)
        assert camera.focal == pytest.approx(f)
    again = part.vector_of(part.cameras(vector))
    for one, other in zip(part.cameras(again), part.cameras(vector), strict=True):
        points = rng.normal(0, 0.1, (9, 3))
        assert np.allclose(one.project(points), other.project(points), atol=0.01)


def _vector(turn: Turn, rng: np.random.Generator) -> Float64Array:
    vector = rng.normal(0, 0.03, turn.size)
    vector[6], vector[PERSPECTIVE] = np.log(800.0), 1.4
    return vector


@given(st.tuples(numbers, numbers, numbers), st.floats(0.01, 100), st.integers(0, 99))
def test_a_similarity_is_found_again(
    axis: tuple[float, float, float], scale: float, seed: int
) -> None:
    """Points moved by a similarity give that similarity, whatever the weights."""
    rng = np.random.default_rng(seed)
    points = rng.normal(size=(9, 3))
    true = Similarity(scale, Rotation.from_rotvec(axis).as_matrix(), rng.normal(size=3))
    found = fit_similarity(points, true.apply(points), rng.uniform(0.1, 1, 9))
    assert np.allclose(found.apply(points), true.apply(points), atol=1e-8 * scale)
    assert np.allclose(found.inverse().apply(true.apply(points)), points, atol=1e-8)


def test_weight_zero_leaves_a_point_out(rng: np.random.Generator) -> None:
    """A wild point of weight 0 changes nothing."""
    points = rng.normal(size=(8, 3))
    wild = points.copy()
    wild[3] += 50
    weights = np.ones(8)
    weights[3] = 0
    assert np.allclose(fit_similarity(points, wild, weights).apply(points), points, atol=1e-9)


@pytest.mark.parametrize(
    ("points", "says"),
    [
        (np.eye(3)[:2], "at least 3 points, got 2"),
        (np.outer(np.arange(5.0), [1, 2, 3]), "lie on one line"),
        (np.full((4, 3), np.nan), "not finite"),
    ],
)
def test_points_that_fix_no_pose_are_refused(points: Float64Array, says: str) -> None:
    """Too few points, points on a line and NaN give one line that says so."""
    with pytest.raises(InputError, match=says):
        fit_similarity(points, points)


@pytest.mark.parametrize("model", ["perspective", "orthographic"])
def test_a_camera_moved_along_sees_the_same(model: str, rng: np.random.Generator) -> None:
    """The moved camera sees moved points where the camera saw the points."""
    focal = 900.0 if model == "perspective" else 1500.0
    camera = Camera.on_turn(30, focal=focal, width=300, height=400, model=model)  # type: ignore[arg-type]
    move = Similarity(
        1.7, Rotation.from_rotvec([0.2, -0.4, 0.1]).as_matrix(), np.array([0.1, 0.2, -0.3])
    )
    points = rng.normal(0, 0.1, (20, 3))
    seen = move.moved_camera(camera).project(move.apply(points))
    assert np.allclose(seen, camera.project(points), atol=1e-6)


@pytest.mark.parametrize("perspective", [1.4, 0.0])
def test_triangulation_undoes_projection(perspective: float, rng: np.random.Generator) -> None:
    """Points come back from their pictures in two or more views; from one view they are NaN."""
    cameras = _turn().nominal(800.0, perspective)[:3]
    points = rng.normal(0, 0.08, (10, 3))
    pixels = np.stack([camera.project(points) for camera in cameras])
    weights = np.ones((3, 10))
    weights[1:, 4] = 0
    found = triangulate(cameras, pixels, weights)
    assert np.isnan(found[4]).all()
    known = np.arange(10) != 4
    assert np.allclose(found[known], points[known], atol=1e-9)


def test_a_point_moves_from_its_start_onto_the_only_ray_that_knows_it(
    rng: np.random.Generator,
) -> None:
    """It comes near to the ray without moving along it, two rays bring it near to where they meet,
    and one that no view knows stays."""
    cameras = _turn().nominal(800.0, 1.4)[:2]
    points = rng.normal(0, 0.08, (3, 3))
    pixels = np.stack([camera.project(points) for camera in cameras])
    start = points + rng.normal(0, 0.005, (3, 3))
    found = triangulate(cameras, pixels, [[1, 1, 0], [0, 1, 0]], start)
    assert np.linalg.norm(cameras[0].project(found[0]) - pixels[0, 0]) < 0.2
    ray = cameras[0].view_direction(found[0])
    assert abs((found[0] - start[0]) @ ray) < 1e-4
    assert np.linalg.norm(found[1] - points[1]) < 0.05 * np.linalg.norm(start[1] - points[1])
    assert np.allclose(found[2], start[2])


def test_the_nominal_turn_is_the_camera_of_the_conventions() -> None:
    """A vector of zeros gives `Camera.on_turn` at every azimuth."""
    for index, camera in enumerate(_turn().nominal(800.0, 1 / 0.7)):
        want = Camera.on_turn(45.0 * index, distance=0.7, focal=560.0, width=300, height=400)
        assert np.allclose(camera.camera_from_head, want.camera_from_head)
        assert camera.focal == pytest.approx(want.focal)


def test_angles_turn_the_camera_as_the_conventions_say() -> None:
    """Azimuth, elevation and roll of a view are those of `Camera.on_turn`."""
    turn = _turn(1)
    vector = np.zeros(turn.size)
    vector[6], vector[PERSPECTIVE] = np.log(800.0), 1 / 0.7
    vector[8:11] = np.radians([3.0, -2.0, 1.5])
    want = Camera.on_turn(
        3.0, elevation_deg=-2.0, roll_deg=1.5, distance=0.7, focal=560.0, width=300, height=400
    )
    assert np.allclose(turn.cameras(vector)[0].camera_from_head, want.camera_from_head)


@pytest.mark.parametrize("perspective", [1 / 0.7, 0.0])
def test_cameras_give_a_vector_that_gives_them_back(
    rng: np.random.Generator, perspective: float
) -> None:
    """`vector_of` finds other numbers, since tilt and angles trade off, but the same cameras."""
    turn = _turn()
    vector = _vector(turn, rng)
    vector[PERSPECTIVE] = perspective
    points = 0.1 * rng.standard_normal((20, 3))
    cameras = turn.cameras(vector)
    for found, want in zip(turn.cameras(turn.vector_of(cameras)), cameras, strict=True):
        assert found.model == want.model
        assert np.allclose(found.project(points), want.project(points), atol=0.1)


def test_photos_of_several_shapes_have_pixels_of_one_size() -> None:
    """Cropped photos share the focal length; enlarged ones of one shape have one by their size."""

    def ratios(*sizes: tuple[int, int]) -> list[float]:
        views = [View(str(i), 0.0, np.zeros((h, w, 3), np.uint8)) for i, (w, h) in enumerate(sizes)]
        return list(Turn.of(Capture(tuple(views))).focal_ratios)

    assert ratios((300, 400), (300, 340), (280, 400)) == [1.0, 1.0, 1.0]
    assert ratios((300, 400), (600, 800), (400, 300)) == [1.0, 2.0, 1.0]


def test_far_cameras_become_orthographic(rng: np.random.Generator) -> None:
    """At the least perspective the orthographic camera sees what the far pinhole would."""
    turn = _turn()
    vector = _vector(turn, rng)
    vector[PERSPECTIVE] = MIN_PERSPECTIVE
    flat = turn.cameras(vector)
    vector[PERSPECTIVE] = MIN_PERSPECTIVE * 1.001
    points = rng.normal(0, 0.1, (30, 3))
    for one, other in zip(flat, turn.cameras(vector), strict=True):
        assert one.model == "orthographic"
        assert other.model == "perspective"
        assert np.abs(one.project(points) - other.project(points)).max() < 0.5


def test_tangents_are_the_derivative_of_the_cameras(rng: np.random.Generator) -> None:
    """Points move in the pictures as the tangents of the vector foretell."""
    turn = _turn()
    vector, move = _vector(turn, rng), rng.normal(size=turn.size)
    step = 1e-6
    points = rng.normal(0, 0.1, (5, 3))
    motions = turn.tangents(vector) @ move
    near, far = turn.cameras(vector), turn.cameras(vector + step * move)
    for camera, moved, motion in zip(near, far, motions, strict=True):
        x = camera.to_camera(points)
        dx = np.cross(motion[:3], x) + motion[3:6]
        pixels = camera.focal * x[:, :2] / x[:, 2:]
        want = camera.focal * (dx[:, :2] - x[:, :2] * dx[:, 2:] / x[:, 2:]) / x[:, 2:]
        want += motion[6] * pixels
        got = (moved.project(points) - camera.project(points)) / step
        assert np.allclose(got, want, rtol=1e-3, atol=1e-2 * np.abs(want).max())
