"""Laws of what benchmarks/simulation.py compares: `rods`, and `pbd` as its peer."""

from __future__ import annotations

import importlib.util
import sys
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

from hairkit.types.groom import Groom


@pytest.fixture
def simulation(project: Path, monkeypatch: pytest.MonkeyPatch) -> ModuleType:
    """The program as a module."""
    path = project / "benchmarks" / "simulation.py"
    monkeypatch.syspath_prepend(path.parent)
    spec = importlib.util.spec_from_file_location("simulation", path)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    monkeypatch.setitem(sys.modules, "simulation", module)
    spec.loader.exec_module(module)
    return module


@pytest.fixture
def scene(simulation: ModuleType) -> Groom:
    """Return a few guides."""
    groom: Groom = simulation.groom_of(20)
    return groom


def test_more_substeps_of_the_peer_are_nearer_to_the_converged(
    simulation: ModuleType, scene: Groom
) -> None:
    """Distance and stretch fall with the substeps; a motion is no way off itself."""
    (coarse, much), (fine, less), (converged, _) = (
        simulation.moved(simulation.peer(scene, setting), scene, 6)
        for setting in ((4, 4), (16, 4), (64, 4))
    )
    rest = simulation.rest_of(scene)
    assert simulation.off_by(fine, converged) < 0.5 * simulation.off_by(coarse, converged)
    assert less < 0.5 * much
    assert simulation.off_by(fine, fine) == 0.0
    assert simulation.stretch_of(rest[None], rest) == 0.0


def test_all_run_on_the_same_head(simulation: ModuleType, scene: Groom) -> None:
    """Roots of rods and of its peer are where the head takes them, at every frame."""
    frames, rest = 3, simulation.rest_of(scene)
    heads = simulation.heads_of(scene, frames, 1)
    wanted = np.stack([rest[:, 0] @ head[:3, :3].T + head[:3, 3] for head in heads])
    for simulator in (
        simulation.ours(scene, 1),
        simulation.peer(scene, (2, 1)),
    ):
        points, _ = simulation.moved(simulator, scene, frames)
        np.testing.assert_allclose(points[:, :, 0], wanted, atol=1e-6)
    assert np.abs(wanted - rest[:, 0]).max() > 1e-3


def test_the_cheapest_row_that_is_good_enough_is_compared(simulation: ModuleType) -> None:
    """Faster rows that stretch more do not count; where none is good enough, that is said."""
    rows = [
        simulation.Row(("rods", 4, 1), 300.0, 0.003, 0.002, 0.001),
        simulation.Row((simulation.XPBD, 4, 4), 50.0, 0.02, 0.02, 0.001),
        simulation.Row((simulation.XPBD, 8, 4), 20.0, 0.03, 0.008, 0.002),
        simulation.Row((simulation.XPBD, 16, 4), 10.0, 0.06, 0.007, 0.001),
    ]
    equal, as_near, below = simulation.verdicts(rows)
    assert equal.endswith("no setting gets there")
    assert "16 x 4" in as_near
    assert "8 x 4" in below
    assert "15.0 times as fast, by processor time 10.0" in below
