"""A batch through all that goes wrong at once, against a quiet one: do the same bytes come out?

Captures run on a Dask scheduler and two workers, on a disk that holds half of the results. A worker
or a capture's process is killed every 10 s until the good captures are done, the scheduler once;
one capture hangs and one eats memory. When a batch has ended that found the disk full, the disk
grows; batches are run until all good captures are done and all of this has been met.

The small disk is a tmpfs. Mounting it needs root, or a Linux that lets `unshare` give it.
"""

from __future__ import annotations

import argparse
import contextlib
import io
import json
import os
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import threading
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from hairkit.cli import main as hairkit

SIZE, STRANDS, GUIDES = "120x160", "500", "100"
SIMPLE = (
    "landmarks=landmark_files", "person=none", "turn=none", "scene=landmarks", "refine=none",
    "fit=none", "export=hairworks",
)  # fmt: skip
"""Captures and recipe of benchmarks/batch.py."""
BAD = ("eat", "hang")
WORKERS = 2
SCHEDULER = {
    "DASK_DISTRIBUTED__SCHEDULER__ALLOWED_FAILURES": "10",
    "DASK_DISTRIBUTED__SCHEDULER__WORKER_SATURATION": "1.0",
}
"""Settings of a scheduler as docs/tutorials/batch.md advises, and as `--dask local` has them."""
QUIET = ("--workers", str(WORKERS), "--time-limit", "3600")
ROUNDS = 8
"""Most batches that are run."""
DISK = 0.5
"""Size of the small disk, in shares of what the quiet results take."""
GROWN = 3.0
"""Its size once it has been full."""
SAID = {
    "hang": "no answer within",
    "eat": "GiB of memory",
    "a full disk": "No space left",
}
"""Words of the lines that tell what was met."""
SAME = ("groom.npz", "scene.json", "groom.apx", "groom.ball")
"""Files that are compared, where they are."""
POISON = """
\"\"\"Captures whose folders hold a file `hang` or `eat` do so.\"\"\"

import time
from pathlib import Path

from hairkit import Capture, hookimpl


@hookimpl
def capture(source: str) -> Capture | None:
    kept = []
    while (Path(source) / "eat").exists():
        kept.append(b"x" * 2**25)
        time.sleep(0.02)
    while (Path(source) / "hang").exists():
        time.sleep(1.0)
    return None
"""


