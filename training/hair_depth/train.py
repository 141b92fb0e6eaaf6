"""Train the network of `hairkit.field.hair_depth` in PyTorch.

python -m training.hair_depth.train -o hair_depth.npz --captures captures/ --folds

A minute on a graphics card of 2024 draws 40,000 views, another one trains on them. `--folds` trains
once for each capture without it, and prints the errors there.
"""

from __future__ import annotations

import argparse
import math
import os
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import torch
import torch.nn.functional as F  # noqa: N812 the name of this module in PyTorch's own documents
from torch import Tensor

from hairkit.field.hair_depth import CHANNELS, DEPTH_SCALE, GRID, LAYERS, MIRRORED
from training.hair_network.train import AVERAGING, DECAY, LEAST_RATE, RATE, network, new_weights

from .grooms import captured_shapes, random_shapes
from .views import Shapes

BATCH, DRAWN = 64, 64
"""Views of a step, and of one drawing."""
CAPTURED = 0.3
"""Share of the views that are of captures."""
CUT = 0.5
"""Share of the photos that an edge cuts off."""
NO_PERSON, HEAD_SLIP = 0.1, 0.006
"""Share of photos without a person, and standard deviation of the head's depth, metres."""


def draw(shapes: Shapes, owners: Tensor, views: int, seed: int) -> tuple[Tensor, Tensor, Tensor]:
    """Return features, depths (half precision) and the owners of random views."""
    device = shapes.hair.device
    random = torch.Generator(device).manual_seed(seed)
    features = torch.empty((views, CHANNELS, GRID, GRID), dtype=torch.half, device=device)
    depths = torch.empty((views, LAYERS, GRID, GRID), dtype=torch.half, device=device)
    drawn = torch.empty(views, dtype=torch.long, device=device)
    captured = owners > 0
    share = CAPTURED * (~captured).sum() / captured.sum().clamp_min(1) / (1 - CAPTURED)
    weights = torch.where(captured, share, 1.0)
    for first in range(0, views, DRAWN):
        part = slice(first, min(first + DRAWN, views))
        chosen = torch.multinomial(weights, part.stop - part.start, True, generator=random)
        features[part], depths[part] = shapes.draw(chosen, random)
        drawn[part] = owners[chosen]
    return features, depths, drawn


def vary(x: Tensor, y: Tensor, random: torch.Generator) -> tuple[Tensor, Tensor]:
    """Return features and depths mirrored, cut off by edges, with poor masks and directions."""
    device, count = x.device, len(x)

    def uniform(*shape: int) -> Tensor:
        return torch.rand((count, *shape), generator=random, device=device)

    def smooth(cells: int, amount: float) -> Tensor:
        field = F.interpolate(uniform(1, cells, cells), size=(GRID, GRID), mode="bilinear")
        return amount * (field - 0.5)

    flip = uniform(1, 1, 1) < 0.5
    signs = torch.ones(CHANNELS, device=device)
    signs[list(MIRRORED)] = -1
    x = torch.where(flip, x.flip(-1) * signs[:, None, None], x)
    y = torch.where(flip, y.flip(-1), y)
    grid = torch.arange(GRID, device=device)
    bottom = torch.where(uniform(1) < CUT, GRID * (0.35 + 0.65 * uniform(1)), GRID)
    top = torch.where(uniform(1) < 0.2, GRID * 0.2 * uniform(1), 0.0)
    side = torch.where(uniform(1) < 0.3, GRID * 0.3 * uniform(1), 0.0)
    rows = (grid >= top) & (grid < bottom)
    columns = (grid >= side) & (grid < GRID - side)
    valid = (rows[:, :, None] & columns[:, None, :])[:, None]
    edge = F.max_pool2d(x[:, :1], 3, 1, 1) + F.max_pool2d(-x[:, :1], 3, 1, 1) > 0
    spoiled = edge & (smooth(16, 1) < -0.15)
    hair = torch.where(spoiled, 1 - x[:, :1], x[:, :1])
    person = x[:, 1:2] * (hair < 0.5) * (uniform(1, 1, 1) > NO_PERSON)
    angle = smooth(8, 0.35) + smooth(32, 0.6)
    fade = 0.4 + 0.8 * uniform(1, 1, 1)
    a, b = x[:, 3:4], x[:, 4:5]
    turned = torch.cat([a * angle.cos() - b * angle.sin(), a * angle.sin() + b * angle.cos()], 1)
    turned = turned * fade * (hair > 0.5)
    slip = HEAD_SLIP / 0.1 * torch.randn((count, 1, 1, 1), generator=random, device=device)
    head = x[:, 5:6] + slip * x[:, 6:7]
    seen = torch.cat([hair, person, torch.ones_like(hair), turned], 1) * valid
    return torch.cat([seen, head, x[:, 6:]], 1), torch.where(valid, y, math.nan)


def errors(scores: Tensor, depths: Tensor) -> Tensor:
    """Return the absolute errors (n, LAYERS) where hair is seen, metres."""
    gap = (scores * DEPTH_SCALE - depths).abs()
    return gap.movedim(1, -1)[torch.isfinite(depths).all(1)]


