"""Laws of the cards: they cover what the strands cover, and files say what they hold."""

from __future__ import annotations

import itertools
import json
import struct
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
from card_picture import TexturedMesh, draw_cards
from hairkit_plugins import cards as plugin
from hairkit_plugins.cards.bones import find_chains, weigh
from hairkit_plugins.cards.build import CardSet, build_cards
from hairkit_plugins.cards.locks import course, sort_into_locks
from hairkit_plugins.cards.packing import GAP, pack
from hairkit_plugins.cards.vrm import BODY

from hairkit.head_model.template import default_head
from hairkit.io.mesh_text import read_obj
from hairkit.manager import Manager
from hairkit.rendering import draw_layers
from hairkit.rendering.framing import framing_cameras
from hairkit.synth import grow
from hairkit.types.groom import Groom
from tests.support.clients_gltf import validated

SMALL = plugin.Options(cards=160, atlas=512, stations=6)
TURN = [(45.0 * view, 0.0) for view in range(8)]
REQUIRED_BONES = {
    "hips", "spine", "head",
    *(side + bone for side in ("left", "right") for bone in (
        "UpperLeg", "LowerLeg", "Foot", "UpperArm", "LowerArm", "Hand")),
}  # fmt: skip
"""Bones that VRM 1.0 requires."""


@cache
def groom(style: str = "wavy") -> Groom:
    """Return a groom whose strands differ in length."""
    return grow(style, default_head(), 3000, 0)  # type: ignore[arg-type]


@cache
def cards() -> CardSet:
    """Return the small cards of the wavy groom."""
    return build_cards(groom(), SMALL)


def picture(name: str) -> np.ndarray:
    """Return a map as (H, W, C) in the order of its file."""
    found = cv2.imdecode(np.frombuffer(cards().maps[name], np.uint8), cv2.IMREAD_UNCHANGED)
    return np.asarray(found)


def export(path: Path, **options: Any) -> dict[str, Any]:
    """Write the groom and return the JSON of a binary glTF."""
    plugin.export_groom(groom(), path, replace(SMALL, **options))
    data = path.read_bytes()
    (length,) = struct.unpack_from("<I", data, 12)
    document: dict[str, Any] = json.loads(data[20 : 20 + length])
    return document


def test_locks_nest_and_are_never_empty() -> None:
    """Each level has fewer locks, and a lock lies wholly in one of the next level."""
    fine, coarse = sort_into_locks(course(groom().strands), [100, 30])
    assert 80 < len(np.unique(fine)) == fine.max() + 1 <= 100
    assert 20 < len(np.unique(coarse)) == coarse.max() + 1 <= 30
    pairs = np.unique(np.stack([fine, coarse]), axis=1)
    assert pairs.shape[1] == fine.max() + 1


@pytest.mark.parametrize("level", range(4))
def test_cards_cover_what_the_strands_cover(level: int) -> None:
    """From eight views the coverage's intersection over union is 0.85 or more, 0.75 far away."""
    mesh, albedo = cards().levels[level], picture("albedo")
    cameras = framing_cameras(groom().strands.points, TURN, 144, 192)
    textured = TexturedMesh(
        mesh.vertices, mesh.faces, mesh.normals, mesh.uv, albedo[..., [2, 1, 0, 3]]
    )
    drawn = draw_cards(textured, groom().head, cameras)
    score = []
    for camera, shot in zip(cameras, drawn, strict=True):
        wanted = draw_layers(groom().strands, groom().head, camera, width=8e-5)[0] > 0.5
        found = shot[..., 3] > 127
        score.append((wanted & found).sum() / (wanted | found).sum())
    assert np.mean(score) > (0.85, 0.82, 0.78, 0.75)[level], score


