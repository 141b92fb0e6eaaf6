"""Laws of what is written into `capture.toml`."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from hairkit.io.capture_toml import (
    HeadEntry,
    head_entry,
    head_values,
    read_capture_file,
    write_table,
)

angles = st.floats(-80, 80)
ways = st.floats(-0.2, 0.2)


@given(st.floats(0.5, 2.0), st.tuples(angles, angles, angles), st.tuples(ways, ways, ways))
def test_a_written_pose_is_read_as_the_same_similarity(
    tmp_path_factory: pytest.TempPathFactory,
    scale: float,
    rotation: tuple[float, float, float],
    translation: tuple[float, float, float],
) -> None:
    """`[head]` to matrix to `[head]` keeps the pose."""
    path = tmp_path_factory.mktemp("pose") / "capture.toml"
    write_table(path, "head", head_values(HeadEntry(scale, rotation, translation)))
    first = read_capture_file(path).head_pose
    assert first is not None
    write_table(path, "head", head_values(head_entry(first)))
    second = read_capture_file(path).head_pose
    assert second is not None
    np.testing.assert_allclose(second, first, atol=1e-6)


def test_what_else_capture_toml_says_stays(tmp_path: Path) -> None:
    """Only the table [head] is replaced: entries, views and comments around it stay."""
    path = tmp_path / "capture.toml"
    path.write_text(
        "orthographic = true # as drawn\n[head]\nscale = 3.0\n\n[[views]]\nname = 'front'\n"
    )
    write_table(path, "head", head_values(HeadEntry(1.1, (0.0, 5.0, 0.0), (0.0, 0.01, 0.0))))
    found = read_capture_file(path)
    assert found.orthographic
    assert found.views[0].name == "front"
    assert "# as drawn" in path.read_text()
    assert found.head_pose is not None
    assert np.cbrt(np.linalg.det(found.head_pose[:3, :3])) == pytest.approx(1.1)
