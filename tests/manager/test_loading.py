"""Laws of plugins that break the contract: refused when they are loaded, in one line."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

from hairkit.cli import main
from hairkit.errors import HairkitError
from hairkit.manager import Manager

HEAD = """
from __future__ import annotations
import sys
from dataclasses import dataclass, field
from hairkit import hookimpl
from hairkit.io.file_format import FileFormat
from hairkit.options import option
"""
HOOK = """
@hookimpl
def orient(view, mask):
    return None
"""
OPTIONS = "@dataclass(frozen=True)\nclass Options:\n    "

BROKEN = {
    "SyntaxError: ": "def (",
    "IndentationError": "def f():\nreturn 1",
    "ModuleNotFoundError: No module named 'nowhere'": "import nowhere",
    "SystemExit: 3": "import sys; sys.exit(3)",
    "GeneratorExit": "raise GeneratorExit",
    "source code string cannot contain null bytes": "x = '\0'",
    "it implements no hook": "x = 1",
    "no hook 'oreint' (did you mean 'orient'?)": "@hookimpl\ndef oreint(view): pass",
    "no hook 'enhance'": "@hookimpl(specname='enhance')\ndef f(view): pass",
    "orient: no argument 'photo'; valid: view, mask, options": "@hookimpl\ndef orient(photo): pass",
    "orient: no argument 'masks' (did you mean 'mask'?)": "@hookimpl\ndef orient(masks): pass",
    "argument 'options' would never be passed": "@hookimpl\ndef orient(view, options=None): pass",
    "argument 'mask' would never be passed": "@hookimpl\ndef orient(view, *, mask): pass",
    "orient takes *rest; name the arguments": "@hookimpl\ndef orient(**rest): pass",
    "orient is no plain function": "@hookimpl\nasync def orient(view): pass",
    "remove async or yield": "@hookimpl\ndef orient(view):\n    yield view",
    "its Options is not a frozen dataclass": HOOK + "class Options: pass",
    "its Options is not a frozen": HOOK
    + "@dataclass\nclass Options:\n    x: int = option(1, doc='')",
    "Options is not a frozen dataclass": HOOK + OPTIONS + "x: int = 1\nOptions = Options()",
    "its Options.x has no default": HOOK + OPTIONS + "x: int",
    "Options.x has no default": HOOK + OPTIONS + "x: str = field(default_factory=str)",
    "its Options.x is of type": HOOK + OPTIONS + "x: dict[str, int] = option(None, doc='')",
    "name 'Nothing' is not defined": HOOK + OPTIONS + "x: Nothing = option(None, doc='')",
    "its Options: option x is 9, expected": HOOK + OPTIONS + "x: int = option(9, high=3, doc='')",
    "its Options: option x is 'a', expected": HOOK + OPTIONS + "x: int = option('a', doc='')",
    "its Options: option x is 'c', expected one of a, b": HOOK
    + OPTIONS
    + "x: str = option('c', choices=('a', 'b'), doc='')",
    "its FORMAT is not a hairkit": HOOK + "FORMAT = '.abc'",
    "its FORMAT has the ending 'abc'": HOOK + "FORMAT = FileFormat('A', ('abc',))",
    "FORMAT has the ending '.ABC'": HOOK + "FORMAT = FileFormat('A', ('.ABC',))",
    "its FORMAT has the ending '.', expected": HOOK + "FORMAT = FileFormat('A', '.abc')",
}
"""What the error says -> a plugin file."""


@pytest.mark.parametrize("reason", BROKEN)
def test_a_broken_plugin_file_is_one_line(
    reason: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Exit code 2, one line with the file and the reason; no module of it is left behind."""
    path = tmp_path / "mine.py"
    path.write_text(BROKEN[reason] if "'\0'" in BROKEN[reason] else HEAD + BROKEN[reason])
    assert main(["plugins", "--plugin", str(path)]) == 2
    printed = capsys.readouterr()
    assert printed.out == ""
    assert printed.err.startswith(f"hairkit: --plugin {path}: ")
    assert reason in printed.err
    assert printed.err.count("\n") == 1
    assert "Traceback" not in printed.err


@pytest.mark.parametrize("name", ["gabor", "none", "a.b", "my method", "1st", "a=b", "a,b"])
def test_a_file_needs_a_name_of_its_own(
    name: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """A name that is taken, or that --set could not spell, is refused: rename it."""
    path = tmp_path / f"{name}.py"
    path.write_text(HEAD + HOOK)
    assert main(["plugins", "--plugin", str(path)]) == 2
    printed = capsys.readouterr().err
    assert "rename" in printed
    assert repr(name) in printed


def test_two_files_of_one_name_are_told_apart(tmp_path: Path) -> None:
    """The second is refused, and the message names the first."""
    paths = [tmp_path / folder / "mine.py" for folder in "ab"]
    for path in paths:
        path.parent.mkdir()
        path.write_text(HEAD + HOOK)
    with pytest.raises(HairkitError, match="already loaded from") as caught:
        Manager.loaded(paths, autoload=False)
    assert str(paths[0]) in str(caught.value)
    assert str(paths[1]) in str(caught.value)


def test_a_file_that_failed_is_not_kept(tmp_path: Path) -> None:
    """Mended, it loads in the same process."""
    path = tmp_path / "mended_later.py"
    path.write_text("raise ValueError")
    with pytest.raises(HairkitError):
        Manager.loaded([path], autoload=False)
    assert "hairkit_plugin_file_mended_later" not in sys.modules
    path.write_text(HEAD + HOOK + "# mended\n")
    assert Manager.loaded([path], autoload=False).names("orient")[-1] == "structure_tensor"
    assert "mended_later" in Manager.loaded([path], autoload=False).names("orient")


CHECKED = (
    HEAD
    + HOOK
    + OPTIONS
    + """low: int = option(1, low=0, high=9, doc="")
    high: int = option(5, low=0, high=9, doc="")

    def __post_init__(self):
        if self.low > self.high:
            raise WHAT
"""
)


@pytest.mark.parametrize(
    ("what", "said"),
    [
        ("ValueError(f'low is {self.low},\\nabove high')", "orient] mine: low is 7, above high"),
        ("KeyError('low')", "orient] mine: its Options failed: KeyError: 'low'"),
        ("SystemExit(0)", "orient] mine: its Options failed: SystemExit: 0"),
    ],
)
def test_options_that_do_not_go_together_are_refused_before_any_stage(
    what: str, said: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """`Options.__post_init__` speaks before the photos are read: exit code 2, one line."""
    path = tmp_path / "mine.py"
    path.write_text(CHECKED.replace("WHAT", what))
    words = ["reconstruct", str(tmp_path / "no photos"), "-o", str(tmp_path / "out")]
    words += ["--plugin", str(path), "--set", "orient=mine", "--set", "mine.low=7"]
    assert main(words) == 2
    printed = capsys.readouterr().err
    assert said in printed
    assert printed.count("\n") == 1
    assert not (tmp_path / "out").exists()
