"""Laws of the events that pages listen to."""

from __future__ import annotations

import asyncio
import json
from concurrent.futures import ThreadPoolExecutor
from typing import Any

from hairkit.studio.events import Events


def test_a_page_that_listens_knows_how_the_project_stands() -> None:
    """The first event is the project as it is when the stream begins; later ones follow it."""
    heard = listen_from({"formats": []}, {"formats": [".npz"]}, {"result": "2"})
    with ThreadPoolExecutor() as beside:  # browsers of other tests keep a loop in this thread
        said = beside.submit(asyncio.run, heard).result()
    assert said == [{"formats": [".npz"]}, {"result": "2"}]


async def listen_from(asked: Any, begun: Any, later: Any) -> list[Any]:
    """Return what a page hears that asked before, was answered after a change, and listens on."""
    events, project = Events(), asked
    stream = events.listen(lambda: project)
    project = begun  # nobody listens yet
    first = await anext(stream)
    events.send("project", **later)
    return [data_of(first), data_of(await anext(stream))]


def data_of(event: str) -> Any:
    """Return what an event carries."""
    [line] = [line for line in event.splitlines() if line.startswith("data: ")]
    return json.loads(line.removeprefix("data: "))
