"""Server-sent events: what changed, to every page that listens."""

from __future__ import annotations

import asyncio
import json
from collections.abc import AsyncIterator, Callable
from typing import Any

BEAT_S = 15.0
"""Seconds after which something is sent, so that nobody takes the line for dead."""
MOST_LISTENERS, MOST_WAITING = 32, 200
"""Pages that may listen, and events that may wait for one that does not read."""


class Events:
    """Sends each event to all listeners; a listener that does not keep up is let go."""

    def __init__(self) -> None:
        self._queues: set[asyncio.Queue[str | None]] = set()

    def send(self, kind: str, **values: Any) -> None:
        """Send an event."""
        text = _text(kind, values)
        for queue in list(self._queues):
            if queue.qsize() < MOST_WAITING:
                queue.put_nowait(text)
            else:
                self._queues.discard(queue)
                queue.put_nowait(None)

    @property
    def full(self) -> bool:
        """Whether no further page may listen."""
        return len(self._queues) >= MOST_LISTENERS

    def close(self) -> None:
        """Let all listeners go."""
        for queue in self._queues:
            queue.put_nowait(None)
        self._queues.clear()

    async def listen(self, summary: Callable[[], dict[str, Any]]) -> AsyncIterator[str]:
        """Yield the text of events as they come, after one with the project's `summary`."""
        queue: asyncio.Queue[str | None] = asyncio.Queue()
        self._queues.add(queue)
        try:
            yield "retry: 2000\n\n" + _text("project", summary())
            while True:
                try:
                    text = await asyncio.wait_for(queue.get(), BEAT_S)
                except TimeoutError:
                    text = ": still here\n\n"
                if text is None:
                    return
                yield text
        finally:
            self._queues.discard(queue)


def _text(kind: str, values: dict[str, Any]) -> str:
    """Return an event as it is sent."""
    return f"event: {kind}\ndata: {json.dumps(values)}\n\n"
