"""A program that answers questions, and may crash, hang, flood or eat memory without harm.

Question and answer are JSON objects, one a line, on the program's stdin and stdout;
`hairkit.worker` answers there. A question has a number `id`; its answer has the same. Lines
`{"id": 1, "tell": ...}` may come before. Whatever goes wrong is one `ChildError`, the process is
ended with all that it started, and the next question starts a new one.
"""

from __future__ import annotations

import contextlib
import itertools
import json
import os
import queue
import signal
import subprocess
import sys
import tempfile
import threading
import time
import weakref
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy.typing as npt

from hairkit.errors import HairkitError, one_line
from hairkit.storage import read_npz
from hairkit.system import kill_group, limit_process, memory_folder, own_group, resident_bytes

POLL_S = 0.05
"""Seconds between two looks at memory and output of a process that is at work."""
LONGEST_LINE = 2**20
"""Bytes of an answer; arrays travel in files."""
LONGEST_QUESTION = 2**15
"""Bytes of a question: a pipe holds twice as many, so that writing never waits for a reader."""
TAIL_BYTES = 4096
"""What is kept of the end of a process's stderr, to say why it ended."""
LONGEST_REASON = 300
"""Characters of what a process says that are shown."""
ENDING_S = 2.0
"""Seconds that a process which closed its output is given to end by itself."""
LARGEST_FILE = 2**32
"""Bytes of a file that a process may write."""
KILLED = -9
"""Exit code of a process that somebody killed; on Windows there is none of its own."""
_NOISE = -1
"""Stands on the queue for output without end."""


@dataclass(frozen=True)
class Limits:
    """What one answer may take."""

    seconds: float = 600.0
    memory_bytes: int | None = None
    """Resident memory of the process and all that it started; watched on Linux only."""
    output_bytes: int = 2**24
    """What may be printed, stdout and stderr together."""


class ChildError(HairkitError):
    """A process gave no answer; the text is the reason, in words that follow the program's name."""

    def __init__(self, reason: str, *, killed: bool = False, limit: bool = False) -> None:
        super().__init__(reason)
        self.killed = killed
        """True when somebody else killed it: this says nothing of the work it was doing."""
        self.limit = limit
        """True when it was ended for its time, memory or output."""


class ChildProcess:
    """One process that is started when needed; threads that share it take turns."""

    def __init__(
        self,
        command: Sequence[str],
        *,
        environment: Mapping[str, str] | None = None,
        folder: str | None = None,
        address_bytes: int | None = None,
    ) -> None:
        """Take a command, and the address space that Linux gives it: a second limit of memory."""
        self._command = tuple(command)
        self._environment = None if environment is None else dict(environment)
        self._folder = folder
        self._address_bytes = address_bytes
        self._turn = threading.Lock()
        self._numbers = itertools.count(1)
        self._running: _Running | None = None
        self._stopped = False

    def ask(
        self, question: Mapping[str, Any], limits: Limits, tell: Callable[[Any], None] | None = None
    ) -> dict[str, Any]:
        """Return the answer; `tell` gets what comes before it. Raises `ChildError`."""
        with self._turn:
            if self._stopped:
                raise ChildError("was stopped", limit=True)
            number = next(self._numbers)
            line = json.dumps({"id": number, **question}).encode() + b"\n"
            if len(line) > LONGEST_QUESTION:
                raise ChildError(f"a question of {len(line)} bytes, at most {LONGEST_QUESTION}")
            running = self._started()
            try:
                running.send(line)
                return running.answer(number, limits, tell)
            except BaseException as error:  # Ctrl-C, too: its answer would come to the next
                self._end()
                if self._stopped:
                    raise ChildError("was stopped", limit=True) from error
                raise

    def ask_twice(self, question: Mapping[str, Any], limits: Limits) -> dict[str, Any]:
        """Return the answer of `ask`; a process that somebody killed is replaced, once."""
        try:
            return self.ask(question, limits)
        except ChildError as error:
            if not error.killed:
                raise
            return self.ask(question, limits)

    @property
    def started(self) -> bool:
        """Whether there is a process."""
        return self._running is not None and self._running.alive

    @property
    def pid(self) -> int | None:
        """Number of the process, None where there is none."""
        return self._running.process.pid if self._running is not None else None

    def close(self) -> None:
        """End the process; the next question starts another."""
        with self._turn:
            self._end()

    def stop(self) -> None:
        """End the process while a thread waits for its answer, and start no other one."""
        self._stopped = True
        running = self._running
        if running is not None:
            running.kill()

    def _started(self) -> _Running:
        if self._running is None or not self._running.alive:
            self._end()
            self._running = _Running(self._command, self._environment, self._folder)
            limit_process(self._running.process.pid, LARGEST_FILE, self._address_bytes)
            weakref.finalize(self, _Running.end, self._running)
        return self._running

    def _end(self) -> None:
        if self._running is not None:
            self._running.end()
            self._running = None


