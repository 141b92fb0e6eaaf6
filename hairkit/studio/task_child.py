"""The program that does the studio's tasks, asked by `TaskProcess`.

It ends when stdin does: it does not outlive the server.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

from hairkit import worker
from hairkit.errors import HairkitError, one_line
from hairkit.parallel import one_blas_thread


def main() -> None:
    """Answer until stdin ends."""
    from hairkit.studio.tasks import TASKS

    with one_blas_thread():
        worker.answer_questions({name: partial(_do, task) for name, task in TASKS.items()})


def _do(task: Callable[..., Any], request: dict[str, Any], tell: Callable[[Any], None]) -> Any:
    """Return what a task `made`, or why it was `refused` in one line for the user."""
    try:
        return {"made": task(request, tell)}
    except HairkitError as error:
        return {"refused": _without_paths(one_line(error), request)}


def _without_paths(line: str, request: dict[str, Any]) -> str:
    """Return a line in which the server's files have the words of the pages."""
    folder = {"": f"{request['folder']}/"} if request.get("folder") else {}
    files = {"the photo": request.get("incoming") or request.get("photo")}
    for words, path in {**files, "the video": request.get("video"), **folder}.items():
        line = line.replace(path, words) if path else line
    return line


if __name__ == "__main__":
    main()
