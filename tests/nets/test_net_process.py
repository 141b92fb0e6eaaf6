"""Laws of the process that runs networks: what happens in it never ends the program."""

from __future__ import annotations

import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest

from hairkit.errors import ModelError
from hairkit.nets.model_folder import find_model
from hairkit.nets.net_process import NetProcess

SERVER = """
import os, signal, sys, time
import numpy as np
from hairkit import worker

def run(question, tell):
    model = question["model"]
    if model.endswith("crash"):
        os.kill(os.getpid(), signal.SIGSEGV)
    if model.endswith("slain"):
        os.kill(os.getpid(), signal.SIGKILL)
    if model.endswith("killed") and not os.path.exists(model):
        open(model, "w").close()
        os.kill(os.getpid(), signal.SIGKILL)
    if model.endswith("hang"):
        time.sleep(60)
    if model.endswith("leave"):
        os._exit(3)
    batch = worker.map_arrays(question["folder"] + "/batch.npz")["batch"]
    worker.write_arrays(question["folder"] + "/outputs.npz", {"0": batch * 2, "1": np.arange(3)})

worker.answer_questions({"run": run})
"""
"""A stand-in for the child: it doubles what it is given, and fails as its model's name says."""
BATCH = np.ones((2, 4, 4, 3), np.float32)


@pytest.fixture
def nets() -> NetProcess:
    """A process that runs the stand-in."""
    return NetProcess(time_limit_s=20, command=[sys.executable, "-c", SERVER])


def test_arrays_come_back_as_they_were_sent(nets: NetProcess) -> None:
    """Outputs have their shapes and values, whatever their number."""
    doubled, count = nets.run("fine", BATCH)
    assert np.array_equal(doubled, 2 * BATCH)
    assert np.array_equal(count, [0, 1, 2])
    nets.close()


@pytest.mark.parametrize(("model", "said"), [("crash", "SIGSEGV"), ("leave", "exit code 3")])
def test_a_crash_is_one_error_and_the_next_call_works(
    nets: NetProcess, model: str, said: str
) -> None:
    """A network that ends the process is named, with the reason; others still run."""
    with pytest.raises(ModelError, match=f"{model}: .*{said}"):
        nets.run(model, BATCH)
    assert np.array_equal(nets.run("fine", BATCH)[0], 2 * BATCH)
    nets.close()


def test_a_kill_from_outside_is_no_fault_of_the_network(nets: NetProcess, tmp_path: Path) -> None:
    """Work whose process somebody killed is done by another; a second kill is an error."""
    trace = tmp_path / "once.killed"
    assert np.array_equal(nets.run(trace, BATCH)[0], 2 * BATCH)
    assert trace.is_file()
    with pytest.raises(ModelError, match="SIGKILL"):
        nets.run("always.slain", BATCH)
    nets.close()


def test_a_hang_ends_at_the_time_limit() -> None:
    """A network that never answers is given up, and the process is ended."""
    nets = NetProcess(time_limit_s=3, command=[sys.executable, "-c", SERVER])
    began = time.monotonic()
    with pytest.raises(ModelError, match="no answer within 3 s"):
        nets.run("hang", BATCH)
    assert time.monotonic() - began < 30
    nets.close()


def test_threads_take_turns(nets: NetProcess) -> None:
    """Calls of several threads do not mix their answers."""
    batches = [np.full((1, 8, 8, 3), value, np.float32) for value in range(24)]
    with ThreadPoolExecutor(8) as pool:
        answers = list(pool.map(lambda batch: nets.run("fine", batch)[0], batches))
    assert all(np.array_equal(a, 2 * b) for a, b in zip(answers, batches, strict=True))
    nets.close()


def test_it_ends_with_the_program() -> None:
    """A program that is killed leaves no process behind: the pipe's end is the signal."""
    code = f"""
import sys, numpy as np
from hairkit.nets.net_process import NetProcess
nets = NetProcess(command=[sys.executable, "-c", {SERVER!r}])
nets.run("fine", np.ones((1, 2, 2, 3), np.float32))
print(nets._child.pid, flush=True)
sys.stdin.read()
"""
    with subprocess.Popen(
        [sys.executable, "-c", code], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    ) as program:
        assert program.stdout is not None
        child = Path(f"/proc/{int(program.stdout.readline())}")
        assert child.exists()
        program.kill()
    deadline = time.monotonic() + 20
    while _alive(child) and time.monotonic() < deadline:
        time.sleep(0.1)
    assert not _alive(child)


def _alive(process: Path) -> bool:
    """Return whether a process runs; one that nobody waited for is dead."""
    try:
        return process.joinpath("stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except OSError:
        return False


def test_a_file_that_is_no_network_is_refused(tmp_path: Path) -> None:
    """What OpenCV cannot load is one line that names the file."""
    path = tmp_path / "net.tflite"
    path.write_bytes(b"\x1c\x00\x00\x00TFL3" + bytes(64))
    nets = NetProcess()
    with pytest.raises(ModelError, match=r"net\.tflite: "):
        nets.run(path, BATCH)
    nets.close()


def test_a_network_gives_each_item_of_a_batch_its_own_answer() -> None:
    """The answer to a picture does not depend on its neighbours in the batch."""
    path = find_model("face_landmark")
    if path is None:
        pytest.skip("the network face_landmark is not installed: hairkit models install")
    pictures = np.random.default_rng(3).uniform(0, 1, (3, 192, 192, 3)).astype(np.float32)
    nets = NetProcess()
    together = nets.run(path, pictures)
    assert [output.shape[0] for output in together] == [3, 3]
    for index in range(3):
        alone = nets.run(path, pictures[index : index + 1])
        assert np.allclose(alone[0][0], together[0][index], atol=1e-4)
    nets.close()
