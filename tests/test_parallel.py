"""Laws of threads that share a loop."""

from __future__ import annotations

import numpy as np
import pytest

from hairkit.parallel import Crew


def test_a_crew_does_every_piece_once() -> None:
    """Whatever the counts, each number is in one piece; an error of a thread is passed on."""
    crew, done = Crew(), np.zeros(1000, int)

    def work(first: int, last: int, step: int) -> None:
        done[first:last] += step

    for count, worth in ((1000, 1), (1000, 400), (7, 3), (0, 1)):
        done[:] = 0
        crew.share(work, count, worth, 2)
        assert (done[:count] == 2).all()
        assert (done[count:] == 0).all()

    def fail(first: int, last: int) -> None:
        raise ValueError(first)

    with pytest.raises(ValueError, match="0"):
        crew.share(fail, 1000, 1)
