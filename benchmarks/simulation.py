"""How fast guides are simulated, and how far off: prints tables.

    python benchmarks/simulation.py [--guides 1000 10000] [--steps 60] [--referee PYTHON]

Each row is steps of 1/60 s a second of wall clock, and the largest stretch: for pbd of guides whose
head is shaken, for the others of horizontal strands that fall. The plain method is distance
constraints by Gauss-Seidel in NumPy over all strands at once (Mueller et al. 2007), at several
counts of iterations: compare the rows of about 1 %. Where `--referee` names a Python with pyPBD,
that library's distance constraints follow, at the same count of nodes.
"""

from __future__ import annotations

import argparse
import subprocess
import time
from collections.abc import Callable
from dataclasses import replace

import numpy as np
from hairkit_plugins.pbd import Options
from hairkit_plugins.pbd.simulator import PbdSimulator

from hairkit.default_head import default_head
from hairkit.errors import RenderError
from hairkit.exporting import dense_groom
from hairkit.groom import Groom
from hairkit.render.context import renderer
from hairkit.simulate import Surroundings, shaken
from hairkit.synth import grow

NODES, FRAME = 16, 1 / 60

PYPBD = """
import time, sys, numpy as np, pypbd as p
guides, nodes, steps, iterations = map(int, sys.argv[1:])
p.Logger.addConsoleSink(p.LogLevel.ERR) if hasattr(p, 'Logger') else None
sim = p.Simulation.getCurrent(); sim.initDefault(); model = sim.getModel()
length = 0.2 / (nodes - 1)
for s in range(guides):
    x = np.zeros((nodes, 3)); x[:, 0] = np.arange(nodes) * length; x[:, 2] = 0.01 * s
    base = model.getParticles().size()
    for k in range(nodes):
        model.getParticles().addVertex(x[k])
        model.getParticles().setMass(base + k, 0.0 if k < 2 else 1.0)
    for k in range(nodes - 1):
        model.addDistanceConstraint_XPBD(base + k, base + k + 1, 1e9)
    for k in range(nodes - 2):
        model.addDistanceConstraint_XPBD(base + k, base + k + 2, 1e3)
step = sim.getTimeStep(); p.TimeManager.getCurrent().setTimeStepSize(1 / 60 / 4)
step.setValueUInt(p.TimeStepController.NUM_SUB_STEPS, 1)
step.setValueUInt(p.TimeStepController.MAX_ITERATIONS, iterations)
step.step(model)  # colours the constraints, once
start = time.perf_counter()
for _ in range(4 * steps):
    step.step(model)
taken = time.perf_counter() - start
x = np.array([model.getParticles().getPosition(k) for k in range(nodes)])
stretch = abs(np.linalg.norm(np.diff(x, axis=0), axis=1) / length - 1).max()
print(steps / taken, stretch)
"""


def groom_of(count: int) -> Groom:
    """Return `count` guides of 16 points of long hair."""
    full = dense_groom(grow("straight", default_head(), 600, 0), count, 0)
    return replace(full, strands=replace(full.strands.resampled(NODES), guide=None))


def rate(step: Callable[[int], None], steps: int, rounds: int = 3) -> float:
    """Return steps per second, the best of several rounds."""
    best = 0.0
    for turn in range(rounds):
        start = time.perf_counter()
        for k in range(steps):
            step(turn * steps + k)
        best = max(best, steps / (time.perf_counter() - start))
    return best


def ours(groom: Groom, backend: str, steps: int, substeps: int) -> tuple[float, float]:
    """Return steps a second and the largest stretch of shaken guides."""
    simulator = PbdSimulator(groom, Options(backend=backend, substeps=substeps))
    motion, stretch = shaken(["yaw:20:1.5"], groom.head), 0.0
    simulator.advance(FRAME, Surroundings())

    def step(frame: int) -> None:
        simulator.advance(FRAME, Surroundings(motion((frame + 1) * FRAME)))
        if (frame + 1) % steps == 0:  # shaders may still be at work
            _ = simulator.points

    speed = rate(step, steps)
    for frame in range(3 * steps, 3 * steps + 20):
        step(frame)
        stretch = max(stretch, simulator.measure().stretch)
    return speed, stretch


