"""A browser's page of a studio, for tests of what a user sees and does."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

GUIDES = 80
OPTION, USED = "finest_window", 2.5
"""Of the stage that follows strands, and its value in the project, which is not the usual one."""
SLOW_S = 600
"""Seconds for what computes, on a busy machine."""
LISTEN = """window.spoken = []; window.streams = [];
speechSynthesis.speak = (said) => { window.spoken.push(said.text); };
const ask = navigator.mediaDevices.getUserMedia.bind(navigator.mediaDevices);
navigator.mediaDevices.getUserMedia = async (wanted) => {
  const stream = await ask(wanted);
  window.streams.push(stream);
  return stream;
};"""
"""What is spoken is written down, since browsers without a sound card say nothing, and what the
camera sends is kept."""
REFUSED = 401
LIVE = "() => window.streams.flatMap((s) => s.getTracks()).some((t) => t.readyState === 'live')"


@contextmanager
def opened(browser: Any, server: Any) -> Iterator[Any]:
    """Open the link of a studio; there is no error, and no request goes to another origin."""
    context = browser.new_context(viewport={"width": 1440, "height": 900})
    page = context.new_page()
    page.set_default_timeout(1000 * SLOW_S)
    page.trouble, foreign = [], []
    page.on("pageerror", lambda error: page.trouble.append(str(error)))
    page.on("console", lambda m: m.type == "error" and page.trouble.append(m.text))
    own = (server.origin, "blob:", "data:")
    page.on("response", lambda r: r.status == REFUSED and page.trouble.append(r.url))
    page.on("request", lambda r: r.url.startswith(own) or foreign.append(r.url))
    page.add_init_script(LISTEN)
    page.goto(server.link)
    try:
        yield page
    finally:
        context.close()
    assert page.trouble == [], page.trouble
    assert foreign == []
