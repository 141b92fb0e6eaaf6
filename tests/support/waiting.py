"""Waiting for what another process or a coroutine does."""

from __future__ import annotations

import asyncio
import time
from collections.abc import Callable, Coroutine
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any, TypeVar

_Result = TypeVar("_Result")


def wait_for(folder: Path, pattern: str, seconds: float = 30) -> None:
    """Wait until a file appears."""
    end = time.monotonic() + seconds
    while not list(folder.glob(pattern)):
        assert time.monotonic() < end, f"no {pattern} in {folder}"
        time.sleep(0.01)


def run(make: Callable[[], Coroutine[Any, Any, _Result]]) -> _Result:
    """Return what a coroutine does, run in a thread of its own.

    Once a test has used the browser, Playwright's event loop runs in the thread of the tests.
    """
    with ThreadPoolExecutor(1) as pool:
        return pool.submit(lambda: asyncio.run(make())).result()
