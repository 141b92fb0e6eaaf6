"""How fast guides are simulated, and how far off: prints a table, and at equal error the ratios.

    python benchmarks/simulation.py [--guides 1000 10000] [--frames 60] [--referee PYTHON]

One scene for all: the same guides of 16 points, from their captured shape, on a head that is
shaken (`yaw:20:1.5`), under gravity, at 60 frames a second. Beside pbd there run a plain scheme of
distance constraints (Mueller et al. 2007; Macklin et al. 2016), in NumPy over all strands at once,
and, where `--referee` names a Python that has it, pyPBD (C++), with the same constraints: each node
to the next one rigidly, to the next but one by a spring, which is their bending. Their first two
nodes go with the head in every substep. They have neither obstacles nor neighbours; pbd has both,
as always.

| column | what |
|---|---|
| steps/s | steps of 1/60 s a second of wall clock, of all guides, the best of three rounds |
| stretch | largest of any segment at any frame, of up to 1000 guides |
| off | root mean square distance from the converged motion of the same material |

The converged motion is that of many substeps: of pbd for pbd, of the plain scheme in float64 for
both others. Of pyPBD the time of its own step is counted, with all threads or with one,
whichever is faster, and not the loops in Python that set roots.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
from hairkit_plugins.pbd import Options
from hairkit_plugins.pbd.simulator import PbdSimulator

from hairkit.errors import RenderError
from hairkit.grooming.prepare_export import dense_groom
from hairkit.head_model.template import default_head
from hairkit.rendering.context import renderer
from hairkit.simulation import Surroundings, add_shakes
from hairkit.synth import grow
from hairkit.types.groom import Groom

Array = npt.NDArray[Any]
NODES, FRAME = 16, 1 / 60
SHAKE = ["yaw:20:1.5"]
GRAVITY = np.array([0.0, -9.81, 0.0])
BENDING = 1000.0
"""N/m for each kilogram of a node: the spring between every node and the next but one."""
SCENE, FEW = 1000, 40
"""Most guides whose error is measured; of the peers', whose strands do not meet, so many."""
CONVERGED, CONVERGED_PLAIN = 64, (512, 2)
"""Substeps of pbd's converged motion; substeps and iterations of the others'."""
SETTINGS = ((4, 20), (16, 5), (16, 20), (32, 2), (32, 8), (64, 1), (64, 4), (128, 1), (128, 4))
"""Substeps and iterations of the peers, of which the cheapest that is as good is taken."""

PYPBD = """
import sys, time, numpy as np, pypbd as p
scene, result, substeps, iterations, bending = sys.argv[1], sys.argv[2], *map(float, sys.argv[3:])
given = np.load(scene); rest, heads, frames = given["rest"], given["heads"], int(given["frames"])
sim = p.Simulation.getCurrent(); sim.initDefault(); model = sim.getModel()
particles, nodes = model.getParticles(), rest.shape[1]
for s, strand in enumerate(rest):
    base = s * nodes
    for k in range(nodes):
        particles.addVertex(strand[k])
        particles.setMass(base + k, 0.0 if k < 2 else 1.0)
    for k in range(1, nodes - 1):
        model.addDistanceConstraint_XPBD(base + k, base + k + 1, 1e9)
    for k in range(nodes - 2):
        model.addDistanceConstraint_XPBD(base + k, base + k + 2, bending)
step = sim.getTimeStep()
p.TimeManager.getCurrent().setTimeStepSize(1 / 60 / substeps)
step.setValueUInt(p.TimeStepController.NUM_SUB_STEPS, 1)
step.setValueUInt(p.TimeStepController.MAX_ITERATIONS, int(iterations))
taken, found = [], []
for frame in range(frames):
    spent = 0.0
    for k in range(int(substeps)):
        head = heads[frame * int(substeps) + k]
        driven = rest[:, :2] @ head[:3, :3].T + head[:3, 3]
        for s in range(len(rest)):
            particles.setPosition(s * nodes, driven[s, 0])
            particles.setPosition(s * nodes + 1, driven[s, 1])
        start = time.perf_counter()
        step.step(model)
        spent += time.perf_counter() - start
    taken.append(spent)
    found.append([particles.getPosition(k) for k in range(particles.size())])
np.savez(result, taken=taken, points=np.array(found))
"""


