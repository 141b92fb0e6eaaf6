"""Laws of the process's renderer."""

from __future__ import annotations

import numpy as np
import pytest

from hairkit.errors import RenderError
from hairkit.rendering import context
from hairkit.rendering.context import on_graphics_card, renderer

SUM = np.arange(4, dtype=np.float32)


def test_a_block_within_a_block_leaves_the_outer_one_its_context() -> None:
    """Buffers can be read after an inner block has ended, by the same renderer."""
    with renderer() as outer:
        buffer = outer.context.buffer(SUM)
        with renderer() as inner:
            assert inner is outer
        assert buffer.read() == SUM.tobytes()
        buffer.release()


def test_numbers_that_a_shader_leaves_open_make_programs_of_their_own() -> None:
    """Equal numbers give the same program, others another one."""
    with renderer() as gl:
        one = gl.compute("rods_substeps", NODES=5)
        assert gl.compute("rods_substeps", NODES=5) is one
        assert gl.compute("rods_substeps", NODES=6) is not one


def test_without_a_renderer_there_is_no_graphics_card(monkeypatch: pytest.MonkeyPatch) -> None:
    """A device whose driver fails does not count, and the question raises nothing."""

    def fail(backend: str) -> None:
        raise RenderError(f"{backend} is not there")

    monkeypatch.setattr(context, "_renderer", None)
    monkeypatch.setattr(context, "_open", fail)
    monkeypatch.setattr(context, "_CARDS", ("null",))
    assert not on_graphics_card()
