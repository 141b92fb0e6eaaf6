"""Laws of texture maps in mesh files: what was written comes back, damage is one line."""

from __future__ import annotations

import json
import struct
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from rich_groom import rich_groom

from hairkit.errors import DataError, FormatError, HairkitError
from hairkit.io.head_reader import HeadFile, read_head, write_head_obj
from hairkit.io.textures import read_mtl, texture_of
from hairkit.manager import Manager
from hairkit.types.head import Head
from hairkit.types.skin import SkinMaps, Texture


@pytest.fixture
def textured() -> Head:
    """The ball head with all four maps and two blendshapes."""
    return rich_groom().head


def _pixels(maps: SkinMaps | None) -> dict[str, bytes]:
    return {} if maps is None else {k: t.pixels.tobytes() for k, t in maps.present().items()}


def test_obj_and_mtl_give_all_maps_back(tmp_path: Path, textured: Head) -> None:
    """Albedo, roughness, normal and bump maps survive OBJ with MTL, pixel for pixel."""
    write_head_obj(tmp_path / "head.obj", textured)
    found = read_head(tmp_path / "head.obj")
    assert _pixels(found.maps) == _pixels(textured.maps)
    read = {path.name for path in HeadFile(str(tmp_path / "head.obj")).files()}
    assert {"head.obj", "head.mtl", "head.albedo.png", "head.bump.png"} <= read


def test_a_coloured_bump_map_is_a_normal_map(tmp_path: Path, textured: Head) -> None:
    """Programs that write normal maps as `map_Bump` are understood."""
    assert textured.maps is not None
    write_head_obj(tmp_path / "head.obj", replace(textured, maps=SkinMaps(textured.maps.albedo)))
    (tmp_path / "head.mtl").write_text("newmtl skin\nmap_Bump -bm 0.5 head.albedo.png\n")
    found = read_head(tmp_path / "head.obj").maps
    assert found is not None
    assert found.bump is None
    assert found.normal is not None


def test_mtl_reads_options_folders_and_case(tmp_path: Path) -> None:
    """Options before a name are passed over; pictures outside the folder are looked for in it."""
    (tmp_path / "a.mtl").write_text(
        "newmtl Skin\nmap_Kd -s 1 1 1 -clamp on textures/my skin.png\n"
        "newmtl B\nmap_kd C:\\art\\b.png\nnorm ../../etc/c.png\n"
    )
    found = read_mtl(tmp_path / "a.mtl")
    assert found["skin"] == {"albedo": tmp_path / "textures" / "my skin.png"}
    assert found["b"] == {"albedo": tmp_path / "b.png", "normal": tmp_path / "c.png"}


@pytest.mark.parametrize(
    "content", [b"", b"\0\1\2", b"newmtl \xff\xfe", b"map_Kd a.png\n"], ids=repr
)
def test_damaged_mtl_files_are_one_line(tmp_path: Path, textured: Head, content: bytes) -> None:
    """A file that is no MTL is refused by name; an empty one just has no maps."""
    write_head_obj(tmp_path / "head.obj", textured)
    (tmp_path / "head.mtl").write_bytes(content)
    if not content:
        assert read_head(tmp_path / "head.obj").maps is None
        return
    with pytest.raises(FormatError, match=r"head\.mtl: [^\n]+$"):
        read_head(tmp_path / "head.obj")


