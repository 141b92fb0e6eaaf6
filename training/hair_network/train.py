"""Train the hair network in PyTorch, write its weights, and compare them with those in NumPy.

python -m training.hair_network.train sets/*.npz -o hair_network.npz --steps 2500
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from itertools import pairwise
from pathlib import Path

import numpy as np
import torch
import torch.nn.functional as F  # noqa: N812 the name of this module in PyTorch's own documents
from numpy.random import Generator
from torch import Tensor

from hairkit.imaging.hair_features import CHANNELS
from hairkit.imaging.hair_network import MIRRORED, read_weights, run_network

from .colours import Array

WIDTHS = (24, 32, 48, 64, 64)
"""Channels of each level, from the finest."""

BATCH, RATE, LEAST_RATE, DECAY, WARM_UP = 12, 2e-3, 2e-5, 1e-3, 100
"""Pictures a step; learning rates of AdamW at the start and at the end of a cosine, its weight
decay, and the steps in which the rate rises."""

AVERAGING = 0.99
"""Share of the mean of the weights that a step keeps; the mean is what is written."""

DICE, DICE_CELLS = 0.5, 50
"""Weight of the Dice loss beside the cross-entropy, and cells added to both of its areas."""


def new_weights(seed: int) -> dict[str, Tensor]:
    """Return kernels (C out, C in, k, k) and biases (C out,) of every layer, by its name."""
    shapes = {"entry": (WIDTHS[0], CHANNELS, 3), "first": (WIDTHS[0], WIDTHS[0], 3)}
    for level, (fine, coarse) in enumerate(pairwise(WIDTHS)):
        shapes[f"down{level}a"] = (coarse, fine, 3)
        shapes[f"down{level}b"] = (coarse, coarse, 3)
        shapes[f"up{level}"] = (fine, fine + coarse, 3)
    shapes["exit"] = (12, WIDTHS[0], 1)
    generator = torch.Generator().manual_seed(seed)
    weights = {}
    for name, (outputs, inputs, edge) in shapes.items():
        reach = 1 / np.sqrt(inputs * edge * edge)
        for part, shape in (("weight", (outputs, inputs, edge, edge)), ("bias", (outputs,))):
            weights[f"{name}.{part}"] = (2 * torch.rand(shape, generator=generator) - 1) * reach
    return weights


def network(weights: dict[str, Tensor], x: Tensor) -> Tensor:
    """Return the scores (N, 3, GRID, GRID) of hair, person and background."""

    def layer(x: Tensor, name: str, stride: int = 1) -> Tensor:
        kernels = weights[f"{name}.weight"]
        edge = kernels.shape[-1] // 2
        return F.conv2d(x, kernels, weights[f"{name}.bias"], stride=stride, padding=edge)

    x = F.relu(layer(F.relu(layer(x, "entry", stride=2)), "first"))
    kept = [x]
    for level in range(len(WIDTHS) - 1):
        x = F.relu(layer(F.max_pool2d(x, 2), f"down{level}a"))
        x = F.relu(layer(x, f"down{level}b"))
        kept.append(x)
    for level in reversed(range(len(WIDTHS) - 1)):
        x = torch.cat([F.interpolate(x, scale_factor=2.0, mode="nearest"), kept[level]], dim=1)
        x = F.relu(layer(x, f"up{level}"))
    return F.pixel_shuffle(layer(x, "exit"), 2)


def loss(scores: Tensor, shares: Tensor) -> Tensor:
    """Return the cross-entropy in the cells of the photos, and the Dice loss of hair."""
    inside = shares.sum(1)
    entropy = -(shares * F.log_softmax(scores, 1)).sum() / inside.sum()
    hair, true = torch.softmax(scores, 1)[:, 0] * (inside > 0), shares[:, 0]
    both, either = (hair * true).sum((1, 2)), hair.sum((1, 2)) + true.sum((1, 2))
    return entropy + DICE * (1 - (2 * both + DICE_CELLS) / (either + DICE_CELLS)).mean()


def train(
    weights: dict[str, Tensor], features: Array, shares: Array, steps: int, rng: Generator
) -> dict[str, Tensor]:
    """Return the mean of the weights over the last of `steps` steps."""
    weights = {name: value.clone().requires_grad_() for name, value in weights.items()}
    mean = {name: value.detach().clone() for name, value in weights.items()}
    optimizer = torch.optim.AdamW(weights.values(), RATE, weight_decay=DECAY)
    for step in range(steps):
        cosine = 0.5 + 0.5 * np.cos(np.pi * step / steps)
        rate = RATE * min(1, step / WARM_UP + 0.05) * cosine + LEAST_RATE
        optimizer.param_groups[0]["lr"] = float(rate)
        chosen = rng.choice(len(features), BATCH)
        x, y = _vary(rng, features[chosen].astype(np.float32), shares[chosen].astype(np.float32))
        value = loss(network(weights, torch.from_numpy(x)), torch.from_numpy(y / 255))
        optimizer.zero_grad()
        value.backward()
        torch.nn.utils.clip_grad_norm_(weights.values(), 1.0)
        optimizer.step()
        keep = min(AVERAGING, (step + 1) / (step + 11))
        for name, average in mean.items():
            average.mul_(keep).add_(weights[name].detach(), alpha=1 - keep)
        if step % 50 == 0 or step == steps - 1:
            print(f"step {step}: loss {value.item():.3f}", flush=True)
    return mean


def _vary(rng: Generator, x: Array, y: Array) -> tuple[Array, Array]:
    """Return features and shares mirrored, of drifted colours, and without person or face."""
    if rng.random() < 0.5:
        x, y = x[..., ::-1].copy(), y[..., ::-1].copy()
        x[:, list(MIRRORED)] *= -1
    inside = x[:, 8]
    x[:, :3] += rng.normal(0, 0.06, (len(x), 3, 1, 1)) * inside[:, None]
    x[:, 3] += rng.normal(0, 0.12, (len(x), 1, 1)) * inside
    no_person, no_face = rng.random(len(x)) < 0.06, rng.random(len(x)) < 0.15
    x[no_person, 7] = 0.5 * inside[no_person]
    x[no_face, 9:] = 0
    return x, y


def disagreement(path: Path, features: Array) -> float:
    """Return by how much the scores in PyTorch and NumPy differ at most."""
    weights = read_weights(path)
    tensors = {name: torch.from_numpy(value) for name, value in weights.items()}
    x = features.astype(np.float32)
    with torch.no_grad():
        expected = network(tensors, torch.from_numpy(x[None]))[0].numpy()
    return float(np.abs(run_network(x, weights) - expected).max())


def main(words: Sequence[str] | None = None) -> None:
    """Train on sets made by `compose` and write the weights in half precision."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("sets", type=Path, nargs="+", help="files of training.hair_network.compose")
    parser.add_argument("-o", "--output", type=Path, required=True, help="weights (.npz)")
    parser.add_argument("--steps", type=int, default=2500)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--start", type=Path, help="weights to start from (random without)")
    arguments = parser.parse_args(words)
    files = [dict(np.load(path)) for path in arguments.sets]
    features, shares = (np.concatenate([f[key] for f in files]) for key in ("features", "shares"))
    weights = new_weights(arguments.seed)
    if arguments.start:
        weights = {k: torch.from_numpy(v) for k, v in read_weights(arguments.start).items()}
    rng = np.random.default_rng(arguments.seed)
    trained = train(weights, features, shares, arguments.steps, rng)
    half = {name: value.numpy().astype(np.float16) for name, value in trained.items()}
    np.savez_compressed(arguments.output, **half)
    print(f"{sum(value.size for value in half.values())} weights in {arguments.output}")
    print(f"NumPy and PyTorch differ by {disagreement(arguments.output, features[0]):.1e} at most")


if __name__ == "__main__":
    main()
