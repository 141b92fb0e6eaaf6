"""Laws of the window's sleep: no pictures while nothing moves."""

from __future__ import annotations

from pathlib import Path

import pytest

from hairkit.manager import Manager
from hairkit.testing import bristle_groom
from hairkit.viewer.session import Session
from hairkit.viewer.window.stillness import AWAKE, CHECK, Stillness


@pytest.fixture
def session(manager: Manager, tmp_path: Path) -> Session:
    """Return hair at rest."""
    bristle_groom().save(tmp_path / "groom.npz")
    return Session(manager, tmp_path / "groom.npz", hairs=100)


def passed(session: Session, stillness: Stillness, start: float, seconds: float) -> bool:
    """Go on, and return whether the window then sleeps."""
    asleep, steps = False, round(seconds / 0.1)
    for k in range(steps):
        session.advance(0.1)
        asleep = stillness.asleep(start + 0.1 * (k + 1))
    return asleep


def test_the_window_sleeps_once_hair_rests_and_wakes_for_events(session: Session) -> None:
    """Not before a second has passed; again a second after an event."""
    stillness = Stillness(session, 0.0)
    assert not passed(session, stillness, 0.0, 0.9 * AWAKE)
    assert passed(session, stillness, 0.9 * AWAKE, 2 * CHECK)
    stillness.stir(3.0)
    assert not stillness.asleep(3.0 + 0.5 * AWAKE)
    assert passed(session, stillness, 3.0 + 0.5 * AWAKE, AWAKE)


def test_wind_and_scripts_keep_the_window_awake(session: Session) -> None:
    """While air blows or a script simulates, pictures go on; then hair has to come to rest."""
    stillness = Stillness(session, 0.0)
    session.wind.blowing = True
    assert not passed(session, stillness, 0.0, 4.0)
    session.wind.blowing = False
    assert not passed(session, stillness, 4.0, CHECK)
    assert passed(session, stillness, 4.0 + CHECK, 8.0)
    session.pending = 0.2
    assert not stillness.asleep(20.0)


def test_a_paused_window_sleeps_though_wind_blows(session: Session) -> None:
    """Nothing moves then."""
    session.paused = session.wind.blowing = True
    assert passed(session, Stillness(session, 0.0), 0.0, 2 * AWAKE)
