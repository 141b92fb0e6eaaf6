"""Laws of the scripts for Maya, run against a stand-in that knows its commands."""

from __future__ import annotations

import importlib
import sys
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest
from example_textures import draw_skin
from maya_stand import MayaStand, maya_modules

from hairkit.imaging.relief import bump_from_albedo
from hairkit.io.textures import read_texture
from hairkit.types.skin import Texture

SCENE: dict[str, dict[str, str]] = {
    "head.fbx": {
        "|head": "transform",
        "|head|headShape": "mesh",
        "shapes": "blendShape",
    },
    "guides.ma": {
        "|groom": "transform",
        "|groom|guides_0": "transform",
        "|groom|guides_0|guide_0": "transform",
        "|groom|guides_0|guide_0|guide_0Shape": "nurbsCurve",
        "|groom|guides_0|guide_1": "transform",
        "|groom|guides_0|guide_1|guide_1Shape": "nurbsCurve",
        "|groom|hair_0": "transform",
        "|groom|hair_0|hair_0": "transform",
        "|groom|hair_0|hair_0|hair_0Shape": "nurbsCurve",
    },
}
"""Nodes that the files bring, by full path."""
GUIDES = ["|groom|guides_0|guide_0", "|groom|guides_0|guide_1"]


@pytest.fixture
def stand() -> MayaStand:
    """A scene without nodes."""
    stand = MayaStand(SCENE)
    stand.values["shapes.weight"] = ["smile", "jaw_open"]
    return stand


@pytest.fixture
def scripts(
    stand: MayaStand, project: Path, monkeypatch: pytest.MonkeyPatch
) -> dict[str, ModuleType]:
    """The two scripts, loaded as Maya loads them."""
    for name, module in maya_modules(stand).items():
        monkeypatch.setitem(sys.modules, name, module)
    monkeypatch.syspath_prepend(str(project / "examples" / "maya"))
    loaded = {}
    for name in ("import_hairkit", "hairkit_shelf"):
        monkeypatch.delitem(sys.modules, name, raising=False)
        loaded[name] = importlib.import_module(name)
        monkeypatch.setitem(sys.modules, name, loaded[name])
    return loaded


def write(path: Path, seed: int = 1) -> Path:
    """Write a picture of skin."""
    path.write_bytes(Texture.encode(draw_skin(32, seed)).data.tobytes())
    return path


def groom_folder(folder: Path, *maps: str) -> Path:
    """Write the files of a groom; what is in them is said by `SCENE`."""
    for name in ("head.fbx", "guides.ma"):
        (folder / name).touch()
    for kind in maps:
        write(folder / f"head.{kind}.png")
    return folder


def test_each_file_goes_to_its_command(stand: MayaStand, scripts: dict[str, Any]) -> None:
    """Every kind of file to its command and plug-in; guides, no hair, are selected."""
    import_files = scripts["import_hairkit"].import_files
    assert import_files("guides.ma", "b.fbx", "c.abc", "d.usdc") == GUIDES
    assert stand.plugins == ["fbxmaya", "AbcImport", "mayaUsdPlugin"]
    assert stand.selected == GUIDES
    imports = [n for n in stand.done if n in ("file", "AbcImport", "mayaUSDImport")]
    assert imports == ["file", "file", "AbcImport", "mayaUSDImport"]
    with pytest.raises(ValueError, match="expected"):
        import_files("e.obj")


