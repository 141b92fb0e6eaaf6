"""Maps beside an .apx file: what varies over the scalp, where its guides are."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest
from hairkit_plugins.hairworks.maps import widths
from PIL import Image
from rich_groom import rich_groom

from hairkit.colour import srgb_from_linear
from hairkit.errors import InputError
from hairkit.grooming.prepare_export import complete_groom
from hairkit.manager import Manager


@pytest.mark.parametrize("name", ["density", "width", "rootColor", "tipColor"])
def test_a_map_has_its_guides_values_where_they_are(name: str, tmp_path: Path) -> None:
    """The file names the picture; at a guide's texture coordinates is what the guide has."""
    groom, path = complete_groom(rich_groom()), tmp_path / "hair.apx"
    Manager.loaded().call("export_groom", "hairworks", {"maps": True}, groom=groom, path=path)
    assert f"hair_{name}.tga" in path.read_text()
    picture = np.asarray(Image.open(tmp_path / f"hair_{name}.tga"), np.float64)
    guides = groom.select(groom.strands.guide)
    strands = guides.strands
    assert strands.root_uv is not None
    assert strands.colours is not None
    ends = {"rootColor": strands.offsets[:-1], "tipColor": strands.offsets[1:] - 1}
    wanted = guides.root_density[:, None]
    if name == "width":
        wanted = widths(guides)[:, None] / widths(guides).max()
    if name in ends:
        wanted = srgb_from_linear(strands.colours[ends[name]])
    u, v = strands.root_uv.T * len(picture)
    rows = (len(picture) - v - 0.5).astype(np.float32), (u - 0.5).astype(np.float32)
    found = cv2.remap(picture, rows[1], rows[0], cv2.INTER_LINEAR).reshape(len(strands), -1)
    assert np.abs(found - 255 * wanted).mean() < 4
    assert np.abs(found - 255 * wanted[::-1]).mean() > 8


def test_a_groom_of_one_colour_and_density_has_no_maps(tmp_path: Path) -> None:
    """Nor has one for which they are not wanted."""
    groom, export = rich_groom(), Manager.loaded().call
    plain = replace(
        groom,
        head=replace(groom.head, density=None),
        strands=replace(groom.strands, colours=None, widths=None),
    )
    export("export_groom", "hairworks", {"maps": True}, groom=plain, path=tmp_path / "a.apx")
    export("export_groom", "hairworks", groom=groom, path=tmp_path / "b.apx")
    assert sorted(file.name for file in tmp_path.iterdir()) == ["a.apx", "b.apx"]


def test_a_name_that_the_format_cannot_hold_leaves_nothing(tmp_path: Path) -> None:
    """HairWorks' texts are ASCII; the maps are not written either."""
    with pytest.raises(InputError, match="ASCII"):
        Manager.loaded().call(
            "export_groom", "hairworks", {"maps": True},
            groom=rich_groom(), path=tmp_path / "Mähne.apx",
        )  # fmt: skip
    assert not list(tmp_path.iterdir())