class _Running:
    """A process, and the two threads that read what it says."""

    def __init__(
        self, command: Sequence[str], environment: dict[str, str] | None, folder: str | None
    ) -> None:
        try:
            self.process = subprocess.Popen(
                command,
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=subprocess.PIPE,
                env=environment,
                cwd=folder,
                **own_group(),  # Ctrl-C is for hairkit, which ends it
            )
        except (OSError, ValueError) as error:
            reason = getattr(error, "strerror", None) or str(error)
            raise ChildError(f"cannot be started: {reason}") from error
        self._owner = os.getpid()
        self._ended = False
        self._lines: queue.SimpleQueue[bytes | int | None] = queue.SimpleQueue()
        self._printed = 0
        self._tail = b""
        self._readers = [
            threading.Thread(target=target, daemon=True) for target in (self._listen, self._hear)
        ]
        for reader in self._readers:
            reader.start()

    @property
    def alive(self) -> bool:
        """Whether it runs and belongs to this process, not to the one that this was forked from."""
        return not self._ended and self._owner == os.getpid() and self.process.poll() is None

    def send(self, line: bytes) -> None:
        """Write a question; that nobody reads it is found out when the answer is waited for."""
        self._printed = 0
        assert self.process.stdin is not None
        with contextlib.suppress(OSError):
            self.process.stdin.write(line)
            self.process.stdin.flush()

    def answer(
        self, number: int, limits: Limits, tell: Callable[[Any], None] | None
    ) -> dict[str, Any]:
        """Return the answer to a question."""
        deadline = time.monotonic() + limits.seconds
        while True:
            wait = min(POLL_S, max(deadline - time.monotonic(), 0.0))
            try:
                line = self._lines.get(timeout=wait)
            except queue.Empty:
                self._check(limits, deadline)
                continue
            if line is None:
                raise self._how_it_ended()
            if isinstance(line, int):
                raise ChildError(f"said more than {LONGEST_LINE} bytes in one line", limit=True)
            message = _parsed(line)
            if message["id"] < number:
                continue  # a late second answer to an earlier question
            if message["id"] > number:
                raise ChildError(f"answered question {message['id']}, which was never asked")
            if "tell" not in message:
                return message
            self._check(limits, deadline)
            if tell is not None:
                tell(message["tell"])

    def kill(self) -> None:
        """End the process and those that it started, unless it belongs to another process."""
        if os.getpid() != self._owner:
            return
        kill_group(self.process)

    def end(self) -> None:
        """Kill it and wait for its end."""
        if self._ended or os.getpid() != self._owner:
            return
        self._ended = True
        self.kill()
        self.process.wait()
        assert self.process.stdin is not None
        with contextlib.suppress(OSError):
            self.process.stdin.close()
        for reader in self._readers:  # a pipe that a runaway grandchild holds keeps its thread
            reader.join(POLL_S)

    def _check(self, limits: Limits, deadline: float) -> None:
        """Raise `ChildError` for a process beyond a limit, or gone without closing its pipe."""
        if limits.memory_bytes is not None:
            taken = resident_bytes(self.process.pid)
            if taken > limits.memory_bytes:
                raise ChildError(
                    f"took {taken / 2**30:.2f} GiB of memory,"
                    f" the limit is {limits.memory_bytes / 2**30:.2f}",
                    limit=True,
                )
        if self._printed > limits.output_bytes:
            raise ChildError(f"printed more than {limits.output_bytes} bytes", limit=True)
        if self.process.poll() is not None and self._lines.empty():
            raise self._how_it_ended()
        if time.monotonic() >= deadline:
            raise ChildError(f"gave no answer within {limits.seconds:g} s", limit=True)

    def _how_it_ended(self) -> ChildError:
        """Return why there is no more output, in words."""
        try:
            code = self.process.wait(ENDING_S)
        except subprocess.TimeoutExpired:
            return ChildError("closed its output without an answer")
        if code < 0:
            name = signal.Signals(-code).name if -code in {*signal.Signals} else f"signal {-code}"
            return ChildError(f"crashed ({name})", killed=code == KILLED)
        self._readers[1].join(POLL_S)
        said = self._tail.decode(errors="replace").strip().splitlines()[-1:]
        reason = f": {shortened(said[0])}" if said else ""
        return ChildError(f"ended with exit code {code}{reason}")

    def _listen(self) -> None:
        """Put each line of stdout on the queue, and None at its end."""
        stream: Any = self.process.stdout
        with stream:
            while line := stream.readline(LONGEST_LINE):
                if len(line) == LONGEST_LINE:
                    self._lines.put(_NOISE)
                    break
                self._lines.put(line)
        self._lines.put(None)

    def _hear(self) -> None:
        """Keep the end of stderr and count the rest."""
        stream: Any = self.process.stderr
        with stream:
            while piece := os.read(stream.fileno(), LONGEST_LINE):
                self._printed += len(piece)
                self._tail = (self._tail + piece)[-TAIL_BYTES:]


