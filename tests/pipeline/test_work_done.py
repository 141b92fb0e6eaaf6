"""Counts of work, which no busy machine disturbs: solver steps, bytes written, memory asked for."""

from __future__ import annotations

import tracemalloc
from collections.abc import Callable
from pathlib import Path
from typing import Any

import ball_plugin
import numpy as np
import pytest
from ball import RECIPE

from hairkit.field import diffusion
from hairkit.grooming.densify import densify
from hairkit.head_model.scalp import sample_roots
from hairkit.head_model.template import default_head
from hairkit.manager import Manager
from hairkit.pipeline.recipe import parse_recipe
from hairkit.pipeline.reconstruct import reconstruct
from hairkit.pipeline.work_folder import WORK
from hairkit.storage import read_npz
from hairkit.testing import ball_head, bristle_groom, turn_capture

STEPS = 20
"""Steps of the solver from the coarse start on the block below; 16 when this was written."""
DENSE_TIMES = 30.0
"""Memory for interpolated hair of five points a strand in multiples of these points; 23.4 when this
was written, most of it for the choice of guides."""


def peak(work: Callable[[], object]) -> int:
    """Return the bytes that work holds at most, arrays of NumPy included."""
    tracemalloc.start()
    try:
        work()
        return tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()


def test_the_coarse_start_saves_solver_steps(monkeypatch: pytest.MonkeyPatch) -> None:
    """The diffusion takes few steps from the coarse solution, several times fewer than from 0."""
    products, product = [], diffusion._product

    def count(*vectors: Any) -> float:
        products.append(1)
        return product(*vectors)

    monkeypatch.setattr(diffusion, "_product", count)
    cells = diffusion.CellGraph.of(np.ones((40, 40, 40), bool))
    weight = np.zeros((40, 40, 40), np.float32)
    weight[0], weight[-1] = 1, 1
    data = np.zeros((len(cells), 1), np.float32)
    data[: 40 * 40] = 1
    taken = []
    for start in (None, np.zeros_like(data)):
        products.clear()
        diffusion.solve_screened(cells, data, weight.ravel(), 1.0, tolerance=1e-2, start=start)
        taken.append(len(products) // 3)  # a step computes three
    assert taken[0] <= STEPS, taken
    assert 3 * taken[0] < taken[1], taken


def test_files_of_stages_hold_their_arrays_and_little_more(tmp_path: Path) -> None:
    """What a run writes is what its results hold: nothing is written twice, or padded."""
    manager = Manager()
    manager.register(ball_plugin, "ball_plugin")
    recipe = parse_recipe(RECIPE.encode(), "ball", "test")
    reconstruct(turn_capture(), tmp_path, recipe, manager, guides=40, head=ball_head(), sheet=False)
    for path in (tmp_path / WORK).glob("*.npz"):
        arrays = read_npz(path)
        assert path.stat().st_size < sum(a.nbytes for a in arrays.values()) + 500 * len(arrays)


def test_memory_of_hair_and_roots_grows_as_they_do() -> None:
    """Twice the hair takes twice the memory, and a known multiple of what is made."""
    groom, head = bristle_groom(), default_head()
    many = densify(groom, 8000)
    peaks = [peak(lambda count=count: densify(groom, count)) for count in (4000, 8000)]
    assert peaks[1] < 2.1 * peaks[0]
    assert peaks[1] < DENSE_TIMES * many.points.nbytes, peaks[1] / many.points.nbytes
    sample_roots(head, 100)
    roots = [peak(lambda count=count: sample_roots(head, count)) for count in (4000, 8000)]
    assert roots[1] < 2.3 * roots[0], roots