@dataclass
class Farm:
    """A scheduler and workers of Dask, and what was killed of them."""

    folder: Path
    port: int
    scheduler: subprocess.Popen[bytes] | None = None
    workers: list[subprocess.Popen[bytes]] = field(default_factory=list)
    killed: Counter[str] = field(default_factory=Counter)
    turn: int = 0
    """Kills that were tried."""

    def start(self) -> None:
        """Start what is not running; workers find a new scheduler at the old address."""
        self.start_workers()
        if self.scheduler is None or self.scheduler.poll() is not None:
            words = ["scheduler", "--host", "127.0.0.1", "--port", str(self.port)]
            self.scheduler = self._dask("scheduler", [*words, "--no-dashboard"])

    def start_workers(self) -> None:
        """Start workers in the place of those that have ended, as they do without a scheduler."""
        for worker in [worker for worker in self.workers if worker.poll() is not None]:
            self.workers.remove(worker)
        while len(self.workers) < WORKERS:
            words = ["worker", f"tcp://127.0.0.1:{self.port}", "--nthreads", "1", "--no-dashboard"]
            words += ["--memory-limit", "0", "--death-timeout", "60"]
            self.workers.append(self._dask("worker", words))

    def _dask(self, name: str, words: Sequence[str]) -> subprocess.Popen[bytes]:
        log = (self.folder / f"{name}.log").open("ab")
        command = [sys.executable, "-m", "dask", *words]
        environment = {**os.environ, **SCHEDULER}
        return subprocess.Popen(command, stdout=log, stderr=log, cwd=self.folder, env=environment)

    def kill_scheduler(self) -> None:
        """Kill the scheduler."""
        assert self.scheduler is not None
        self.scheduler.kill()
        self.scheduler.wait()
        self.killed["scheduler"] += 1

    def kill_one(self) -> None:
        """Kill a worker, or the process of a capture, in turns."""
        below = descendants(self.workers[self.turn // 2 % WORKERS].pid)
        kind, part = (("worker", b"spawn_main"), ("capture", b"capture_child"))[self.turn % 2]
        self.turn += 1
        for pid in [pid for pid in below if part in words_of(pid)][:1]:
            with contextlib.suppress(ProcessLookupError):
                os.kill(pid, signal.SIGKILL)
                self.killed[kind] += 1

    def stop(self) -> None:
        """End all processes."""
        for process in [*self.workers, self.scheduler]:
            if process is not None:
                for pid in descendants(process.pid):
                    with contextlib.suppress(ProcessLookupError):
                        os.kill(pid, signal.SIGKILL)
                process.kill()
                process.wait()


def main() -> int:
    """Run both batches and print the verdict; 0 when every good capture is as in the quiet one."""
    args = arguments()
    with tempfile.TemporaryDirectory() as at:
        folder = Path(at)
        captures = folder / "captures"
        draw_captures(captures, args)
        (folder / "poison.py").write_text(POISON)
        good = sorted(path.name for path in captures.iterdir() if path.name not in BAD)
        only = [word for name in good for word in ("--only", name)]
        quiet = run_batch(args, folder, "quiet", [*only, *QUIET])
        taken = sum(path.stat().st_size for path in (folder / "quiet").rglob("*"))
        print(f"quiet: {quiet['done']} of {len(good)} captures done, {taken / 1e6:.0f} MB")
        with small_disk(folder / "chaos", taken) as grow:
            farm = Farm(folder, free_port())
            said = run_chaos(args, folder, farm, good, grow)
            return print_verdict(folder, good, farm, said)


def arguments() -> argparse.Namespace:
    """Return what the command line says."""
    parser = argparse.ArgumentParser(prog="batch_chaos.py", description=__doc__)
    add = parser.add_argument
    add("--captures", type=int, default=8, help="good captures")
    add("--from", dest="given", type=Path, help="take captures of this folder, draw none")
    add("--every", type=float, default=10.0, help="seconds between kills of workers")
    add("--scheduler-after", type=float, default=25.0, help="seconds before the scheduler's end")
    add("--time-limit", type=float, default=30.0, help="seconds of a capture")
    add("--memory", type=float, default=1.5, help="GiB of a capture")
    add("--recipe", default="default", help="recipe")
    add("--set", action="append", default=[], help="changes of the recipe")
    add("--plugin", action="append", default=[], help="plugin file")
    return parser.parse_args()


def draw_captures(captures: Path, args: argparse.Namespace) -> None:
    """Write the good captures, and the two bad ones, which are copies of the first."""
    if args.given is not None:
        shutil.copytree(args.given, captures)
    for number in range(args.captures if args.given is None else 0):
        words = ["synth", "short", "-o", str(captures / f"{number:02}"), "--seed", str(number)]
        with contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(None):
            hairkit([*words, "--size", SIZE, "--strands", STRANDS])
    first = min(captures.iterdir())
    for name in BAD:
        shutil.copytree(first, captures / name)
        (captures / name / name).touch()


def run_batch(
    args: argparse.Namespace, folder: Path, out: str, more: Sequence[str]
) -> Counter[str]:
    """Run `hairkit batch` and return the number of captures by state, and of full disks."""
    changes = ["capture=poison,photo_folder", *(args.set or SIMPLE)]
    words = [sys.executable, "-m", "hairkit", "batch", "captures", "-o", out, "--quiet", "--json"]
    words += ["--recipe", args.recipe, "--guides", GUIDES, "--threads", "1", "--no-report"]
    words += [word for text in changes for word in ("--set", text)]
    words += [word for file in ["poison.py", *args.plugin] for word in ("--plugin", file)]
    words += ["--time-limit", str(args.time_limit), "--capture-memory", str(args.memory), *more]
    done = subprocess.run(words, cwd=folder, capture_output=True, text=True, check=False)
    try:
        results = json.loads(done.stdout)
    except ValueError:
        return Counter({f"ended: {done.stderr.strip().splitlines()[-1:]}": 1})
    states = Counter(result["state"] for result in results)
    for result in results:
        if result["name"] in BAD or result["error"]:
            states[f"{result['name']}: {result['error']}"] += 1
    return states


def run_chaos(
    args: argparse.Namespace, folder: Path, farm: Farm, good: Sequence[str], grow: Growing
) -> list[Counter[str]]:
    """Run the batch until all good captures are done; return what each run said."""
    said: list[Counter[str]] = []
    ended = threading.Event()
    chaos = folder / "chaos"
    threads = [threading.Thread(target=kill_workers, args=(farm, args.every, chaos, good, ended))]
    threads += [threading.Thread(target=kill_scheduler, args=(farm, args.scheduler_after, ended))]
    farm.start()
    try:
        for thread in threads:
            thread.start()
        for number in range(ROUNDS):
            farm.start()
            said.append(run_batch(args, folder, "chaos", ["--scheduler", farm_address(farm)]))
            print(f"run {number + 1}: {'; '.join(f'{n} {what}' for what, n in said[-1].items())}")
            sys.stdout.flush()
            if line_about("a full disk", said[-1:]):
                grow()
            met = all(line_about(what, said) for what in SAID)
            if not missing(chaos, good) and farm.killed["scheduler"] and met:
                break
        else:
            print(f"{len(missing(chaos, good))} good captures are not done after {ROUNDS} runs")
    finally:
        ended.set()
        for thread in threads:
            thread.join()
        farm.stop()
    return said


def farm_address(farm: Farm) -> str:
    """Return the scheduler's address."""
    return f"tcp://127.0.0.1:{farm.port}"


def missing(chaos: Path, good: Sequence[str]) -> list[str]:
    """Return the good captures that are not done."""
    return [name for name in good if not (chaos / name / "batch.json").is_file()]


def line_about(what: str, said: Sequence[Counter[str]]) -> str:
    """Return a line that tells that something was met, empty where none does."""
    lines = [text for each in said for text in each if SAID[what] in text]
    own = [text for text in lines if what not in BAD or text.startswith(f"{what}: ")]
    return own[0] if own else ""


def kill_workers(
    farm: Farm, every: float, chaos: Path, good: Sequence[str], ended: threading.Event
) -> None:
    """Kill one after the other while good captures are missing."""
    while not ended.wait(every / 2):
        farm.start_workers()
        if not ended.wait(every / 2) and missing(chaos, good):
            farm.kill_one()


def kill_scheduler(farm: Farm, after: float, ended: threading.Event) -> None:
    """Kill the scheduler once."""
    if not ended.wait(after):
        farm.kill_scheduler()


def print_verdict(
    folder: Path, good: Sequence[str], farm: Farm, said: Sequence[Counter[str]]
) -> int:
    """Print what was killed, what was full, and what is equal."""
    full = sum(n for each in said for text, n in each.items() if SAID["a full disk"] in text)
    others = {name: other_files(folder / "quiet" / name, folder / "chaos" / name) for name in good}
    equal = [name for name, files in others.items() if not files]
    killed = ", ".join(f"{count} x {what}" for what, count in sorted(farm.killed.items()))
    print(f"killed: {killed}; captures that met a full disk: {full}")
    for what in SAID:
        print(line_about(what, said) or f"{what}: NOT MET")
    print(f"{len(equal)} of {len(good)} good captures have the bytes of the quiet batch")
    for name, files in others.items():
        if files:
            print(f"{name}: other bytes in {', '.join(files)}")
    met = full and farm.killed["scheduler"] and all(line_about(what, said) for what in SAID)
    return 0 if len(equal) == len(good) and met else 2


def other_files(first: Path, second: Path) -> list[str]:
    """Return the files of two results that have other bytes, or that one of them lacks."""
    contents = [
        {name: (folder / name).read_bytes() for name in SAME if (folder / name).is_file()}
        for folder in (first, second)
    ]
    if not contents[0]:
        return ["all"]
    return [name for name in SAME if contents[0].get(name) != contents[1].get(name)]


class Growing:
    """Makes the small disk large."""

    def __init__(self, path: Path, size: int) -> None:
        self._path, self._size = path, size

    def __call__(self) -> None:
        words = ["mount", "-o", f"remount,size={self._size}", str(self._path)]
        subprocess.run(words, check=True)


@contextlib.contextmanager
def small_disk(path: Path, taken: int) -> Iterator[Growing]:
    """Mount a disk at a new folder that is too small for what is taken."""
    path.mkdir()
    words = ["mount", "-t", "tmpfs", "-o", f"size={int(DISK * taken)}", "tmpfs", str(path)]
    subprocess.run(words, check=True)
    try:
        yield Growing(path, int(GROWN * taken))
    finally:
        subprocess.run(["umount", "-l", str(path)], check=True)


def descendants(pid: int) -> list[int]:
    """Return all processes below one, by all of its threads."""
    found = []
    for children in Path(f"/proc/{pid}/task").glob("*/children"):
        with contextlib.suppress(OSError):
            found += [int(child) for child in children.read_text().split()]
    return found + [below for child in found for below in descendants(child)]


def words_of(pid: int) -> bytes:
    """Return the command line of a process, empty when it is gone."""
    with contextlib.suppress(OSError):
        return Path(f"/proc/{pid}/cmdline").read_bytes()
    return b""


def free_port() -> int:
    """Return a port that nobody listens at."""
    with socket.socket() as listener:
        listener.bind(("127.0.0.1", 0))
        return int(listener.getsockname()[1])


if __name__ == "__main__":
    if os.geteuid() != 0:  # user and mounts of its own, in which it may mount
        namespace = ["unshare", "--user", "--map-root-user", "--mount"]
        os.execvp(namespace[0], [*namespace, sys.executable, *sys.argv])
    sys.exit(main())
