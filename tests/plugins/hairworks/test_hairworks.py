"""Laws of the HairWorks exporter and importer."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest
from hairkit_plugins import hairworks
from hairkit_plugins.hairworks import schema
from references import reference

from hairkit.errors import InputError
from hairkit.types.groom import Groom, HairMaterial, HairPhysics
from hairkit.types.head import Capsules, Head
from hairkit.types.strands import Strands

CLASSES = ["HairWorksInfo", "HairSceneDescriptor", "HairAssetDescriptor", "HairInstanceDescriptor"]
ASSET_FIELDS = """
numGuideHairs U32, numVertices U32, vertices Vec3, endIndices U32, numFaces U32, faceIndices U32,
faceUVs Vec2, numBones U32, boneIndices Vec4, boneWeights Vec4, boneNames U8, boneNameList String,
bindPoses Mat44, boneParents I32, numBoneSpheres U32, boneSpheres Struct, numBoneCapsules U32,
boneCapsuleIndices U32, numPinConstraints U32, pinConstraints Struct, sceneUnit F32, upAxis U32,
handedness U32
"""


def cap_groom(side: int = 4, points: int = 12) -> Groom:
    """Return a dome-shaped head with side^2 guides of uneven point counts, two capsules."""
    rng = np.random.default_rng(5)
    grid = np.linspace(-0.06, 0.06, 7)
    x, z = (axis.ravel() for axis in np.meshgrid(grid, grid, indexing="ij"))
    vertices = np.stack([x, 0.1 - 8 * (x**2 + z**2), z], axis=1).astype(np.float32)
    cell = np.arange(49).reshape(7, 7)
    a, b = cell[:-1, :-1].ravel(), cell[:-1, 1:].ravel()
    c, d = cell[1:, :-1].ravel(), cell[1:, 1:].ravel()
    faces = np.concatenate([np.stack([a, b, c], 1), np.stack([b, d, c], 1)]).astype(np.int32)
    uv = np.stack([x + 0.06, z + 0.06], axis=1).astype(np.float32) / 0.12
    capsules = Capsules(
        np.array([[0, 0.05, 0], [0, -0.1, -0.02]], np.float32),
        np.array([[0, 0.02, 0.01], [0, -0.05, -0.02]], np.float32),
        np.array([[0.05, 0.06], [0.04, 0.04]], np.float32),
    )
    joints = np.array([[0, -0.3, 0], [0, -0.1, -0.02], [0, 0.02, 0]], np.float32)
    head = Head(vertices, faces, uv, np.ones(49, np.float32), None, joints, capsules)
    triangle = rng.choice(len(faces), side**2, replace=False).astype(np.int32)
    barycentric = rng.dirichlet([4, 4, 4], side**2).astype(np.float32)
    roots = np.einsum("nk,nkc->nc", barycentric, vertices[faces[triangle]])
    strands = []
    for root in roots:
        count = int(rng.integers(points, 2 * points))
        steps = rng.normal([0, -0.004, 0.004], 0.002, (count - 1, 3))
        strands.append(np.vstack([root, root + np.cumsum(steps, axis=0)]))
    return Groom(
        Strands.from_list(strands),
        head,
        triangle,
        barycentric,
        HairMaterial(np.array([0.2, 0.1, 0.05]), np.array([0.3, 0.2, 0.1]), 7e-5),
        HairPhysics(0.3, 0.7, 0.02, 0.15, 9.81),
    )


def written(groom: Groom, path: Path, **options: object) -> ElementTree.Element:
    hairworks.export_groom(groom, path, hairworks.Options(**options))
    return ElementTree.fromstring(path.read_text("ascii"))


def fields_of(root: ElementTree.Element, name: str) -> dict[str, ElementTree.Element]:
    found = next(value for value in root if value.get("className") == name)
    return {element.get("name", ""): element for element in found[0]}


def numbers(element: ElementTree.Element) -> np.ndarray:
    return np.array((element.text or "").replace(",", " ").split(), float)


@pytest.fixture
def exported(tmp_path: Path) -> ElementTree.Element:
    return written(cap_groom(), tmp_path / "hair.apx")


def test_frame_is_that_of_nvidias_files(tmp_path: Path) -> None:
    """No XML prolog, the bare DOCTYPE, four objects, ASCII, line feeds."""
    written(cap_groom(), tmp_path / "hair.apx")
    raw = (tmp_path / "hair.apx").read_bytes()
    head = b'<!DOCTYPE NvParameters>\n<NvParameters numObjects="4" version="1.0" >\n'
    assert raw.startswith(head)
    assert raw.endswith(b"</NvParameters>\n")
    assert raw.isascii()
    assert b"\r" not in raw


def test_classes_stand_in_order_with_checksums(exported: ElementTree.Element) -> None:
    """Class order, versions and checksums are those of version 1.1."""
    assert [value.get("className") for value in exported] == CLASSES
    assert {value.get("version") for value in exported} == {"1.1"}
    sums = [value.get("checksum", "").split() for value in exported]
    assert [s[0] for s in sums] == ["0xd225a2e5", "0x299b335f", "0xce296058", "0x4998e6df"]
    assert [s[-1] for s in sums] == ["0x7230aea", "0xa3094fa7", "0xd878cd3", "0x29c4b445"]


def test_info_and_textures(exported: ElementTree.Element) -> None:
    """Five info strings and sixteen textures, the odd spelling and the unset ones included."""
    info = fields_of(exported, "HairWorksInfo")
    wanted = ["fileVersion", "toolVersion", "sourcePath", "authorName", "lastModified"]
    assert list(info) == wanted
    assert info["fileVersion"].text == "1.1"
    textures = fields_of(exported, "HairSceneDescriptor")
    assert len(textures) == 16
    assert "waveScaletexture" in textures
    unset = [name for name, element in textures.items() if element.get("null") == "1"]
    assert unset == ["rootWidthTexture", "tipWidthTexture", "clumpNoiseTexture"]


def test_asset_fields_stand_in_order(exported: ElementTree.Element) -> None:
    """Names and types of the asset descriptor, in the order the schema's checksum stands for."""
    found = [(n, e.get("type")) for n, e in fields_of(exported, "HairAssetDescriptor").items()]
    assert found == [tuple(entry.split()) for entry in ASSET_FIELDS.split(",")]


