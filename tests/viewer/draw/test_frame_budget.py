"""Laws of the frame budget."""

from __future__ import annotations

import itertools
from dataclasses import astuple

from hairkit.viewer.draw.frame_budget import HURRIED, LEVELS, Budget


def settle(budget: Budget, times: list[float], pictures: int = 400) -> None:
    """Draw pictures that take, at each level, so long."""
    for _ in range(pictures):
        budget.record(times[budget.level])


def test_slow_drawing_draws_less_until_it_fits() -> None:
    """The level ends where pictures fit, and does not swing."""
    budget = Budget(0.05)
    times = [0.4, 0.2, 0.1, 0.045, 0.03, 0.02, 0.01]
    settle(budget, times)
    assert budget.level == 3
    settle(budget, times)
    assert budget.level == 3


def test_a_hand_gets_sixty_frames_a_second() -> None:
    """While a brush is led pictures are made faster, and better again when it is lifted."""
    budget = Budget(0.05)
    times = [0.02, 0.018, 0.015, 0.011, 0.008, 0.006, 0.004]
    settle(budget, times)
    assert budget.level == 0
    budget.hurried = True
    settle(budget, times, 40)
    assert times[budget.level] <= HURRIED
    budget.hurried = False
    settle(budget, times)
    assert budget.level == 0


def test_fast_drawing_draws_the_best() -> None:
    """With time to spare every level is climbed."""
    budget = Budget(0.05, level=len(LEVELS) - 1)
    settle(budget, [0.005] * len(LEVELS))
    assert budget.quality == LEVELS[0]


def test_hopeless_drawing_stays_at_the_fastest() -> None:
    """Too slow at every level is no reason to stop."""
    budget = Budget(0.05)
    settle(budget, [1.0] * len(LEVELS))
    assert budget.quality == LEVELS[-1]


def test_no_budget_draws_the_best() -> None:
    """Scripts have all the time in the world."""
    budget = Budget(0.0)
    settle(budget, [9.0] * len(LEVELS))
    assert budget.quality == LEVELS[0]


def test_levels_draw_less_and_less() -> None:
    """From level to level nothing gets finer."""
    for better, worse in itertools.pairwise(astuple(level) for level in LEVELS):
        assert better > worse
        assert all(a >= b for a, b in zip(better, worse, strict=True))


def test_a_slow_simulator_does_not_take_all_the_time_from_drawing() -> None:
    """Drawing keeps half of the budget, however long the simulation takes."""
    budget = Budget(0.05)
    for _ in range(300):
        budget.record(0.02, simulated=1.0)
    assert budget.quality == LEVELS[1]


def test_a_busy_machine_does_not_make_pictures_pop() -> None:
    """Where a rise never lasts, rises become rare."""
    budget, changes, before = Budget(0.05), [], 1
    for number in range(6000):
        # fast for a while, until more is drawn; then the burst that takes it back
        budget.record(0.09 if budget.level < 4 else 0.01)
        if budget.level != before:
            changes.append(number)
        before = budget.level
    assert budget.level >= 3
    first, second = (sum(n // 3000 == half for n in changes) for half in (0, 1))
    assert second < 0.5 * first
    assert second <= 6
