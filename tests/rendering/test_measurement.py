"""Laws of the pictures to measure with: they show what `Camera.project` says, nearest first."""

from __future__ import annotations

import threading

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hairkit.rendering import (
    draw_depth,
    draw_layers,
    draw_measurements,
    visible_points,
)
from hairkit.testing import ball_head
from hairkit.types.camera import Camera, CameraModel
from hairkit.types.orientation import angle_between
from hairkit.types.strands import Strands

WIDTH, HEIGHT = 96, 72


def camera_at(azimuth: float, model: CameraModel = "perspective", roll: float = 0.0) -> Camera:
    """A small camera whose principal point is off the middle."""
    return Camera.on_turn(
        azimuth,
        elevation_deg=9.0,
        roll_deg=roll,
        distance=0.7,
        focal=160.0 if model == "perspective" else 230.0,
        width=WIDTH,
        height=HEIGHT,
        centre=(45.3, 38.6),
        model=model,
    )


@settings(max_examples=12)
@given(
    model=st.sampled_from(["perspective", "orthographic"]),
    azimuth=st.floats(0, 360),
    roll=st.floats(-20, 20),
    point=st.tuples(*[st.floats(-0.06, 0.06)] * 3),
)
def test_a_drawn_point_lands_where_project_says(
    model: CameraModel, azimuth: float, roll: float, point: tuple[float, float, float]
) -> None:
    """The centre of what is drawn of a speck lies within half a pixel of its projection."""
    camera = camera_at(azimuth, model, roll)
    side = 0.002 * camera.rotation[0]
    speck = Strands.from_list([np.array([point - side, point + side])])
    cover = draw_layers(speck, None, camera)[0].astype(np.float64)
    rows, columns = np.mgrid[:HEIGHT, :WIDTH] + 0.5
    drawn = np.array([(cover * columns).sum(), (cover * rows).sum()]) / cover.sum()
    assert np.abs(drawn - camera.project(point)).max() < 0.5


@pytest.mark.parametrize("model", ["perspective", "orthographic"])
def test_a_drawn_line_runs_as_its_projection(model: CameraModel) -> None:
    """Every pixel of a straight strand has the angle of its projection and lies on it."""
    camera = camera_at(33.0, model, roll=7.0)
    ends = np.array([[-0.05, -0.04, 0.02], [0.06, 0.05, -0.03]])
    drawn = draw_measurements(Strands.from_list([np.linspace(*ends, 12)]), None, camera)
    angle, seen = drawn.angle, drawn.seen
    first, last = camera.project(ends)
    along = (last - first) / np.linalg.norm(last - first)
    assert seen.sum() >= np.abs(last - first).max() - 1
    gap = angle_between(angle[seen], np.arctan2(along[1], along[0]))
    assert np.degrees(gap.max()) < 0.5
    rows, columns = np.nonzero(seen)
    offset = np.stack([columns + 0.5, rows + 0.5], axis=1) - first
    assert np.abs(offset[:, 0] * along[1] - offset[:, 1] * along[0]).max() < 1.0


def test_what_lies_nearer_is_seen() -> None:
    """Of two crossing strands the nearer one gives angle, depth and visibility at the crossing."""
    camera = camera_at(0.0)
    level = np.linspace([-0.05, 0, 0.03], [0.05, 0, 0.03], 21)
    behind = level[10] + 0.06 * camera.view_direction(level[10])
    upright = behind + np.linspace([0, -0.05, 0], [0, 0.05, 0], 21)
    strands = Strands.from_list([upright, level])
    column, row = np.floor(camera.project(level[10])).astype(int)
    angle = draw_measurements(strands, None, camera, width=0.01).angle
    flat = np.arctan2(*(camera.project(level[11]) - camera.project(level[9]))[::-1])
    assert np.degrees(angle_between(angle[row, column], flat)) < 1
    depth = draw_depth(strands, None, camera, width=0.01)
    assert depth[row, column] == pytest.approx(float(camera.depth(level[10])), abs=1e-3)
    visible = visible_points(strands, None, camera)
    assert not visible[10]
    assert visible[31]


def test_the_head_hides_what_is_behind_it() -> None:
    """Strands behind the head are not drawn; roots on its surface are."""
    head = ball_head()
    behind = np.linspace([-0.02, 0, -0.15], [0.02, 0, -0.15], 5)
    before = np.linspace([0, 0.0, 0.1], [0, 0.03, 0.0955], 5)
    camera = camera_at(0.0)
    assert draw_layers(Strands.from_list([behind]), None, camera)[0].any()
    assert not draw_layers(Strands.from_list([behind]), head, camera)[0].any()
    assert draw_layers(Strands.from_list([before]), head, camera)[0].max() > 0.5


def test_coverage_is_the_area_that_is_drawn() -> None:
    """A strand's coverage sums up to its length times its width in pixels."""
    camera = camera_at(0.0, "orthographic")
    ends = np.array([[-0.1, -0.08, 0], [0.1, 0.07, 0]])
    strand = Strands.from_list([np.linspace(*ends, 8)])
    for width in (0.01, 0.02):
        cover = draw_layers(strand, None, camera, width=width)[0]
        length = np.linalg.norm(np.diff(camera.project(ends), axis=0))
        assert cover.sum() == pytest.approx(length * width * camera.focal, rel=0.05)


def test_strands_beyond_what_a_dispatch_takes_are_drawn_in_parts(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Many parts, single strands among them, give the picture of one."""
    generator = np.random.default_rng(3)
    counts = generator.integers(2, 20, 40)
    lines = [generator.uniform(-0.08, 0.08, (2, 3)) for _ in counts]
    hair = Strands.from_list([np.linspace(*ends, n) for ends, n in zip(lines, counts, strict=True)])
    whole = draw_layers(hair, None, camera_at(30.0))[0]
    monkeypatch.setattr("hairkit.rendering.hair._MOST_POINTS", 30)
    assert np.array_equal(draw_layers(hair, None, camera_at(30.0))[0], whole)


def test_layers_share_out_a_pixel() -> None:
    """Hair and solids together never cover more than a pixel, and the ball is as big as it is."""
    head = ball_head(24)
    hair = Strands.from_list([np.linspace([-0.05, 0.02, 0.11], [0.05, 0.02, 0.11], 9)])
    camera = camera_at(10.0, "orthographic")
    share, solid = draw_layers(hair, head, camera, width=0.01)
    assert (share + solid).max() <= 1 + 1e-6
    alone = draw_layers(hair.select([]), head, camera)[1]
    assert alone.sum() == pytest.approx(np.pi * (0.1 * camera.focal) ** 2, rel=0.03)


def test_no_strands_draw_nothing() -> None:
    """Without strands nothing is covered and nothing seen, with and without a head."""
    none = Strands(np.zeros((0, 3)), np.zeros(1))
    for head in (None, ball_head()):
        assert not draw_layers(none, head, camera_at(0))[0].any()
        assert not draw_measurements(none, head, camera_at(0)).seen.any()


def test_equal_input_gives_equal_pictures_on_any_thread() -> None:
    """Drawing again, also from another thread, gives the same bytes."""
    strands = Strands.from_list(
        [np.random.default_rng(i).normal(0, 0.05, (9, 3)) for i in range(9)]
    )
    results = []

    def job() -> None:
        results.append(draw_measurements(strands, ball_head(), camera_at(20.0)).angle.tobytes())

    job()
    for _ in range(2):
        thread = threading.Thread(target=job)
        thread.start()
        thread.join()
    job()
    assert len(results) == 4
    assert len(set(results)) == 1
