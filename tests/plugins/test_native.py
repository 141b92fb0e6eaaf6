"""The native format loses nothing."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from hairkit.manager import Manager
from hairkit.storage import to_arrays
from hairkit.testing import bristle_groom


def test_export_then_import_gives_the_same_groom(manager: Manager, tmp_path: Path) -> None:
    """Every array comes back equal in every bit."""
    groom, path = bristle_groom(), tmp_path / "a.npz"
    assert manager.call("export_groom", "native", groom=groom, path=path)
    back = to_arrays(manager.call("import_groom", "native", path=path))
    assert all(np.array_equal(array, back[name]) for name, array in to_arrays(groom).items())
