"""Laws of the command line as a whole."""

from __future__ import annotations

import errno
import importlib
import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from hairkit import cli
from hairkit.errors import InputError
from hairkit.testing import bristle_groom


def let_plugins_raise(monkeypatch: pytest.MonkeyPatch, error: BaseException) -> None:
    """Make `hairkit plugins` raise `error`."""

    def run(_: Any) -> int:
        raise error

    monkeypatch.setattr(importlib.import_module("hairkit.cli.plugins"), "run", run)


def outcome(words: list[str]) -> int:
    """Run the command line and return the exit code, argparse's own exits too."""
    try:
        return cli.main(words)
    except SystemExit as stop:
        return int(str(stop.code))


@pytest.mark.parametrize(
    ("error", "line", "code"),
    [
        (InputError("bad\nphoto"), "bad photo", 2),
        (KeyboardInterrupt(), "interrupted; run it again to continue where it stopped", 2),
        (KeyboardInterrupt("c.npz was not written"), "interrupted; c.npz was not written", 2),
        (
            OSError(errno.ENOSPC, "No space left on device", "out/groom.npz"),
            "out/groom.npz: No space left on device; free some space and run it again",
            2,
        ),
        (PermissionError(errno.EACCES, "Permission denied", "out"), "out: Permission denied", 2),
        (MemoryError("8 GiB"), "out of memory; use smaller pictures or larger voxels (8 GiB)", 2),
        (
            KeyError("x"),
            "unexpected KeyError: 'x'; run it again with --debug to see where",
            1,
        ),
    ],
    ids=lambda value: type(value).__name__,
)
def test_every_error_is_one_line_and_a_code(
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    error: BaseException,
    line: str,
    code: int,
) -> None:
    """What a user can mend ends with 2, a bug with 1; a traceback comes only with --debug."""
    let_plugins_raise(monkeypatch, error)
    assert cli.main(["plugins"]) == code
    output = capsys.readouterr()
    assert output.err == f"hairkit: {line}\n"
    assert output.out == ""
    assert cli.main(["plugins", "--debug"]) == code
    assert "Traceback" in capsys.readouterr().err


def test_a_closed_pipe_is_quiet() -> None:
    """`hairkit plugins | head -0` says nothing on stderr."""
    code = (
        "import sys\n"
        "from hairkit import cli\n"
        "import hairkit.cli.plugins as verb\n"
        "def run(args):\n"
        "    print('x' * 100000, flush=True)\n"
        "    return 0\n"
        "verb.run = run\n"
        "sys.exit(cli.main(['plugins']))\n"
    )
    with subprocess.Popen(
        [sys.executable, "-c", code], stdout=subprocess.PIPE, stderr=subprocess.PIPE
    ) as process:
        assert process.stdout is not None
        assert process.stderr is not None
        process.stdout.close()
        assert process.stderr.read() == b""
        assert process.wait() == 0


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["plugns"], "no command 'plugns' (did you mean 'plugins'?); commands: reconstruct"),
        (["plugins", "--jsno"], "no option '--jsno' (did you mean '--json'?)"),
        (["plugins", "a", "b"], "unexpected argument 'b'"),
        (["new-plugin"], "the following arguments are required: STAGE, NAME"),
        (["plugins", "gabro"], "did you mean 'gabor'?"),
    ],
    ids=str,
)
def test_what_is_misspelt_is_answered_with_what_was_meant(
    capsys: pytest.CaptureFixture[str], words: list[str], said: str
) -> None:
    """Unknown commands, options and plugins are one line with the closest name, exit code 2."""
    assert outcome(words) == 2
    error = capsys.readouterr().err
    assert said in error
    assert error.count("\n") == 1


@pytest.mark.parametrize("verb", cli.VERBS)
def test_help_begins_with_an_example(verb: str, capsys: pytest.CaptureFixture[str]) -> None:
    """`hairkit VERB --help` shows first how the verb is called, and that call can be parsed."""
    assert outcome([verb, "--help"]) == 0
    text = capsys.readouterr().out
    assert f"hairkit {verb}" in text.splitlines()[0]
    assert text.index(f"hairkit {verb}") < text.index("usage:")


@pytest.mark.parametrize("verb", [verb for verb in cli.VERBS if verb != "studio"])
def test_every_verb_speaks_to_programs(verb: str, capsys: pytest.CaptureFixture[str]) -> None:
    """All but the server of pages print JSON when they are asked to."""
    assert outcome([verb, "--help"]) == 0
    assert "--json" in capsys.readouterr().out


