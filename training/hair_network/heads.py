"""Photograph random heads of hair, with masks and truth, as captures for `compose`.

    python -m training.hair_network.heads -o captures/ --count 20
    python -m training.hair_network.heads -o captures/ --count 20 --draped --first 2000

`hairkit synth` has six kinds of hair, none of which lies on the shoulders. These heads have hair of
any length, tied, in coils, cropped and with fringes; draped hair lies on shoulders and back.
"""

from __future__ import annotations

import argparse
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from pathlib import Path

import numpy as np

from hairkit.synth.photographs import photograph

from ..hair_depth.grooms import random_groom

STRANDS = 10_000
SIZES = ((810, 1080), (810, 1440), (1080, 1080))
"""Photos: a phone held upright, one that shows more of the body, and a square one."""


def main() -> None:
    """Write a folder for each head."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("-o", "--output", type=Path, required=True, help="folder")
    parser.add_argument("--count", type=int, default=20)
    parser.add_argument("--first", type=int, default=1000, help="seed of the first head")
    parser.add_argument("--draped", action="store_true", help="hair that lies on the shoulders")
    parser.add_argument("--workers", type=int, default=2)
    arguments = parser.parse_args()
    seeds = range(arguments.first, arguments.first + arguments.count)
    with ProcessPoolExecutor(arguments.workers) as pool:
        for name in pool.map(partial(photographed, arguments.output, arguments.draped), seeds):
            print(name, flush=True)


def photographed(folder: Path, draped: bool, seed: int) -> Path:
    """Write the photos of a seed's head to `folder` and return their capture."""
    rng = np.random.default_rng([seed, 8])
    path = folder / f"random_{seed}"
    size = SIZES[rng.integers(len(SIZES))]
    photograph(random_groom(seed, STRANDS, draped=draped), path, seed=seed, size=size)
    return path


if __name__ == "__main__":
    main()
