"""Laws of the scalp of an unmarked head: it lies where the default head has it, or is refused."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from foreign_heads import make_coarse_head
from scipy.spatial import cKDTree

from hairkit.cli import main
from hairkit.errors import InputError
from hairkit.head_model.identity import blend_head
from hairkit.io.head_reader import TRANSFER, read_head
from hairkit.types.head import Head


def _write(path: Path, vertices: np.ndarray, faces: np.ndarray) -> Path:
    lines = ["v {} {} {}".format(*point) for point in vertices.tolist()]
    lines += ["f {} {} {}".format(*face) for face in (faces + 1).tolist()]
    path.write_text("\n".join(lines))
    return path


def _shares(head: Head, true: np.ndarray) -> float:
    """Return area on which two scalps agree over that of either."""
    corners = head.vertices[head.faces].astype(np.float64)
    area = np.linalg.norm(
        np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1
    )
    first, second = ((w[head.faces].mean(axis=1) > 0.5) for w in (head.scalp, true))
    return float(area[first & second].sum() / area[first | second].sum())


def test_scalp_and_landmarks_lie_where_they_were(tmp_path: Path) -> None:
    """A child's head away from the origin, its marks taken off, gets them back, in centimetres."""
    child = blend_head({"child": 1.0})
    file = _write(
        tmp_path / "child.obj", 100 * (child.vertices + np.array([0.1, 1.1, 0])), child.faces
    )
    found = read_head(file, units="cm", scalp=TRANSFER)
    assert _shares(found, child.scalp) > 0.93
    assert found.landmark_vertices is not None
    assert child.landmark_vertices is not None
    places = child.vertices[found.landmark_vertices], child.vertices[child.landmark_vertices]
    assert np.linalg.norm(places[0] - places[1], axis=1).mean() < 0.005


def test_a_coarse_mesh_gets_the_scalp_of_the_head_that_it_was(tmp_path: Path) -> None:
    """Of 2,500 vertices joined anew, those are scalp that were it, but for the hairline."""
    bare = make_coarse_head()
    man = blend_head({"man": 1.0, "head_length": 1.5, "ears": 1.0})
    file = _write(tmp_path / "coarse.obj", bare.vertices, bare.faces)
    found = read_head(file, scalp=TRANSFER)
    near = cKDTree(man.vertices).query(bare.vertices - [0.0, 1.6, 0.0])[1]
    assert _shares(found, man.scalp[near]) > 0.9


def test_marks_come_before_the_transfer(tmp_path: Path) -> None:
    """Landmarks beside the file stay as they are."""
    child = blend_head({"child": 1.0})
    assert child.landmark_vertices is not None
    file = _write(tmp_path / "child.obj", child.vertices, child.faces)
    marks = child.landmark_vertices.tolist()
    (tmp_path / "child.landmarks.json").write_text(str(marks))
    found = read_head(file, scalp=TRANSFER)
    assert found.landmark_vertices is not None
    assert found.landmark_vertices.tolist() == marks


def test_what_is_no_head_is_refused(tmp_path: Path) -> None:
    """A head in another unit, and one that looks backwards, are refused in one line."""
    child = blend_head({"child": 1.0})
    file = _write(tmp_path / "child.obj", child.vertices, child.faces)
    with pytest.raises(InputError, match="give its unit"):
        read_head(file, units="mm", scalp=TRANSFER)
    file = _write(tmp_path / "back.obj", child.vertices * [-1, 1, -1], child.faces)
    with pytest.raises(InputError, match="looks along -Z"):
        read_head(file, scalp=TRANSFER)


def test_the_command_tells_of_it(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """The error of an unmarked head names the option, `info` shows it bare; the option helps."""
    child = blend_head({"child": 1.0})
    file = str(_write(tmp_path / "child.obj", child.vertices, child.faces))
    with pytest.raises(InputError, match="--head-scalp transfer"):
        read_head(file)
    assert main(["info", file]) == 0
    assert "scalp_vertices: 0\n" in capsys.readouterr().out
    assert main(["info", file, "--head-scalp", "transfer"]) == 0
    told = capsys.readouterr().out
    assert "scalp_vertices" in told
    assert "scalp_vertices: 0\n" not in told
