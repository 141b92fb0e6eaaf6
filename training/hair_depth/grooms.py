"""Random procedural grooms on random heads, and those of captures with truth, as points."""

from __future__ import annotations

import json
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace
from pathlib import Path
from unittest import mock

import numpy as np

from hairkit.arrays import Float32Array, Int32Array
from hairkit.cameras.similarity import fit_similarity
from hairkit.field.hair_depth import head_middle
from hairkit.head_model.template import default_head
from hairkit.io.mesh_text import read_obj
from hairkit.synth import STYLES, Style, grow
from hairkit.synth.bust import Bust
from hairkit.synth.growth import cut_strands
from hairkit.types.groom import Groom
from hairkit.types.head import JAW_LANDMARKS, Head
from hairkit.types.strands import Strands

STRANDS, POINTS = 2000, 40
"""Strands of a groom, and points of a strand."""
SKIN, CLOTHES = 20_000, 12_000
"""Points on the surfaces of head and torso."""
SIZES = np.array([0.07, 0.06, 0.07])
"""Greatest deviations of a head's breadth, height and depth, shares."""
FRINGE = (0.075, 0.03)
"""Half the width of a fringe, and how far before the head's origin it begins, metres."""
LONG, MID, SHORT, COILS, TIED = 0.42, 0.2, 0.23, 0.08, 0.07
"""Shares of the kinds of hair."""


@dataclass(frozen=True, eq=False)
class Shape:
    """A groom and what hides it, head frame, metres."""

    name: str
    hair: Float32Array
    """(STRANDS, POINTS, 3)."""
    skin: Float32Array
    """(SKIN, 3) points on the head's surface."""
    clothes: Float32Array
    """(CLOTHES, 3) points on the torso's."""
    middle: Float32Array
    """(3,) of the cranium, as `hairkit.field.hair_depth` has it."""


def random_shapes(seeds: Sequence[int], workers: int) -> list[Shape]:
    """Return a groom of each seed."""
    with ProcessPoolExecutor(workers) as pool:
        return list(pool.map(random_shape, seeds, chunksize=8))


def random_shape(seed: int) -> Shape:
    """Return the random groom of a seed as points."""
    rng = np.random.default_rng([seed, 9])
    groom = random_groom(seed, STRANDS)
    head, strands = groom.head, groom.strands
    bust = Bust.under(head)
    return Shape(
        "synth",
        _resampled(strands.points.reshape(STRANDS, -1, 3)),
        _scattered(head.vertices, head.faces, SKIN, rng),
        _scattered(bust.vertices, bust.faces, CLOTHES, rng),
        head_middle(head).astype(np.float32),
    )


def random_groom(seed: int, count: int, *, draped: bool = False) -> Groom:
    """Return `count` strands of a random style, or draped over the shoulders, on a random head."""
    rng = np.random.default_rng([seed, 7])
    head, look = random_head(rng), random_style(rng)
    if draped:
        length, cut = float(rng.uniform(0.42, 0.65)), float(rng.uniform(-0.5, -0.25))
        parting = 0.02 if look.parting is None else look.parting
        look = replace(
            look,
            points=110,
            length=length,
            cut=cut,
            parting=parting,
            bend=0.028,
            lift=0.3,
            tail=0.0,
        )
    with mock.patch.dict(STYLES, {"straight": look}):
        groom = grow("straight", head, count, seed)
    if look.length <= 0.1 or look.tail or rng.random() >= 0.3:
        return groom
    strands = groom.strands
    paths = _with_fringe(strands.points.reshape(count, look.points, 3), rng)
    flat = paths.reshape(-1, 3)
    return replace(groom, strands=Strands(flat, strands.offsets, root_uv=strands.root_uv))


def random_head(rng: np.random.Generator) -> Head:
    """Return the default head with other proportions."""
    head, scale = default_head(), 1 + SIZES * rng.uniform(-1, 1, 3)
    assert head.joints is not None
    return replace(
        head,
        vertices=(head.vertices * scale).astype(np.float32),
        joints=(head.joints * scale).astype(np.float32),
    )