PLAIN, PYPBD_NAME = "plain distances", "pyPBD distances"
Way = tuple[str, int, int]
"""Method, substeps, iterations."""


@dataclass(frozen=True)
class Row:
    """A line of the table."""

    way: Way
    speed: float
    """Steps of 1/60 s a second."""
    stretch: float
    """Largest, as a share."""
    off: float
    """Metres from the converged motion, root mean square."""


def groom_of(count: int) -> Groom:
    """Return `count` guides of 16 points of long hair."""
    full = dense_groom(grow("straight", default_head(), 600, 0), count, 0)
    return replace(full, strands=replace(full.strands.resampled(NODES), guide=None))


def rest_of(groom: Groom) -> Array:
    """Return the guides' points (S, 16, 3)."""
    return groom.strands.points.reshape(-1, NODES, 3).astype(np.float64)


def heads_of(groom: Groom, frames: int, substeps: int) -> Array:
    """Return the head's motion (frames * substeps, 4, 4) after each substep."""
    motion = add_shakes(SHAKE, groom.head)
    return np.stack([motion((k + 1) * FRAME / substeps) for k in range(frames * substeps)])


def stretch_of(points: Array, rest: Array) -> float:
    """Return the largest change (a share) of a segment's length in points (F, S, n, 3)."""
    length = np.linalg.norm(np.diff(rest, axis=1), axis=-1)
    size = np.linalg.norm(np.diff(points, axis=2), axis=-1)
    return float(np.abs(size / length - 1)[..., 1:].max())


def off_by(points: Array, converged: Array) -> float:
    """Return the root mean square distance of nodes, metres."""
    return float(np.sqrt(((points - converged) ** 2).sum(axis=-1).mean()))


def rate(step: Callable[[int], None], steps: int, rounds: int = 3) -> float:
    """Return steps per second, the best of several rounds."""
    best = 0.0
    for turn in range(rounds):
        start = time.perf_counter()
        for k in range(steps):
            step(turn * steps + k)
        best = max(best, steps / (time.perf_counter() - start))
    return best


def ours_moved(groom: Groom, backend: str, substeps: int, frames: int) -> tuple[Array, float]:
    """Return pbd's points (F, S, n, 3) and the largest stretch of its rods."""
    simulator = PbdSimulator(groom, Options(backend=backend, substeps=substeps))
    found, stretch = [], 0.0
    for head in heads_of(groom, frames, 1):
        simulator.advance(FRAME, Surroundings(head))
        found.append(simulator.points.reshape(-1, NODES, 3))
        stretch = max(stretch, simulator.measure().stretch)
    return np.stack(found), stretch


def ours_speed(groom: Groom, backend: str, substeps: int, steps: int) -> float:
    """Return pbd's steps a second."""
    simulator = PbdSimulator(groom, Options(backend=backend, substeps=substeps))
    motion = add_shakes(SHAKE, groom.head)
    simulator.advance(FRAME, Surroundings())

    def step(frame: int) -> None:
        simulator.advance(FRAME, Surroundings(motion((frame + 1) * FRAME)))
        if (frame + 1) % steps == 0:  # shaders may still be at work
            _ = simulator.points

    return rate(step, steps)


