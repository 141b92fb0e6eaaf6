"""Laws of the peers that benchmarks/simulation.py compares rods with."""

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
    rest = simulation.few(simulation.rest_of(scene))
    coarse, fine, converged = (
        simulation.peer_moved(scene, setting, 6) for setting in ((4, 4), (16, 4), (64, 4))
    )
    assert simulation.off_by(fine, converged) < 0.5 * simulation.off_by(coarse, converged)
    assert simulation.stretch_of(fine, rest) < 0.5 * simulation.stretch_of(coarse, rest)
    assert simulation.off_by(fine, fine) == 0.0
    assert simulation.stretch_of(rest[None], rest) == 0.0


def test_all_run_on_the_same_head(simulation: ModuleType, scene: Groom) -> None:
    """Roots of rods and of its peer are where the head takes them, at every frame."""
    frames, rest = 3, simulation.few(simulation.rest_of(scene))
    heads = simulation.heads_of(scene, frames, 1)
    wanted = np.stack([rest[:, 0] @ head[:3, :3].T + head[:3, 3] for head in heads])
    ours, _ = simulation.ours_moved(scene, "reference", 1, frames)
    peer = simulation.peer_moved(scene, (2, 1), frames)
    picked = simulation.few(np.moveaxis(ours, 1, 0))[:, :, 0].swapaxes(0, 1)
    np.testing.assert_allclose(picked, wanted, atol=1e-6)
    np.testing.assert_allclose(peer[:, :, 0], wanted, atol=1e-6)
    assert np.abs(wanted - rest[:, 0]).max() > 1e-3


def test_the_cheapest_row_that_is_good_enough_is_compared(simulation: ModuleType) -> None:
    """Faster rows that stretch more do not count; where none is good enough, that is said."""
    rows = [
        simulation.Row(("rods fast", 4, 1), 300.0, 0.003, 0.002, 0.001),
        simulation.Row((simulation.XPBD, 4, 4), 50.0, 0.02, 0.02, 0.001),
        simulation.Row((simulation.XPBD, 8, 4), 20.0, 0.03, 0.008, 0.002),
        simulation.Row((simulation.XPBD, 16, 4), 10.0, 0.06, 0.007, 0.001),
    ]
    equal, as_near, below = simulation.verdicts(rows)
    assert equal.endswith("no setting gets there")
    assert "16 x 4" in as_near
    assert "8 x 4" in below
    assert "15.0 times as fast, by processor time 10.0" in below


def test_the_peer_stays_out_of_the_head(simulation: ModuleType, scene: Groom) -> None:
    """With contact no node gets nearer than it was or 2 mm, but for half a millimetre."""
    obstacles, rest = (
        simulation.head_obstacles(scene.head),
        simulation.few(simulation.rest_of(scene)),
    )
    least = np.minimum(obstacles.at(rest.reshape(-1, 3))[0], 0.002).reshape(rest.shape[:2])
    deepest = []
    for contact in (True, False):
        points = simulation.peer_moved(scene, (16, 5), 20, contact=contact)
        head = simulation.heads_of(scene, 20, 1)[-1]
        local = (points[-1] - head[:3, 3]) @ head[:3, :3]
        distance = obstacles.at(local.reshape(-1, 3))[0].reshape(least.shape)
        deepest.append(float((least - distance).max()))
    assert deepest[0] < 5e-4 < deepest[1]
