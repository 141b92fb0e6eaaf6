"""Laws of the word about compilation."""

from __future__ import annotations

from numba import njit

from hairkit.compilation import COMPILING, announce_compilation


def test_compilation_is_announced_once() -> None:
    """The first kernel that is compiled is announced; others and compiled ones are not."""

    @njit
    def twice(x: float) -> float:
        return x + x

    said: list[str] = []
    with announce_compilation(said.append):
        assert twice(1) == 2
        assert twice(1.5) == 3.0
    assert said == [COMPILING]
    with announce_compilation(said.append):
        assert twice(2) == 4
    assert said == [COMPILING]