class Plain:
    """Distance constraints by Gauss-Seidel in six colours: (n, 3, S), a colour at once."""

    def __init__(self, rest: Array, substeps: int, iterations: int, kind: Any = np.float32) -> None:
        self._rest = np.ascontiguousarray(rest.transpose(1, 2, 0), kind)
        self._x, self._v = self._rest.copy(), np.zeros_like(self._rest)
        self._h, self._iterations = kind(FRAME / substeps), iterations
        self._down = GRAVITY.astype(kind)[:, None]
        soft = kind(1 / (BENDING * self._h**2))
        self._colours = [
            *(self._colour(first, 1, 2, kind(0)) for first in (1, 2)),
            *(self._colour(first, 2, 4, soft) for first in range(4)),
        ]

    def _colour(self, first: int, apart: int, every: int, soft: Any) -> tuple[Any, ...]:
        """Nodes at either end, softness, rest lengths and free ends of constraints at once."""
        start, end = slice(first, NODES - apart, every), slice(first + apart, NODES, every)
        free = (np.arange(NODES) >= 2).astype(self._rest.dtype)[:, None, None]
        length = np.linalg.norm(self._rest[end] - self._rest[start], axis=1, keepdims=True)
        return start, end, soft, length, free[start], free[end]

    @property
    def points(self) -> Array:
        """(S, n, 3) present positions."""
        return self._x.transpose(2, 0, 1)

    def substep(self, head: Array) -> None:
        """Go on by a substep, to where the head is then."""
        old = self._x.copy()
        self._v[2:] += self._h * self._down
        self._x[2:] += self._h * self._v[2:]
        turn, shift = head[:3, :3].astype(old.dtype), head[:3, 3:].astype(old.dtype)
        self._x[:2] = turn @ self._rest[:2] + shift
        pulls = [np.zeros_like(colour[3]) for colour in self._colours]
        for _ in range(self._iterations):
            for colour, pull in zip(self._colours, pulls, strict=True):
                self._hold(*colour, pull)
        self._v = (self._x - old) / self._h

    def _hold(
        self, start: Any, end: Any, soft: Any, rest: Array, a: Array, b: Array, pull: Array
    ) -> None:
        """Move the ends of constraints (equations 17 and 18 of XPBD); rigid where soft is 0."""
        edge = self._x[end] - self._x[start]
        size = np.sqrt((edge * edge).sum(axis=1, keepdims=True))
        change = (size - rest - soft * pull) / (a + b + soft)
        pull += change
        edge *= change / size
        self._x[start] += a * edge
        self._x[end] -= b * edge


def plain_moved(
    groom: Groom, setting: tuple[int, int], frames: int, kind: Any = np.float32
) -> Array:
    """Return points (F, S, n, 3) of some strands by the plain scheme."""
    scheme, found = Plain(few(rest_of(groom)), *setting, kind), []
    heads = heads_of(groom, frames, setting[0]).reshape(frames, setting[0], 4, 4)
    for frame in heads:
        for head in frame:
            scheme.substep(head)
        found.append(scheme.points.copy())
    return np.stack(found)


def plain_speed(groom: Groom, setting: tuple[int, int], steps: int) -> float:
    """Return the plain scheme's steps a second."""
    scheme, substeps = Plain(rest_of(groom), *setting), setting[0]
    heads = heads_of(groom, 3 * steps, substeps)

    def step(frame: int) -> None:
        for k in range(substeps):
            scheme.substep(heads[frame * substeps + k])

    return rate(step, steps)


