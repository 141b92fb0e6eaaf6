"""Laws of the glTF exporter and importer."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh
from client_groom import swinging
from clients_gltf import complaints
from gltf_player import Client, GltfPlayer
from hairkit_plugins import gltf

from hairkit.errors import FormatError, InputError
from hairkit.grooming.prepare_export import complete_groom
from hairkit.head_model.bust import bust_under
from hairkit.head_model.template import default_head
from hairkit.io.glb_file import GlbFile
from hairkit.io.glb_motion import read_head_motion
from hairkit.io.head_reader import read_head
from hairkit.io.polylines import join_segments
from hairkit.simulation.motion import turn_about
from hairkit.synth import grow
from hairkit.testing import ball_head, bristle_groom
from hairkit.types.groom import Groom, HairMaterial, HairPhysics
from hairkit.types.point_cache import PointCache
from hairkit.types.strands import Strands
from hairkit.types.torso_shape import TorsoShape


def rich_groom() -> Groom:
    """Return hair with everything a groom can hold: uneven strands, widths, groups, guides."""
    groom = bristle_groom()
    rng = np.random.default_rng(3)
    strands = [
        points[: 2 + number % 4] + rng.normal(scale=1e-4, size=(2 + number % 4, 3))
        for number, points in enumerate(groom.strands.points.reshape(-1, 5, 3))
    ]
    packed = Strands.from_list(strands)
    full = replace(
        packed,
        widths=rng.uniform(5e-5, 1e-4, len(packed.points)),
        root_uv=groom.strands.root_uv,
        group=np.arange(len(packed)) % 3 - 1,
        guide=np.arange(len(packed)) % 5 > 0,
    )
    head = replace(ball_head(), landmark_vertices=np.arange(68))
    look = HairMaterial(np.array([0.2, 0.1, 0.04]), np.array([0.3, 0.2, 0.1]), 7e-5, 0.004, 0.03)
    physics = HairPhysics(0.3, 0.7, 0.02, 0.15, 9.7)
    return replace(groom, strands=full, head=head, material=look, physics=physics)


def waving_cache(groom: Groom, frames: int = 6) -> PointCache:
    """Return a head that turns and nods while the tips of the hair sway."""
    strands = groom.strands
    share = strands.arc_lengths() / strands.arc_lengths().max()
    time = np.arange(frames) / 30
    motion = np.tile(np.eye(4), (frames, 1, 1))
    angle = np.sin(9 * time)
    motion[:, 0, 0] = motion[:, 2, 2] = np.cos(angle)
    motion[:, 0, 2], motion[:, 2, 0] = np.sin(angle), -np.sin(angle)
    motion[:, 1, 3] = 0.05 * time
    sway = (
        0.01
        * share[None, :, None]
        * np.stack([np.sin(20 * time), 0 * time, np.cos(13 * time)], axis=1)[:, None]
    )
    points = (strands.points + sway) @ motion[:, :3, :3].transpose(0, 2, 1)
    return PointCache(points + motion[:, None, :3, 3], time, motion)


def written(folder: Path, groom: Groom, name: str = "a.glb", **options: Any) -> Path:
    gltf.export_groom(groom, folder / name, gltf.Options(**options))
    return folder / name


def attribute(file: GlbFile, mesh: str, name: str) -> np.ndarray:
    found = next(item for item in file.document["meshes"] if item["name"] == mesh)
    return file.numbers(found["primitives"][0]["attributes"][name])


@pytest.mark.parametrize("hair", ["none", "ribbons"])
def test_round_trip_is_identity(tmp_path: Path, hair: str) -> None:
    """Everything that the format declares exact comes back within float32."""
    plain = rich_groom()
    torso = TorsoShape(breadth=1.2, drop=-0.01, yaw=0.1)
    groom = replace(plain, head=replace(plain.head, torso=torso))
    found = gltf.import_groom(written(tmp_path, groom, hair=hair, strips=50), gltf.Options())
    assert vars(found.head.torso) == vars(torso)
    for name in ("points", "offsets", "widths", "group", "guide"):
        np.testing.assert_array_equal(getattr(found.strands, name), getattr(groom.strands, name))
    np.testing.assert_allclose(found.strands.root_uv, groom.strands.root_uv, atol=1e-7)
    for name in ("vertices", "faces", "scalp", "joints", "landmark_vertices"):
        np.testing.assert_array_equal(getattr(found.head, name), getattr(groom.head, name))
    np.testing.assert_allclose(found.head.uv, groom.head.uv, atol=1e-7)
    for name in ("first", "second", "radius"):
        np.testing.assert_array_equal(
            getattr(found.head.capsules, name), getattr(groom.head.capsules, name)
        )
    for thing in ("material", "physics"):
        for name, value in vars(getattr(groom, thing)).items():
            np.testing.assert_array_equal(getattr(getattr(found, thing), name), value)


def test_equal_grooms_are_equal_files(tmp_path: Path) -> None:
    """Written twice, byte for byte the same."""
    one, two = (written(tmp_path, rich_groom(), name, strips=40) for name in ("a.glb", "b.glb"))
    assert one.read_bytes() == two.read_bytes()


OPTIONS: list[dict[str, Any]] = [
    {"strips": 60},
    {"hair": "cards", "strips": 30, "alpha": "BLEND", "lods": 3},
    {"hair": "none", "lines": "guides", "head_mesh": False},
    {"lines": "none", "alpha": "OPAQUE", "strips": 20, "strip_width": 0.004},
    {"hair": "none", "strands": "hair"},
    {"cache": 1, "strips": 60, "lods": 2},
    {"cache": 1, "strips": 10, "hair": "cards", "morphs": 2, "frame_step": 2},
    {"cache": 1, "animation": "skin", "strips": 20},
    {"cache": 1, "animation": "none", "strips": 20},
    {"hairs": 400, "strips": 20},
]


def test_khronos_validator_is_silent(tmp_path: Path) -> None:
    """No error, warning or information, whatever the options."""
    groom = rich_groom()
    cache = tmp_path / "cache.npz"
    waving_cache(groom.select(groom.strands.guide)).save(cache)
    files = []
    for number, options in enumerate(OPTIONS):
        chosen = options | ({"cache": cache} if "cache" in options else {})
        files.append(written(tmp_path, groom, f"{number}.glb", **chosen))
    assert complaints(files) == []


def test_ribbons_are_as_many_as_asked(tmp_path: Path) -> None:
    """Strips, points and levels of detail are counted; each level has half the strips, wider."""
    path = written(tmp_path, rich_groom(), strips=64, strip_points=8, lods=3, strip_width=0.002)
    file = GlbFile(path)
    assert len(file.document["scenes"]) == 3
    assert len(attribute(file, "hair_LOD0", "POSITION")) == 64 * 8 * 2
    widest = []
    for level, count in enumerate([64, 32, 16]):
        uv = attribute(file, f"hair_LOD{level}", "TEXCOORD_0")
        assert ((uv == 0).all(axis=1)).sum() <= count
        left, right = (
            attribute(file, f"hair_LOD{level}", "POSITION").reshape(-1, 2, 3).swapaxes(0, 1)
        )
        widest.append(np.linalg.norm(left - right, axis=1).max())
    np.testing.assert_allclose(widest, [0.002, 0.004, 0.008], rtol=0.05)


def test_colours_are_the_captured_ones(tmp_path: Path) -> None:
    """Base colour times vertex colour is the root's colour at the root, the tip's at the tip."""
    groom = rich_groom()
    file = GlbFile(written(tmp_path, groom, strips=40))
    look = next(item for item in file.document["materials"] if item["name"] == "hair")
    factor = np.array(look["pbrMetallicRoughness"]["baseColorFactor"][:3])
    colour = attribute(file, "hair_LOD0", "COLOR_0")[:, :3] * factor
    v = attribute(file, "hair_LOD0", "TEXCOORD_0")[:, 1]
    for share, want in ((0, groom.material.root_colour), (1, groom.material.tip_colour)):
        strips = colour[v == share]
        assert (strips <= want + 1e-2).all()
        assert (strips >= 0.79 * want - 1e-2).all()


def test_trimesh_reads_points_and_triangles(tmp_path: Path) -> None:
    """Another reader finds the strands' points, their attributes and all triangles."""
    groom = rich_groom()
    found = list(
        trimesh.load(written(tmp_path, groom, strips=50, strip_points=4)).geometry.values()
    )
    lines = next(item for item in found if isinstance(item, trimesh.path.Path3D))
    np.testing.assert_array_equal(lines.vertices, groom.strands.points)
    owner = np.ravel(lines.vertex_attributes["_STRAND_ID"])
    np.testing.assert_array_equal(owner, groom.strands.strand_of_point)
    counts = {len(item.faces) for item in found if isinstance(item, trimesh.Trimesh)}
    assert counts == {len(groom.head.faces), 50 * 3 * 2}


