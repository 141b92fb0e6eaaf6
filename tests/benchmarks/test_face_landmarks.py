"""Laws of the program that makes the table of landmarks."""

from __future__ import annotations

import importlib.util
import sys
from dataclasses import replace
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest
from hairkit_plugins.face_mesh.landmark_table import MIRROR

from hairkit.nets.model_folder import missing_models

PROJECT = Path(__file__).parents[2]


@pytest.fixture(scope="module")
def program() -> ModuleType:
    """The program as a module."""
    path = PROJECT / "benchmarks" / "face_landmarks.py"
    spec = importlib.util.spec_from_file_location("face_landmarks", path)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules["face_landmarks"] = module
    spec.loader.exec_module(module)
    return module


def made_up(program: ModuleType, count: int) -> list[Any]:
    """Return samples whose landmarks are the middles of two mesh points each."""
    rng = np.random.default_rng(5)
    base = rng.uniform(0, 100, (468, 3))
    samples = []
    for index in range(count):
        mesh = base + rng.normal(0, 2, base.shape)
        landmarks = (mesh[:68, :2] + mesh[100:168, :2]) / 2
        other = base + rng.normal(0, 2, base.shape)
        other[:68], other[100:168] = mesh[:68][MIRROR], mesh[100:168][MIRROR]
        meshes = np.stack([mesh, other])
        samples.append(program.Sample(str(index), 0.0, 0.0, meshes, landmarks, 100.0, 1080))
    return samples


def test_weights_sum_to_one_and_few_points_have_any(program: ModuleType) -> None:
    """Each landmark is a weighted mean of the points around it."""
    weights = program.fit_weights(made_up(program, 6))
    assert np.allclose(weights.sum(axis=1), 1)
    assert (np.count_nonzero(weights, axis=1) <= program.POINTS).all()


def test_heads_left_out_are_not_seen_by_the_fit(program: ModuleType) -> None:
    """The error of a sample does not change when its own landmarks do."""
    samples = made_up(program, 6)
    errors, _ = program.measure_left_out(samples)
    moved = [replace(samples[0], landmarks=samples[0].landmarks + 50), *samples[1:]]
    assert np.allclose(program.measure_left_out(moved)[0][0], errors[0] - 50)


@pytest.mark.skipif(bool(missing_models(["face_landmark"])), reason="networks are not installed")
def test_it_prints_its_table(
    program: ModuleType,
    captures: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    """On captures with truth, eyes and inner points are found and nothing behind the head."""
    monkeypatch.setattr("sys.argv", ["face_landmarks.py", str(captures)])
    program.main()
    lines = capsys.readouterr().out.splitlines()
    cells = [[cell.strip() for cell in line.split("|")[1:-1]] for line in lines[2:4]]
    for row in cells:
        assert float(row[2]) < 6
        assert float(row[3]) < 10
    assert float(lines[-1].rpartition(" ")[2]) < 0.3