def test_four_materials_of_130_values(exported: ElementTree.Element) -> None:
    """HairWorks writes past its array when a material is missing."""
    materials = fields_of(exported, "HairInstanceDescriptor")["materials"]
    assert len(materials) == int(materials.get("size", 0)) == 4
    for material in materials:
        names = [element.get("name") for element in material]
        assert len(names) == len(set(names)) == 130
        assert (names[0], names[14], names[-1]) == ("name", "width", "enable")
        types = {element.get("name"): element.get("type") for element in material}
        assert types["gravity"] == "Vec3"
        assert types["rootColor"] == "Vec4"
        assert types["diffuseBoneIndex"] == "U32"


def test_numeric_arrays_end_with_white_space(exported: ElementTree.Element) -> None:
    """FurViewer crashes on an array whose text ends with a number."""
    for element in exported.iter("array"):
        if (element.text or "").strip():
            assert (element.text or "")[-1].isspace(), element.get("name")


def test_sizes_say_what_is_there(exported: ElementTree.Element) -> None:
    """Every array's size is its number of elements, and vectors are parted by commas."""
    asset = fields_of(exported, "HairAssetDescriptor")
    components = {"Struct": 5, **schema.COMPONENTS}
    for name, element in asset.items():
        if element.tag == "array" and element.get("type") != "String":
            size, kind = int(element.get("size", -1)), element.get("type", "")
            assert len(numbers(element)) == size * components[kind], name
            commas = (element.text or "").count(",")
            assert commas == (max(size - 1, 0) if components[kind] > 1 else 0), name
    guides, points = int(asset["numGuideHairs"].text or 0), int(asset["numVertices"].text or 0)
    assert points == 16 * guides
    assert np.array_equal(numbers(asset["endIndices"]), np.arange(1, guides + 1) * 16 - 1)


def test_growth_mesh_is_made_of_the_roots(exported: ElementTree.Element) -> None:
    """Every guide is a corner, and faces turn counter-clockwise seen from where hair grows to."""
    asset = fields_of(exported, "HairAssetDescriptor")
    faces = numbers(asset["faceIndices"]).astype(int).reshape(-1, 3)
    assert np.array_equal(np.unique(faces), np.arange(int(asset["numGuideHairs"].text or 0)))
    roots = numbers(asset["vertices"]).reshape(-1, 16, 3)[:, 0]
    a, b, c = roots[faces[:, 0]], roots[faces[:, 1]], roots[faces[:, 2]]
    assert (np.cross(b - a, c - a)[:, 1] > 0).all()