def ask_once(
    program: Path, question: Mapping[str, Any], limits: Limits, address_bytes: int | None = None
) -> dict[str, Any]:
    """Return the result of the only question to a program of Python.

    Raises `ChildError` where it gives none, an error of the program's own among the reasons.
    """
    child = ChildProcess((sys.executable, "-P", str(program)), address_bytes=address_bytes)
    try:
        answer = child.ask(question, limits)
    finally:
        child.close()
    if "error" in answer:
        raise ChildError(f"failed: {shortened(str(answer['error']))}")
    return dict(answer["result"])


def ask_for_arrays(
    program: Path, question: Mapping[str, Any], limits: Limits, address_bytes: int | None = None
) -> tuple[dict[str, Any], dict[str, npt.NDArray[Any]]]:
    """Return the result of `ask_once`, and the arrays that the program wrote.

    It is told in `target` to which .npz file; there are none where it wrote no file.
    """
    with call_folder() as folder:
        target = Path(folder) / "arrays.npz"
        answer = ask_once(program, {**question, "target": str(target)}, limits, address_bytes)
        return answer, read_npz(target) if target.exists() else {}


def call_folder() -> tempfile.TemporaryDirectory[str]:
    """Return a folder for the files of one call, in memory where the system has room there."""
    return tempfile.TemporaryDirectory(
        prefix="hairkit-call-", dir=memory_folder(), ignore_cleanup_errors=True
    )


def shortened(text: str) -> str:
    """Return a text in one line of at most `LONGEST_REASON` characters that can be printed."""
    line = one_line(text)
    return line if len(line) <= LONGEST_REASON else f"{line[:LONGEST_REASON]}..."


def _parsed(line: bytes) -> dict[str, Any]:
    try:
        message = json.loads(line)
    except (ValueError, RecursionError):
        message = None
    if not isinstance(message, dict) or type(message.get("id")) is not int:
        raise ChildError(f"said what is no answer: {shortened(line.decode(errors='replace'))}")
    return message
