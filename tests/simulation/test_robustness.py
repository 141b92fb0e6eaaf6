"""Laws of both simulators over random hair: it stays whole whatever is done to it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
import pytest
from hairkit_plugins import pbd, super_helix
from hypothesis import given, settings
from hypothesis import strategies as st

from hairkit.arrays import Float64Array
from hairkit.simulation import Simulator, Surroundings, quaternion
from hairkit.testing import bristle_groom
from hairkit.types.groom import Groom
from hairkit.types.strands import Strands

BALL = bristle_groom()
SIMULATORS: dict[str, Callable[[Groom], Simulator]] = {
    "pbd": lambda groom: pbd.make_simulator(groom, pbd.Options(backend="fast", friction=0.0)),
    "super_helix": lambda groom: super_helix.make_simulator(
        groom, super_helix.Options(friction=0.0)
    ),
}
METHODS = pytest.mark.parametrize("method", list(SIMULATORS))


@dataclass(frozen=True)
class Happening:
    """What is done to the hair in half a second, in steps of `step` seconds."""

    kind: str
    step: float
    """Seconds."""
    far: float
    """Metres from the origin."""

    def at(self, time: float, rng: np.random.Generator) -> Surroundings:
        """Return the state of the head and the air."""
        angles = {"spin": 62.8 * time, "shake": 1.5 * np.sin(20 * time), "leap": rng.uniform(-3, 3)}
        head = self.away()
        turn = quaternion.from_axis([0.3, 1.0, 0.2], angles.get(self.kind, 0.0))
        head[:3, :3] = quaternion.to_matrix(turn)
        if self.kind == "teleport":
            head[:3, 3] += rng.uniform(-1, 1, 3) * rng.choice([0.05, 1.0, 100.0])
        wind = np.array([200.0, 0.0, 0.0]) if self.kind == "storm" else np.zeros(3)
        return Surroundings(head, wind, 0.3)

    def away(self) -> Float64Array:
        """Return the place of the head at rest."""
        head = np.eye(4)
        head[:3, 3] = self.far
        return head


def strand(kind: str, length: float, count: int, rng: np.random.Generator) -> Float64Array:
    """Return points (count, 3) of a strand from the origin along x."""
    s = np.linspace(0, 1, count)[:, None]
    way, side, up = np.eye(3)
    if kind == "curl":
        turns, radius = rng.uniform(0, 28), rng.uniform(0.001, 0.02)
        angle = 2 * np.pi * turns * s
        return s * way * length + radius * (np.sin(angle) * side + (1 - np.cos(angle)) * up)
    if kind == "walk":
        points = np.cumsum(rng.normal(size=(count, 3)), axis=0) * length / count
        return points - points[0]
    if kind == "repeated":
        return length * np.where(s > 0.5, 0.5, s) * way
    if kind == "fold":
        return length * (0.5 - np.abs(s - 0.5)) * way
    return (0.0 if kind == "point" else length) * s * way


KINDS = ["straight", "curl", "walk", "repeated", "fold", "point"]
STRANDS = st.lists(
    st.tuples(st.sampled_from(KINDS), st.floats(-3.0, 0.18), st.integers(2, 60)),
    min_size=1,
    max_size=6,
)
HAPPENINGS = st.builds(
    Happening,
    st.sampled_from(["spin", "shake", "leap", "teleport", "storm"]),
    st.sampled_from([0.001, 1 / 240, 1 / 60, 0.05, 0.2]),
    st.sampled_from([0.0, 0.0, 1000.0, 5000.0]),
)


def groom_of(strands: list[tuple[str, float, int]], rng: np.random.Generator) -> Groom:
    """Return hair on a ball; of each strand its kind, log10 of its length, and its points."""
    pick, made = rng.choice(len(BALL.strands), len(strands)), []
    for root, (kind, size, count) in zip(BALL.strands.roots[pick], strands, strict=True):
        out = root.astype(np.float64)
        turn = quaternion.shortest_arc(np.array([1.0, 0, 0]), out / np.linalg.norm(out))
        made.append(out + quaternion.rotate(turn, strand(kind, 10**size, count, rng)))
    return replace(
        BALL,
        strands=Strands.from_list(made),
        root_triangle=BALL.root_triangle[pick],
        root_barycentric=BALL.root_barycentric[pick],
    )


def endure(simulator: Simulator, happening: Happening, rng: np.random.Generator, calm: int) -> None:
    """Let it happen for half a second, then leave the hair alone for `calm` frames."""
    simulator.reset(happening.away())
    for k in range(min(int(0.5 / happening.step), 60)):
        simulator.advance(happening.step, happening.at((k + 1) * happening.step, rng))
        assert np.isfinite(simulator.points).all()
    for _ in range(calm):
        simulator.advance(1 / 60, Surroundings(happening.away()))


@METHODS
@settings(max_examples=8)
@given(STRANDS, HAPPENINGS, st.integers(0, 2**31))
def test_any_hair_is_whole_a_second_after_anything(
    method: str, strands: list[tuple[str, float, int]], happening: Happening, seed: int
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
    method: str, strands: list[tuple[str, float, int]], happening: Happening, seed: int
) -> None:
    """Straight hair of up to 25 mm, which bears its weight: within 2 mm after five seconds."""
    rng = np.random.default_rng(seed)
    groom = groom_of(strands[:6], rng)
    simulator = SIMULATORS[method](groom)
    endure(simulator, replace(happening, far=0.0), rng, 300)
    assert np.abs(simulator.points - groom.strands.points).max() < 0.002
