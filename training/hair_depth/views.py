"""What a photo of a groom shows to `hairkit.field.hair_depth`, and the true depths, on a card."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

import torch
import torch.nn.functional as F  # noqa: N812 the name of this module in PyTorch's own documents
from torch import Tensor

from hairkit.field.hair_depth import ABOVE, CHANNELS, GRID, HEAD_SCALE, LAYERS, WINDOW

from .grooms import Shape

BETWEEN = 3
"""Points drawn for each of a strand."""
FIRST = 0.008
"""Depth behind the first hair in which directions are seen, metres."""
UNDER = 0.004
"""Metres under the surface of the skin at which hair is still seen."""
CELLS = GRID * GRID


class Shapes:
    """Grooms on the device."""

    def __init__(self, shapes: Sequence[Shape], device: str) -> None:
        def stacked(name: str) -> Tensor:
            return torch.stack([torch.from_numpy(getattr(s, name)) for s in shapes]).to(device)

        self.hair, self.skin = stacked("hair"), stacked("skin")
        self.clothes, self.middle = stacked("clothes"), stacked("middle")

    def draw(self, chosen: Tensor, random: torch.Generator) -> tuple[Tensor, Tensor]:
        """Return features (B, CHANNELS, GRID, GRID) and depths (B, LAYERS, GRID, GRID) in metres.

        Depths are NaN where the photo sees no hair. Grooms are deformed, and views drawn, at
        random.
        """
        device, count = self.hair.device, len(chosen)

        def uniform(low: float, high: float, *shape: int) -> Tensor:
            values = torch.rand((count, *shape), generator=random, device=device)
            return low + (high - low) * values

        scale = 1 + uniform(-0.04, 0.04, 1, 3)
        scale[..., 0] *= torch.where(uniform(0, 1, 1) < 0.5, -1.0, 1.0)
        middle = self.middle[chosen][:, None]
        hair = (self.hair[chosen].flatten(1, 2) - middle) * scale
        hair = _deformed(hair, uniform).unflatten(1, self.hair.shape[1:3])
        hair, along = _between(hair)
        skin = (self.skin[chosen] - middle) * scale
        clothes = (self.clothes[chosen] - middle) * scale
        turned = torch.where(
            uniform(0, 1) < 0.3,
            uniform(-math.pi, math.pi),
            0.6 * torch.randn(count, generator=random, device=device),
        )
        raised = 0.14 * torch.randn(count, generator=random, device=device)
        view = _View(turned, raised, uniform(0.45, 2.0))
        return _pictures(view, hair, along, skin, clothes)


class _View:
    """Upright cameras that look at the middle of the head."""

    def __init__(self, azimuth: Tensor, elevation: Tensor, distance: Tensor) -> None:
        sa, ca, se, ce = azimuth.sin(), azimuth.cos(), elevation.sin(), elevation.cos()
        back = torch.stack([sa * ce, se, ca * ce], 1)
        right = torch.stack([ca, torch.zeros_like(ca), -sa], 1)
        down = -torch.linalg.cross(back, right)
        self.rotation = torch.stack([right, down, -back], 1)
        self.distance = distance[:, None]

    def place(self, points: Tensor) -> tuple[Tensor, Tensor, Tensor]:
        """Return cell (B, N), depth behind the middle (B, N), and the local points (B, N, 3).

        Cells outside of the window are CELLS.
        """
        local = points @ self.rotation.transpose(1, 2)
        focal = GRID / WINDOW * self.distance
        depth = (local[..., 2] + self.distance).clamp_min(0.05)
        u = focal * local[..., 0] / depth + GRID / 2
        v = focal * local[..., 1] / depth + GRID * ABOVE / WINDOW
        inside = (u >= 0) & (v >= 0) & (u < GRID) & (v < GRID)
        cell = torch.where(inside, v.long() * GRID + u.long(), CELLS)
        return cell, local[..., 2], local


def _deformed(hair: Tensor, uniform: Callable[..., Tensor]) -> Tensor:
    """Return hair (B, N, 3), its curtains moved back or forward, and wider or narrower."""
    x, y, z = hair.unbind(-1)
    low = torch.sigmoid((uniform(-0.08, 0.0, 1) - y) / 0.02)
    side = torch.sigmoid((x.abs() - 0.05) / 0.012)
    front = torch.sigmoid((z + 0.03) / 0.02)
    amount = torch.where(uniform(0, 1, 1) < 0.5, uniform(-0.06, 0.03, 1), torch.zeros(()).to(x))
    z = z + amount * low * side * front
    x = x * (1 + uniform(-0.12, 0.2, 1) * low)
    return torch.stack([x, y, z], -1)


def _between(hair: Tensor) -> tuple[Tensor, Tensor]:
    """Return BETWEEN times as many points (B, M, 3) of strands (B, S, n, 3), and their ways."""
    first, second = hair[:, :, :-1], hair[:, :, 1:]
    shares = torch.arange(BETWEEN, device=hair.device) / BETWEEN
    points = first[..., None, :] + shares[:, None] * (second - first)[..., None, :]
    way = (second - first)[..., None, :].expand_as(points)
    return points.flatten(1, 3), way.flatten(1, 3)


def _least(cell: Tensor, values: Tensor) -> Tensor:
    """Return (B, CELLS + 1) the least value in each cell, infinity without any."""
    empty = torch.full((len(cell), CELLS + 1), math.inf, device=cell.device)
    return empty.scatter_reduce(1, cell, values, "amin")


def _surface(view: _View, points: Tensor) -> Tensor:
    """Return (B, CELLS) depths of a surface of scattered points, its gaps closed."""
    cell, depth, _ = view.place(points)
    return _closed(_least(cell, depth)[:, :-1])


def _closed(near: Tensor) -> Tensor:
    """Return depths (B, CELLS) whose holes of a cell are as near as what is around them."""
    grown = -F.max_pool2d(-near.unflatten(1, (GRID, GRID))[:, None], 3, 1, 1)
    return torch.minimum(near, F.max_pool2d(grown, 3, 1, 1)[:, 0].flatten(1))


def _pictures(
    view: _View, hair: Tensor, along: Tensor, skin: Tensor, clothes: Tensor
) -> tuple[Tensor, Tensor]:
    cell, depth, _ = view.place(hair)
    front = _least(cell, depth)
    end = -_least(cell, -depth)
    seen = depth <= front.gather(1, cell) + FIRST
    local = along @ view.rotation.transpose(1, 2)
    angle = 2 * torch.atan2(local[..., 1], local[..., 0])
    sums = torch.zeros((len(cell), 3, CELLS + 1), device=cell.device)
    for k, values in enumerate((angle.cos(), angle.sin(), torch.ones_like(angle))):
        sums[:, k].scatter_add_(1, cell, values * seen)
    head, torso = _surface(view, skin), _surface(view, clothes)
    front, end, sums = _closed(front[:, :-1]), end[:, :-1], sums[..., :-1]
    end = torch.maximum(end, front)
    body = torch.minimum(head + UNDER, torso)
    visible = front < body
    person = ~visible & torch.isfinite(body)
    flow = sums[:, :2] / sums[:, 2:].clamp_min(1) * visible[:, None]
    steps = (torch.arange(GRID, device=cell.device) + 0.5) / GRID * 2 - 1
    down, across = torch.meshgrid(steps, steps, indexing="ij")
    planes = [
        visible.float(), person.float(), torch.ones_like(front), flow[:, 0], flow[:, 1],
        torch.where(torch.isfinite(head), head / HEAD_SCALE, 0.0), torch.isfinite(head).float(),
        across.flatten().expand_as(front), down.flatten().expand_as(front),
    ]  # fmt: skip
    assert len(planes) == CHANNELS
    features = torch.stack(planes, 1).unflatten(2, (GRID, GRID))
    depths = torch.stack([front, end], 1)
    assert depths.shape[1] == LAYERS
    depths = torch.where(visible[:, None], depths, math.nan).unflatten(2, (GRID, GRID))
    return features, depths
