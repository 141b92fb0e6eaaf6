"""Laws of what is told of files of hair cards."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from hairkit_plugins import cards as plugin

import hairkit
from hairkit.cli import main
from hairkit.errors import FormatError
from hairkit.io.card_file import read_card_file
from hairkit.io.glb_file import GlbFile
from hairkit.testing import bristle_groom


def written(path: Path, **options: object) -> Path:
    """Return a file of few cards."""
    chosen = plugin.Options(cards=24, levels=2, atlas=256, stations=4, **options)  # type: ignore[arg-type]
    plugin.export_groom(bristle_groom(), path, chosen)
    return path


@pytest.mark.parametrize(
    ("name", "levels", "bones", "springs"),
    [
        ("a.cards.glb", 2, True, False),
        ("a.cards.obj", 1, False, False),
        ("a.vrm", 1, True, True),
    ],
)
def test_info_tells_what_cards_a_file_holds(
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    name: str,
    levels: int,
    bones: bool,
    springs: bool,
) -> None:
    """Its levels, each with its triangles (six for a card of four stations), bones and springs."""
    path = written(tmp_path / name, bones=3)
    assert main(["info", str(path), "--json"]) == 0
    facts = json.loads(capsys.readouterr().out)
    assert facts["kind"] == "cards"
    triangles = [level["triangles"] for level in facts["levels"].values()]
    assert [*facts["levels"]] == [f"cards_LOD{number}" for number in range(levels)]
    assert all(count % 6 == 0 and count > 0 for count in triangles)
    assert (np.diff(triangles) < 0).all()
    assert (facts["bones"] > 0) == bones
    assert (facts["springs"] > 0) == springs
    assert main(["info", str(path)]) == 0
    assert "cards_LOD0: triangles" in capsys.readouterr().out


def test_other_files_hold_no_cards(tmp_path: Path) -> None:
    """Heads and hair are left to their own readers; damaged documents are refused."""
    (tmp_path / "a.obj").write_text("o head\nv 0 0 0\n")
    assert read_card_file(tmp_path / "a.obj") is None
    (tmp_path / "a.gltf").write_text('{"asset": {"version": "2.0"}, "meshes": [{"name": "x"}]}')
    assert read_card_file(tmp_path / "a.gltf") is None
    assert read_card_file(tmp_path / "a.ply") is None
    (tmp_path / "b.gltf").write_text(
        '{"meshes": [{"name": "cards_LOD0", "primitives": [{"indices": 7}]}]}'
    )
    with pytest.raises(FormatError, match="not a readable glTF file"):
        read_card_file(tmp_path / "b.gltf")


@pytest.mark.parametrize("name", ["a.cards.glb", "a.vrm", "a.glb"])
def test_nodes_and_meshes_have_names_of_their_own(name: str, tmp_path: Path) -> None:
    """Loaders that go by names find one joint `head`, whatever levels of detail there are."""
    if name == "a.glb":
        hairkit.export(bristle_groom(), tmp_path / name, lods=3)
    else:
        written(tmp_path / name, bones=3)
    document = GlbFile(tmp_path / name).document
    for kind in ("nodes", "meshes"):
        names = [item["name"] for item in document[kind]]
        assert len(set(names)) == len(names)
    assert "head" in [node["name"] for node in document["nodes"]]


def test_an_avatar_of_others_is_told_as_a_head(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """A .vrm without our cards has no strands, but a body that can be measured, scalp or not."""
    hairkit.export(bristle_groom(), tmp_path / "a.glb", lines="none")
    (tmp_path / "a.glb").rename(tmp_path / "a.vrm")
    assert main(["info", str(tmp_path / "a.vrm")]) == 0
    assert "kind: head" in capsys.readouterr().out
    (tmp_path / "b.obj").write_text("v 0 0 0\nv 0.1 0 0\nv 0 0.1 0.1\nf 1 2 3\n")
    assert main(["info", str(tmp_path / "b.obj"), "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["scalp_vertices"] == 0
