"""Laws of finding ties: where the hull has a neck and the directions of all views converge."""

from __future__ import annotations

import numpy as np
import pytest

from hairkit.arrays import Float64Array
from hairkit.field.find_ties import find_bundles, measure_ties
from hairkit.field.growth_prior import measure_scalp_distance
from hairkit.types.tie import Tail, TiedHair
from hairkit.types.volume import Hull
from tests.support import tied_ball as ball


def measure(hull: Hull, place: Float64Array = ball.TIE) -> TiedHair:
    """Measure the ties of a hull whose hair runs towards a direction (3,) on the scalp."""
    cameras = ball.cameras()
    masks, maps = zip(*(ball.seen(camera, place) for camera in cameras), strict=True)
    return measure_ties(
        masks, maps, cameras, ball.HEAD, hull, measure_scalp_distance(ball.HEAD, hull)
    )


@pytest.fixture(scope="module")
def tail() -> Tail:
    found = measure(ball.tied_hull()).tails
    assert len(found) == 1
    return found[0]


def test_a_ponytail_is_tied_where_it_leaves_the_head(tail: Tail) -> None:
    """Centre and axis are those of the tail's narrowest place."""
    course, _ = ball.tail_course()
    assert np.linalg.norm(course - tail.tie.centre, axis=1).min() < 0.008
    assert np.linalg.norm(tail.tie.centre) < ball.BALL + 0.05
    assert tail.tie.axis @ ball.TIE > 0.8
    assert 0.5 * ball.RING < tail.tie.radius < 1.5 * ball.RING
    assert tail.tie.kind == "tail"
    assert tail.sureness > 0.4


def test_the_tube_follows_the_tail(tail: Tail) -> None:
    """The spine runs to the tail's end, and the section in its middle is as wide as the hair."""
    course, radii = ball.tail_course()
    gap = np.linalg.norm(course[:, None] - tail.spine[None], axis=2)
    assert gap.min(axis=0).max() < 0.008
    assert np.linalg.norm(tail.spine[-1] - course[-1]) < 0.03
    middle = len(tail.spine) // 2
    own = radii[gap[:, middle].argmin()]
    half = np.linalg.norm(tail.spokes[middle], axis=1)
    assert half == pytest.approx([own, own], rel=0.25)


def test_strands_end_as_the_tail_grows_thin(tail: Tail) -> None:
    """All strands reach the widest section; few reach the end, which is half as wide."""
    assert tail.share[0] == 1
    assert (np.diff(tail.share) <= 0).all()
    assert 0.03 < tail.share[-1] < 0.6


def test_loose_hair_has_no_neck() -> None:
    """A curtain joins the head along its whole hairline: nothing is tied."""
    hull = ball.tied_hull(curtain=True)
    assert find_bundles(hull, measure_scalp_distance(ball.HEAD, hull)) == ()
    assert measure(hull).tails == ()


def test_directions_must_converge_at_the_neck() -> None:
    """The same hull with hair that runs to the crown, as loose hair does, is not tied."""
    assert measure(ball.tied_hull(), np.array([0.0, 1.0, 0.0])).tails == ()
