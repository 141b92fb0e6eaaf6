"""What tests of several rooms need."""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path

import hypothesis
import numpy as np
import pytest

from hairkit.head_model import photo_skin
from hairkit.manager import Manager

# No deadline: what is slow on a busy machine is not wrong.
hypothesis.settings.register_profile("hairkit", deadline=None, max_examples=50)
hypothesis.settings.load_profile("hairkit")

PROJECT = Path(__file__).parents[1]


@pytest.fixture(scope="session")
def captures() -> Path:
    """The folder of captures with truth, which does not ship with the project."""
    named = os.environ.get("HAIRKIT_CAPTURES")
    if not named:
        pytest.skip("HAIRKIT_CAPTURES names no folder of captures with truth")
    return Path(named)


@pytest.fixture(scope="session", autouse=True)
def small_skins() -> Iterator[None]:
    """Skins from photos of a quarter of the edge: the work of whole runs is mostly their texels."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(photo_skin, "SIZE", 512)
        patch.setattr(photo_skin, "COARSE", 256)
        yield


@pytest.fixture(scope="session")
def project() -> Path:
    """The project's checkout."""
    return PROJECT


@pytest.fixture(scope="session")
def manager() -> Manager:
    """The plugins that ship with hairkit; not for tests that register others."""
    return Manager.loaded(autoload=False)


@pytest.fixture
def rng() -> np.random.Generator:
    """Return a generator with a fixed seed."""
    return np.random.default_rng(7)
