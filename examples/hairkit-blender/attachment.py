"""A uv map in which every face of the head has a place of its own.

Blender finds the face that carries a hair by the hair's uv, and gives up where faces overlap in the
map. Heads are unwrapped for textures: the underside of a neck may well lie over the whole scalp.
"""

import numpy as np

_MARGIN = 0.05
"""Free border of a cell, so that rounding takes no root to the next face."""


def face_cells(count):
    """Return (count, 3, 2) uv of the corners of each triangle, one cell of a square grid each."""
    across = int(np.ceil(np.sqrt(count)))
    cell = np.stack([np.arange(count) % across, np.arange(count) // across], axis=1)
    corners = np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]]) * (1 - 2 * _MARGIN) + _MARGIN
    return ((cell[:, None] + corners) / across).astype(np.float32)


def places(cells, triangle, barycentric):
    """Return (S, 2) uv of roots on faces (S,) at weights (S, 3) of their corners."""
    return np.einsum("sk,skc->sc", barycentric, cells[triangle]).astype(np.float32)
