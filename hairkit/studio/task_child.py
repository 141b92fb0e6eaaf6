"""The other end of `TaskProcess`: requests as JSON lines on stdin, answers as JSON lines on stdout.

A request `{"id": 1, "do": "outline", ...}` is answered by any number of `{"id": 1, "tell": ...}`
and then `{"id": 1, "result": ...}` or `{"id": 1, "error": "one line"}`. `{"stop": 1}` asks request
1 to end early. The process ends when stdin does: it does not outlive the server.
"""

from __future__ import annotations

import json
import os
import queue
import sys
import threading
from typing import Any

from hairkit.errors import HairkitError
from hairkit.parallel import one_blas_thread


def serve() -> None:
    """Do what stdin asks until it ends."""
    answers = os.fdopen(os.dup(1), "w", encoding="utf-8")
    os.dup2(2, 1)  # what a plugin prints is no answer
    requests: queue.Queue[dict[str, Any]] = queue.Queue()
    stopped: set[int] = set()
    threading.Thread(target=_listen, args=(requests, stopped), daemon=True).start()
    guard = threading.Lock()

    def write(message: dict[str, Any]) -> None:
        with guard:
            answers.write(json.dumps(message) + "\n")
            answers.flush()

    from hairkit.studio.tasks import TASKS

    while True:
        request = requests.get()
        number = request["id"]
        try:
            with one_blas_thread():
                result = TASKS[request["do"]](
                    request,
                    lambda event, number=number: write({"id": number, "tell": event}),  # type: ignore[misc]
                    lambda number=number: number in stopped,  # type: ignore[misc]
                )
            write({"id": number, "result": result})
        except Exception as error:  # a task may fail in any way; the next one is served
            write({"id": number, "error": _one_line(error)})


def _one_line(error: Exception) -> str:
    text = " ".join(str(error).split())
    return text if isinstance(error, HairkitError) else f"unexpected {type(error).__name__}: {text}"


def _listen(requests: queue.Queue[dict[str, Any]], stopped: set[int]) -> None:
    for line in sys.stdin:
        message = json.loads(line)
        if "stop" in message:
            stopped.add(message["stop"])
        else:
            requests.put(message)
    os._exit(0)


if __name__ == "__main__":
    serve()
