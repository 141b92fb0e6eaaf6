"""Laws of both simulators over random hair: it stays whole whatever is done to it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from hairkit_plugins import rods, super_helix
from hypothesis import given, settings
from hypothesis import strategies as st
from random_hair import DEEDS, FAR, KINDS, STEPS, Happening, Strand, endure, groom_of

from hairkit.simulation import Simulator
from hairkit.types.groom import Groom

SIMULATORS: dict[str, Callable[[Groom], Simulator]] = {
    "rods": lambda groom: rods.make_simulator(groom, rods.Options(backend="fast", friction=0.0)),
    "super_helix": lambda groom: super_helix.make_simulator(
        groom, super_helix.Options(friction=0.0)
    ),
}
METHODS = pytest.mark.parametrize("method", list(SIMULATORS))


STRANDS = st.lists(
    st.tuples(st.sampled_from(KINDS), st.floats(-3.0, 0.18), st.integers(2, 60)),
    min_size=1,
    max_size=6,
)
HAPPENINGS = st.builds(
    Happening,
    st.sampled_from(DEEDS),
    st.sampled_from(STEPS),
    st.sampled_from(FAR),
)


@METHODS
@settings(max_examples=8)
@given(STRANDS, HAPPENINGS, st.integers(0, 2**31))
def test_any_hair_is_whole_a_second_after_anything(
    method: str, strands: list[Strand], happening: Happening, seed: int
) -> None:
    """1 mm to 1.5 m, curled by 10,000 degrees, folded, without length; spun, shaken, elsewhere.

    Points are finite at all times; a second later no two are farther apart than at rest by 1 %.
    """
    rng = np.random.default_rng(seed)
    simulator = SIMULATORS[method](groom_of(strands, rng))
    endure(simulator, happening, rng, 60)
    assert simulator.measure().stretch < 0.01


@METHODS
@settings(max_examples=4)
@given(
    st.lists(st.tuples(st.just("straight"), st.floats(-3, -1.6), st.integers(2, 20)), min_size=1),
    HAPPENINGS,
    st.integers(0, 2**31),
)
def test_hair_too_short_to_fall_comes_back_to_rest(
    method: str, strands: list[Strand], happening: Happening, seed: int
) -> None:
    """Straight hair of up to 25 mm, which bears its weight: within 2 mm after five seconds."""
    rng = np.random.default_rng(seed)
    groom = groom_of(strands[:6], rng)
    simulator = SIMULATORS[method](groom)
    endure(simulator, replace(happening, far=0.0), rng, 300)
    assert np.abs(simulator.points - groom.strands.points).max() < 0.002
