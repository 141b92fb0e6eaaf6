"""Hair as helix arcs: a compact, lossy form of strands, and what super-helices start from.

A strand is a root point, a frame there and, for each arc, its length and the Darboux vector in the
frame that travels along: torsion about the tangent and two curvatures about the normals. 16 bytes
an arc; neighbouring arcs share point and frame by construction.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from hairkit.arrays import Float32Array, Float64Array, Int64Array, frozen_array
from hairkit.errors import InputError
from hairkit.helices.arc_counts import TOLERANCE, adaptive_counts
from hairkit.helices.arc_length import Path, unit
from hairkit.helices.floating_tangents import Arcs, fit_arcs
from hairkit.helices.helix import mean_rotation, rotation
from hairkit.storage import Stored
from hairkit.types.strands import Strands


@dataclass(frozen=True, eq=False)
class HelixStrands(Stored):
    """Strands as arcs of constant curvature and torsion, packed like `Strands`."""

    roots: Float32Array
    """(S, 3) metres, head frame."""
    frames: Float32Array
    """(S, 3, 3) columns: tangent and two normals at the root, orthonormal, right-handed."""
    torsions: Float32Array
    """(A,) turn about the tangent, radians per metre."""
    curvatures: Float32Array
    """(A, 2) turn about the two normals, radians per metre."""
    lengths: Float32Array
    """(A,) metres."""
    offsets: Int64Array
    """(S + 1,) ascending, first 0, last A: strand s has arcs `offsets[s]` to `offsets[s + 1]`."""

    def __post_init__(self) -> None:
        offsets = frozen_array(self.offsets, np.int64, (None,), "helix offsets")
        if not len(offsets) or offsets[0] != 0 or (np.diff(offsets) < 1).any():
            raise InputError("helix offsets must start at 0 and give each strand an arc or more")
        strands, arcs = len(offsets) - 1, int(offsets[-1])
        shapes = {
            "roots": (strands, 3),
            "frames": (strands, 3, 3),
            "torsions": (arcs,),
            "curvatures": (arcs, 2),
            "lengths": (arcs,),
        }
        object.__setattr__(self, "offsets", offsets)
        for name, shape in shapes.items():
            array = frozen_array(getattr(self, name), np.float32, shape, f"helix {name}")
            object.__setattr__(self, name, array)

    def __len__(self) -> int:
        return len(self.offsets) - 1

    @property
    def darboux(self) -> Float64Array:
        """(A, 3) torsion and both curvatures: Darboux vectors in the travelling frame."""
        return np.column_stack([self.torsions, self.curvatures]).astype(np.float64)

    @classmethod
    def from_arcs(cls, arcs: Arcs) -> HelixStrands:
        """Take the arcs' Darboux vectors into frames that travel along the strands."""
        root, local = travelling(arcs)
        return cls(
            arcs.points[arcs.offsets[:-1]].astype(np.float32),
            root.astype(np.float32),
            local[:, 0].astype(np.float32),
            local[:, 1:].astype(np.float32),
            arcs.lengths.astype(np.float32),
            arcs.offsets,
        )

    @classmethod
    def from_strands(cls, strands: Strands, tolerance: float = TOLERANCE) -> HelixStrands:
        """Return helices within `tolerance`, metres, of the strands on average along each."""
        return cls.from_arcs(fit_arcs(strands, adaptive_counts(strands, tolerance)))

    def arcs(self) -> Arcs:
        """Return where the arcs lie, by moving point and frame along each strand."""
        turns = self.darboux * self.lengths[:, None].astype(np.float64)
        rotations, step = rotation(turns), mean_rotation(turns)[..., 0] * self.lengths[:, None]
        frames, points = np.empty((len(turns), 3, 3)), np.empty((len(turns), 3))
        for here, before, strand in _ranks(self.offsets):
            if before is None:
                frames[here], points[here] = self.frames[strand], self.roots[strand]
            else:
                frames[here] = frames[before] @ rotations[before]
                points[here] = points[before] + (frames[before] @ step[before, :, None])[..., 0]
        world = (frames @ self.darboux[..., None])[..., 0]
        return Arcs(points, frames[..., 0], world, self.lengths.astype(np.float64), self.offsets)

    def to_strands(self, step: float = 0.004) -> Strands:
        """Return strands with points at most `step` metres apart, the arcs' ends among them."""
        if not step > 0:
            raise InputError(f"step along the helices is {step}, expected metres above 0")
        pieces = np.maximum(np.ceil(self.lengths / step - 1e-6), 1).astype(np.int64)
        last = np.zeros(len(pieces), np.int64)
        last[self.offsets[1:] - 1] = 1
        arc = np.repeat(np.arange(len(pieces)), pieces + last)
        start = np.cumsum(pieces + last) - (pieces + last)
        share = (np.arange(len(arc)) - start[arc]) / pieces[arc]
        counts = np.add.reduceat(pieces + last, self.offsets[:-1])
        points, _ = self.arcs().at(arc, share)
        return Strands(points.astype(np.float32), np.concatenate([[0], np.cumsum(counts)]))


def smooth_strands(strands: Strands, tolerance: float) -> Strands:
    """Return the strands on helix arcs within `tolerance` metres on average along each.

    Point counts, roots, widths and groups stay; every tracker's strands can be smoothed by it.
    """
    counts = adaptive_counts(strands, tolerance)
    path = Path.of(strands)
    arcs = fit_arcs(path, counts)
    strand = strands.strand_of_point
    place = path.arc / np.maximum(path.lengths, 1e-12)[strand] * counts[strand]
    rank = np.minimum(place.astype(np.int64), counts[strand] - 1)
    points, _ = arcs.at(arcs.offsets[:-1][strand] + rank, place - rank)
    points[strands.offsets[:-1]] = strands.roots
    return replace(strands, points=points.astype(np.float32))


def travelling(arcs: Arcs) -> tuple[Float64Array, Float64Array]:
    """Return frames (S, 3, 3) at the roots and Darboux vectors (A, 3) in frames that travel along.

    Columns of the frames: tangent and two normals; so the vectors are torsion and two curvatures.
    """
    root = first_frames(arcs.tangents[arcs.offsets[:-1]])
    turns = rotation(arcs.darboux * arcs.lengths[:, None])
    frames = np.empty((len(arcs.lengths), 3, 3))
    for here, before, strand in _ranks(arcs.offsets):
        frames[here] = root[strand] if before is None else turns[before] @ frames[before]
    return root, np.einsum("aji,aj->ai", frames, arcs.darboux)


def first_frames(tangents: Float64Array) -> Float64Array:
    """Return right-handed frames (S, 3, 3) whose first columns are unit tangents (S, 3)."""
    spare = np.eye(3)[np.argmin(np.abs(tangents), axis=-1)]
    normal = unit(np.cross(tangents, spare))
    return np.stack([tangents, normal, np.cross(tangents, normal)], axis=-1)


def _ranks(
    offsets: Int64Array,
) -> list[tuple[Int64Array, Int64Array | None, Int64Array]]:
    """Return, root to tip, the k-th arcs of all strands that have one, those before, strands."""
    counts = np.diff(offsets)
    steps: list[tuple[Int64Array, Int64Array | None, Int64Array]] = []
    for rank in range(int(counts.max(initial=0))):
        strand = np.flatnonzero(counts > rank)
        here = offsets[:-1][strand] + rank
        steps.append((here, None if rank == 0 else here - 1, strand))
    return steps
