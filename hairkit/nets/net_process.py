"""The process that runs networks, seen from hairkit: started when needed, replaced when it dies.

Networks of TensorFlow Lite are run by LiteRT. A user's file may crash it, so no model is
loaded into hairkit's own process. A crash or a hang is one `ModelError`; the next call starts a new
process. A process that somebody else killed, such as a system without memory, says nothing of the
model: its work is given to another, once.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Sequence
from functools import cache
from pathlib import Path
from typing import Any

from hairkit import worker
from hairkit.arrays import Float32Array
from hairkit.child_process import ChildError, ChildProcess, Limits, call_folder
from hairkit.errors import ModelError

TIME_LIMIT_S = 60.0
"""Seconds for one call, loading included; the slowest known model takes 0.1 s a picture."""
MEMORY_BYTES = 4 * 2**30
"""Address space of the process: a bad model cannot take the machine's."""
COMMAND = (sys.executable, "-P", "-m", "hairkit.nets.net_child")
"""What is started."""


class NetProcess:
    """One process that keeps networks loaded. Threads may share it: their calls take turns."""

    def __init__(
        self, time_limit_s: float = TIME_LIMIT_S, command: Sequence[str] = COMMAND
    ) -> None:
        self._limits = Limits(time_limit_s, MEMORY_BYTES)
        self._child = ChildProcess(command, address_bytes=MEMORY_BYTES)

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
        with call_folder() as at:
            folder = Path(at)
            worker.write_arrays(folder / "batch.npz", {"batch": batch})
            self._ask(model, {"do": "run", "folder": at})
            return tuple(worker.map_arrays(folder / "outputs.npz").values())

    def input_shape(self, model: str | os.PathLike[str]) -> tuple[int, ...]:
        """Return the shape of a network's first input, usually (1, height, width, channels).

        Raises `ModelError` as `run` does.
        """
        return tuple(self._ask(model, {"do": "shape"}))

    def _ask(self, model: str | os.PathLike[str], question: dict[str, Any]) -> Any:
        question["model"] = str(Path(model).resolve())
        try:
            answer = self._child.ask_twice(question, self._limits)
        except ChildError as error:
            raise ModelError(f"{model}: LiteRT {error} on this network") from error
        if "error" in answer:
            raise ModelError(f"{model}: LiteRT cannot run this network: {answer['error']}")
        return answer["result"]

    def close(self) -> None:
        """End the process; the next call starts another."""
        self._child.close()


@cache
def shared_nets() -> NetProcess:
    """Return the process that all plugins share."""
    return NetProcess()
