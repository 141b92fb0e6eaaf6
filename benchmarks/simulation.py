"""How fast guides are simulated, and how far off: prints a table, and at equal error the ratios.

    python benchmarks/simulation.py [--guides 1000 10000] [--frames 60] [--referee PYTHON]

One scene for all: the same guides of 16 points, from their captured shape, on a head that is
shaken (`yaw:20:1.5`), under gravity, at 60 frames a second. Beside `rods` there run extended
position-based dynamics (the plugin `pbd`: Mueller et al. 2007; Macklin et al. 2016) without what it
has to keep captured hair in place, and, where `--referee` names a Python that has it, pyPBD (C++),
without contact.
Both have the same constraints: each node to the next one rigidly, to the next but one by a spring,
which is their bending. Their first two nodes go with the head in every substep. `rods` also has
twist, friction and neighbours, as always.

| column | what |
|---|---|
| steps/s | steps of 1/60 s a second of wall clock, of all guides, the best of three rounds |
| CPU ms | processor time of a step, of all threads, the best of three rounds |
| stretch | largest of any segment at any frame, of up to 1000 guides |
| off | root mean square distance from the converged motion of the same material |

The converged motion is that of many substeps: of `rods` for itself; of XPBD in float64, and without
the head for pyPBD. Of pyPBD the time of its own step is counted, with all threads or with
one, whichever is faster, and not the loops in Python that set roots.
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
from hairkit_plugins import pbd, rods
from hairkit_plugins.pbd.simulator import PbdSimulator
from hairkit_plugins.rods.simulator import RodSimulator

from hairkit.grooming.prepare_export import dense_groom
from hairkit.head_model.template import default_head
from hairkit.simulation import Simulator, Surroundings, add_shakes
from hairkit.synth import grow
from hairkit.types.groom import Groom

Array = npt.NDArray[Any]
NODES, FRAME = 16, 1 / 60
SHAKE = ["yaw:20:1.5"]
SCENE, FEW = 1000, 40
"""Most guides whose error is measured; of the peers', whose strands do not meet, so many."""
CONVERGED, CONVERGED_PEER = 64, (512, 2)
"""Substeps of the rods' converged motion; substeps and iterations of the others'."""
SETTINGS = ((4, 20), (16, 5), (16, 20), (32, 2), (32, 8), (64, 1), (64, 4), (128, 1), (128, 4))
"""Substeps and iterations of the peers, of which the cheapest that is as good is taken."""
PLAIN = pbd.Options(stiffness=0.0, damping=0.0, drag=0.0, friction=0.0, borne=0.0)
"""The method alone, as pyPBD has it."""

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


XPBD, PYPBD_NAME = "pbd (XPBD)", "pyPBD distances"
Way = tuple[str, int, int]
"""Method, substeps, iterations."""
Setting = tuple[int, int]
"""Substeps and iterations."""
Speed = tuple[float, float]
"""Steps of 1/60 s a second, and processor seconds of a step."""


@dataclass(frozen=True)
class Row:
    """A line of the table."""

    way: Way
    speed: float
    """Steps of 1/60 s a second."""
    cpu: float
    """Processor seconds of a step, of all threads."""
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


def rate(step: Callable[[int], None], steps: int, rounds: int = 3) -> Speed:
    """Return how fast steps are, the best of several rounds."""
    wall = cpu = np.inf
    for turn in range(rounds):
        start, used = time.perf_counter(), time.process_time()
        for k in range(steps):
            step(turn * steps + k)
        cpu = min(cpu, (time.process_time() - used) / steps)
        wall = min(wall, (time.perf_counter() - start) / steps)
    return 1 / wall, cpu


def ours(groom: Groom, substeps: int) -> Simulator:
    """Return `rods`."""
    return RodSimulator(groom, rods.Options(substeps=substeps))


def peer(
    groom: Groom, setting: Setting, kind: type[Any] = np.float32, contact: bool = True
) -> Simulator:
    """Return `pbd`, of as many nodes as the guides have points."""
    options = replace(PLAIN, nodes=NODES, substeps=setting[0], iterations=setting[1])
    return PbdSimulator(groom, options, kind, contact)


def moved(simulator: Simulator, groom: Groom, frames: int) -> tuple[Array, float]:
    """Return a simulator's points (F, S, n, 3), and its largest stretch."""
    found, stretch = [], 0.0
    for head in heads_of(groom, frames, 1):
        simulator.advance(FRAME, Surroundings(head))
        found.append(simulator.points.reshape(-1, NODES, 3))
        stretch = max(stretch, simulator.measure().stretch)
    return np.stack(found), stretch


def speed(simulator: Simulator, groom: Groom, steps: int) -> Speed:
    """Return how fast a simulator is."""
    heads = heads_of(groom, 3 * steps, 1)  # for the referee, too, known before
    simulator.advance(FRAME, Surroundings())  # compiles

    def step(frame: int) -> None:
        simulator.advance(FRAME, Surroundings(heads[frame]))
        if (frame + 1) % steps == 0:  # shaders may still be at work
            _ = simulator.points

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
        words = [python, "-c", PYPBD, scene, result, *setting, PLAIN.bend]
        done = subprocess.run(
            [*map(str, words)], capture_output=True, text=True, timeout=1800,
            env={**os.environ, **({"OMP_NUM_THREADS": threads} if threads else {})},
        )  # fmt: skip
        if done.returncode:
            raise RuntimeError(done.stderr.strip())
        with np.load(result) as found:
            return found["taken"], found["points"].reshape(-1, *rest.shape)


