"""What the file's ribbons look like: drawn beside the groom's own strands, and with faults."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from glb_picture import VIEWS, Array, Picture, Surface, differences, draw
from hairkit_plugins import gltf

from hairkit.head_model.scalp import bind
from hairkit.testing import ball_head
from hairkit.types.groom import Groom, HairMaterial
from hairkit.types.point_cache import PointCache
from hairkit.types.strands import Strands

WIDTH = 0.006
POINTS = 7
ROOT, TIP = np.array([0.3, 0.15, 0.05]), np.array([0.8, 0.6, 0.3])
ALLOWED = {"silhouette": 0.05, "lit": 0.02, "shine": 0.02, "colours": 0.03, "uv": 0.02}
"""Differences of pictures at most; the strips' shades, 0.8 to 1, are told in the mean."""


def parted_groom() -> Groom:
    """Return hair combed from a parting over a ball of 10 cm, shorter on the subject's right."""
    head, angle = ball_head(24), np.linspace(0.05, 1.0, POINTS)
    across = np.linspace(-0.08, 0.08, 12)
    strands = [
        np.stack(
            [
                side * r * np.sin(length * angle),
                r * np.cos(length * angle),
                np.full(POINTS, z),
            ],
            axis=1,
        )
        for z in across
        for r in [np.sqrt(0.104**2 - z**2)]
        for side, length in ((1, 1.7), (-1, 1.1))
    ]
    packed = Strands.from_list(strands)
    triangle, barycentric = bind(packed.roots, head)
    uv = np.clip([0.5, 0.2] + 4 * packed.roots[:, [2, 0]], 0, 1)
    return Groom(replace(packed, root_uv=uv), head, triangle, barycentric, HairMaterial(ROOT, TIP))


def nodded(groom: Groom) -> PointCache:
    """Return the head at rest, then turned by 0.5 about an axis through the origin."""
    motion = np.tile(np.eye(4), (2, 1, 1))
    motion[1, 1:3, 1:3] = [[np.cos(0.5), -np.sin(0.5)], [np.sin(0.5), np.cos(0.5)]]
    points = groom.strands.points @ motion[:, :3, :3].transpose(0, 2, 1)
    return PointCache(points, np.array([0, 1.0]), motion)


def wanted(groom: Groom, turn: Array) -> Surface:
    """Return the strips that the groom's strands are: flat on the ball, as wide as asked."""
    lines = groom.strands.points.reshape(-1, POINTS, 3).astype(float)
    out = lines / np.linalg.norm(lines, axis=2, keepdims=True)
    along = np.gradient(lines, axis=1)
    along /= np.linalg.norm(along, axis=2, keepdims=True)
    share = np.linspace(0, 1, POINTS)
    width = WIDTH * np.minimum(0.7 + 3 * share, 1) * (1 - 0.65 * share**4)
    half = 0.5 * width[:, None] * np.cross(out, along)
    points = np.stack([lines - half, lines + half], axis=2)
    colours = 0.9 * (ROOT + share[:, None] * (TIP - ROOT))
    uv = np.stack(np.broadcast_arrays([0, 1.0], share[:, None]), axis=-1)
    root_uv = np.asarray(groom.strands.root_uv, float) * [1, -1] + [0, 1]
    corners = np.array([[0, 2, 1], [1, 2, 3]])
    quads = (2 * np.arange(POINTS - 1)[:, None, None] + corners).reshape(-1, 3)
    count = len(lines)
    return Surface(
        points.reshape(-1, 3) @ turn.T,
        np.repeat(out.reshape(-1, 3), 2, axis=0) @ turn.T,
        np.tile(np.repeat(colours, 2, axis=0), (count, 1)),
        np.tile(uv.reshape(-1, 2), (count, 1)),
        np.repeat(root_uv, 2 * POINTS, axis=0),
        (quads[None] + 2 * POINTS * np.arange(count)[:, None, None]).reshape(-1, 3),
    )


@pytest.fixture(scope="module")
def written(tmp_path_factory: pytest.TempPathFactory) -> tuple[Surface, ...]:
    """Return the exported ribbons at rest and nodded."""
    folder, groom = tmp_path_factory.mktemp("glb"), parted_groom()
    nodded(groom).save(folder / "cache.npz")
    options = gltf.Options(
        strips=len(groom.strands), strip_points=POINTS, strip_width=WIDTH, bust=False,
        cache=folder / "cache.npz",
    )  # fmt: skip
    gltf.export_groom(groom, folder / "hair.glb", options)
    return tuple(Surface.of(folder / "hair.glb", time) for time in (0.0, 1.0))


@pytest.fixture(scope="module")
def true_pictures() -> dict[tuple[int, str], Picture]:
    """Return what the groom looks like from every view, at rest and nodded."""
    groom = parted_groom()
    turns = nodded(groom).head_from_rest[:, :3, :3]
    return {
        (frame, view): draw(wanted(groom, turn), view)
        for frame, turn in enumerate(turns)
        for view in VIEWS
    }