def random_style(rng: np.random.Generator) -> Style:
    """Return the parameters of some hair."""
    kind = rng.choice(5, p=[LONG, MID, SHORT, COILS, TIED])
    waves = rng.random() < 0.5
    parting = None if rng.random() < 0.25 else float(rng.uniform(-0.04, 0.04))
    cut = float(rng.uniform(-0.4, -0.08)) if rng.random() < 0.7 else None
    look = replace(
        STYLES["straight"], points=64, parting=parting, cut=cut, length=rng.uniform(0.2, 0.5),
        lift=rng.uniform(0.15, 0.6), bend=rng.uniform(0.015, 0.05), layer=rng.uniform(0.005, 0.03),
        wave_radius=rng.uniform(0.002, 0.009) if waves else 0.0, coil=rng.uniform(0, 1),
        wave_pitch=rng.uniform(0.03, 0.1), clumps=int(rng.integers(150, 600)),
        clumping=rng.uniform(0.2, 0.8), frizz=rng.uniform(0.0005, 0.004),
        length_spread=rng.uniform(0.05, 0.3),
    )  # fmt: skip
    if kind == 1:
        return replace(look, length=rng.uniform(0.09, 0.22), layer=rng.uniform(0.005, 0.02))
    if kind == 2:
        size = np.exp(rng.uniform(np.log(0.012), np.log(0.09)))
        return replace(
            look, length=float(size), points=32, parting=None if rng.random() < 0.6 else parting,
            cut=None, lift=rng.uniform(0.2, 0.8), bend=rng.uniform(0.04, 0.3),
            layer=rng.uniform(0.002, 0.014), wave_radius=0.05 * size if waves else 0.0,
        )  # fmt: skip
    if kind == 3:
        return replace(
            look, length=rng.uniform(0.05, 0.2), points=160, parting=None, cut=None, lift=1.5,
            bend=rng.uniform(0.2, 0.6), wave_radius=rng.uniform(0.003, 0.006), coil=1.0,
            wave_pitch=rng.uniform(0.01, 0.02), clumps=1500, clumping=0.4,
        )  # fmt: skip
    if kind == 4:
        return replace(STYLES["tied"], tail=float(rng.uniform(0.04, 0.25)))
    return look


def captured_shapes(folder: Path, rng: np.random.Generator) -> list[Shape]:
    """Return the grooms of all captures with truth in a folder."""
    return [_captured(path, rng) for path in sorted(folder.glob("*/truth"))]


def _captured(truth: Path, rng: np.random.Generator) -> Shape:
    strands, mesh = np.load(truth / "strands.npz"), read_obj(truth / "head.obj")
    points, offsets = strands["points"], strands["offsets"]
    chosen = rng.choice(len(offsets) - 1, STRANDS)
    paths = np.concatenate([_resampled(points[None, offsets[k] : offsets[k + 1]]) for k in chosen])
    said = json.loads((truth / "truth.json").read_text())["landmarks3d"]
    marks = np.array(said["xyz"] if isinstance(said, dict) else said)[JAW_LANDMARKS:]
    head = default_head()
    own = head.vertices[head.landmark_vertices].astype(np.float64)[JAW_LANDMARKS:]
    moved = fit_similarity(own, marks, np.ones(len(own)))
    bust = Bust.under(head)
    return Shape(
        truth.parent.name,
        paths.astype(np.float32),
        _scattered(
            np.asarray(mesh.vertices, np.float32), np.asarray(mesh.faces, np.int32), SKIN, rng
        ),
        moved.apply(_scattered(bust.vertices, bust.faces, CLOTHES, rng)).astype(np.float32),
        moved.apply(head_middle(head)[None])[0].astype(np.float32),
    )


def _resampled(paths: Float32Array) -> Float32Array:
    """Return strands (N, n, 3) with POINTS points each."""
    place = np.linspace(0, paths.shape[1] - 1, POINTS)
    low = np.minimum(place.astype(int), paths.shape[1] - 2)
    share = (place - low)[:, None]
    return np.asarray(paths[:, low] * (1 - share) + paths[:, low + 1] * share, np.float32)


def _with_fringe(paths: Float32Array, rng: np.random.Generator) -> Float32Array:
    """Return the strands, those before the face cut off above the eyes or at the cheeks."""
    line = rng.uniform(-0.06, 0.01) + 0.005 * rng.standard_normal((len(paths), 1))
    before = (np.abs(paths[..., 0]) < FRINGE[0]) & (paths[..., 2] > FRINGE[1])
    below = before & (paths[..., 1] < line)
    return cut_strands(paths, below, 4)


def _scattered(
    vertices: Float32Array, faces: Int32Array, count: int, rng: np.random.Generator
) -> Float32Array:
    """Return random points (count, 3) on triangles, by their area."""
    corners = vertices[faces[:, :3]]
    across, along = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    area = np.linalg.norm(np.cross(across, along), axis=1)
    chosen = rng.choice(len(faces), count, p=area / area.sum())
    a, b = rng.random((2, count, 1))
    flip = a + b > 1
    a, b = np.where(flip, 1 - a, a), np.where(flip, 1 - b, b)
    first, second, third = np.moveaxis(corners[chosen], 1, 0)
    return np.asarray(first + a * (second - first) + b * (third - first), np.float32)