def referee_speed(python: str, groom: Groom, setting: Setting, steps: int) -> Speed:
    """Return how fast pyPBD is, by all threads or by one; processor time is that of one."""
    rest, heads = rest_of(groom), heads_of(groom, 3 * steps, setting[0])
    one, all_ = (
        float(referee(python, rest, heads, setting, threads)[0].min()) for threads in ("1", "")
    )
    return 1 / min(one, all_), one


def few(groom: Groom) -> Groom:
    """Return some of the strands, evenly picked."""
    count = len(groom.strands)
    return groom.select(np.linspace(0, count - 1, min(FEW, count)).astype(int))


def errors(scene: Groom, frames: int, python: str | None) -> dict[Way, tuple[float, float]]:
    """Return largest stretch and distance from the converged motion of all that is compared."""
    found: dict[Way, tuple[float, float]] = {}
    converged, _ = moved(ours(scene, CONVERGED), scene, frames)
    for substeps in (4, 2):
        points, stretch = moved(ours(scene, substeps), scene, frames)
        found["rods", substeps, 1] = stretch, off_by(points, converged)
    some = few(scene)
    rest = rest_of(some)
    touching, free = (
        moved(peer(some, CONVERGED_PEER, np.float64, contact), some, frames)[0]
        for contact in (True, False)
    )
    for setting in SETTINGS:
        points, stretch = moved(peer(some, setting), some, frames)
        found[XPBD, *setting] = stretch, off_by(points, touching)
        if python:
            _, points = referee(python, rest, heads_of(scene, frames, setting[0]), setting, "1")
            found[PYPBD_NAME, *setting] = stretch_of(points, rest), off_by(points, free)
    return found


def speed_of(way: Way, groom: Groom, frames: int, python: str | None) -> Speed:
    """Return how fast a method is."""
    method, substeps, iterations = way
    steps = max(1, frames * 1000 // max(len(groom.strands), 1000))
    few_steps = max(1, steps // 30)
    if method == XPBD:
        return speed(peer(groom, (substeps, iterations)), groom, few_steps)
    if method == PYPBD_NAME:
        assert python is not None
        return referee_speed(python, groom, (substeps, iterations), few_steps)
    return speed(ours(groom, substeps), groom, steps)


def cheapest(rows: list[Row], stretch: float, off: float) -> Row | None:
    """Return the fastest row that stretches no more and is no farther off."""
    good = (row for row in rows if row.stretch <= stretch and row.off <= off)
    return max(good, key=lambda row: row.speed, default=None)


def verdicts(rows: list[Row]) -> list[str]:
    """Return, for each peer, how much faster the first row is at no more of an error."""
    ours, lines = rows[0], []
    for name in dict.fromkeys(row.way[0] for row in rows if row.way[0] in (XPBD, PYPBD_NAME)):
        peers = [row for row in rows if row.way[0] == name]
        for words, stretch, off in (
            ("no more stretch than rods", ours.stretch, np.inf),
            ("below 1 %, no farther off than rods", 0.01, ours.off),
            ("below 1 %", 0.01, np.inf),
        ):
            best = cheapest(peers, stretch, off)
            if best is None:
                lines.append(f"{name}, {words}: no setting gets there")
            else:
                wall, cpu = ours.speed / best.speed, best.cpu / ours.cpu
                setting = f"{best.way[1]} x {best.way[2]}, {best.speed:.1f} steps/s"
                ratio = f"{wall:.1f} times as fast, by processor time {cpu:.1f}"
                lines.append(f"{name}, {words}: {setting}; rods is {ratio}")
    return lines


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--guides", type=int, nargs="+", default=[1000, 10_000])
    parser.add_argument("--frames", type=int, default=60)
    parser.add_argument("--referee", help="a Python with pyPBD")
    args = parser.parse_args()
    scene = groom_of(min(*args.guides, SCENE))
    found = errors(scene, args.frames, args.referee)
    head = f"{'guides':>7} {'method':<30} {'steps/s':>8} {'CPU ms':>8} {'stretch %':>9}"
    print(f"{head} {'off mm':>7} ratio")
    for count in args.guides:
        groom, rows = groom_of(count), []
        for way, error in found.items():
            row = Row(way, *speed_of(way, groom, args.frames, args.referee), *error)
            rows.append(row)
            name = f"{way[0]}, {way[1]} x {way[2]}"
            speeds = f"{row.speed:>8.1f} {1000 * row.cpu:>8.2f}"
            figures = f"{100 * row.stretch:>9.3f} {1000 * row.off:>7.2f}"
            ratio = rows[0].speed / row.speed
            print(f"{count:>7} {name:<30} {speeds} {figures} {ratio:>5.1f}", flush=True)
        for line in verdicts(rows):
            print(f"{count:>7} {line}", flush=True)


if __name__ == "__main__":
    main()