def train(
    features: Tensor, depths: Tensor, views: Tensor, steps: int, seed: int
) -> dict[str, Tensor]:
    """Return the mean of the weights over the last steps on some views."""
    device = features.device
    random = torch.Generator(device).manual_seed(seed)
    weights = {
        name: value.to(device).requires_grad_()
        for name, value in new_weights(seed, CHANNELS, LAYERS).items()
    }
    mean = {name: value.detach().clone() for name, value in weights.items()}
    optimizer = torch.optim.AdamW(weights.values(), RATE, weight_decay=DECAY)
    for step in range(steps):
        cosine = 0.5 + 0.5 * math.cos(math.pi * step / steps)
        optimizer.param_groups[0]["lr"] = RATE * min(1, step / 100 + 0.05) * cosine + LEAST_RATE
        chosen = views[torch.randint(len(views), (BATCH,), generator=random, device=device)]
        x, y = vary(features[chosen].float(), depths[chosen].float(), random)
        with torch.autocast(device.type, torch.bfloat16):
            scores = network(weights, x)
        gaps = errors(scores.float(), y)
        value = F.smooth_l1_loss(gaps / DEPTH_SCALE, torch.zeros_like(gaps), beta=0.05)
        optimizer.zero_grad()
        value.backward()
        torch.nn.utils.clip_grad_norm_(list(weights.values()), 1.0)
        optimizer.step()
        keep = min(AVERAGING, (step + 1) / (step + 11))
        for name, average in mean.items():
            average.mul_(keep).add_(weights[name].detach(), alpha=1 - keep)
    return mean


def report(name: str, weights: dict[str, Tensor], features: Tensor, depths: Tensor) -> None:
    """Print the errors of the depths, whole photos and photos that are cut off."""
    if not len(features):
        return
    random = torch.Generator(features.device).manual_seed(5)
    found = []
    for first in range(0, len(features), BATCH):
        x, y = features[first : first + BATCH].float(), depths[first : first + BATCH].float()
        x, y = vary(x, y, random)
        with torch.no_grad():
            found.append(errors(network(weights, x), y))
    gaps = torch.cat(found)
    print(
        f"{name}: {len(features)} views, mean error front, back, mm:"
        f" {', '.join(f'{1e3 * g:.1f}' for g in gaps.mean(0).tolist())}; median"
        f" {', '.join(f'{1e3 * g:.1f}' for g in gaps.median(0).values.tolist())}",
        flush=True,
    )


def save(weights: dict[str, Tensor], path: Path) -> None:
    """Write the weights in half precision."""
    half = {name: value.detach().cpu().numpy() for name, value in weights.items()}
    half = {name: value.astype(np.float16) for name, value in half.items()}
    np.savez_compressed(path, **half)


def main(words: Sequence[str] | None = None) -> None:
    """Draw, train, print errors and write the weights."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("-o", "--output", type=Path, required=True, help="weights (.npz)")
    parser.add_argument("--captures", type=Path, help="folder of captures with truth")
    parser.add_argument("--grooms", type=int, default=640)
    parser.add_argument("--views", type=int, default=40_000)
    parser.add_argument("--steps", type=int, default=3000)
    parser.add_argument("--workers", type=int, default=os.cpu_count())
    parser.add_argument("--folds", action="store_true", help="train without each capture, too")
    args = parser.parse_args(words)
    device = "cuda" if torch.cuda.is_available() else "cpu"
    captured = captured_shapes(args.captures, np.random.default_rng(0)) if args.captures else []
    shapes = random_shapes(range(args.grooms), args.workers)
    spared = len(shapes) // 10
    owners = [-1] * spared + [0] * (len(shapes) - spared) + list(range(1, len(captured) + 1))
    views = draw(Shapes(shapes + captured, device), torch.tensor(owners).to(device), args.views, 0)
    names = [shape.name for shape in captured]
    for suffix, left_out in folds(names).items() if args.folds else [("", [])]:
        weights = fit(views, left_out, args.steps, names)
        save(weights, args.output.with_stem(args.output.stem + suffix))


def folds(names: Sequence[str]) -> dict[str, list[int]]:
    """Return which captures (1 is the first) to leave out, by the end of a file's name.

    Captures whose names begin alike have the same hair.
    """
    every = list(range(1, len(names) + 1))
    kinds: dict[str, list[int]] = {"": [], "-synth": every}
    for k, name in zip(every, names, strict=True):
        kinds.setdefault(f"-without-{name.split('_')[0]}", []).append(k)
    return kinds


def fit(
    views: tuple[Tensor, Tensor, Tensor], left_out: Sequence[int], steps: int, names: Sequence[str]
) -> dict[str, Tensor]:
    """Return weights trained without some captures, and print the errors on those."""
    features, depths, owners = views
    inside = torch.nonzero(~torch.isin(owners, torch.tensor([-1, *left_out]).to(owners)))[:, 0]
    weights = train(features, depths, inside, steps, 0)
    for owner in (-1, *left_out):
        here = owners == owner
        title = "grooms left out" if owner < 0 else names[owner - 1]
        report(title, weights, features[here], depths[here])
    return weights


if __name__ == "__main__":
    main()
