"""Records whose fields hold the numbers of many strands or points side by side, for kernels.

Compilers make vector instructions of loops over the `LANES` of a record, whose fields lie at known
distances in memory. Its fields are those of a class, with the types `One` to `Four`.
"""

from __future__ import annotations

from typing import Annotated, Any, get_type_hints

import numpy as np
import numpy.typing as npt

from hairkit.arrays import Float64Array
from hairkit.parallel import compiled_with
from hairkit.simulation.vectors import Floats, Frame, Vector, inlined

LANES = 64
"""Strands or points in a record. Compilers make vector instructions of loops over so many; shorter
ones they unroll into instructions for single numbers."""
Kind = type[np.float32] | type[np.float64]
"""Precision of a record."""
KINDS: tuple[Kind, ...] = (np.float32, np.float64)
One = Annotated[Floats, 1]
"""(LANES,) numbers of the strands."""
Two = Annotated[Floats, 2]
"""(2, LANES) pairs."""
Three = Annotated[Floats, 3]
"""(3, LANES) vectors."""
Four = Annotated[Floats, 4]
"""(4, LANES) quaternions or planes."""
Records = npt.NDArray[np.void]
"""Records of strands side by side, one for each node."""
stage = compiled_with(fastmath=True)
"""Compiles one step of a method, by itself."""


def sizes_of(record: type) -> dict[str, int]:
    """Return how many numbers of a strand each field of a record holds."""
    hints = get_type_hints(record, include_extras=True)
    return {name: hint.__metadata__[0] for name, hint in hints.items()}


def lanes_of(record: type) -> dict[Kind, np.dtype[Any]]:
    """Return the types of records whose fields hold `LANES` numbers, or as many vectors."""
    fields = sizes_of(record).items()
    shapes = [(name, (size, LANES) if size > 1 else (LANES,)) for name, size in fields]
    return {kind: np.dtype([(name, kind, shape) for name, shape in shapes]) for kind in KINDS}


def pack_lanes(values: Floats, kind: Kind) -> Floats:
    """Return values (S, ...) of strands as (B, ..., LANES); the last strand fills blocks."""
    rows = np.minimum(np.arange(-(-len(values) // LANES) * LANES), len(values) - 1)
    spread = values.astype(kind)[rows].reshape(-1, LANES, *values.shape[1:])
    return np.ascontiguousarray(np.moveaxis(spread, 1, -1))


def fill_lanes(records: Records, **values: Float64Array) -> None:
    """Set fields of records (B, n) to values (S, n, ...) of strands."""
    for name, value in values.items():
        records[name] = pack_lanes(value, records[name].dtype.type)


@inlined
def three(field: Floats, w: int) -> Vector:
    """Return the vector of lane w in a field (3, LANES)."""
    return field[0, w], field[1, w], field[2, w]


@inlined
def four(field: Floats, w: int) -> Frame:
    """Return the quaternion of lane w in a field (4, LANES)."""
    return field[0, w], field[1, w], field[2, w], field[3, w]


@inlined
def put(field: Floats, w: int, value: Vector) -> None:
    """Store a vector of lane w."""
    field[0, w], field[1, w], field[2, w] = value[0], value[1], value[2]


@inlined
def put_four(field: Floats, w: int, value: Frame) -> None:
    """Store a quaternion of lane w."""
    field[0, w], field[1, w], field[2, w], field[3, w] = value
