"""Laws of scenes, their JSON form, and of grooms."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from hairkit import testing
from hairkit.errors import InputError
from hairkit.types.groom import HairMaterial
from hairkit.types.scene import Scene, read_cameras


def test_json_gives_the_cameras_back(tmp_path: Path) -> None:
    """What `write_json` wrote, `read_cameras` reads, names and order too."""
    scene = testing.turn_scene()
    scene.write_json(tmp_path / "scene.json")
    names, cameras = read_cameras(tmp_path / "scene.json")
    assert names == scene.names
    for back, camera in zip(cameras, scene.cameras, strict=True):
        np.testing.assert_array_equal(back.camera_from_head, camera.camera_from_head)
        assert back.focal == camera.focal
    document = json.loads((tmp_path / "scene.json").read_text())
    assert document["units"] == "metres"
    assert set(document["head"]["joints"]) == {"root", "neck", "head"}


@pytest.mark.parametrize("text", ["", "[]", "{}", '{"views": 3}', '{"views": [{"R": 1}]}', "\xff"])
def test_what_holds_no_cameras_is_refused(tmp_path: Path, text: str) -> None:
    """Any other file is told by name, in one line."""
    path = tmp_path / "scene.json"
    path.write_bytes(text.encode("latin-1"))
    with pytest.raises(InputError) as caught:
        read_cameras(path)
    assert "\n" not in str(caught.value)
    with pytest.raises(InputError, match="none"):
        read_cameras(tmp_path / "none.json")


def test_a_scene_has_a_name_for_every_camera() -> None:
    """Fewer names than cameras, or no camera, is refused."""
    scene = testing.turn_scene()
    with pytest.raises(InputError, match="8 cameras for 7 view names"):
        replace(scene, names=scene.names[:7])
    with pytest.raises(InputError, match="0 cameras"):
        Scene((), (), scene.head)


def test_roots_of_a_groom_lie_on_its_head() -> None:
    """Triangles that the head does not have, or too few of them, are refused."""
    groom = testing.bristle_groom()
    corners = groom.head.vertices[groom.head.faces[groom.root_triangle]]
    bound = np.einsum("sc,scx->sx", groom.root_barycentric, corners)
    np.testing.assert_allclose(bound, groom.strands.roots, atol=1e-6)
    with pytest.raises(InputError, match="faces that the head does not have"):
        replace(groom, root_triangle=groom.root_triangle + len(groom.head.faces))
    with pytest.raises(InputError, match="root_barycentric"):
        replace(groom, root_barycentric=groom.root_barycentric[1:])


@pytest.mark.parametrize("width", [0.0, -1e-5, float("nan")])
def test_hair_has_a_width(width: float) -> None:
    """A strand's diameter is above 0."""
    with pytest.raises(InputError, match="width"):
        HairMaterial(width=width)