def test_custom_attributes_are_scalars(tmp_path: Path) -> None:
    """Blender 4.5 fails on custom attributes of different widths in one mesh."""
    file = GlbFile(written(tmp_path, rich_groom(), strips=10))
    kinds = {
        (accessor["type"], accessor["componentType"])
        for mesh in file.document["meshes"]
        for name, number in mesh["primitives"][0]["attributes"].items()
        if name.startswith("_")
        for accessor in [file.document["accessors"][number]]
    }
    assert kinds == {("SCALAR", 5126)}


def test_a_written_head_is_a_head_again(tmp_path: Path) -> None:
    """`read_head` takes the head out of a file with hair; its scalp is marked."""
    groom = rich_groom()
    head = read_head(written(tmp_path, groom, strips=50))
    np.testing.assert_array_equal(head.vertices, groom.head.vertices)
    np.testing.assert_array_equal(head.scalp, groom.head.scalp)


@pytest.mark.parametrize(("waves", "fewest", "most"), [(150, 100, 120), (6, 7, 7)])
def test_every_client_plays_the_cache_at_every_frame(
    tmp_path: Path, waves: int, fewest: int, most: int
) -> None:
    """Over 120 frames head, lines and ribbons are where the cache has them, within 0.1 mm.

    Motion of many waves takes about a shape a frame; of few, one more than these. Blender
    clamps weights to 0 to 1, three.js skins no lines.
    """
    groom = bristle_groom().select(np.arange(len(bristle_groom().strands)) < 20)
    cache = swinging(groom, 120, np.linspace(0.05, 3, waves))
    cache.save(tmp_path / "cache.npz")
    path = written(tmp_path, groom, strips=20, strip_points=5, cache=tmp_path / "cache.npz")
    player = GltfPlayer(path)
    assert fewest <= len(player.json["meshes"][-1]["primitives"][0]["targets"]) <= most
    np.testing.assert_allclose(player.times, cache.times, atol=1e-6)
    top = groom.head.scalp > 0.5
    for time, points, turn in zip(player.times, cache.points, cache.head_from_rest, strict=True):
        skin = groom.head.vertices @ turn[:3, :3].T + turn[:3, 3]
        clients: tuple[Client, ...] = ("blender", "three")
        for client in clients:
            lines, hair, head = (
                player.mesh(name, time, client) for name in ("guides", "hair_LOD0", "head_mesh")
            )
            np.testing.assert_allclose(lines, points, atol=1e-4)
            np.testing.assert_allclose(hair.reshape(-1, 2, 3).mean(axis=1), points, atol=1e-4)
            np.testing.assert_allclose(head[top], skin[top], atol=1e-5)


