"""Laws of a batch on Dask: the same results, and what is lost is done by others."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest
import quick_captures
from quick_captures import write_captures

from hairkit.batches.jobs import find_jobs

pytest.importorskip("distributed")
START = f"""
import contextlib, json, os, signal, subprocess, sys, threading, time
sys.path.insert(0, {str(Path(quick_captures.__file__).parent)!r})
from pathlib import Path
from quick_captures import COMMAND
from hairkit.batches.dask_pool import DaskPool, SchedulerLostError, connect, local_client
from hairkit.batches.jobs import Settings, find_jobs, finished, job_digest
from hairkit.batches.run_job import JobLimits

def missing():
    jobs = [(job, job_digest(job, "same")) for job in find_jobs("captures", "out")]
    return [(job, digest) for job, digest in jobs if finished(job, digest) is None]

def pool(client, retries=20):
    limits = JobLimits(seconds=5.0, memory_bytes=2**29, retries=retries)
    return DaskPool(client, limits, command=COMMAND)
"""
LOCAL = (
    START
    + """
def main():
    client = local_client(2)
    pids = [info["pid"] for info in client.run(lambda dask_worker: {"pid": os.getpid()}).values()]
    threading.Timer(2.0, os.kill, (pids[0], signal.SIGKILL)).start()
    for result in pool(client).run(missing(), Settings(seed=400)):
        print(result.state, result.name, result.error, flush=True)
    client.close()
    client.cluster.close()

if __name__ == "__main__":
    main()
"""
)
LOST = (
    START
    + """
def main():
    dask = [sys.executable, "-m", "dask"]
    scheduler = [*dask, "scheduler", "--port", "0", "--no-dashboard", "--scheduler-file", "at.json"]
    quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
    first = subprocess.Popen(scheduler, **quiet)
    address = None
    while address is None:
        time.sleep(0.05)
        with contextlib.suppress(OSError, ValueError):  # not there, or half-written
            address = json.loads(Path("at.json").read_text())["address"]
    worker = [*dask, "worker", address, "--no-nanny", "--nthreads", "1", "--no-dashboard"]
    second = subprocess.Popen([*worker, "--death-timeout", "5"], **quiet)
    client = connect(address)
    try:
        for result in pool(client).run(missing(), Settings(seed=400)):
            print(result.state, result.name, flush=True)
            time.sleep(LATE)  # others may end before the scheduler is lost
            first.kill()
    except SchedulerLostError as error:
        print("lost:", error, flush=True)
    finally:
        second.kill()
        first.wait(), second.wait()
        os._exit(0)

if __name__ == "__main__":
    main()
"""
)


def run(code: str, folder: Path) -> list[str]:
    """Run a program in a folder and return its lines."""
    (folder / "program.py").write_text(code)
    words = [sys.executable, "program.py"]
    done = subprocess.run(words, cwd=folder, capture_output=True, text=True, timeout=240)
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout.splitlines()


def test_a_killed_worker_of_dask_loses_nothing(tmp_path: Path) -> None:
    """With a worker killed and captures poisoned, good captures are done and bad ones named."""
    names = [f"good-{number}" for number in range(8)]
    write_captures(tmp_path / "captures", *names, "crash", "eat", "fails", "hang")
    lines = run(LOCAL, tmp_path)
    assert sorted(line for line in lines if line.startswith("done")) == [
        f"done {name} " for name in names
    ]
    failed = {line.split()[1]: line for line in lines if line.startswith("failed")}
    assert set(failed) == {"crash", "eat", "fails", "hang"}
    assert "SIGSEGV" in failed["crash"]
    assert "GiB of memory" in failed["eat"]
    assert "no answer within 5 s" in failed["hang"]
    for name in names:
        assert (tmp_path / "out" / name / "groom.npz").read_bytes() == name.encode()


@pytest.mark.parametrize("late", [0.0, 1.5])
def test_a_lost_scheduler_is_one_line_and_the_rest_is_done_again(
    tmp_path: Path, late: float
) -> None:
    """kill -9 of the scheduler ends the batch in one line; done captures stay done."""
    names = [f"good-{number}" for number in range(6)]
    write_captures(tmp_path / "captures", *names)
    lines = run(LOST.replace("LATE", str(late)), tmp_path)
    assert lines[0].startswith("done")
    assert lines[-1].startswith("lost: the Dask scheduler is gone; run the batch again")
    done = [path.parent.name for path in (tmp_path / "out").glob("*/batch.json")]
    assert len(done) >= 1
    assert late or len(done) < len(names)
    assert len(find_jobs(tmp_path / "captures", tmp_path / "out")) == len(names)


def test_what_a_lost_worker_has_done_is_not_done_again(tmp_path: Path) -> None:
    """A task that Dask gives to a second worker finds the capture done, and starts no process."""
    from hairkit.batches.dask_pool import _do
    from hairkit.batches.jobs import DONE, Result, Settings
    from hairkit.batches.run_job import JobLimits

    write_captures(tmp_path / "captures", "good-0")
    (job,) = find_jobs(tmp_path / "captures", tmp_path / "out")
    Path(job.out).mkdir(parents=True)
    (Path(job.out) / "groom.npz").write_bytes(b"hair")
    Result(job.name, DONE, job.out, 2.5, digest="same").write()
    found = _do(job, Settings(), "same", JobLimits(60.0), 1, ("/nobody/here",))
    assert (found.state, found.seconds, found.error) == (DONE, 2.5, "")
    lost = _do(job, Settings(), "other", JobLimits(60.0), 1, ("/nobody/here",))
    assert "cannot be started" in lost.error
