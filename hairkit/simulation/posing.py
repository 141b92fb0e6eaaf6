"""A groom at one frame of a simulation."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from hairkit.errors import InputError
from hairkit.head_model.skinning import HEAD_JOINT, head_weights
from hairkit.types.groom import Groom
from hairkit.types.point_cache import PointCache


def pose_groom(groom: Groom, cache: PointCache, frame: int) -> Groom:
    """Return the groom, hair and head, as it is at a frame of its simulation.

    The head's vertices follow the head joint by their skin weights, so that the neck bends.
    Negative frames count from the last. Raises `InputError` where the cache has no such frame or
    is of another groom.
    """
    if not -len(cache) <= frame < len(cache):
        raise InputError(f"frame {frame} of a cache of {len(cache)} frames, 0 to {len(cache) - 1}")
    points = cache.points[frame]
    if len(points) != len(groom.strands.points):
        raise InputError(
            f"a cache of {len(points)} points, the groom has {len(groom.strands.points)};"
            " give the groom that was simulated"
        )
    motion, rest = cache.head_from_rest[frame], groom.head.vertices
    weight = head_weights(groom.head)[:, HEAD_JOINT, None]
    moved = rest @ motion[:3, :3].T + motion[:3, 3]
    vertices = (rest + weight * (moved - rest)).astype(np.float32)
    head = replace(groom.head, vertices=vertices)
    return replace(groom, strands=replace(groom.strands, points=points), head=head)
