"""The native groom: an npz file that anything with NumPy can read, and that loses nothing.

`points` (P, 3) and `offsets` (S + 1,) stand at the top, with `widths`, `root_uv`, `group`, `guide`,
`root_triangle` and `root_barycentric`; the rest is named `head.vertices`, `material.width`, ...
"""

from __future__ import annotations

import os

import numpy as np

from hairkit.errors import FormatError
from hairkit.storage import from_arrays, read_npz, to_arrays, write_npz
from hairkit.types.groom import Groom

_VERSION, _NEWEST = "hairkit_groom", 1
_STRANDS = "strands."
_AT_TOP = ("points", "offsets", "widths", "root_uv", "group", "guide")


def write_groom(path: str | os.PathLike[str], groom: Groom) -> None:
    """Write the groom, atomically; equal grooms give equal files."""
    arrays = {name.removeprefix(_STRANDS): array for name, array in to_arrays(groom).items()}
    write_npz(path, arrays | {_VERSION: np.asarray(_NEWEST)})


def read_groom(path: str | os.PathLike[str]) -> Groom:
    """Read what `write_groom` wrote; raises `FormatError` naming `path` for anything else."""
    arrays = read_npz(path)
    version = arrays.pop(_VERSION, None)
    if version is None or not {"points", "offsets"} <= set(arrays):
        raise FormatError(f"{path}: not a groom of hairkit; expected what `reconstruct` wrote")
    if version.shape != () or version != _NEWEST:
        raise FormatError(f"{path}: a groom of version {version}, this hairkit reads {_NEWEST}")
    named = {_STRANDS + name if name in _AT_TOP else name: arrays[name] for name in arrays}
    return from_arrays(Groom, named, str(path))