def plain(count: int, iterations: int, substeps: int, steps: int) -> tuple[float, float]:
    """Return the same for distance constraints: strands that start horizontal and fall."""
    length = np.float32(0.2 / (NODES - 1))
    x = np.zeros((NODES, 3, count), np.float32)
    x[:, 0] = (np.arange(NODES) * length)[:, None]
    v = np.zeros_like(x)
    h = np.float32(FRAME / substeps)
    down = np.array([0, -9.81, 0], np.float32)[:, None]

    def hold(a: int, b: int, rest: np.float32, stiffness: np.float32) -> None:
        edge = x[b] - x[a]
        size = np.sqrt((edge * edge).sum(axis=0))
        move = edge * (stiffness * (size - rest) / np.maximum(size, 1e-9))
        if a < 2:
            x[b] -= move if b >= 2 else 0
        else:
            x[a] += np.float32(0.5) * move
            x[b] -= np.float32(0.5) * move

    def step(_: int) -> None:
        nonlocal x, v
        for _ in range(substeps):
            old = x.copy()
            v[2:] += h * down
            x[2:] += h * v[2:]
            for _ in range(iterations):
                for a in range(1, NODES - 1):
                    hold(a, a + 1, length, np.float32(1))
                for a in range(NODES - 2):
                    hold(a, a + 2, 2 * length, np.float32(0.3))
            v = (x - old) * (np.float32(0.99) / h)

    speed = rate(step, steps, 1)
    size = np.linalg.norm(np.diff(x, axis=0), axis=1)[1:]
    return speed, float(np.abs(size / length - 1).max())


def referee(python: str, count: int, iterations: int, steps: int) -> tuple[float, float]:
    """Return the same for pyPBD in another environment."""
    words = [python, "-c", PYPBD, *map(str, (count, NODES, steps, iterations))]
    done = subprocess.run(words, capture_output=True, text=True, check=True, timeout=600)
    speed, stretch = done.stdout.split()[-2:]
    return float(speed), float(stretch)


def _shaders() -> str:
    """Return the backend of shaders and print what runs them; nothing where no OpenGL is."""
    try:
        with renderer() as gl:
            print(gl.description)
    except RenderError as error:
        print(error)
        return ""
    return "compute"


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--guides", type=int, nargs="+", default=[1000, 10_000])
    parser.add_argument("--steps", type=int, default=60)
    parser.add_argument("--referee", help="a Python with pyPBD")
    args = parser.parse_args()
    shaders = _shaders()
    print(f"{'guides':>7} {'method':<42} {'steps/s':>8} {'stretch %':>9}")

    def row(count: int, name: str, result: tuple[float, float]) -> None:
        print(f"{count:>7} {name:<42} {result[0]:>8.1f} {100 * result[1]:>9.2f}", flush=True)

    for count in args.guides:
        steps = max(3, args.steps * 1000 // max(count, 1000))
        groom = groom_of(count)
        for backend, substeps in (("fast", 4), ("fast", 2), (shaders, 4), (shaders, 2)):
            if backend:
                name = f"pbd {backend}, {substeps} substeps"
                row(count, name, ours(groom, backend, steps, substeps))
        if count <= 1000:
            row(count, "pbd reference, 4 substeps", ours(groom, "reference", 3, 4))
        for substeps, iterations in ((1, 10), (4, 20), (16, 4), (16, 12)):
            name = f"distance PBD, {substeps} substeps x {iterations} iterations"
            row(count, name, plain(count, iterations, substeps, max(2, steps // 10)))
        if args.referee:
            for iterations in (20, 60):
                name = f"pyPBD XPBD distances, 4 x {iterations} iterations"
                row(count, name, referee(args.referee, count, iterations, max(2, steps // 10)))


if __name__ == "__main__":
    main()