def test_a_groom_comes_in_one_go(
    stand: MayaStand, scripts: dict[str, Any], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Head, maps on a skin shader, blendshapes and guides, from a folder that the user chooses."""
    stand.chosen = [str(groom_folder(tmp_path, "albedo", "roughness", "normal", "bump"))]
    assert scripts["hairkit_shelf"].import_groom() == GUIDES
    assert "3 maps, 2 blendshapes, 2 guides" in capsys.readouterr().out
    assert stand.members == {"hairkit_skinSG": ["|head|headShape"]}
    wires = stand.connections
    assert wires["hairkit_skinSG.surfaceShader"] == "hairkit_skin.outColor"
    assert wires["hairkit_skin.baseColor"] == "hairkit_albedo.outColor"
    assert wires["hairkit_skin.subsurfaceColor"] == "hairkit_albedo.outColor"
    assert wires["hairkit_skin.specularRoughness"] == "hairkit_roughness.outAlpha"
    assert wires["hairkit_skin.normalCamera"] == "hairkit_normal_bump.outNormal"
    assert stand.values["hairkit_normal_bump.bumpInterp"] == 1
    assert stand.values["hairkit_albedo.colorSpace"] == "sRGB"
    assert stand.values["hairkit_normal.colorSpace"] == "Raw"
    assert stand.values["hairkit_albedo.fileTextureName"].endswith("/head.albedo.png")
    assert stand.selected == GUIDES


def test_a_head_without_maps_keeps_its_material(
    stand: MayaStand, scripts: dict[str, Any], tmp_path: Path
) -> None:
    """No shader is made; nothing happens where the user cancels; a missing file is named."""
    assert scripts["hairkit_shelf"].import_groom(str(groom_folder(tmp_path))) == GUIDES
    assert "standardSurface" not in stand.nodes.values()
    assert scripts["hairkit_shelf"].import_groom() == []
    (tmp_path / "guides.ma").unlink()
    with pytest.raises(FileNotFoundError, match=r"expected one of guides\.ma"):
        scripts["hairkit_shelf"].import_groom(str(tmp_path))


def test_the_shelf_has_a_button_for_each_tool(stand: MayaStand, scripts: dict[str, Any]) -> None:
    """Made twice it is there once, and what its buttons call exists."""
    shelf = scripts["hairkit_shelf"]
    for _ in range(2):
        shelf.make_shelf()
    assert stand.layouts == {"hairkit"}
    assert [b["label"] for b in stand.buttons] == ["import", "sharpen", "bump", "normal"]
    for button in stand.buttons:
        assert button["sourceType"] == "python"
        called = button["command"].removeprefix("import hairkit_shelf; hairkit_shelf.")
        assert callable(getattr(shelf, called.partition("(")[0]))
        compile(button["command"], "button", "exec")


def test_the_selected_map_is_worked_on(
    stand: MayaStand, scripts: dict[str, Any], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """hairkit runs on its picture; a bump map becomes a new node, a sharp map replaces the old."""
    shelf = scripts["hairkit_shelf"]
    monkeypatch.setattr(shelf, "COMMAND", [sys.executable, "-m", "hairkit"])
    picture = write(tmp_path / "head.albedo.png")
    node = shelf.make_file(picture, "albedo", colour=True)
    with pytest.raises(RuntimeError, match="select the file node"):
        shelf.work_on_texture("bump")
    stand.selected = [node]
    written = tmp_path / "head.albedo_bump.png"
    assert shelf.work_on_texture("bump") == [str(written)]
    wanted = bump_from_albedo(read_texture(picture).pixels)
    np.testing.assert_array_equal(read_texture(written).pixels[..., 0], wanted)
    assert stand.selected == ["hairkit_bump"]
    assert stand.values["hairkit_bump.colorSpace"] == "Raw"
    stand.selected, stand.chosen = [node], [str(write(tmp_path / "close_up.png", 2))]
    sharp = tmp_path / "head.albedo_sharpen.png"
    assert shelf.work_on_texture("sharpen") == [str(sharp)]
    assert stand.values[f"{node}.fileTextureName"] == sharp.as_posix()
    picture = tmp_path / "gone.png"
    stand.values[f"{node}.fileTextureName"] = str(picture)
    with pytest.raises(RuntimeError, match=r"^hairkit: .*gone\.png"):
        shelf.work_on_texture("bump")


def test_the_stand_in_refuses_what_maya_refuses(stand: MayaStand) -> None:
    """Unknown commands, flags, values and attributes."""
    with pytest.raises(AttributeError, match="importFile"):
        stand.importFile("a")
    with pytest.raises(TypeError, match="Invalid flag 'replaces'"):
        stand.select([], replaces=True)
    with pytest.raises(TypeError, match="Invalid arguments"):
        stand.ls(type=3)
    node = stand.shadingNode("file", asTexture=True, name="a")
    with pytest.raises(AssertionError):
        stand.setAttr(f"{node}.baseColor", 1.0)
    with pytest.raises(AssertionError):
        stand.connectAttr(f"{node}.outColor", f"{node}.alphaIsLuminance")
