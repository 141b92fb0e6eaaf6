"""Laws of the times of stages: nothing is counted twice, and nothing is lost."""

from __future__ import annotations

import importlib.util
from pathlib import Path
from types import ModuleType

import pytest

PROGRAM = Path(__file__).parents[2] / "benchmarks" / "stages.py"


@pytest.fixture(scope="module")
def stages() -> ModuleType:
    """The program, as a module."""
    spec = importlib.util.spec_from_file_location("stages", PROGRAM)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_all_time_belongs_to_one_stage(stages: ModuleType) -> None:
    """Time is charged to the stage that ends next; stages that overlap share it in that order."""
    times = iter([1.0, 3.0, 3.5, 7.0, 8.0])
    meter = stages.Meter((lambda: next(times),), (0.5,))
    meter.started("landmarks", 8)
    meter.started("person", 8)
    for stage in ("person", "landmarks", "scene"):
        meter.finished(stage, 99.0, False)
    meter.charge("end")
    assert meter.seconds == {
        "start": [0.5],
        "person": [2.0],
        "landmarks": [0.5],
        "scene": [3.5],
        "end": [1.0],
    }


def test_the_table_ends_with_the_sums(stages: ModuleType) -> None:
    """Every stage of any run has a row; the last row is the whole."""
    first = {"start": [1.0, 2.0], "scene": [3.0, 4.0]}
    lines = stages.table({"first": first, "warm": {"start": [0.5, 0.5]}}).splitlines()
    assert lines[2] == "| start | 1.00 | 2.00 | 0.50 | 0.50 |"
    assert lines[3] == "| scene | 3.00 | 4.00 | 0.00 | 0.00 |"
    assert lines[-1] == "| whole | 4.00 | 6.00 | 0.50 | 0.50 |"
