"""Pictures that Blender's Cycles makes of the files, beside hairkit's own picture of the groom.

What Blender draws is compared with `hairkit.rendering.draw`: where hair is, how much of it, and,
where a file carries a material, its colour from the roots to the tips. Each deliberate fault of a
file must be seen in one of these figures.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import numpy.typing as npt
import pytest
from blender_session import BlenderSession
from client_groom import written

from hairkit.head_model.scalp import sample_roots
from hairkit.head_model.template import default_head
from hairkit.manager import Manager
from hairkit.rendering import draw
from hairkit.rendering.framing import framing_cameras
from hairkit.rendering.picture import display_width
from hairkit.types.camera import Camera
from hairkit.types.groom import Groom, HairMaterial
from hairkit.types.strands import Strands

Array = npt.NDArray[np.floating]
COUNT, POINTS = 900, 14
WIDTH, HEIGHT, BLOCK = 96, 128, 8
"""Pixels of a picture, and of the blocks over which its noise is averaged."""
FINE = 8
"""Samples along an edge of hairkit's pixels: strands half a pixel wide are drawn as wide as they
are."""
ROOT, TIP = np.array([0.10, 0.05, 0.02]), np.array([0.55, 0.38, 0.18])
BESIDE = ("head", "torso")
"""Words in the names of what is not hair."""
OPERATORS = {
    ".abc": "wm.alembic_import",
    ".usdc": "wm.usd_import",
    ".glb": "import_scene.gltf",
    ".cards.glb": "import_scene.gltf",
}
OPTIONS: dict[str, dict[str, object]] = {
    ".glb": {"strips": COUNT, "strip_points": POINTS, "strip_width": 0.0016, "lines": "none"},
    ".cards.glb": {"cards": 300, "levels": 1, "atlas": 512},
}
LEAST_OVERLAP = {".abc": 0.96, ".usdc": 0.96, ".glb": 0.78, ".cards.glb": 0.85}
"""Intersection over union of what the blocks are covered by; ribbons lie flat on the head and are
seen on edge at the outline."""
COVERED = {".abc": 0.03, ".usdc": 0.03, ".glb": 0.22, ".cards.glb": 0.08}
"""Share by which more or less may be covered."""
HUE, DARKEST, BRIGHTEST = 0.4, 0.35, 1.1
"""Logarithm of a ratio of channels off the material's; brightness under a white sky over the
material's mean: strands shade each other."""
BRIGHTER = 1.1
"""Tips over roots, at least."""


def combed(count: int = COUNT) -> Groom:
    """Return fair-tipped hair that falls from the scalp, longer at the left and at the back."""
    head = default_head()
    roots = sample_roots(head, count)
    place, out = roots.positions.astype(float), roots.normals.astype(float)
    along = np.linspace(0, 1, POINTS)[:, None]
    length = 0.10 + 0.09 * (place[:, 0] > 0.01) + 0.06 * (place[:, 2] < -0.02)
    away = 0.5 * out[:, None] * (along - 0.6 * along**2) + [0, -0.9, 0] * along**1.4
    points = place[:, None] + length[:, None, None] * away
    widths = np.tile(np.linspace(1.6e-3, 0.8e-3, POINTS), count).astype(np.float32)
    offsets = np.arange(0, count * POINTS + 1, POINTS)
    strands = Strands(points.reshape(-1, 3).astype(np.float32), offsets, widths=widths)
    return Groom(strands, head, roots.triangle, roots.barycentric, HairMaterial(ROOT, TIP))


def cameras(groom: Groom) -> list[Camera]:
    """Return a camera before the head and one at its left."""
    points = np.concatenate([groom.strands.points, groom.head.vertices])
    return framing_cameras(points, [(0, 5), (90, 5)], WIDTH, HEIGHT)


def cover(groom: Groom) -> Array:
    """Return how much hair covers each block of hairkit's pictures (C, H, W)."""
    strands = groom.strands
    wider = display_width(strands, groom.material) / strands.widths
    strands = replace(strands, widths=strands.widths / wider)
    black = np.zeros((HEIGHT, WIDTH, 3), np.uint8)
    pictures = []
    for camera in cameras(groom):
        dark, light = (
            draw(strands, None, camera, background=ground, supersample=FINE).astype(float)
            for ground in (black, black + np.uint8(255))
        )
        pictures.append(1 - (light - dark).mean(axis=2) / 255)
    return blocks(np.stack(pictures))


