"""Laws of examples/gallery: each script and notebook runs as it is, and is shown in the docs."""

from __future__ import annotations

import ast
import json
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

PROJECT = Path(__file__).parents[2]
GALLERY = PROJECT / "examples" / "gallery"
EXAMPLES = sorted(path for path in GALLERY.iterdir() if path.suffix in (".py", ".ipynb"))


def code_of(path: Path) -> str:
    """Return the program of a script, or of a notebook's cells one after the other."""
    if path.suffix == ".py":
        return path.read_text()
    cells = json.loads(path.read_text())["cells"]
    return "\n\n".join("".join(c["source"]) for c in cells if c["cell_type"] == "code")


def test_examples_are_numbered_without_gaps() -> None:
    """The names order the gallery: 01_, 02_, ..."""
    numbers = [int(path.name.partition("_")[0]) for path in EXAMPLES]
    assert numbers == list(range(1, len(EXAMPLES) + 1))
    assert {path.suffix for path in EXAMPLES} == {".py", ".ipynb"}


@pytest.mark.parametrize("path", EXAMPLES, ids=lambda path: path.stem)
def test_it_runs(path: Path, tmp_path: Path) -> None:
    """An example ends without an error or a warning, wherever it is started."""
    environment = {**os.environ, "PYTHONWARNINGS": "error"}
    done = subprocess.run(
        [sys.executable, "-c", code_of(path), str(tmp_path / "made")],
        cwd=tmp_path,
        env=environment,
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    assert list(tmp_path.iterdir()), "an example leaves something to look at"


@pytest.mark.parametrize("path", EXAMPLES, ids=lambda path: path.stem)
def test_it_explains_itself(path: Path) -> None:
    """A script has a title and a text; a notebook begins with them and stores no outputs."""
    if path.suffix == ".py":
        title, _, text = (ast.get_docstring(ast.parse(path.read_text())) or "").partition("\n")
        assert re.fullmatch(r"\w.*\.", title)
        assert text.strip()
        return
    cells = json.loads(path.read_text())["cells"]
    assert cells[0]["source"][0].startswith("# ")
    assert not any(cell.get("outputs") for cell in cells)
