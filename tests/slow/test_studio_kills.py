"""Laws of the program that kills the studio's processes: it finds them all, counts what stays."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

PARENT = """
import subprocess, sys
child = subprocess.Popen([sys.executable, "-c", sys.argv[1]], stdin=subprocess.PIPE)
print(child.pid, flush=True)
child.wait()
"""
ENDS, STAYS = "import sys; sys.stdin.read()", "import time; time.sleep(20)"
"""Children that end when their parent does, and that do not."""


@pytest.fixture
def program(monkeypatch: pytest.MonkeyPatch) -> Any:
    """The program, impatient."""
    monkeypatch.syspath_prepend(str(Path(__file__).parent))
    import studio_kills

    monkeypatch.setattr(studio_kills, "SPACING_S", (0.0, 0.01))
    monkeypatch.setattr(studio_kills, "END_S", 2.0)
    return studio_kills


@pytest.mark.parametrize(("child", "orphans"), [(ENDS, 0), (STAYS, 1)])
def test_processes_that_outlive_their_server_are_counted(
    program: Any, child: str, orphans: int
) -> None:
    """A killed server's children are looked for until the time is over."""
    command = [sys.executable, "-c", PARENT, child]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as server:
        assert server.stdout is not None
        pid = int(server.stdout.readline())
        assert program._descendants(server.pid) == [pid]
        story = SimpleNamespace(studio=SimpleNamespace(process=server), doing="a stroke")
        killer = program.Killer(story, 1, np.random.default_rng(2))
        killer.generator = SimpleNamespace(uniform=lambda *_: 0.0, random=lambda: 1.0)
        killer.run()
        assert [row[:2] for row in killer.rows] == [("server", "a stroke")]
        assert killer.orphans == orphans
        server.wait()
    if orphans:
        program.os.kill(pid, program.signal.SIGKILL)


def test_what_was_confirmed_and_is_gone_is_told(program: Any, tmp_path: Path) -> None:
    """A stroke that is not in its file, and a width that is not in capture.toml, are lost."""
    story = program.Story(tmp_path, None, drawn={1: 7}, width_mm=0.08)
    story.check()
    assert story.lost == ["stroke on photo 1", "width 0.08 mm: None"]
