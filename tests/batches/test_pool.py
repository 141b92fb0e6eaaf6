"""Laws of a batch on this machine: what happens to one capture happens to no other."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Sequence
from pathlib import Path

import pytest
import quick_captures
from quick_captures import COMMAND, write_captures

from hairkit.batches.jobs import Job, Result, Settings, find_jobs, finished, job_digest, part_of
from hairkit.batches.pool import LocalPool, Watcher
from hairkit.batches.run_job import JobLimits
from hairkit.errors import InputError
from hairkit.system import available_bytes

GOOD = tuple(f"good-{number}" for number in range(6))
GIB = 2**30


def run(
    captures: Path,
    out: Path,
    workers: int = 2,
    limits: JobLimits | None = None,
    budget: int = GIB,
    settings: Settings | None = None,
) -> dict[str, Result]:
    """Do every capture by the quick stand-in; return the results by name."""
    pool = LocalPool(workers, limits or JobLimits(60), budget_bytes=budget, command=COMMAND)
    jobs = [(job, job_digest(job, "same")) for job in find_jobs(captures, out)]
    missing = [(job, digest) for job, digest in jobs if finished(job, digest) is None]
    return {result.name: result for result in pool.run(missing, settings or Settings())}


def grooms(out: Path, names: Sequence[str] = GOOD) -> list[bytes]:
    """Return the grooms that were made, each by its name."""
    return [(out / name / "groom.npz").read_bytes() for name in names]


def starts(out: Path, name: str) -> int:
    """Return how often a capture was begun."""
    return len((out / name / "starts").read_text())


def test_a_poisoned_capture_fails_alone(tmp_path: Path) -> None:
    """Hangs, crashes, floods, bugs and hunger end in one line each; the rest is as in quiet."""
    bad = ("crash", "hang", "eat", "flood", "fails", "raises", "killed")
    captures = write_captures(tmp_path / "captures", *GOOD, *bad)
    limits = JobLimits(seconds=4.0, memory_bytes=GIB // 2, retries=1)
    found = run(captures, tmp_path / "out", limits=limits)
    assert set(found) == {*GOOD, *bad}
    said = {name: result.error for name, result in found.items() if result.state == "failed"}
    assert set(said) == set(bad) - {"killed"}
    assert "SIGSEGV" in said["crash"]
    assert "no answer within 4 s" in said["hang"]
    assert "GiB of memory, the limit is 0.50" in said["eat"]
    assert "printed more than" in said["flood"]
    assert said["fails"] == "no photos in it"
    assert said["raises"] == "RuntimeError: a bug"
    assert all("\n" not in line for line in said.values())
    tries = {name: starts(tmp_path / "out", name) for name in bad}
    assert tries == {"crash": 2, "killed": 2} | dict.fromkeys(
        ("hang", "eat", "flood", "fails", "raises"), 1
    )
    run(write_captures(tmp_path / "quiet", *GOOD), tmp_path / "alone")
    assert grooms(tmp_path / "out") == grooms(tmp_path / "alone")


def test_a_second_batch_does_what_is_missing(tmp_path: Path) -> None:
    """Done captures are kept; failed ones, changed ones and new ones are done."""
    captures, out = write_captures(tmp_path / "captures", "a", "b", "fails"), tmp_path / "out"
    assert {r.state for r in run(captures, out).values()} == {"done", "failed"}
    assert set(run(captures, out)) == {"fails"}
    (captures / "fails" / "mended").touch()
    (captures / "b" / "photo").write_text("another")
    write_captures(captures, "new")
    assert set(run(captures, out)) == {"b", "fails", "new"}
    assert (out / "b" / "groom.npz").read_bytes() == b"another"
    assert run(captures, out) == {}
    (out / "a" / "groom.npz").unlink()
    assert set(run(captures, out)) == {"a"}


def test_killed_workers_lose_nothing(tmp_path: Path) -> None:
    """Processes killed again and again are replaced; every capture is done as in quiet."""
    captures, out = write_captures(tmp_path / "captures", *GOOD), tmp_path / "out"
    ended = threading.Event()

    def kill() -> None:
        while not ended.wait(1.0):
            for pid in _threads_children()[:1]:
                os.kill(int(pid), signal.SIGKILL)

    killer = threading.Thread(target=kill)
    killer.start()
    limits = JobLimits(60, retries=50)
    found = run(captures, out, limits=limits, settings=Settings(seed=500))
    ended.set()
    killer.join()
    assert {result.state for result in found.values()} == {"done"}
    assert sum(result.tries for result in found.values()) > len(GOOD)
    assert grooms(out) == [name.encode() for name in GOOD]


def _threads_children() -> list[str]:
    """Return the processes that threads of this one started and that run the stand-in."""
    tasks = Path(f"/proc/{os.getpid()}/task").glob("*/children")
    pids = [pid for task in tasks for pid in task.read_text().split()]
    name = quick_captures.__file__.encode()
    return [pid for pid in pids if name in Path(f"/proc/{pid}/cmdline").read_bytes()]


def test_a_killed_batch_leaves_no_process_and_goes_on(tmp_path: Path) -> None:
    """kill -9 of the batch itself ends its workers; the next one does what is missing."""
    names = tuple(f"slow-{number}" for number in range(8))
    captures, out = write_captures(tmp_path / "captures", *names), tmp_path / "out"
    code = f"""