def worst(surfaces: tuple[Surface, ...], true: dict[tuple[int, str], Picture]) -> dict[str, float]:
    """Return the largest differences over all views of as many frames as there are surfaces."""
    found = [
        differences(draw(surfaces[frame], view), picture)
        for (frame, view), picture in true.items()
        if frame < len(surfaces)
    ]
    return {name: max(each.get(name, 1.0) for each in found) for name in ALLOWED}


def test_ribbons_look_like_the_strands(
    written: tuple[Surface, ...], true_pictures: dict[tuple[int, str], Picture]
) -> None:
    """Silhouette, light, highlight, colour and texture coordinates, from three sides, in motion."""
    found = worst(written, true_pictures)
    assert all(found[name] <= most for name, most in ALLOWED.items()), found


def _turned(axes: list[int]) -> Callable[[Surface], Surface]:
    return lambda s: replace(s, points=s.points[:, axes], normals=s.normals[:, axes])


def _wider(factor: float) -> Callable[[Surface], Surface]:
    def change(surface: Surface) -> Surface:
        pairs = surface.points.reshape(-1, 2, 3)
        middle = pairs.mean(axis=1, keepdims=True)
        return replace(surface, points=(middle + factor * (pairs - middle)).reshape(-1, 3))

    return change


def _backwards(values: Array) -> Array:
    """Return values of each strip from tip to root."""
    return values.reshape(-1, POINTS, 2, values.shape[1])[:, ::-1].reshape(values.shape)


def _across_the_parting(surface: Surface) -> Surface:
    points = surface.points.copy()
    x = points.reshape(-1, 2 * POINTS, 3)
    x[::5, :, 0] *= -1
    return replace(surface, points=points)


FAULTS: dict[str, Callable[[Surface], Surface]] = {
    "inverted normals": lambda s: replace(s, normals=-s.normals),
    "faces wound the other way": lambda s: replace(s, faces=s.faces[:, ::-1]),
    "normals along the strip": lambda s: replace(
        s, normals=np.gradient(s.points.reshape(-1, POINTS, 2, 3), axis=1).reshape(-1, 3)
    ),
    "normals of the world": lambda s: replace(s, normals=np.tile([0, 1.0, 0], (len(s.points), 1))),
    "red base colour": lambda s: replace(s, colours=s.colours * [1, 0.2, 0.2]),
    "white base colour": lambda s: replace(s, colours=np.ones_like(s.colours)),
    "sRGB taken for linear": lambda s: replace(s, colours=s.colours ** (1 / 2.2)),
    "linear taken for sRGB": lambda s: replace(s, colours=s.colours**2.2),
    "red and blue swapped": lambda s: replace(s, colours=s.colours[:, ::-1]),
    "colours from tip to root": lambda s: replace(s, colours=_backwards(s.colours)),
    "radius for diameter": _wider(0.5),
    "diameter for radius": _wider(2.0),
    "width in another unit": _wider(0.1),
    "centimetres": lambda s: replace(s, points=100 * s.points),
    "inches": lambda s: replace(s, points=s.points / 2.54),
    "Z up": _turned([0, 2, 1]),
    "left and right mirrored": lambda s: replace(
        s, points=s.points * [-1, 1, 1], normals=s.normals * [-1, 1, 1]
    ),
    "strips from tip to root": lambda s: replace(s, points=_backwards(s.points)),
    "texture from tip to root": lambda s: replace(s, uv=s.uv * [1, -1] + [0, 1]),
    "texture mirrored across": lambda s: replace(s, uv=s.uv * [-1, 1] + [1, 0]),
    "roots of other strands": lambda s: replace(s, root_uv=np.roll(s.root_uv, 8 * POINTS, axis=0)),
    "root texture upside down": lambda s: replace(s, root_uv=s.root_uv * [1, -1] + [0, 1]),
    "hair across the parting": _across_the_parting,
}


@pytest.mark.parametrize("fault", FAULTS)
def test_every_fault_of_appearance_is_seen(
    fault: str, written: tuple[Surface, ...], true_pictures: dict[tuple[int, str], Picture]
) -> None:
    """A file with one thing wrong looks wrong: some difference is beyond what is allowed."""
    found = worst((FAULTS[fault](written[0]),), true_pictures)
    assert any(found[name] > most for name, most in ALLOWED.items()), found


def test_hair_that_stays_behind_a_nodding_head_is_seen(
    written: tuple[Surface, ...], true_pictures: dict[tuple[int, str], Picture]
) -> None:
    """Weights of another joint leave the hair at rest, and half weights half-way."""
    still = (written[0], written[0])
    middle = replace(written[1], points=0.5 * (written[0].points + written[1].points))
    for faulty in (still, (written[0], middle)):
        assert worst(faulty, true_pictures)["silhouette"] > ALLOWED["silhouette"]