def test_damaged_pictures_are_one_line(tmp_path: Path, textured: Head) -> None:
    """A picture cut short, or something else under its name, is refused by name."""
    write_head_obj(tmp_path / "head.obj", textured)
    picture = tmp_path / "head.albedo.png"
    whole = picture.read_bytes()
    for content in (b"", b"GIF89a", whole[: len(whole) // 2], whole[:40] + b"x" + whole[41:]):
        picture.write_bytes(content)
        with pytest.raises(HairkitError, match=r"head\.albedo\.png: [^\n]+$"):
            read_head(tmp_path / "head.obj")


def test_missing_pictures_are_said(
    tmp_path: Path, textured: Head, caplog: pytest.LogCaptureFixture
) -> None:
    """A missing MTL file or picture leaves its maps out, with a warning."""
    write_head_obj(tmp_path / "head.obj", textured)
    (tmp_path / "head.normal.png").unlink()
    maps = read_head(tmp_path / "head.obj").maps
    assert maps is not None
    assert maps.normal is None
    assert "no normal map" in caplog.text
    (tmp_path / "head.mtl").unlink()
    assert read_head(tmp_path / "head.obj").maps is None
    assert "no texture maps" in caplog.text


def test_glb_gives_maps_and_blendshapes_back(
    tmp_path: Path, textured: Head, manager: Manager
) -> None:
    """A groom's head read from its .glb has its maps, except bump, and its shapes by name."""
    path = tmp_path / "groom.glb"
    groom = replace(rich_groom(), head=textured)
    manager.call("export_groom", "gltf", groom=groom, path=path)
    found = read_head(path)
    wanted = _pixels(textured.maps)
    del wanted["bump"]
    assert _pixels(found.maps) == wanted
    for shape, true in zip(found.blendshapes, textured.blendshapes, strict=True):
        assert shape.name == true.name
        np.testing.assert_allclose(shape.offsets, true.offsets, atol=1e-8)


def test_a_base_colour_multiplies_the_albedo(
    tmp_path: Path, textured: Head, manager: Manager
) -> None:
    """A glTF material of black colour has a black albedo, whatever its picture."""
    path = tmp_path / "groom.glb"
    manager.call("export_groom", "gltf", groom=replace(rich_groom(), head=textured), path=path)
    data = path.read_bytes()
    size = struct.unpack_from("<I", data, 12)[0]
    document = json.loads(data[20 : 20 + size])
    look = next(m for m in document["materials"] if m["name"] == "head")
    look["pbrMetallicRoughness"]["baseColorFactor"] = [0, 0, 0, 1]
    text = json.dumps(document, separators=(",", ":")).encode().ljust(size + 400)
    chunk = struct.pack("<II", len(text), 0x4E4F534A) + text
    whole = chunk + data[20 + size :]
    path.write_bytes(b"glTF" + struct.pack("<II", 2, 12 + len(whole)) + whole)
    maps = read_head(path).maps
    assert maps is not None
    assert maps.albedo is not None
    assert maps.albedo.pixels.max() == 0


def test_ply_names_its_texture(tmp_path: Path, textured: Head) -> None:
    """MeshLab's comment `TextureFile` is the albedo."""
    assert textured.maps is not None
    assert textured.maps.albedo is not None
    lines = ["ply", "format ascii 1.0", "comment TextureFile skin.png"]
    lines += [f"element vertex {len(textured.vertices)}"]
    lines += [f"property float {name}" for name in ("x", "y", "z", "s", "t", "scalp")]
    lines += [f"element face {len(textured.faces)}", "property list uchar int vertex_indices"]
    rows = np.column_stack([textured.vertices, textured.uv, textured.scalp])
    lines += ["end_header", *(" ".join(map(str, row)) for row in rows.tolist())]
    lines += [f"3 {a} {b} {c}" for a, b, c in textured.faces.tolist()]
    (tmp_path / "head.ply").write_text("\n".join(lines) + "\n")
    (tmp_path / "skin.png").write_bytes(textured.maps.albedo.data.tobytes())
    assert _pixels(read_head(tmp_path / "head.ply").maps) == _pixels(SkinMaps(textured.maps.albedo))


def test_textures_keep_their_file_and_sample_linearly() -> None:
    """PNG files stay byte for byte; between two pixels a texture is their mean."""
    pixels = np.zeros((2, 2, 3), np.uint8)
    pixels[0] = 200
    texture = Texture.encode(pixels)
    assert texture_of(texture.data.tobytes(), "a.png").data.tobytes() == texture.data.tobytes()
    np.testing.assert_allclose(
        texture.sample([[0.5, 0.75], [0.5, 0.5], [0.5, 0.25]])[:, 0] * 255, [200, 100, 0], atol=1
    )
    many = texture.sample(np.full((40_000, 2), 0.75))
    assert many.shape == (40_000, 3)
    assert np.ptp(many) == 0
    with pytest.raises(DataError, match="neither a PNG nor a JPEG"):
        Texture(np.zeros(20, np.uint8))
    with pytest.raises(DataError, match="damaged"):
        _ = Texture(texture.data[:30]).pixels


def test_an_eighth_of_a_texture_is_the_mean_of_its_pixels() -> None:
    """Heads that are drawn small take 1/64 of the pixels; damaged pictures are refused."""
    pixels = np.random.default_rng(0).integers(0, 256, (64, 32, 3), np.uint8)
    small = Texture.encode(pixels).at_eighth().pixels
    means = pixels.reshape(8, 8, 4, 8, 3).mean(axis=(1, 3))
    assert small.shape == (8, 4, 3)
    assert np.abs(small - means).max() < 2
    with pytest.raises(DataError, match="damaged"):
        Texture(np.frombuffer(b"\x89PNG\r\n\x1a\n", np.uint8)).at_eighth()
