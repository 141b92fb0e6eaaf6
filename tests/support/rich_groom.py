"""A groom with something in every field, for tests of file formats."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from hairkit.arrays import Float32Array
from hairkit.testing import bristle_groom
from hairkit.types.groom import Groom, HairMaterial, HairPhysics
from hairkit.types.head import Capsules
from hairkit.types.skin import Blendshape, SkinMaps, Texture
from hairkit.types.strand_blocks import colours
from hairkit.types.strands import Strands
from hairkit.types.tie import Tie

LOOK = HairMaterial(np.array([0.3, 0.2, 0.1]), np.array([0.6, 0.4, 0.3]), 7e-5, 0.002, 0.011)
_MAP_SIZES = ((8, 8), (8, 8, 3), (8, 8))
"""Of roughness, normal and bump."""


def rich_groom(strands: int = 40) -> Groom:
    """Return guides and hair on the ball head; nothing is at its default, counts are unequal."""
    rng = np.random.default_rng(11)
    bare = bristle_groom()
    index = np.sort(rng.choice(len(bare.strands), strands, replace=False))
    roots, up = bare.strands.roots[index], bare.strands.tangents()[bare.strands.offsets[index]]
    counts = rng.integers(4, 20, strands)
    offsets = np.concatenate([[0], np.cumsum(counts)])
    rank = (np.arange(offsets[-1]) - np.repeat(offsets[:-1], counts))[:, None]
    bend = rng.normal(0, 0.0004, (offsets[-1], 3)) * rank
    points = np.repeat(roots, counts, axis=0) + 0.004 * rank * np.repeat(up, counts, axis=0) + bend
    packed = Strands(
        points,
        offsets,
        widths=rng.uniform(4e-5, 1e-4, offsets[-1]),
        root_uv=rng.uniform(0.1, 0.9, (strands, 2)),
        group=rng.integers(0, 3, strands),
        guide=np.arange(strands) % 3 != 1,
    )
    head = replace(
        bare.head,
        capsules=_capsules(),
        joints=bare.head.joints + np.float32(0.01),
        density=rng.uniform(0.2, 1.0, len(bare.head.vertices)),
        maps=SkinMaps(
            Texture.encode(rng.integers(0, 255, (16, 16, 3), np.uint8)),
            *(Texture.encode(rng.integers(0, 255, size, np.uint8)) for size in _MAP_SIZES),
        ),
        blendshapes=tuple(
            Blendshape(name, rng.normal(0, 1e-3, bare.head.vertices.shape))
            for name in ("smile", "jaw_open")
        ),
    )
    return Groom(
        replace(packed, colours=_streaked(packed)),
        head,
        bare.root_triangle[index],
        bare.root_barycentric[index],
        LOOK,
        HairPhysics(0.31, 0.72, 0.023, 0.17, 9.0),
        (Tie(np.array([0.1, 0.2, -0.4]), np.array([0.6, 0.0, -0.8]), 0.011, "braid"),),
    )


def _streaked(strands: Strands) -> Float32Array:
    """Return colours (P, 3) that differ by strand; roots and tips have LOOK's in the mean."""
    streak = np.linspace(-0.05, 0.05, len(strands), dtype=np.float32)
    own: Float32Array = colours(LOOK, strands).at() + streak[strands.strand_of_point, None]
    return own


def with_degenerate(groom: Groom) -> Groom:
    """Return the groom with all points of its first strand at the root."""
    points = groom.strands.points.copy()
    points[: groom.strands.offsets[1]] = points[0]
    return replace(groom, strands=replace(groom.strands, points=points))


def _capsules() -> Capsules:
    return Capsules(
        np.array([[0, 0.01, 0], [0, -0.1, -0.02]], np.float32),
        np.array([[0, -0.03, 0.01], [0, -0.2, -0.01]], np.float32),
        np.array([[0.09, 0.08], [0.05, 0.04]], np.float32),
    )