def test_thick_strands_are_as_wide_on_cards() -> None:
    """Hair is drawn one texel wide; strands of several texels cover as many."""
    hair = groom()
    few = hair.strands.select(np.arange(len(hair.strands)) < 30)
    alone = replace(hair, strands=few, root_triangle=hair.root_triangle[:30],
                    root_barycentric=hair.root_barycentric[:30])  # fmt: skip
    covered = []
    for width in (8e-5, 4e-3):
        wide = replace(few, widths=np.full(len(few.points), width, np.float32))
        maps = build_cards(replace(alone, strands=wide), replace(SMALL, cards=30, levels=1)).maps
        alpha = cv2.imdecode(np.frombuffer(maps["alpha"], np.uint8), cv2.IMREAD_UNCHANGED)
        covered.append(int((alpha > 127).sum()))
    assert covered[1] > 2 * covered[0]


def test_cards_are_as_long_as_their_strands_and_face_away_from_the_head() -> None:
    """Lengths agree in the mean, normals point outward and are at right angles to the card."""
    level = cards().levels[0]
    strands = groom().strands
    longest = np.zeros(len(level.cards))
    np.maximum.at(longest, level.cards.lock, strands.lengths())
    ratio = level.cards.lengths() / longest
    assert 0.75 < np.median(ratio) < 1.05
    away = level.cards.centre - groom().head.vertices.mean(axis=0)
    assert ((level.cards.outward * away).sum(axis=2) > 0).mean() > 0.9
    along = np.gradient(level.cards.centre, axis=1)
    along /= np.linalg.norm(along, axis=2, keepdims=True)
    assert np.abs((level.cards.outward * along).sum(axis=2)).max() < 0.05
    corners = level.vertices[level.faces]
    facing = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    assert ((facing * level.normals[level.faces[:, 0]]).sum(axis=1) > 0).mean() > 0.92


def test_places_in_the_atlas_do_not_overlap() -> None:
    """Not even with the gap between them, and all lie inside."""
    places = pack([level.cards for level in cards().levels], SMALL.atlas)
    taken = np.zeros((SMALL.atlas, SMALL.atlas), np.int32)
    for place in places:
        for (x, y), (columns, rows) in zip(place.corner, place.size, strict=True):
            assert x + columns <= SMALL.atlas
            assert y + rows <= SMALL.atlas
            taken[y : y + rows + GAP, x : x + columns + GAP] += 1
    assert taken.max() == 1
    assert taken.mean() > 0.6


def test_maps_agree_where_hair_is() -> None:
    """Coverage is the albedo's alpha; flow runs along the card; colours are the material's."""
    albedo, flow, normal = picture("albedo"), picture("flow"), picture("normal")
    np.testing.assert_array_equal(albedo[..., 3], picture("alpha"))
    hair = albedo[..., 3] > 200
    assert 0.1 < hair.mean() < 0.9
    towards_root = flow[..., 1].astype(float)[hair] - 128
    assert np.median(towards_root) < -80, "strands run down the picture"
    length = np.linalg.norm(normal[hair].astype(float) - 128, axis=1)
    assert np.abs(length - 127).max() < 4
    assert picture("depth").shape == picture("id").shape == hair.shape
    assert len(np.unique(picture("id")[hair])) > 200


def test_the_atlas_shows_the_materials_colours() -> None:
    """Red hair makes red cards, root and tip."""
    red = replace(groom(), material=replace(groom().material, root_colour=np.array([0.5, 0, 0])))
    found = build_cards(red, replace(SMALL, levels=1, atlas=256)).maps["albedo"]
    pixels = cv2.imdecode(np.frombuffer(found, np.uint8), cv2.IMREAD_UNCHANGED)
    assert pixels[..., 2].max() > 180
    assert pixels[..., 2].max() > 2 * pixels[..., 0].max()


def test_equal_grooms_give_equal_cards() -> None:
    """Byte for byte, whatever the number of threads."""
    again = build_cards(groom(), SMALL)
    assert again.maps == cards().maps
    np.testing.assert_array_equal(again.levels[0].vertices, cards().levels[0].vertices)


def test_weights_sum_to_one_and_hold_the_roots() -> None:
    """Chains are 20 to 80; vertices follow four joints at most; roots follow first joints."""
    chains = find_chains(groom(), cards(), 24)
    assert 20 <= len(chains.first) - 1 <= 24
    level = cards().levels[0]
    joints, weights = weigh(level, chains)
    np.testing.assert_allclose(weights.sum(axis=1), 1, atol=1e-6)
    assert (joints[weights == 0] == 0).all()
    at_root = np.arange(len(level.vertices)).reshape(len(level.cards), -1)[:, :2].ravel()
    first = np.isin(joints[at_root], chains.first[:-1]) | (weights[at_root] == 0)
    assert first.all()
    tips = chains.first[1:] - 1
    assert not np.isin(joints[weights > 0], tips).any(), "the last joint turns nothing"