import sys
sys.path.insert(0, {str(Path(quick_captures.__file__).parent)!r})
sys.path.insert(0, {str(Path(__file__).parent)!r})
from pathlib import Path
from hairkit.batches.jobs import Settings
from test_pool import run
run(Path({str(captures)!r}), Path({str(out)!r}), settings=Settings(seed=400))
"""
    process = subprocess.Popen([sys.executable, "-c", code])
    deadline = time.monotonic() + 60
    while len([*out.glob("*/batch.json")]) < 2 and time.monotonic() < deadline:
        time.sleep(0.05)
    process.kill()
    process.wait()
    time.sleep(1.0)
    before = {name: starts(out, name) for name in names if (out / name / "starts").exists()}
    done = {path.parent.name for path in out.glob("*/batch.json")}
    time.sleep(1.0)
    assert before == {n: starts(out, n) for n in names if (out / n / "starts").exists()}
    assert 2 <= len(done) < len(names)
    assert set(run(captures, out)) == set(names) - done
    again = sum(starts(out, name) for name in names) - len(names)
    assert again <= 2
    assert grooms(out, names) == [name.encode() for name in names]


def test_memory_decides_how_many_run_at_once(tmp_path: Path) -> None:
    """Where the budget holds one capture, four workers do one after the other."""
    captures = write_captures(tmp_path / "captures", *GOOD)
    seen, running, guard = [], [0], threading.Lock()

    class Counting(Watcher):
        def started(self, name: str) -> None:
            with guard:
                running[0] += 1
                seen.append(running[0])

    for budget in (GIB, 4 * GIB):
        seen.clear()
        running[0] = 0
        pool = LocalPool(4, JobLimits(60), budget_bytes=budget, command=COMMAND)
        out = tmp_path / f"out-{budget}"
        jobs = [(job, "x") for job in find_jobs(captures, out)]
        for _ in pool.run(jobs, Settings(seed=100), Counting()):
            with guard:
                running[0] -= 1
        assert (max(seen) <= 2) == (budget == GIB)  # one may start before the other is counted off
    assert available_bytes() > 0


def test_a_batch_that_is_left_ends_its_processes(tmp_path: Path) -> None:
    """Who stops listening after the first result has no process left."""
    captures = write_captures(tmp_path / "captures", *GOOD, "hang")
    pool = LocalPool(2, JobLimits(600), budget_bytes=4 * GIB, command=COMMAND)
    jobs = [(job, "x") for job in find_jobs(captures, tmp_path / "out")]
    results = pool.run(jobs[::-1], Settings())
    next(results)
    results.close()
    assert _threads_children() == []


@pytest.mark.parametrize("text", ["0/3", "4/3", "2", "a/b", "1/0", "-1/2", ""])
def test_a_wrong_part_is_refused(text: str) -> None:
    """A part is K/N with K from 1 to N."""
    with pytest.raises(InputError, match="expected K/N"):
        part_of([Job("a", "", "")], text)


def test_parts_are_all_jobs_once() -> None:
    """However many parts, each job is in one of them."""
    jobs = [Job(str(number), "", "") for number in range(11)]
    for count in (1, 2, 5, 11, 13):
        parts = [part_of(jobs, f"{k + 1}/{count}") for k in range(count)]
        assert sorted(int(job.name) for part in parts for job in part) == list(range(11))


def test_folders_that_cannot_be_are_refused(tmp_path: Path) -> None:
    """No captures, an unknown name, and results among the captures are one line each."""
    captures = write_captures(tmp_path / "captures", "anna", "bert")
    for folder, out, only, said in (
        (tmp_path / "none", tmp_path / "out", (), "no such folder"),
        (captures, captures, (), "choose one beside it"),
        (captures, captures / "out", (), "choose one beside it"),
        (captures, tmp_path / "out", ("ana",), "did you mean 'anna'"),
        (captures / "anna", tmp_path / "out", (), "holds no capture"),
    ):
        with pytest.raises(InputError, match=said):
            find_jobs(folder, out, only)
