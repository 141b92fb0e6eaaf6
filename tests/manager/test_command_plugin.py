"""Laws of plugins in environments of their own: what they do is one line, and the run goes on."""

from __future__ import annotations

import os
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from hairkit.child_process import ChildError, ChildProcess, Limits, resident_bytes
from hairkit.errors import HairkitError, OptionError, PluginError
from hairkit.manager import Manager
from hairkit.manager.command_plugin import PluginCommand
from hairkit.testing import stage_arguments, turn_capture

BAD = Path(__file__).parents[1] / "support" / "bad_command.py"
GOOD = '''"""Hair by brightness."""
import numpy as np
from hairkit.worker import option, serve

def segment(view, options):
    print("on stdout")
    labels = np.where(view.image.mean(axis=-1) < options.level, 255, 0).astype("u1")
    return {"labels": labels, "person_known": False}

def estimate_scene(capture, start):
    assert start is None and len(capture.views) == 8 and capture.views[0].name == "front"

if __name__ == "__main__":
    level = option(120, low=0, high=255, doc="Grey level.", unit="grey")
    serve(segment, estimate_scene, options={"level": level}, version="1.0")
'''
DESCRIBING = {
    "old_protocol": "speaks version 0 of the protocol",
    "no_hooks": "implements no hook",
    "unknown_hook": "did you mean 'segment'",
    "live_object": "no hook of commands 'make_simulator'",
    "unknown_argument": "did you mean 'view'",
    "hooks_of_numbers": "described itself wrongly",
    "unknown_kind": "option level is of kind matrix",
    "default_out_of_bounds": "option level is 7.0, expected a number from 0.0 to 2.0",
    "option_without_default": "described itself wrongly",
    "garbage": "said what is no answer: Traceback",
    "a_list": "said what is no answer",
    "no_number": "said what is no answer",
    "deep": "said what is no answer",
    "other_number": "answered question 77",
    "not_utf8": "said what is no answer",
    "no_result": "described itself wrongly",
    "silent": "gave no answer within 1 s",
    "leaves": "ended with exit code 3: no module named torch",
    "endless_line": "more than 1048576 bytes in one line",
    "closes_stdout": "closed its output without an answer",
}
"""What a command does before its first answer -> what is said."""
CALLING = {
    "raises": "RuntimeError: CUDA out of memory",
    "raises_a_novel": r"RuntimeError: \\x1b\[31mword word",
    "exits": "SystemExit: 4",
    "exits_hard": "ended with exit code 5",
    "crashes": r"crashed \(SIGSEGV\)",
    "aborts": r"crashed \(SIGABRT\)",
    "is_killed": r"crashed \(SIGKILL\)",
    "hangs": "gave no answer within 1 s",
    "stops": "gave no answer within 1 s",
    "spins": "gave no answer within 1 s",
    "leaves_a_child": "ended with exit code 6",
    "eats_memory": "GiB of memory, the limit is 0.30",
    "eats_memory_in_a_child": "GiB of memory, the limit is 0.30",
    "floods_stderr": "printed more than 16777216 bytes",
    "floods_stdout": "printed more than 16777216 bytes",
    "text": "is a str, expected Mask",
    "number": "is a int, expected Mask",
    "nothing": "returned nothing",
    "an_array": "is a ndarray, expected Mask",
    "wrong_shape": "the mask has 4 x 4 pixels, expected 96 x 128",
    "wrong_values": "mask holds the value 7",
    "wrong_kind": "invalid value encountered in cast",
    "texts_for_numbers": "its result cannot be used",
    "field_missing": "'labels'",
    "field_misspelt": "did you mean 'labels'",
    "objects": "result.labels is an array of objects",
    "generator": "result is a generator, expected an array",
    "no_file": "result.npz: no such file",
    "file_cut": "not a zip file",
    "file_is_a_folder": "result.npz: is a folder, expected a file",
    "file_is_a_pipe": "result.npz: is a named pipe, expected a file",
    "folder_removed": "no such file",
    "bomb": "is not as hairkit.worker writes it",
    "pickle": "is no array of",
    "claims_too_much": "is no array of",
    "text_is_no_json": "its result cannot be used",
    "text_is_deep": "its result cannot be used",
    "text_names_no_array": "its result cannot be used",
}
"""What a command does when it is called -> what is said."""
SLOW = ("hangs", "stops", "spins")
"""What is ended by the limit of time."""


