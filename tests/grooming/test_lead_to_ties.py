"""Laws of strands that are led to their tie and down the tail."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from hairkit.arrays import Float64Array
from hairkit.grooming.lead_to_ties import RISE, SKIN, lead_to_ties, plait
from hairkit.types.strands import Strands
from hairkit.types.tie import Tail, Tie, TiedHair
from tests.support import tied_ball as ball


def tube() -> Tail:
    """The exact tail of the ball, from outside its hair."""
    course, radii = ball.tail_course()
    start = int(np.argmax(np.linalg.norm(course, axis=1) > ball.BALL + ball.THICK))
    spine, radii = course[start::3], radii[start::3]
    tangent = np.gradient(spine, axis=0)
    tangent /= np.linalg.norm(tangent, axis=1, keepdims=True)
    first = np.broadcast_to([1.0, 0.0, 0.0], spine.shape)
    spokes = np.stack([first, np.cross(tangent, first)], axis=1) * radii[:, None, None]
    share = np.minimum.accumulate(np.minimum(1, (radii / radii.max()) ** 2)[::-1])[::-1]
    share = np.where(np.arange(len(radii)) <= radii.argmax(), 1.0, share)
    tie = Tie(spine[0].astype(np.float32), tangent[0].astype(np.float32), ball.RING, "tail")
    return Tail(tie, 1.0, *(v.astype(np.float32) for v in (spine, spokes, share)))


def bristles() -> Strands:
    """Short strands out of the scalp, 48 points each."""
    vertices = ball.HEAD.vertices[ball.HEAD.scalp > 0.5].astype(np.float64)
    course = np.linspace(0.1, 0.12, 48)[None, :, None]
    points = vertices[:, None] / np.linalg.norm(vertices, axis=1)[:, None, None] * course
    offsets = np.arange(len(vertices) + 1) * 48
    return Strands(points.reshape(-1, 3).astype(np.float32), offsets)


@pytest.fixture(scope="module")
def led() -> Float64Array:
    """Points (S, 48, 3) of the bristles led through the tie."""
    strands = lead_to_ties(bristles(), TiedHair((tube(),)), ball.tied_hull(), ball.tied_field())
    assert strands.group is not None
    assert (strands.group == 1).all()
    return strands.resampled(400).points.reshape(len(strands), 400, 3).astype(np.float64)


def test_every_strand_passes_its_ring(led: Float64Array) -> None:
    """Somewhere each strand is within the ring's radius of its centre; roots stay."""
    tie = tube().tie
    nearest = np.linalg.norm(led - tie.centre, axis=2).min(axis=1)
    assert nearest.max() < 1.1 * tie.radius + 0.002
    assert np.allclose(led[:, 0], bristles().roots, atol=1e-6)


def test_strands_stay_out_of_the_ball_and_in_the_hair(led: Float64Array) -> None:
    """No point lies in the ball; almost all lie in the hull or within a cell of it."""
    assert np.linalg.norm(led, axis=2).min() > 0.098
    hull = ball.tied_hull()
    sample = hull.grid.sample(hull.dense.astype(np.float32), led.reshape(-1, 3))
    assert (sample > 0.05).mean() > 0.95


def test_strands_rise_from_the_skin_evenly(rng: np.random.Generator) -> None:
    """At a hairline, where no hair lies underneath, strands do not jump to the top of the hull."""
    count, across = 600, np.cross(ball.TIE, [1.0, 0.0, 0.0])
    turn, angle = rng.uniform(-0.3, 0.3, count), rng.uniform(1.6, 1.62, count)
    side = np.outer(np.sin(turn), [1, 0, 0]) - np.outer(np.cos(turn), across)
    out = np.cos(angle)[:, None] * ball.TIE + np.sin(angle)[:, None] * side
    course = out[:, None] * np.linspace(ball.BALL, 0.12, 48)[:, None]
    hairline = Strands(course.reshape(-1, 3).astype(np.float32), np.arange(count + 1) * 48)
    led = lead_to_ties(hairline, TiedHair((tube(),)), ball.tied_hull(), ball.tied_field())
    points = led.points.reshape(count, 48, 3).astype(np.float64)
    height = np.linalg.norm(points[:, 1], axis=1) - ball.BALL
    arc = np.linalg.norm(points[:, 1] - points[:, 0], axis=1)
    assert (height < SKIN + RISE * arc).all()


def test_the_tail_is_filled(led: Float64Array) -> None:
    """Half way down, strands are spread over the section: its quarters hold equal parts."""
    tail = tube()
    at = len(tail.spine) // 2
    off = led - tail.spine[at]
    along = tail.spine[at + 1] - tail.spine[at]
    cut = np.abs(off @ (along / np.linalg.norm(along))) < 0.003
    half = np.linalg.norm(tail.spokes[at, 0])
    place = np.einsum("nj,kj->nk", off[cut], tail.spokes[at].astype(np.float64)) / half**2
    inside = place[np.linalg.norm(place, axis=1) < 1.05]
    assert len(inside) > 0.9 * len(place)
    quarters = np.bincount((inside[:, 0] > 0) + 2 * (inside[:, 1] > 0), minlength=4) / len(inside)
    assert quarters == pytest.approx(np.full(4, 0.25), abs=0.06)


def test_loose_hair_is_left_alone() -> None:
    """Without ties the strands are the same object."""
    strands = bristles()
    assert lead_to_ties(strands, TiedHair(), ball.tied_hull(), ball.tied_field()) is strands


def test_a_braid_crosses_its_spine_at_the_measured_angle() -> None:
    """Bundles stay in the tube, weave to both sides, and run at the angle in the mean square."""
    turn = np.linspace(0, 2 * np.pi, 60, endpoint=False)
    spine = np.stack([0 * np.arange(400), -5e-4 * np.arange(400), 0 * np.arange(400)], axis=1)
    spokes = np.broadcast_to([[0.02, 0, 0], [0, 0, 0.02]], (400, 2, 3))
    tie = Tie(np.zeros(3, np.float32), np.array([0, -1, 0], np.float32), 0.02, "braid")
    braid = Tail(tie, 1.0, spine, spokes, np.ones(400), crossing=0.6)
    courses = np.array([plait(float(np.cos(a)), float(np.sin(a)), braid) for a in turn])
    assert np.linalg.norm(courses, axis=2).max() < 1.1
    sideways = 0.02 * np.diff(courses[..., 0], axis=1) / 5e-4
    assert np.sqrt((sideways**2).mean()) == pytest.approx(np.tan(0.6), rel=0.05)
    assert 0.4 < (sideways > 0).mean() < 0.6
    plain = replace(braid, crossing=0.0)
    assert np.ptp(plait(0.3, 0.4, plain), axis=0) == pytest.approx([0, 0])
