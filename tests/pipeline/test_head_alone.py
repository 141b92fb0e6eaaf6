"""Laws of the head without hair: every format holds mesh and skin; photos give a face."""

from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np
import pytest

from hairkit.cli import main
from hairkit.errors import InputError
from hairkit.head_model import photo_skin
from hairkit.head_model.template import default_head
from hairkit.io.capture_reader import read_capture, sample_folder
from hairkit.io.head_reader import read_head
from hairkit.pipeline.head_alone import ENDINGS, photograph_head, write_head
from hairkit.types.head import Head


@pytest.mark.parametrize("suffix", ENDINGS)
def test_a_head_is_written_with_its_skin(tmp_path: Path, suffix: str) -> None:
    """Each ending gives a file with the mesh; those that are read back have the same albedo."""
    head = default_head()
    path = tmp_path / f"head{suffix}"
    write_head(path, head)
    if suffix == ".fbx":
        assert path.stat().st_size > len(head.vertices) * 24
        return
    found = Head.load(path) if suffix == ".npz" else read_head(path)
    np.testing.assert_allclose(found.vertices, head.vertices, atol=1e-6)
    assert found.maps is not None
    assert found.maps.albedo is not None
    assert head.maps is not None
    assert head.maps.albedo is not None
    assert (found.maps.albedo.pixels == head.maps.albedo.pixels).all()


def test_other_endings_are_one_line(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """An ending that holds no head is refused before anything is computed."""
    with pytest.raises(InputError, match=r"head\.abc: a head is written as \.glb, "):
        write_head(tmp_path / "head.abc", default_head())
    assert main(["head", str(tmp_path), "-o", str(tmp_path / "head.abc")]) == 2
    assert capsys.readouterr().err.count("\n") == 1


def test_the_choices_of_a_capture_hold_for_the_head(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Options in capture.toml are used, wrong ones refused as by `reconstruct`; a head that was
    moved by hand has the skin of its place."""
    folder = tmp_path / "sample"
    shutil.copytree(sample_folder(), folder)
    said = []
    for verb in ("head", "reconstruct"):
        (folder / "capture.toml").write_text("[options]\nthin_plate.nonsense = 3\n")
        out = tmp_path / ("head.npz" if verb == "head" else "out")
        assert main([verb, str(folder), "-o", str(out)]) == 2
        said.append(capsys.readouterr().err)
    assert said[0] == said[1]
    assert "no option 'nonsense'" in said[0]
    plain = photograph_head(read_capture(sample_folder(), 300))
    (folder / "capture.toml").write_text("[fitted_head]\nscale = 1.1\n")
    moved = photograph_head(read_capture(folder, 300))
    assert plain.head.maps is not None
    assert plain.head.maps.albedo is not None
    assert moved.head.maps is not None
    assert moved.head.maps.albedo is not None
    colours = [maps.albedo.pixels.astype(int) for maps in (plain.head.maps, moved.head.maps)]
    assert np.abs(colours[0] - colours[1]).mean() > 1
    first, second = (scene.cameras[0].project(scene.head.vertices) for scene in (plain, moved))
    assert np.abs(first - second).max() > 2


def test_photos_give_cameras_and_a_skin(tmp_path: Path) -> None:
    """A small procedural capture gives its cameras, and a skin that is not the default head's."""
    words = ["synth", "short", "-o", str(tmp_path / "short"), "--strands", "2000"]
    assert main([*words, "--size", "240x320"]) == 0
    scene = photograph_head(tmp_path / "short")
    assert len(scene.cameras) == 8
    own = default_head().maps
    assert scene.head.maps is not None
    assert scene.head.maps.albedo is not None
    assert own is not None
    assert own.albedo is not None
    assert scene.head.maps.albedo.pixels.shape == (photo_skin.SIZE, photo_skin.SIZE, 3)
    uv = scene.head.uv
    assert np.abs(scene.head.maps.albedo.sample(uv) - own.albedo.sample(uv)).mean() > 0.02
