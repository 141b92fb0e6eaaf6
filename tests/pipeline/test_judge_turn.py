"""Laws of the judged turn: the arrangement whose cameras fit is taken, however unlikely it was."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest
from turntable import NAMES, Turntable, turntable

from hairkit.pipeline.judge_turn import judge_turn
from hairkit.types.turnaround import Turnaround


@pytest.fixture(scope="module")
def bust() -> Turntable:
    """A head seen by perspective cameras off the turn, its photos from the front on."""
    return turntable(np.random.default_rng(3))


def arranged(places: Sequence[int]) -> Turnaround:
    """Return the turn in which photo k has the place `places[k]`."""
    azimuth = 45.0 * np.asarray(places, np.float64)
    names = tuple(NAMES[place] for place in places)
    return Turnaround(np.argsort(places), azimuth, np.zeros(8), names, 1.05, "a turn")


RIGHT = arranged(range(8))
SWAPPED = arranged([0, 1, 2, 5, 4, 3, 6, 7])
MIRRORED = arranged([0, 1, 6, 5, 4, 3, 2, 7])


def judged(bust: Turntable, turn: Turnaround) -> Turnaround:
    """Return the turn that the cameras of the bust choose."""
    return judge_turn(bust.capture, bust.masks, bust.head, turn)


@pytest.mark.parametrize("others", [(RIGHT,), (MIRRORED, RIGHT)], ids=["one", "two"])
def test_cameras_find_the_right_arrangement(
    bust: Turntable, others: tuple[Turnaround, ...]
) -> None:
    """Back views in each other's place fit no cameras, though the photos thought it likelier."""
    turn = judged(bust, replace(SWAPPED, others=others))
    assert np.array_equal(turn.azimuth_deg, RIGHT.azimuth_deg)
    assert turn.names == NAMES
    assert turn.margin > 1.25
    assert turn.doubts == turn.others == ()


def test_the_likeliest_stays_where_it_fits(bust: Turntable) -> None:
    """A right arrangement is not changed by wrong ones that fit nearly as well by other signs."""
    turn = judged(bust, replace(RIGHT, others=(SWAPPED,)))
    assert turn.names == NAMES
    assert turn.margin > 1.25


def test_a_tie_of_cameras_is_told(bust: Turntable) -> None:
    """Two arrangements whose cameras fit alike: one is taken, and its photos are named."""
    turn = judged(bust, replace(RIGHT, others=(replace(RIGHT, margin=1.0),)))
    assert turn.margin == pytest.approx(1.0)
    assert len(turn.doubts) == 1
    assert "may have another place" in turn.doubts[0]


def test_where_no_cameras_fit_the_photos_decide(bust: Turntable) -> None:
    """Outlines that fit no arrangement overrule nothing: the likeliest stays, with its margin."""
    shifted = [
        replace(mask, labels=np.roll(mask.labels, 60 * (k % 3 - 1), axis=1))
        for k, mask in enumerate(bust.masks)
    ]
    turn = judge_turn(bust.capture, tuple(shifted), bust.head, replace(SWAPPED, others=(RIGHT,)))
    assert turn.names == SWAPPED.names
    assert turn.margin == SWAPPED.margin
    assert "may have another place" in turn.doubts[0]


def test_without_others_nothing_is_asked(bust: Turntable) -> None:
    """A turn that is sure stays as it is: no mask is needed."""
    assert judge_turn(bust.capture, (), bust.head, RIGHT) is RIGHT


def test_the_line_tells_margin_and_doubts() -> None:
    """The log has the summary, the margin and what is unsure."""
    told = replace(RIGHT, doubts=("IMG_2.jpg is unsure",)).line()
    assert told == "a turn; margin 1.05; IMG_2.jpg is unsure"
    assert replace(RIGHT, margin=np.inf).line() == "a turn"
