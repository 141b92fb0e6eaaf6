"""Fixtures of tests that draw frames."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
from frame_pictures import make_frame_renderer

from hairkit.rendering.context import renderer
from hairkit.viewer.draw.frame import FrameRenderer


@pytest.fixture(scope="module", params=[True, False], ids=["processor", "shaders"])
def frame_renderer(request: pytest.FixtureRequest) -> Iterator[FrameRenderer]:
    """A frame renderer with the ball head and 3000 bristles, drawn either way."""
    with renderer() as gl:
        frame_renderer = make_frame_renderer(gl, soft=request.param)
        yield frame_renderer
        frame_renderer.release()
