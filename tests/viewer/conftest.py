"""A small session without a window: the ball head with bristles, on the trivial simulator."""

from __future__ import annotations

from pathlib import Path

import pytest
import swaying

from hairkit.manager import Manager
from hairkit.testing import bristle_groom
from hairkit.viewer.session import Session


@pytest.fixture
def swaying_manager() -> Manager:
    """A manager that knows only the trivial simulator."""
    manager = Manager()
    manager.register(swaying, "swaying")
    return manager


@pytest.fixture
def session(swaying_manager: Manager, tmp_path: Path) -> Session:
    """A session of 160 x 120 pixels on the bristles."""
    bristle_groom().save(tmp_path / "groom.npz")
    return Session(swaying_manager, tmp_path / "groom.npz", size=(160, 120), hairs=600)
