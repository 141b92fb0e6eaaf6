"""The process that runs networks, seen from hairkit: started when needed, replaced when it dies.

OpenCV 5.0 ends with a segmentation fault on some model files, so no model is loaded into hairkit's
own process. A crash or a hang is one `ModelError`; the next call starts a new process. A process
that somebody else killed, such as a system without memory, says nothing of the model: its work is
given to another, once.
"""

from __future__ import annotations

import contextlib
import os
import signal
import subprocess
import sys
import threading
import weakref
from collections.abc import Sequence
from functools import cache
from pathlib import Path
from typing import Any

from hairkit.arrays import Float32Array
from hairkit.errors import ModelError
from hairkit.nets import net_child

TIME_LIMIT_S = 60.0
"""Seconds for one call, loading included; the slowest known model takes 0.05 s on one core."""


class NetProcess:
    """One process that keeps networks loaded. Threads may share it: their calls take turns."""

    def __init__(
        self,
        time_limit_s: float = TIME_LIMIT_S,
        command: Sequence[str] = (sys.executable, "-P", net_child.__file__),
    ) -> None:
        self._time_limit_s = time_limit_s
        self._command = tuple(command)
        self._lock = threading.Lock()
        self._process: subprocess.Popen[bytes] | None = None
        self._owner = 0

    def run(self, model: str | os.PathLike[str], batch: Float32Array) -> tuple[Float32Array, ...]:
        """Return the outputs of a network for a batch of pictures, the largest output first.

        Parameters
        ----------
        model
            A `.tflite` file.
        batch
            (N, H, W, C), of the size and the range that the network wants.

        Raises
        ------
        ModelError
            The network cannot be loaded or run, crashes, or takes longer than the time limit.
        """
        with self._lock:
            for last in (False, True):
                process = self._started()
                timer = threading.Timer(self._time_limit_s, process.kill)
                timer.start()
                answer = _ask(process, str(Path(model).resolve()), batch)
                timed_out = timer.finished.is_set()
                timer.cancel()
                if answer is not None:
                    break
                self._end()
                if timed_out:
                    raise ModelError(f"{model}: no answer within {self._time_limit_s:g} s")
                if last or process.returncode != -signal.SIGKILL:
                    raise ModelError(f"{model}: {_how_it_ended(process)}")
        assert answer is not None
        head, arrays = answer
        if "error" in head:
            raise ModelError(f"{model}: OpenCV cannot run this network: {head['error']}")
        return tuple(arrays)

    def close(self) -> None:
        """End the process; the next call starts another."""
        with self._lock:
            self._end()

    def _started(self) -> subprocess.Popen[bytes]:
        """Return the running process; after a fork, one of the new process's own."""
        if self._process is None or self._owner != os.getpid():
            self._process = subprocess.Popen(
                self._command,
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=subprocess.DEVNULL,
                env={**os.environ, "OPENCV_LOG_LEVEL": "SILENT"},
            )
            self._owner = os.getpid()
            weakref.finalize(self, _end, self._process, self._owner)
        return self._process

    def _end(self) -> None:
        if self._process is not None:
            _end(self._process, self._owner)
            self._process = None


@cache
def shared_nets() -> NetProcess:
    """Return the process that all plugins share."""
    return NetProcess()


def _ask(
    process: subprocess.Popen[bytes], model: str, batch: Float32Array
) -> tuple[dict[str, Any], list[Any]] | None:
    """Return the answer to one request, None when the process ended before it gave one."""
    if process.stdin is None or process.stdout is None:
        return None
    try:
        net_child.write_message(process.stdin, {"model": model}, [batch])
        return net_child.read_message(process.stdout)
    except (OSError, EOFError, ValueError):
        return None


def _end(process: subprocess.Popen[bytes], owner: int) -> None:
    """End a process that this one started; in a fork of this one, leave it alone."""
    if os.getpid() != owner:
        return
    process.kill()
    for stream in (process.stdin, process.stdout):
        if stream is not None:
            with contextlib.suppress(OSError):
                stream.close()
    process.wait()


def _how_it_ended(process: subprocess.Popen[bytes]) -> str:
    """Return why a process that was waited for has ended, in words."""
    code = process.returncode
    if code < 0:
        return f"OpenCV crashed on this network ({signal.Signals(-code).name})"
    return f"the process that runs networks ended with exit code {code}"