def referee(
    python: str, rest: Array, heads: Array, setting: tuple[int, int], threads: str = ""
) -> tuple[Array, Array]:
    """Return seconds (F,) of pyPBD's own steps, and its points (F, S, n, 3).

    `threads` are those that it may take; as many as there are where it says nothing.
    """
    with tempfile.TemporaryDirectory() as folder:
        scene, result = Path(folder, "scene.npz"), Path(folder, "result.npz")
        np.savez(scene, rest=rest, heads=heads, frames=len(heads) // setting[0])
        words = [python, "-c", PYPBD, scene, result, *setting, BENDING]
        done = subprocess.run(
            [*map(str, words)], capture_output=True, text=True, timeout=1800,
            env={**os.environ, **({"OMP_NUM_THREADS": threads} if threads else {})},
        )  # fmt: skip
        if done.returncode:
            raise RuntimeError(done.stderr.strip())
        with np.load(result) as found:
            return found["taken"], found["points"].reshape(-1, *rest.shape)


def referee_speed(python: str, groom: Groom, setting: tuple[int, int], steps: int) -> float:
    """Return pyPBD's steps a second: by all threads or by one, whichever is faster."""
    rest, heads = rest_of(groom), heads_of(groom, 3 * steps, setting[0])
    return float(
        max(1 / referee(python, rest, heads, setting, threads)[0].min() for threads in ("1", ""))
    )


def few(strands: Array) -> Array:
    """Return some of the strands, evenly picked."""
    return strands[np.linspace(0, len(strands) - 1, min(FEW, len(strands))).astype(int)]


def errors(
    scene: Groom, frames: int, backends: list[str], python: str | None
) -> dict[Way, tuple[float, float]]:
    """Return largest stretch and distance from the converged motion of all that is compared."""
    found: dict[Way, tuple[float, float]] = {}
    converged, _ = ours_moved(scene, "fast", CONVERGED, frames)
    for backend in backends:
        for substeps in (4, 2):
            points, stretch = ours_moved(scene, backend, substeps, frames)
            found["pbd " + backend, substeps, 1] = stretch, off_by(points, converged)
    rest = few(rest_of(scene))
    converged = plain_moved(scene, CONVERGED_PLAIN, frames, np.float64)
    for setting in SETTINGS:
        points = plain_moved(scene, setting, frames)
        found[PLAIN, *setting] = stretch_of(points, rest), off_by(points, converged)
        if python:
            _, points = referee(python, rest, heads_of(scene, frames, setting[0]), setting, "1")
            found[PYPBD_NAME, *setting] = stretch_of(points, rest), off_by(points, converged)
    return found


def speed_of(way: Way, groom: Groom, frames: int, python: str | None) -> float:
    """Return steps of 1/60 s a second."""
    method, substeps, iterations = way
    steps = max(1, frames * 1000 // max(len(groom.strands), 1000))
    few_steps = max(1, steps // 30)
    if method == PLAIN:
        return plain_speed(groom, (substeps, iterations), few_steps)
    if method == PYPBD_NAME:
        assert python is not None
        return referee_speed(python, groom, (substeps, iterations), few_steps)
    return ours_speed(groom, method.removeprefix("pbd "), substeps, steps)


def cheapest(rows: list[Row], stretch: float, off: float) -> Row | None:
    """Return the fastest row that stretches no more and is no farther off."""
    good = (row for row in rows if row.stretch <= stretch and row.off <= off)
    return max(good, key=lambda row: row.speed, default=None)


def verdicts(rows: list[Row]) -> list[str]:
    """Return, for each peer, how much faster the first row is at no more of an error."""
    ours, lines = rows[0], []
    for name in dict.fromkeys(row.way[0] for row in rows if row.way[0] in (PLAIN, PYPBD_NAME)):
        peers = [row for row in rows if row.way[0] == name]
        for words, stretch, off in (
            ("no more stretch than pbd", ours.stretch, np.inf),
            ("below 1 %, no farther off than pbd", 0.01, ours.off),
            ("below 1 %", 0.01, np.inf),
        ):
            best = cheapest(peers, stretch, off)
            if best is None:
                lines.append(f"{name}, {words}: no setting gets there")
            else:
                ratio = ours.speed / best.speed
                setting = f"{best.way[1]} x {best.way[2]}, {best.speed:.1f} steps/s"
                lines.append(f"{name}, {words}: {setting}; pbd is {ratio:.1f} times as fast")
    return lines


def _shaders() -> list[str]:
    """Return the backend of shaders and print what runs them; nothing where no OpenGL is."""
    try:
        with renderer() as gl:
            print(gl.description)
    except RenderError as error:
        print(error)
        return []
    return ["compute"]


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--guides", type=int, nargs="+", default=[1000, 10_000])
    parser.add_argument("--frames", type=int, default=60)
    parser.add_argument("--referee", help="a Python with pyPBD")
    parser.add_argument("--without-shaders", action="store_true")
    args = parser.parse_args()
    backends = ["fast", *([] if args.without_shaders else _shaders())]
    scene = groom_of(min(*args.guides, SCENE))
    found = errors(scene, args.frames, backends, args.referee)
    print(f"{'guides':>7} {'method':<30} {'steps/s':>8} {'stretch %':>9} {'off mm':>7} ratio")
    for count in args.guides:
        groom, rows = groom_of(count), []
        for way, error in found.items():
            row = Row(way, speed_of(way, groom, args.frames, args.referee), *error)
            rows.append(row)
            name = f"{way[0]}, {way[1]} x {way[2]}"
            figures = f"{100 * row.stretch:>9.3f} {1000 * row.off:>7.2f}"
            ratio = rows[0].speed / row.speed
            print(f"{count:>7} {name:<30} {row.speed:>8.1f} {figures} {ratio:>5.1f}", flush=True)
        for line in verdicts(rows):
            print(f"{count:>7} {line}", flush=True)


if __name__ == "__main__":
    main()