def test_the_files_pass_the_validator_of_khronos(tmp_path: Path) -> None:
    """Silent for .glb with and without bones; of .vrm it says that it does not know VRM."""
    document = export(tmp_path / "a.cards.glb")
    assert [scene["name"] for scene in document["scenes"]] == ["LOD0", "LOD1", "LOD2", "LOD3"]
    export(tmp_path / "b.cards.glb", bones=20)
    export(tmp_path / "c.vrm")
    plain, boned, vrm = validated([tmp_path / n for n in ("a.cards.glb", "b.cards.glb", "c.vrm")])
    assert plain["issues"]["messages"] == boned["issues"]["messages"] == []
    assert {m["code"] for m in vrm["issues"]["messages"]} == {"UNSUPPORTED_EXTENSION"}


def test_a_vrm_file_keeps_the_rules_of_vrm(tmp_path: Path) -> None:
    """Every required bone once, in its order; springs are chains of children; groups exist."""
    document = export(tmp_path / "hair.vrm", author="A. Stylist", bones=30)
    vrm, spring = (document["extensions"][n] for n in ("VRMC_vrm", "VRMC_springBone"))
    assert vrm["specVersion"] == spring["specVersion"] == "1.0"
    assert vrm["meta"]["authors"] == ["A. Stylist"]
    bones = {name: bone["node"] for name, bone in vrm["humanoid"]["humanBones"].items()}
    assert set(bones) >= REQUIRED_BONES
    assert len(set(bones.values())) == len(bones)
    nodes = document["nodes"]
    parent = {child: n for n, node in enumerate(nodes) for child in node.get("children", [])}
    for name, above, _ in BODY:
        assert parent.get(bones[name]) == (bones[above] if above else None)
    assert 20 <= len(spring["springs"]) <= 80
    used: list[int] = []
    for chain in spring["springs"]:
        members = [joint["node"] for joint in chain["joints"]]
        assert len(members) >= 3
        assert parent[members[0]] == bones["head"]
        assert all(parent[b] == a for a, b in itertools.pairwise(members))
        assert all(0 <= joint["dragForce"] <= 1 for joint in chain["joints"])
        assert all(0 <= g < len(spring["colliderGroups"]) for g in chain["colliderGroups"])
        used += members
    assert len(used) == len(set(used)), "no joint swings twice"
    assert len(spring["colliders"]) == len(groom().head.capsules.first)
    world = np.zeros(3)
    node = bones["leftFoot"]
    while node is not None:
        world += nodes[node].get("translation", [0, 0, 0])
        node = parent.get(node)  # type: ignore[assignment]
    assert 0 < world[1] < 0.2, "it stands on the ground"
    assert world[0] > 0, "its left is +X"


def test_the_manager_finds_the_plugin_by_the_long_ending(tmp_path: Path) -> None:
    """`.cards.obj` writes a file a level, which reads back as a mesh, and the maps beside it."""
    from hairkit.pipeline.open_groom import plugin_for

    path = tmp_path / "hair.cards.obj"
    assert plugin_for(Manager.loaded(), "export_groom", path) == "cards"
    assert plugin_for(Manager.loaded(), "export_groom", tmp_path / "hair.glb") == "gltf"
    plugin.export_groom(groom(), path, SMALL)
    names = {file.name for file in tmp_path.iterdir()}
    assert names == {
        "hair.cards.obj", "hair.mtl", *(f"hair_LOD{n}.cards.obj" for n in (1, 2, 3)),
        *(f"hair.{m}.png" for m in ("albedo", "alpha", "normal", "flow", "depth", "id")),
    }  # fmt: skip
    mesh = read_obj(path)
    assert len(mesh.faces) == len(cards().levels[0].faces)
