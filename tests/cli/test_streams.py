"""Laws of the standard streams: any of them may be closed, and no file's bytes reach a terminal."""

from __future__ import annotations

import logging
import subprocess
import sys
from pathlib import Path

import pytest

from hairkit.cli import explain, main
from hairkit.errors import FormatError

ENTRY = [sys.executable, "-m", "hairkit"]
HOSTILE = "\x1b[2Jgone\0\a\ud800"


@pytest.mark.parametrize("closed", ["<&-", ">&-", "2>&-", "<&- >&- 2>&-"])
def test_closed_streams_cost_no_command(closed: str, tmp_path: Path) -> None:
    """A daemon's command ends as any other does, and none of its files takes what it prints."""
    line = f'exec "$@" {closed}'
    words = [*ENTRY, "new-plugin", "orient", "mine", "-o", str(tmp_path / "made")]
    ended = subprocess.run(["sh", "-c", line, "sh", *words], cwd=tmp_path, check=False)
    assert ended.returncode == 0
    assert list((tmp_path / "made").rglob("*.py"))
    words = [*ENTRY, "info", str(tmp_path / "none.npz")]
    assert subprocess.run(["sh", "-c", line, "sh", *words], check=False).returncode == 2


def test_control_characters_reach_no_terminal(caplog: pytest.LogCaptureFixture) -> None:
    """Errors and warnings that quote a file are one line of characters that can be printed."""
    line, code = explain(FormatError(f"x.abc: {HOSTILE}\nno groom"))
    assert code == 2
    assert line.isprintable()
    assert "gone" in line
    main(["--version-of-nothing"])
    (handler,) = logging.getLogger("hairkit").handlers
    record = logging.LogRecord("hairkit", logging.WARNING, "", 0, "x.abc: %s", (HOSTILE,), None)
    assert handler.format(record).isprintable()


def test_info_shows_names_of_files_as_text(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """A name within a file that would clear the screen is shown as an escape."""
    path = tmp_path / "hair.ply"
    path.write_bytes(f"ply\nformat {HOSTILE} 1.0\n".encode(errors="surrogatepass"))
    assert main(["info", str(path)]) == 2
    assert capsys.readouterr().err.strip().isprintable()


@pytest.mark.parametrize(
    "words", [["reconstruct", "photos", "-o", "\udcffout"], ["export", "a.npz", "-o", "\udcff.glb"]]
)
def test_names_that_are_not_utf8_are_refused_at_once(
    words: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    """Before any work one line names the file, however its bytes are to be shown."""
    assert main(words) == 2
    assert (
        capsys.readouterr().err
        == f"hairkit: {ascii(words[-1])[1:-1]}: its name is not UTF-8;"
        + (" rename the file or its folder\n")
    )