def blocks(pictures: Array) -> Array:
    """Return the means of blocks of pictures (C, H, W, ...)."""
    shape = (len(pictures), HEIGHT // BLOCK, BLOCK, WIDTH // BLOCK, BLOCK, *pictures.shape[3:])
    return np.asarray(pictures.reshape(shape).mean(axis=(2, 4)))


def misfits(blender: BlenderSession, path: Path, kind: str, true: Array, groom: Groom) -> list[str]:
    """Return the names of the figures in which Blender's pictures of a file are wrong."""
    views = [
        {
            "rotation": camera.rotation.tolist(),
            "position": camera.position.tolist(),
            "focal": float(camera.focal),
            "width": WIDTH,
            "height": HEIGHT,
        }
        for camera in cameras(groom)
    ]
    pictures = blocks(
        blender.call(
            "pictures.seen", path=path, operator=OPERATORS[kind], cameras=views, hidden=BESIDE
        )
    )
    covered = pictures[..., 3]
    overlap = np.minimum(covered, true).sum() / np.maximum(covered, true).sum()
    wrong = [] if overlap >= LEAST_OVERLAP[kind] else ["overlap"]
    if abs(covered.sum() / true.sum() - 1) > COVERED[kind]:
        wrong.append("amount")
    if kind.endswith(".glb") and covered.sum() > 0:
        wrong += off_colours(pictures[..., :3], covered)
    return wrong


def off_colours(colours: Array, covered: Array) -> list[str]:
    """Return what is wrong with colours (C, H, W, 3), premultiplied, of covered blocks."""
    mean = colours.sum(axis=(0, 1, 2)) / covered.sum()
    material = (ROOT + TIP) / 2
    wrong = []
    hues = np.log((mean[[0, 2]] / mean[1]) / (material[[0, 2]] / material[1]))
    if np.abs(hues).max() > HUE:
        wrong.append("hue")
    if not DARKEST < mean.mean() / material.mean() < BRIGHTEST:
        wrong.append("brightness")
    rows = np.flatnonzero(covered.sum(axis=(0, 2)) > 1)
    upper, lower = (
        colours[:, part].sum() / covered[:, part].sum() for part in (rows[1:3], rows[-4:-1])
    )
    if lower < BRIGHTER * upper:
        wrong.append("gradient")
    return wrong


@pytest.fixture(scope="module")
def hair() -> Groom:
    """The groom that all files are of."""
    return combed()


@pytest.fixture(scope="module")
def true(hair: Groom) -> Array:
    """Return what of each block hair covers."""
    return cover(hair)


@pytest.mark.parametrize("kind", OPERATORS)
def test_blender_draws_what_hairkit_draws(
    kind: str, blender: BlenderSession, manager: Manager, hair: Groom, true: Array, tmp_path: Path
) -> None:
    """Where hair is, how much of it, and the colours that the file carries."""
    path = written(manager, hair, tmp_path / f"hair{kind}", **OPTIONS.get(kind, {}))
    assert misfits(blender, path, kind, true, hair) == []


def _moved(change: Callable[[Array], Array]) -> Callable[[Groom], Groom]:
    def made(groom: Groom) -> Groom:
        points = change(groom.strands.points.astype(np.float64)).astype(np.float32)
        return replace(groom, strands=replace(groom.strands, points=points))

    return made


def _as_wide(times: float) -> Callable[[Groom], Groom]:
    return lambda groom: replace(
        groom, strands=replace(groom.strands, widths=groom.strands.widths * np.float32(times))
    )


def _coloured(root: Array, tip: Array) -> Callable[[Groom], Groom]:
    return lambda groom: replace(groom, material=HairMaterial(root, tip))


def _cut(groom: Groom) -> Groom:
    points = groom.strands.points.reshape(-1, POINTS, 3)
    shorter = points[:, :1] + 0.75 * (points - points[:, :1])
    return _moved(lambda _: shorter.reshape(-1, 3))(groom)


FAULTS: dict[str, tuple[str, Callable[[Groom], Groom]]] = {
    "radius for width": (".abc", _as_wide(2.0)),
    "width for radius": (".usdc", _as_wide(0.5)),
    "left for right": (".abc", _moved(lambda p: p * [-1, 1, 1])),
    "back for front": (".usdc", _moved(lambda p: p * [-1, 1, -1])),
    "z up": (".abc", _moved(lambda p: p[:, [0, 2, 1]] * [1, -1, 1])),
    "metres as centimetres": (".abc", _moved(lambda p: 100 * p)),
    "inches as centimetres": (".usdc", _moved(lambda p: p / 2.54)),
    "1 cm too high": (".abc", _moved(lambda p: p + np.array([0, 0.01, 0]))),
    "cut": (".usdc", _cut),
    "cut ribbons": (".glb", _cut),
    "left for right ribbons": (".glb", _moved(lambda p: p * [-1, 1, 1])),
    "red": (".glb", _coloured(np.array([0.4, 0.01, 0.01]), np.array([0.8, 0.02, 0.02]))),
    "linear as picker values": (".glb", _coloured(ROOT**2.2, TIP**2.2)),
    "picker values as linear": (".glb", _coloured(ROOT ** (1 / 2.2), TIP ** (1 / 2.2))),
    "tips at the roots": (".glb", _coloured(TIP, ROOT)),
    "left for right cards": (".cards.glb", _moved(lambda p: p * [-1, 1, 1])),
    "wide cards": (".cards.glb", _as_wide(3.0)),
    "tips at the roots of cards": (".cards.glb", _coloured(TIP, ROOT)),
    "red cards": (".cards.glb", _coloured(np.array([0.4, 0.01, 0.01]), np.array([0.8, 0, 0]))),
    "half of the hair": (".abc", lambda groom: combed(COUNT // 2)),
}
"""Faults by name: the file, and what is done to the groom before it is written."""


@pytest.mark.parametrize("name", FAULTS)
def test_a_deliberate_fault_is_seen(
    name: str, blender: BlenderSession, manager: Manager, hair: Groom, true: Array, tmp_path: Path
) -> None:
    """Twenty faults that exporters have had, or could have."""
    kind, change = FAULTS[name]
    path = written(manager, change(hair), tmp_path / f"hair{kind}", **OPTIONS.get(kind, {}))
    assert misfits(blender, path, kind, true, hair) != []