def test_what_was_written_is_json(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """One document with the names of the files, which exist, and figures beside them."""
    groom = tmp_path / "groom.npz"
    bristle_groom().save(groom)
    for words, key in (
        (["export", str(groom), "-o", str(tmp_path / "a.obj")], "files"),
        (["convert", str(groom), str(tmp_path / "b.hair")], "strands"),
        (["new-plugin", "orient", "mine", "-o", str(tmp_path / "mine")], "files"),
        (["simulate", str(groom), "-o", str(tmp_path / "c.npz"), "--frames", "2"], "stretch"),
    ):
        assert outcome([*words, "--json"]) == 0, words
        document = json.loads(capsys.readouterr().out)
        assert key in document
        assert all(Path(file).exists() for file in document["files"])
    for words in (["plugins", "--formats"], ["plugins", "--lock", "default"]):
        assert outcome([*words, "--json"]) == 0
        assert json.loads(capsys.readouterr().out)


def test_help_names_every_verb(capsys: pytest.CaptureFixture[str]) -> None:
    """`hairkit --help` lists the verbs with what they do, and no verb is imported for it."""
    assert outcome(["--help"]) == 0
    text = capsys.readouterr().out
    assert text.startswith("Example: hairkit ")
    for verb, summary in cli.VERBS.items():
        assert verb in text
        assert summary in text
    assert outcome([]) == 2


def test_only_the_verb_asked_for_is_imported() -> None:
    """Help is fast: no verb, no OpenCV, no Numba."""
    code = (
        "import sys; from hairkit.cli import main\n"
        "try: main(['--help'])\n"
        "except SystemExit: pass\n"
        "print([m for m in sys.modules if m.startswith(('hairkit.cli.', 'cv2', 'numba'))])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.splitlines()[-1] == "[]"


@pytest.mark.parametrize("module", ["hairkit.cli", "argparse", "numpy", "numba", "hairkit.manager"])
def test_ctrl_c_is_one_line_whatever_is_just_loading(module: str) -> None:
    """The first press while modules load ends the command like a later one: no traceback."""
    code = f"""
import signal, sys
class Pressed:
    def find_spec(self, name, path, target=None):
        if name == {module!r}:
            signal.raise_signal(signal.SIGINT)
signal.signal(signal.SIGINT, signal.default_int_handler)  # a background job's is ignored
sys.meta_path.insert(0, Pressed())
sys.argv = ["hairkit", "plugins"]
from hairkit.__main__ import main
sys.exit(main())
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert done.returncode == 2
    assert done.stdout == ""
    assert done.stderr.startswith("hairkit: interrupted")
    assert done.stderr.count("\n") == 1


def test_ctrl_c_is_recognised_behind_another_error() -> None:
    """A library that was loading may report it as its own failure."""
    failure = ImportError("cannot import")
    failure.__cause__ = KeyboardInterrupt()
    assert cli.explain(failure) == cli.explain(KeyboardInterrupt())


def test_plugins_are_listed_without_what_only_their_work_needs() -> None:
    """SciPy's splines, the web and the exporters' libraries load when a stage runs."""
    heavy = ("scipy.interpolate", "scipy.optimize", "urllib.request", "alembic3d")
    code = (
        "import sys; from hairkit.cli import main; main(['plugins']);"
        f"print('loaded', [m for m in {heavy} if m in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.splitlines()[-1] == "loaded []"


def test_every_verb_is_a_file() -> None:
    """The list of verbs is the list of files."""
    folder = Path(cli.__file__).parent
    files = {path.stem for path in folder.glob("*.py")} - {"__init__"}
    assert {verb.replace("-", "_") for verb in cli.VERBS} <= files
    for verb in cli.VERBS:
        module = importlib.import_module(f"hairkit.cli.{verb.replace('-', '_')}")
        assert callable(module.add_arguments)
        assert callable(module.run)


def test_version_is_the_packages(capsys: pytest.CaptureFixture[str]) -> None:
    """`hairkit --version` prints the version on stdout."""
    import hairkit

    assert outcome(["--version"]) == 0
    assert capsys.readouterr().out == f"hairkit {hairkit.__version__}\n"


def test_an_error_without_a_file_name_is_still_told() -> None:
    """An OSError made from a text alone keeps its text."""
    assert cli.explain(OSError("the disk is gone")) == ("the disk is gone", 2)


@pytest.mark.parametrize(
    "words",
    [
        ["head", "photos", "-o"],
        ["render", "a.npz", "-o"],
        ["simulate", "a.npz", "-o"],
        ["export", "a.npz", "-o"],
        ["convert", "a.npz"],
        ["texture", "bump", "a.png", "-o"],
    ],
)
@pytest.mark.parametrize("ending", ["x.glb", "x.npz", "x.png"])
def test_a_missing_folder_for_the_result_is_told_before_any_work(
    words: list[str],
    ending: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    """Verbs that write one file look for its folder first, or refuse its ending."""
    bristle_groom().save(tmp_path / "a.npz")
    monkeypatch.chdir(tmp_path)
    assert cli.main([*words, f"none/{ending}"]) == 2
    said = capsys.readouterr().err
    assert "none: no such folder; make it first" in said or f"none/{ending}: " in said
    assert "No such file" not in said
