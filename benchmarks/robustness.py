"""The laws of robustness over many random grooms, for both simulators.

    python benchmarks/robustness.py [--grooms 1000] [--first 0] [--only rods]

Each groom has up to six strands on a ball: straight, curled by up to 10,000 degrees, a random walk,
folded, with points twice or without length; 1 mm to 1.5 m. For half a second its head spins at
3,600 degrees a second, is shaken, jumps or is elsewhere in every step, or wind of 200 m/s blows, in
steps of 1 ms to 0.2 s, up to 5 km from the origin; then it is left alone for a second.

| column | what |
|---|---|
| not finite | grooms with a point that is not finite at any time |
| stretched | grooms whose hair is stretched by 1 % or more at the end |
| largest % | largest stretch at the end |
| not back | grooms of straight hair of up to 25 mm, alone for five seconds instead, 2 mm off rest |
| CPU s | processor time |
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable
from dataclasses import replace

import numpy as np
from hairkit_plugins import rods, super_helix
from random_hair import DEEDS, FAR, KINDS, STEPS, Happening, Strand, endure, groom_of

from hairkit.simulation import Simulator
from hairkit.types.groom import Groom

SIMULATORS: dict[str, Callable[[Groom], Simulator]] = {
    "rods": lambda groom: rods.make_simulator(groom, rods.Options(backend="fast", friction=0.0)),
    "super_helix": lambda groom: super_helix.make_simulator(
        groom, super_helix.Options(friction=0.0)
    ),
}
EVERY = 5
"""One groom of so many is of short straight hair, which has to come back to rest."""
BACK = 0.002
"""Metres off rest that count as back."""


def strands_of(rng: np.random.Generator, short: bool) -> list[Strand]:
    """Return up to six random strands."""
    made: list[Strand] = []
    for _ in range(rng.integers(1, 7)):
        kind = "straight" if short else str(rng.choice(KINDS))
        longest, most = (-1.6, 20) if short else (0.18, 60)
        made.append((kind, float(rng.uniform(-3.0, longest)), int(rng.integers(2, most + 1))))
    return made


def outcome(method: str, seed: int) -> tuple[bool, float, float | None]:
    """Return whether all was finite, the stretch at the end, and metres off rest of short hair."""
    rng, short = np.random.default_rng(seed), seed % EVERY == 0
    groom = groom_of(strands_of(rng, short), rng)
    happening = Happening(str(rng.choice(DEEDS)), float(rng.choice(STEPS)), float(rng.choice(FAR)))
    simulator = SIMULATORS[method](groom)
    try:
        if not short:
            endure(simulator, happening, rng, 60)
            return True, simulator.measure().stretch, None
        endure(simulator, replace(happening, far=0.0), rng, 300)
    except AssertionError:
        return False, np.inf, None
    off = float(np.abs(simulator.points - groom.strands.points).max())
    return True, simulator.measure().stretch, off


def main() -> None:
    """Print a row for each simulator."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--grooms", type=int, default=1000)
    parser.add_argument("--first", type=int, default=0, help="seed of the first groom")
    parser.add_argument("--only", choices=list(SIMULATORS))
    args = parser.parse_args()
    print("| simulator | grooms | not finite | stretched | largest % | not back | CPU s |")
    print("|---|---|---|---|---|---|---|")
    for method in [args.only] if args.only else SIMULATORS:
        begun, lost, worst, bad, off = time.process_time(), 0, 0.0, [], []
        for seed in range(args.first, args.first + args.grooms):
            finite, stretch, away = outcome(method, seed)
            lost += not finite
            worst = max(worst, stretch)
            bad += [seed] if stretch >= 0.01 else []
            off += [seed] if away is not None and away > BACK else []
        spent = time.process_time() - begun
        figures = f"{lost} | {len(bad)} | {100 * worst:.3f} | {len(off)} | {spent:.0f}"
        print(f"| {method} | {args.grooms} | {figures} |", flush=True)
        if bad or off:
            print(f"{method}: stretched: seeds {bad}; not back: seeds {off}")


if __name__ == "__main__":
    main()