def test_the_bust_goes_where_the_head_goes(tmp_path: Path) -> None:
    """A head that jumps takes the torso along; one that turns about the neck does not."""
    groom = grow("straight", default_head(), 20, 0)
    cache, joint = swinging(groom, 4, np.ones(1)), groom.head.joints[1].astype(np.float64)
    motion = np.stack([turn_about(joint, ("yaw", 0.3 * frame)) for frame in range(4)])
    jump = np.array([0.1, 0.15, -0.2])
    motion[2:, :3, 3] += jump
    replace(cache, head_from_rest=motion).save(tmp_path / "cache.npz")
    path = written(tmp_path, groom, animation="skin", strips=5, cache=tmp_path / "cache.npz")
    player, bust = GltfPlayer(path), bust_under(groom.head, groom.strands)
    assert bust is not None
    for time, shift in zip(player.times, [0, 0, 1, 1], strict=True):
        places = player.mesh("torso", time, "three") - bust.vertices
        np.testing.assert_allclose(places - shift * jump, 0, atol=1e-6)


def test_fewer_shapes_than_the_motion_needs_are_told(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    """With morphs=4 the loss is printed, and no weight lies outside 0 to 1."""
    groom = bristle_groom()
    swinging(groom, 20, np.linspace(0.05, 3, 12)).save(tmp_path / "cache.npz")
    path = written(tmp_path, groom, strips=5, morphs=4, cache=tmp_path / "cache.npz")
    assert "20 frames in 4 morph targets are off by" in caplog.text
    file = GlbFile(path)
    weights = file.numbers(file.document["animations"][0]["samplers"][-1]["output"])
    assert weights.shape == (20 * 4, 1)
    assert weights.min() >= 0
    assert weights.max() <= 1


def test_head_motion_reads_back(tmp_path: Path) -> None:
    """With animation=skin the head joint carries the cache's motion, and no shapes are written."""
    groom = bristle_groom()
    cache = waving_cache(groom, 5)
    cache.save(tmp_path / "cache.npz")
    path = written(tmp_path, groom, strips=20, animation="skin", cache=tmp_path / "cache.npz")
    times, motion = read_head_motion(path)
    np.testing.assert_allclose(times[::2], cache.times, atol=1e-6)
    np.testing.assert_allclose(motion[::2], cache.head_from_rest, atol=1e-6)
    assert "targets" not in path.read_bytes()[:20000].decode("latin1")


def test_files_without_lines_say_so(tmp_path: Path) -> None:
    """Ribbons alone are no strands; nothing at all is not written."""
    path = written(tmp_path, bristle_groom(), lines="none", strips=10)
    with pytest.raises(FormatError, match=r"a\.glb: holds no lines; ribbons and cards"):
        gltf.import_groom(path, gltf.Options())
    with pytest.raises(InputError, match="nothing to write"):
        written(tmp_path, bristle_groom(), lines="none", hair="none", head_mesh=False)


@pytest.mark.parametrize("shuffled", [False, True])
def test_segments_join_to_strands(rng: np.random.Generator, shuffled: bool) -> None:
    """Segments in any order and direction make the same polylines, whatever their numbers."""
    counts = rng.integers(2, 9, 40)
    first = np.cumsum(counts) - counts
    names = rng.permutation(counts.sum()) if shuffled else np.arange(counts.sum())
    chains = [names[a : a + n] for a, n in zip(first, counts, strict=True)]
    segments = np.concatenate([np.stack([c[:-1], c[1:]], axis=1) for c in chains])
    if shuffled:
        segments = segments[rng.permutation(len(segments))]
        flip = rng.random(len(segments)) < 0.3
        segments[flip] = segments[flip, ::-1]
    order, found = join_segments(segments, len(names))
    assert len(order) == found.sum() == counts.sum()
    ends = np.cumsum(found)
    strands = [tuple(order[e - n : e]) for e, n in zip(ends, found, strict=True)]
    if not shuffled:
        assert strands == [tuple(chain) for chain in chains]
    assert {min(s, s[::-1]) for s in strands} == {min(tuple(c), tuple(c[::-1])) for c in chains}


def test_rings_forks_and_twins() -> None:
    """A ring ends where it starts, a fork ends three strands, a doubled segment counts once."""
    ring = np.array([[5, 6], [6, 7], [7, 5]])
    fork = np.array([[0, 1], [1, 2], [1, 3]])
    twins = np.array([[8, 9], [9, 8], [8, 9], [9, 9]])
    order, counts = join_segments(np.concatenate([ring, fork, twins]), 10)
    assert counts.tolist() == [4, 2, 2, 2, 2]
    assert order.tolist() == [5, 6, 7, 5, 0, 1, 1, 2, 1, 3, 8, 9]


def test_completed_is_what_is_written(tmp_path: Path) -> None:
    """What a bare groom lacks is written by the stated defaults."""
    bare = bristle_groom()
    bare = replace(bare, strands=replace(bare.strands, root_uv=None))
    found = gltf.import_groom(written(tmp_path, bare, hair="none"), gltf.Options())
    want = complete_groom(bare).strands
    np.testing.assert_array_equal(found.strands.widths, want.widths)
    np.testing.assert_allclose(found.strands.root_uv, want.root_uv, atol=1e-7)
    assert found.strands.guide is not None
    assert found.strands.guide.all()
