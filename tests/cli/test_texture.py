"""Laws of `hairkit texture`: each work writes its map, and damage is one line with exit code 2."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from example_textures import draw_map, draw_skin

from hairkit.arrays import UInt8Array
from hairkit.cli import main
from hairkit.imaging.relief import bump_from_albedo, normal_from_height
from hairkit.io.textures import read_texture
from hairkit.types.skin import Texture


def write(path: Path, pixels: UInt8Array) -> str:
    """Write a picture and return its name."""
    path.write_bytes(Texture.encode(pixels).data.tobytes())
    return str(path)


@pytest.fixture
def skin(tmp_path: Path) -> str:
    """A texture of 40 x 32 pixels."""
    return write(tmp_path / "skin.png", draw_skin(40, 1)[:32])


@pytest.fixture
def close_up(tmp_path: Path) -> str:
    """A picture of other skin."""
    return write(tmp_path / "close.png", draw_skin(48, 2))


def pixels(path: Path) -> UInt8Array:
    """Return a picture."""
    return np.asarray(read_texture(path).pixels)


def test_bump_and_normal_are_those_of_the_functions(tmp_path: Path, skin: str) -> None:
    """An albedo becomes a bump map, a bump map a normal map of the depth asked for."""
    bump, normal = tmp_path / "bump.png", tmp_path / "normal.png"
    assert main(["texture", "bump", skin, "-o", str(bump)]) == 0
    assert main(["texture", "normal", str(bump), "-o", str(normal), "--depth", "2"]) == 0
    height = bump_from_albedo(pixels(Path(skin)))
    np.testing.assert_array_equal(pixels(bump)[..., 0], height)
    np.testing.assert_array_equal(pixels(normal), normal_from_height(height, 2.0))


@pytest.mark.parametrize("plugin", ["image_analogies", "super_resolution"])
def test_sharpen_writes_texture_and_difference(
    tmp_path: Path, skin: str, close_up: str, plugin: str, capsys: pytest.CaptureFixture[str]
) -> None:
    """Names of both files are printed; the plugin says how large the texture becomes."""
    out, seen = tmp_path / "out.png", tmp_path / "seen.png"
    words = ["--using", plugin, "--difference", str(seen)]
    if plugin == "super_resolution":
        words += ["--set", "atoms=32", "--set", "super_resolution.rounds=2"]
    assert main(["texture", "sharpen", skin, "--example", close_up, "-o", str(out), *words]) == 0
    assert capsys.readouterr().out.split() == [str(out), str(seen)]
    factor = 2 if plugin == "super_resolution" else 1
    assert pixels(out).shape == pixels(seen).shape == (32 * factor, 40 * factor, 3)


def test_filters_and_numbers_follow_a_pair(tmp_path: Path, skin: str, close_up: str) -> None:
    """What was done to the example is done to the texture."""
    inverse = write(tmp_path / "inverse.png", 255 - pixels(Path(close_up)))
    out = tmp_path / "out.png"
    pair = ["--example", close_up, "--filtered", inverse]
    assert main(["texture", "filter", skin, *pair, "-o", str(out), "--set", "remap=no"]) == 0
    first, second = pixels(Path(skin)).mean(axis=2), pixels(out).mean(axis=2)
    assert np.corrcoef(first.ravel(), second.ravel())[0, 1] < -0.5

    labels, painted = draw_map(48, 1)
    names = write(tmp_path / "labels.png", labels), write(tmp_path / "painted.png", painted)
    other = write(tmp_path / "other.png", draw_map(48, 2)[0])
    pair = ["--example", names[0], "--filtered", names[1]]
    assert main(["texture", "by-numbers", other, *pair, "-o", str(out)]) == 0
    every = {tuple(colour) for colour in painted.reshape(-1, 3)}
    assert {tuple(colour) for colour in pixels(out).reshape(-1, 3)} <= every


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["sharpen", "SKIN"], "sharpen needs --example"),
        (["filter", "SKIN", "--example", "CLOSE"], "filter needs --filtered"),
        (["sharpen", "missing.png", "--example", "CLOSE"], "missing.png"),
        (["sharpen", "DAMAGED", "--example", "CLOSE"], "damaged.png"),
        (["sharpen", "SKIN", "--example", "DAMAGED"], "damaged.png"),
        (["sharpen", "SKIN", "--example", "EMPTY"], "empty.png"),
        (["filter", "SKIN", "--example", "SKIN", "--filtered", "CLOSE"], "40 x 32 pixels"),
        (["tint", "SKIN"], "tint needs --blood"),
        (["tint", "SKIN", "--melanin", "DAMAGED"], "damaged.png"),
        (["normal", "SKIN", "--depth", "0"], "--depth 0, expected"),
        (["sharpen", "SKIN", "--example", "CLOSE", "--using", "gabor"], "enhance_texture"),
        (["sharpen", "SKIN", "--example", "CLOSE", "--set", "kapa=1"], "kappa"),
    ],
    ids=lambda v: " ".join(v) if isinstance(v, list) else "",
)
def test_damage_is_one_line(
    tmp_path: Path, skin: str, close_up: str, words: list[str], said: str,
    capsys: pytest.CaptureFixture[str],
) -> None:  # fmt: skip
    """Nothing is written, the line names what is wrong, and the exit code is 2."""
    whole = Path(skin).read_bytes()
    (tmp_path / "damaged.png").write_bytes(whole[: len(whole) // 2])
    (tmp_path / "empty.png").write_bytes(b"")
    named = {"SKIN": skin, "CLOSE": close_up, "DAMAGED": str(tmp_path / "damaged.png"),
             "EMPTY": str(tmp_path / "empty.png")}  # fmt: skip
    out = tmp_path / "out.png"
    assert main(["texture", *(named.get(w, w) for w in words), "-o", str(out)]) == 2
    error = capsys.readouterr().err
    assert error.count("\n") == 1
    assert said in error
    assert not out.exists()


def test_tint_reddens_with_blood(tmp_path: Path, skin: str) -> None:
    """More blood takes green and blue, and hardly any red."""
    blood = write(tmp_path / "blood.png", np.full((8, 8, 3), 200, np.uint8))
    out = tmp_path / "out.png"
    assert main(["texture", "tint", skin, "--blood", blood, "-o", str(out)]) == 0
    before, after = (pixels(path).mean(axis=(0, 1)) for path in (Path(skin), out))
    assert after[0] > 0.88 * before[0]
    assert (after[1:] < 0.86 * before[1:]).all()


def test_textures_are_png(skin: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Lossy files would spoil a map."""
    assert main(["texture", "bump", skin, "-o", str(tmp_path / "bump.jpg")]) == 2
    assert ".png" in capsys.readouterr().err
