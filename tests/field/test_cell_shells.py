"""The law of grown and shrunk cells: they are SciPy's."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import ndimage

from hairkit.field.cell_shells import dilate_cells, erode_cells


@pytest.mark.parametrize("shape", [(9, 14, 7), (1, 5, 3), (2, 2, 30)])
@pytest.mark.parametrize("rounds", [1, 2, 4])
def test_cells_grow_and_shrink_as_scipys(shape: tuple[int, ...], rounds: int) -> None:
    """Cells at the volume's border are eroded too; the given cells stay as they are."""
    cells = np.random.default_rng(1).random(shape) < 0.3
    before = cells.copy()
    grown = ndimage.binary_dilation(cells, iterations=rounds)
    np.testing.assert_array_equal(dilate_cells(cells, rounds), grown)
    np.testing.assert_array_equal(
        erode_cells(grown, rounds), ndimage.binary_erosion(grown, iterations=rounds)
    )
    np.testing.assert_array_equal(cells, before)
