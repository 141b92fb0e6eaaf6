"""Train the hair network in PyTorch, write its weights, and compare them with those in NumPy.

python -m training.hair_network.train sets/*.npz -o hair_network.npz --steps 2500

`--start old.npz --blend old.npz` goes on from weights and writes a mean of the old ones and the new
ones (Wortsman et al. 2022), which keeps what the new pictures do not show.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from itertools import pairwise
from pathlib import Path

import cv2
import numpy as np
import torch
import torch.nn.functional as F  # noqa: N812 the name of this module in PyTorch's own documents
from numpy.random import Generator
from torch import Tensor

from hairkit.imaging.hair_features import CHANNELS, GRID
from hairkit.imaging.hair_network import MIRRORED
from hairkit.imaging.unet import read_weights, run_network

from .colours import Array

WIDTHS = (32, 40, 64, 96, 96)
"""Channels of each level, from the finest."""

BATCH, RATE, LEAST_RATE, DECAY, WARM_UP = 12, 2e-3, 2e-5, 1e-3, 100
"""Pictures a step; learning rates of AdamW at the start and at the end of a cosine, its weight
decay, and the steps in which the rate rises."""

AVERAGING = 0.99
"""Share of the mean of the weights that a step keeps; the mean is what is written."""

DICE, DICE_CELLS = 0.5, 50
"""Weight of the Dice loss beside the cross-entropy, and cells added to both of its areas."""

POOR = 0.12
"""Share of the pictures in parts of which the person is uncertain."""


def new_weights(seed: int, channels: int = CHANNELS, answers: int = 3) -> dict[str, Tensor]:
    """Return kernels (C out, C in, k, k) and biases (C out,) of every layer, by its name."""
    shapes = {"entry": (WIDTHS[0], channels, 3), "first": (WIDTHS[0], WIDTHS[0], 3)}
    for level, (fine, coarse) in enumerate(pairwise(WIDTHS)):
        shapes[f"down{level}a"] = (coarse, fine, 3)
        shapes[f"down{level}b"] = (coarse, coarse, 3)
        shapes[f"up{level}"] = (fine, fine + coarse, 3)
    shapes["exit"] = (4 * answers, WIDTHS[0], 1)
    generator = torch.Generator().manual_seed(seed)
    weights = {}
    for name, (outputs, inputs, edge) in shapes.items():
        reach = 1 / np.sqrt(inputs * edge * edge)
        for part, shape in (("weight", (outputs, inputs, edge, edge)), ("bias", (outputs,))):
            weights[f"{name}.{part}"] = (2 * torch.rand(shape, generator=generator) - 1) * reach
    return weights


def widen(old: dict[str, Tensor], weights: dict[str, Tensor]) -> dict[str, Tensor]:
    """Return `weights` of a network that answers as the narrower `old` one does.

    Channels that the old one lacks keep their kernels, and nothing of the old one sees them yet.
    """
    result = {}
    for name, value in weights.items():
        wide, narrow = value.clone(), old[name]
        outputs = len(narrow)
        if name.endswith("bias"):
            wide[:outputs] = narrow
        else:
            wide[:outputs] = 0
            known = narrow.shape[1]
            coarser = f"down{name[2]}b.bias" if name.startswith("up") else None
            above = len(old[coarser]) if coarser else known
            beside = len(weights[coarser]) if coarser else above
            wide[:outputs, :above] = narrow[:, :above]
            wide[:outputs, beside : beside + known - above] = narrow[:, above:]
        result[name] = wide
    return result


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
    weights: dict[str, Tensor],
    features: Array,
    shares: Array,
    steps: int,
    rng: Generator,
    highest: float = RATE,
    batch: int = BATCH,
) -> dict[str, Tensor]:
    """Return the mean of the weights over the last of `steps` steps.

    Convolutions are computed in half precision on channels that lie together: three times as fast.
    """
    weights = {name: _packed(value.clone()).requires_grad_() for name, value in weights.items()}
    mean = {name: value.detach().clone() for name, value in weights.items()}
    optimizer = torch.optim.AdamW(weights.values(), highest, weight_decay=DECAY)
    for step in range(steps):
        cosine = 0.5 + 0.5 * np.cos(np.pi * step / steps)
        rate = highest * min(1, step / WARM_UP + 0.05) * cosine + LEAST_RATE
        optimizer.param_groups[0]["lr"] = float(rate)
        chosen = rng.choice(len(features), batch)
        x, y = _vary(rng, features[chosen].astype(np.float32), shares[chosen].astype(np.float32))
        with torch.autocast("cpu", torch.bfloat16):
            scores = network(weights, _packed(torch.from_numpy(x)))
        value = loss(scores.float(), torch.from_numpy(y / 255))
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


def _packed(value: Tensor) -> Tensor:
    return value.to(memory_format=torch.channels_last) if value.dim() == 4 else value


def _vary(rng: Generator, x: Array, y: Array) -> tuple[Array, Array]:
    """Return features and shares mirrored, of drifted colours, and with a poor person or none."""
    if rng.random() < 0.5:
        x, y = x[..., ::-1].copy(), y[..., ::-1].copy()
        x[:, list(MIRRORED)] *= -1
    for cells in (one[7] for one in x if rng.random() < POOR):
        cells += cv2.resize(rng.random((4, 4), np.float32), (GRID, GRID)) * (0.5 - cells)
    inside = x[:, 8]
    x[:, 7] *= inside
    x[:, :3] += rng.normal(0, 0.06, (len(x), 3, 1, 1)) * inside[:, None]
    x[:, 3] += rng.normal(0, 0.12, (len(x), 1, 1)) * inside
    no_person, no_face = rng.random(len(x)) < 0.06, rng.random(len(x)) < 0.15
    x[no_person, 7] = 0.5 * inside[no_person]
    x[no_face, 9:] = 0
    return x, y


def _read(path: Path) -> dict[str, Tensor]:
    return {name: torch.from_numpy(value) for name, value in read_weights(path).items()}


def disagreement(path: Path, features: Array) -> float:
    """Return by how much the scores in PyTorch and NumPy differ at most."""
    weights = read_weights(path)
    tensors = _read(path)
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
    parser.add_argument("--rate", type=float, default=RATE, help="highest learning rate")
    parser.add_argument("--batch", type=int, default=BATCH, help="pictures a step")
    parser.add_argument("--start", type=Path, help="weights to start from (random without)")
    parser.add_argument("--blend", type=Path, help="weights that the result is averaged with")
    parser.add_argument("--new", type=float, default=0.75, help="share of the new in that mean")
    arguments = parser.parse_args(words)
    files = [dict(np.load(path)) for path in arguments.sets]
    features, shares = (np.concatenate([f[key] for f in files]) for key in ("features", "shares"))
    weights = new_weights(arguments.seed)
    if arguments.start:
        weights = widen(_read(arguments.start), weights)
    rng = np.random.default_rng(arguments.seed)
    trained = train(
        weights, features, shares, arguments.steps, rng, arguments.rate, arguments.batch
    )
    if arguments.blend:
        old = widen(_read(arguments.blend), trained)
        trained = {k: torch.lerp(old[k], value, arguments.new) for k, value in trained.items()}
    half = {name: value.numpy().astype(np.float16) for name, value in trained.items()}
    np.savez_compressed(arguments.output, **half)
    print(f"{sum(value.size for value in half.values())} weights in {arguments.output}")
    print(f"NumPy and PyTorch differ by {disagreement(arguments.output, features[0]):.1e} at most")


if __name__ == "__main__":
    main()