def test_texture_coordinates_run_down(tmp_path: Path) -> None:
    """V is 0 at the top in the file and at the bottom in a groom."""
    groom = cap_groom()
    uv = np.random.default_rng(1).random((len(groom.strands), 2)).astype(np.float32)
    groom = replace(groom, strands=replace(groom.strands, root_uv=uv))
    asset = fields_of(written(groom, tmp_path / "hair.apx"), "HairAssetDescriptor")
    faces = numbers(asset["faceIndices"]).astype(int)
    found = numbers(asset["faceUVs"]).reshape(-1, 2)
    assert np.allclose(found[:, 0], uv[faces, 0], atol=1e-6)
    assert np.allclose(found[:, 1], 1 - uv[faces, 1], atol=1e-6)


def test_bones_are_global_row_vector_poses(exported: ElementTree.Element) -> None:
    """Three bones, the place of each in the last row of its pose, every guide on the head."""
    asset = fields_of(exported, "HairAssetDescriptor")
    names = [element.text for element in asset["boneNameList"]]
    assert names == ["root", "neck", "head"]
    spelt = "".join(chr(int(byte)) for byte in numbers(asset["boneNames"]))
    assert spelt == "root\0neck\0head\0"
    assert numbers(asset["boneParents"]).tolist() == [-1, 0, 1]
    poses = numbers(asset["bindPoses"]).reshape(3, 4, 4)
    assert np.allclose(poses[:, 3, :3], 100 * cap_groom().head.joints, atol=1e-4)
    assert np.allclose(poses[:, :, 3], [0, 0, 0, 1])
    weights = numbers(asset["boneWeights"]).reshape(-1, 4)
    assert np.allclose(weights.sum(axis=1), 1)
    assert (numbers(asset["boneIndices"]).reshape(-1, 4)[:, 0] == 2).all()


@pytest.mark.parametrize("axis", ["y_up", "z_up"])
@pytest.mark.parametrize(("unit", "scale"), [("cm", 100.0), ("m", 1.0)])
def test_unit_and_axis_are_declared_and_kept(
    tmp_path: Path, axis: str, unit: str, scale: float
) -> None:
    """Lengths scale with the unit; z_up is (x, -z, y); gravity pulls down the file's own axis."""
    groom = cap_groom()
    root = written(groom, tmp_path / "hair.apx", axis=axis, unit=unit)
    asset = fields_of(root, "HairAssetDescriptor")
    points = numbers(asset["vertices"]).reshape(-1, 3) / scale
    wanted = groom.strands.resampled(16).points
    if axis == "z_up":
        wanted = np.stack([wanted[:, 0], -wanted[:, 2], wanted[:, 1]], axis=1)
    assert np.allclose(points, wanted, atol=1e-7)
    assert asset["sceneUnit"].text == {"cm": "1", "m": "100"}[unit]
    assert asset["upAxis"].text == {"y_up": "1", "z_up": "2"}[axis]
    assert asset["handedness"].text == "1"
    material = fields_of(root, "HairInstanceDescriptor")["materials"][0]
    gravity = next(element.text for element in material if element.get("name") == "gravity")
    assert gravity == {"y_up": "0 -1 0", "z_up": "0 0 -1"}[axis]


@pytest.mark.parametrize("axis", ["y_up", "z_up"])
@pytest.mark.parametrize("unit", ["cm", "m"])
def test_export_then_import_gives_the_same_groom(tmp_path: Path, axis: str, unit: str) -> None:
    """Points, material, physics, skeleton and collision shapes come back to float precision."""
    groom, path = cap_groom(), tmp_path / "hair.apx"
    hairworks.export_groom(groom, path, hairworks.Options(axis=axis, unit=unit))
    back = hairworks.import_groom(path, hairworks.Options())
    wanted = groom.strands.resampled(16)
    assert np.allclose(back.strands.points, wanted.points, rtol=2e-7, atol=1e-8)
    assert np.array_equal(back.strands.offsets, wanted.offsets)
    assert np.allclose(back.head.joints, groom.head.joints, atol=1e-8)
    for name in ("first", "second", "radius"):
        found, true = (getattr(g.head.capsules, name) for g in (back, groom))
        assert np.allclose(found, true, atol=1e-7), name
    assert np.allclose(back.material.root_colour, groom.material.root_colour)
    assert back.material.width == pytest.approx(groom.material.width)
    for name in ("stiffness", "bend_stiffness", "damping", "friction", "gravity"):
        assert getattr(back.physics, name) == pytest.approx(getattr(groom.physics, name)), name
    corners = back.head.vertices[back.head.faces[back.root_triangle]]
    bound = np.einsum("nk,nkc->nc", back.root_barycentric, corners)
    assert np.allclose(bound, back.strands.roots, atol=1e-8)
    assert (back.head.normals()[:, 1] > 0).all()


