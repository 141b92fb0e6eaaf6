"""Random hair and what is done to it: for the laws of robustness and the program that runs many."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from hairkit.arrays import Float64Array
from hairkit.simulation import Simulator, Surroundings, quaternion
from hairkit.testing import bristle_groom
from hairkit.types.groom import Groom
from hairkit.types.strands import Strands

Strand = tuple[str, float, int]
"""Kind, log10 of the length in metres, number of points."""
BALL = bristle_groom()
KINDS = ["straight", "curl", "walk", "repeated", "fold", "point"]
DEEDS = ["spin", "shake", "leap", "teleport", "storm"]
STEPS = [0.001, 1 / 240, 1 / 60, 0.05, 0.2]
"""Seconds."""
FAR = [0.0, 0.0, 1000.0, 5000.0]
"""Metres from the origin."""


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


def groom_of(strands: list[Strand], rng: np.random.Generator) -> Groom:
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