def bad(how: str, *more: str, **limits: float) -> PluginCommand:
    """Return the command that misbehaves."""
    words = (sys.executable, str(BAD), how, *more)
    return PluginCommand("bad", words, **{"seconds": 60.0, "start_seconds": 60.0, **limits})


@pytest.fixture
def plugins(tmp_path: Path) -> Iterator[Manager]:
    """A manager with the good command."""
    manager = Manager()
    (tmp_path / "matte.py").write_text(GOOD)
    manager.add_command(PluginCommand("matte", (sys.executable, "matte.py"), str(tmp_path)))
    yield manager
    manager._pluggy.get_plugin("matte").close()


def test_a_command_is_a_plugin_like_any_other(
    plugins: Manager, capfd: pytest.CaptureFixture[str]
) -> None:
    """It is described, its options are checked, and it does what the same code would do here."""
    info = plugins.info("matte")
    assert info.stages == ("segment", "estimate_scene")
    assert (info.version, info.summary) == ("1.0", "Hair by brightness.")
    assert [o.wanted for o in info.options] == ["a whole number from 0 to 255 (grey)"]
    view = stage_arguments("segment")["view"]
    mask = plugins.call("segment", "matte", {"level": "100"}, view=view)
    assert np.array_equal(mask.hair, view.image.mean(axis=-1) < 100)
    with pytest.raises(OptionError, match="option level is 300"):
        plugins.call("segment", "matte", {"level": 300}, view=view)
    with pytest.raises(PluginError, match="returned nothing from 'estimate_scene'"):
        plugins.call("estimate_scene", "matte", **stage_arguments("estimate_scene"))
    assert "on stdout" not in capfd.readouterr().out


@pytest.mark.parametrize("how", DESCRIBING)
def test_a_command_that_starts_badly_is_one_line(how: str) -> None:
    """What it says or does instead of describing itself is named, and no process is left."""
    limit = 1.0 if how == "silent" else 60.0
    with pytest.raises(HairkitError, match=DESCRIBING[how]) as caught:
        Manager().add_command(bad(how, start_seconds=limit))
    _is_one_line(caught.value)


@pytest.fixture(scope="module")
def as_told() -> Iterator[Manager]:
    """A manager with the command that misbehaves as the view's name says; it outlives its tests."""
    manager = Manager()
    manager.add_command(bad("as_told", memory_gib=0.3))
    yield manager
    manager._pluggy.get_plugin("bad").close()


@pytest.mark.parametrize("how", [how for how in CALLING if how not in SLOW])
def test_a_command_that_works_badly_is_one_line(how: str, as_told: Manager) -> None:
    """A call that goes wrong says what happened in one line that names plugin and command.

    The next one finds the plugin at work again.
    """
    view = replace(stage_arguments("segment")["view"], name=how)
    with pytest.raises(HairkitError, match=CALLING[how]) as caught:
        as_told.call("segment", "bad", view=view)
    _is_one_line(caught.value)


@pytest.mark.parametrize("how", SLOW)
def test_a_command_without_an_answer_is_one_line(how: str) -> None:
    """A call that never ends is ended at its limit, whatever the process does meanwhile."""
    manager = Manager()
    manager.add_command(bad(how, seconds=1.0))
    with pytest.raises(HairkitError, match=CALLING[how]) as caught:
        manager.call("segment", "bad", **stage_arguments("segment"))
    _is_one_line(caught.value)
    manager._pluggy.get_plugin("bad").close()


def _is_one_line(error: HairkitError) -> None:
    text = str(error)
    assert len(text) < 1000
    assert "'bad'" in text
    assert "bad_command.py" in text
    assert text.isprintable()


@pytest.mark.parametrize("command", [("/no/such/python",), ("/etc/passwd",), ("nul\0",)])
def test_a_command_that_cannot_be_started_is_one_line(command: tuple[str, ...]) -> None:
    """A program that is missing or none is named with the reason."""
    with pytest.raises(PluginError, match="cannot be started"):
        Manager().add_command(PluginCommand("bad", command))


