"""How deep drawn points of simulated hair get into head and torso, at rest and while shaken.

    python benchmarks/contact.py [--guides 300] [--frames 120]

Each groom of `hairkit synth` is simulated under gravity on a head that is still, shaken
(`yaw:30:1.5`) or nods (`pitch:25:1.5`). The torso is the bust that is drawn; it stays when the head
turns. Both are signed distances on a 5 mm grid.

| column | what |
|---|---|
| deeper | points that are more than 1 mm deeper in head or torso than at rest, of all frames |
| deepest mm | by how much the deepest is |
| inside | captured points that are more than 1 mm inside the torso |
| CPU ms | processor time of a step of 1/60 s |
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable

import numpy as np
from hairkit_plugins import rods, super_helix

from hairkit.head_model.template import default_head
from hairkit.simulation import Simulator, Surroundings, add_shakes
from hairkit.simulation.obstacles import groom_bodies
from hairkit.simulation.rigid_motion import follow_head, inverse_motion
from hairkit.synth import STYLES, grow
from hairkit.types.groom import Groom

SIMULATORS: dict[str, Callable[[Groom], Simulator]] = {
    "rods": lambda groom: rods.make_simulator(groom, rods.Options()),
    "super_helix": lambda groom: super_helix.make_simulator(groom, super_helix.Options()),
}
HAIR = ("straight", "wavy", "short")
MOTIONS = {"still": [], "shaken": ["yaw:30:1.5"], "nods": ["pitch:25:1.5"]}
DEEP = 0.001
"""Metres from which a point counts as deeper."""


def outcome(groom: Groom, method: str, shakes: list[str], frames: int) -> tuple[int, float, float]:
    """Return how many points are deeper than `DEEP`, how deep the deepest is, and CPU seconds."""
    simulator, bodies = SIMULATORS[method](groom), groom_bodies(groom)
    motion, torso = add_shakes(shakes, groom.head), np.eye(4)
    least = np.minimum(bodies.at(groom.strands.points)[0], 0.0)
    deeper, deepest, spent = 0, 0.0, 0.0
    for frame in range(frames):
        head = motion((frame + 1) / 60)
        begun = time.process_time()
        simulator.advance(1 / 60, Surroundings(head))
        spent += time.process_time() - begun
        torso = follow_head(torso, head, bodies.joint)
        local = (simulator.points - head[:3, 3]) @ head[:3, :3]
        depth = least - bodies.at(local, inverse_motion(torso) @ head)[0]
        deeper += int((depth > DEEP).sum())
        deepest = max(deepest, float(depth.max()))
    return deeper, deepest, spent / frames


def main() -> None:
    """Print a row for each simulator, groom and motion."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--guides", type=int, default=300)
    parser.add_argument("--frames", type=int, default=120)
    parser.add_argument("--hair", nargs="+", default=list(HAIR), choices=STYLES)
    args = parser.parse_args()
    print("| simulator | hair | head | deeper | deepest mm | inside | CPU ms |")
    print("|---|---|---|---|---|---|---|")
    for hair in args.hair:
        groom = grow(hair, default_head(), args.guides, 0)
        distance, _, on_torso = groom_bodies(groom).at(groom.strands.points)
        inside = int((on_torso & (distance < -DEEP)).sum())
        for method in SIMULATORS:
            for name, shakes in MOTIONS.items():
                deeper, deepest, spent = outcome(groom, method, shakes, args.frames)
                figures = f"{deeper} | {1e3 * deepest:.2f} | {inside} | {1e3 * spent:.1f}"
                print(f"| {method} | {hair} | {name} | {figures} |", flush=True)


if __name__ == "__main__":
    main()
