"""Laws of the process's renderer."""

from __future__ import annotations

import numpy as np

from hairkit.rendering.context import renderer

SUM = np.arange(4, dtype=np.float32)


def test_a_block_within_a_block_leaves_the_outer_one_its_context() -> None:
    """Buffers can be read after an inner block has ended, by the same renderer."""
    with renderer() as outer:
        buffer = outer.context.buffer(SUM)
        with renderer() as inner:
            assert inner is outer
        assert buffer.read() == SUM.tobytes()
        buffer.release()