def test_the_next_call_gets_a_new_process(tmp_path: Path) -> None:
    """After a crash the plugin works again; a kill from outside is not even noticed."""
    manager, call = Manager(), stage_arguments("segment")
    manager.add_command(bad("is_killed_once", str(tmp_path / "trace")))
    assert manager.call("segment", "bad", **call).hair.all()
    assert (tmp_path / "trace").exists()
    manager._pluggy.get_plugin("bad").close()
    assert manager.call("segment", "bad", **call).hair.all()
    manager._pluggy.get_plugin("bad").close()


def test_calls_run_side_by_side_in_as_many_processes_as_allowed(tmp_path: Path) -> None:
    """Two processes answer two threads at once, and answers do not mix."""
    code = (
        "import os, time, numpy as np\nfrom hairkit.worker import serve\n"
        "def segment(view):\n    time.sleep(0.3)\n    open(str(os.getpid()), 'w')\n"
        "    labels = np.zeros(view.image.shape[:2], 'u1')\n"
        "    labels[0, int(view.azimuth_deg) // 45] = 255\n"
        "    return {'labels': labels, 'person_known': False}\n"
        "if __name__ == '__main__':\n    serve(segment)\n"
    )
    manager, found = Manager(), {}
    (tmp_path / "side.py").write_text(code)
    command = (sys.executable, "side.py")
    manager.add_command(PluginCommand("side", command, str(tmp_path), processes=2))

    def work(view: object, index: int) -> None:
        found[index] = manager.call("segment", "side", view=view).labels[0].argmax()

    threads = [
        threading.Thread(target=work, args=(view, index))
        for index, view in enumerate(turn_capture().views[:4])
    ]
    [thread.start() for thread in threads]
    [thread.join() for thread in threads]
    assert found == {index: index for index in range(4)}
    assert len([path for path in tmp_path.iterdir() if path.name.isdigit()]) == 2
    manager._pluggy.get_plugin("side").close()


def test_nothing_is_left_of_a_command_that_was_ended() -> None:
    """The processes that it started are ended with it; one that was stopped is not replaced."""
    code = "import subprocess as s; print('started', s.Popen(['sleep', '60']).pid)"
    child = ChildProcess((sys.executable, "-u", "-c", f"{code}; input(); input()"))
    with pytest.raises(ChildError, match="no answer: started") as caught:
        child.ask({}, Limits(20))
    grandchild = Path(f"/proc/{str(caught.value).split()[-1]}/cmdline")
    deadline = time.monotonic() + 10
    while grandchild.exists() and grandchild.read_bytes() and time.monotonic() < deadline:
        time.sleep(0.01)
    assert time.monotonic() < deadline
    child = ChildProcess((sys.executable, "-c", "import time; time.sleep(60)"))
    threading.Timer(0.3, child.stop).start()
    with pytest.raises(ChildError, match="was stopped"):
        child.ask({}, Limits(20))
    assert not child.started


@pytest.mark.parametrize("beside", [False, True])
def test_memory_of_descendants_counts(beside: bool) -> None:
    """Resident memory is that of a process and of all that it started, on any of its threads."""
    own = resident_bytes(os.getpid())
    eat = "import time; kept = bytes(range(256)) * 2**20; print(flush=True); time.sleep(60)"

    def start() -> subprocess.Popen[bytes]:
        return subprocess.Popen([sys.executable, "-c", eat], stdout=subprocess.PIPE)

    with ThreadPoolExecutor(1) as pool:  # children of a thread that ends become the first one's
        process = pool.submit(start).result() if beside else start()
        assert process.stdout is not None
        process.stdout.readline()
        assert resident_bytes(os.getpid()) > own + 2**28
        process.kill()
        process.communicate()
    assert resident_bytes(process.pid) == 0


def test_the_other_side_needs_numpy_alone() -> None:
    """`hairkit.worker` loads nothing but NumPy and Python's own modules."""
    code = (
        f"import sys; sys.path = {sys.path!r}; import hairkit.worker, numpy; "
        "print({m.partition('.')[0] for m in sys.modules} - set(sys.stdlib_module_names))"
    )
    words = [sys.executable, "-S", "-c", code]
    done = subprocess.run(words, capture_output=True, text=True, check=True)
    assert {"hairkit", "numpy"} <= set(eval(done.stdout)) <= {"hairkit", "numpy", "__main__"}