def test_equal_grooms_are_equal_files(tmp_path: Path) -> None:
    """Neither the clock nor the machine is in the file."""
    for name in ("a", "b"):
        hairworks.export_groom(cap_groom(), tmp_path / name, hairworks.Options())
    assert (tmp_path / "a").read_bytes() == (tmp_path / "b").read_bytes()


def test_only_guides_are_written(tmp_path: Path) -> None:
    """Interpolated hair is left to HairWorks, which makes its own."""
    groom = cap_groom()
    guide = np.arange(len(groom.strands)) % 3 != 1
    mixed = replace(groom, strands=replace(groom.strands, guide=guide))
    hairworks.export_groom(mixed, tmp_path / "hair.apx", hairworks.Options())
    back = hairworks.import_groom(tmp_path / "hair.apx", hairworks.Options())
    assert np.allclose(back.strands.roots, groom.strands.roots[guide], atol=1e-7)


def test_waves_are_written_where_the_points_cannot_show_them(tmp_path: Path) -> None:
    """Curls finer than the guides' points become wave parameters, coarser ones stay points."""
    groom = cap_groom()
    fine = replace(groom, material=replace(groom.material, curl_radius=0.004, curl_pitch=0.01))
    hairworks.export_groom(fine, tmp_path / "f", hairworks.Options(points_per_strand=6))
    back = hairworks.import_groom(tmp_path / "f", hairworks.Options()).material
    assert back.curl_radius == pytest.approx(0.004)
    assert back.curl_pitch == pytest.approx(0.01, rel=0.05)
    hairworks.export_groom(fine, tmp_path / "c", hairworks.Options(points_per_strand=64))
    assert hairworks.import_groom(tmp_path / "c", hairworks.Options()).material.curl_radius == 0


def test_too_few_guides_are_refused(tmp_path: Path) -> None:
    """A growth mesh needs a triangle; nothing is left half-written."""
    groom = cap_groom()
    pair = groom.strands.select([0, 1])
    two = Groom(pair, groom.head, groom.root_triangle[:2], groom.root_barycentric[:2])
    with pytest.raises(InputError, match="at least 3"):
        hairworks.export_groom(two, tmp_path / "hair.apx", hairworks.Options())
    assert list(tmp_path.iterdir()) == []


def test_roots_that_share_a_place_all_get_a_face(tmp_path: Path) -> None:
    """A guide doubled at its root still stands on the growth mesh."""
    groom = cap_groom()
    index = np.concatenate([[0], np.arange(len(groom.strands))])
    doubled = Groom(
        groom.strands.select(index),
        groom.head,
        groom.root_triangle[index],
        groom.root_barycentric[index],
    )
    hairworks.export_groom(doubled, tmp_path / "hair.apx", hairworks.Options())
    back = hairworks.import_groom(tmp_path / "hair.apx", hairworks.Options())
    assert np.allclose(back.strands.roots[0], back.strands.roots[1], atol=1e-7)


@pytest.mark.parametrize("text", ["\u00e9", "line\nbreak", "x" * 200])
def test_texts_hairworks_cannot_hold_are_refused(tmp_path: Path, text: str) -> None:
    """Names are printable ASCII below 128 letters."""
    with pytest.raises(InputError, match="authorName"):
        hairworks.export_groom(cap_groom(), tmp_path / "a", hairworks.Options(author=text))


def test_texts_are_escaped(tmp_path: Path) -> None:
    """Markup in an author's name stays a name."""
    path = tmp_path / "hair.apx"
    hairworks.export_groom(cap_groom(), path, hairworks.Options(author="a<b>&c"))
    assert hairworks.read_apx(path).info[3] == "a<b>&c"


def test_nvidias_own_file_has_our_structure(tmp_path: Path) -> None:
    """A file of NVIDIA's tools is read, and has the fields we write, in our order."""
    path = reference("apx/ExampleAsset_unity3d-jp.apx")
    theirs = ElementTree.fromstring(path.read_bytes())
    ours = written(cap_groom(), tmp_path / "hair.apx")

    def structure(root: ElementTree.Element) -> list[tuple[str | None, ...]]:
        skipped = ("boneNameList",)
        keys = ("name", "type", "className", "version", "checksum", "structElements")
        return [
            (element.tag, *(element.get(key) for key in keys))
            for parent in root.iter()
            if parent.get("name") not in skipped
            for element in parent
        ]

    assert structure(ours) == structure(theirs)
    groom = hairworks.import_groom(path, hairworks.Options())
    assert len(groom.strands) == 451
    assert set(groom.strands.counts) == {5}
