"""Hair that Blender's nodes fill in, and hair that moves: files, simulations, the scene's head."""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from blender_session import BlenderSession, z_up
from client_groom import nodding, swinging, written
from scipy.spatial import cKDTree

from hairkit.grooming.guide_weights import guide_mask
from hairkit.head_model.template import default_head
from hairkit.manager import Manager
from hairkit.synth import grow
from hairkit.types.groom import Groom
from hairkit.types.point_cache import PointCache
from hairkit.types.strands import Strands

NEAR = 1e-4
"""Metres between a frame in Blender and the frame of the cache."""
POINTS = 12
FRAMES = 20


@pytest.fixture(scope="module")
def guides() -> Groom:
    """Return 80 guides on the default head."""
    groom = grow("wavy", default_head(), 80, 0)
    return replace(groom, strands=groom.strands.resampled(POINTS))


@pytest.fixture(scope="module")
def stored(guides: Groom, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The guides as hairkit's own file."""
    path = tmp_path_factory.mktemp("guides") / "anna.npz"
    guides.save(path)
    return path


def moving(groom: Groom) -> PointCache:
    """Return frames of swaying hair on a nodding head."""
    return swinging(groom, FRAMES, np.linspace(0.05, 0.4, 8))


def lengths(frames: np.ndarray, like: Strands) -> np.ndarray:
    """Return (T, S) lengths of strands at frames (T, P, 3)."""
    return np.array([replace(like, points=points).lengths() for points in frames])


def test_guides_are_filled_with_hair(addon: BlenderSession, stored: Path, guides: Groom) -> None:
    """About as many hairs as asked for grow from the scalp, each beside guides; 0 leaves guides."""
    hair = addon.call("addon.grown", path=stored, fill=3000)
    assert 2000 < len(hair) < 3600
    scalp = cKDTree(z_up(guides.head.vertices[guides.head.scalp > 0]))
    assert scalp.query(hair[:, 0])[0].max() < 0.01
    between = cKDTree(z_up(guides.strands.points)).query(hair.reshape(-1, 3))[0]
    assert np.percentile(between, 95) < 0.03
    assert len(addon.call("addon.grown", path=stored, fill=0)) == len(guides.strands)


def test_hair_grows_only_where_guides_stand(
    addon: BlenderSession, guides: Groom, tmp_path: Path
) -> None:
    """Guides on the left side of the head leave the right side bare."""
    left = np.flatnonzero(guides.strands.roots[:, 0] > 0.01)
    half = replace(
        guides,
        strands=guides.strands.select(left),
        root_triangle=guides.root_triangle[left],
        root_barycentric=guides.root_barycentric[left],
    )
    half.save(tmp_path / "half.npz")
    roots = addon.call("addon.grown", path=tmp_path / "half.npz", fill=3000)[:, 0]
    assert roots[:, 0].min() > -0.05
    assert len(roots) > 500


def test_filled_hair_follows_the_skin(addon: BlenderSession, stored: Path) -> None:
    """When a shape key moves the head's surface, hair that nodes grew moves with it."""
    shift = [0.1, 0.0, 0.05]
    seen = addon.call("addon.shaped", path=stored, shift=shift, fill=500)
    moved = seen["after"] - seen["before"]
    np.testing.assert_allclose(moved, np.broadcast_to(shift, moved.shape), atol=2e-5)


@pytest.mark.parametrize("ending", [".abc", ".usdc", ".glb"])
def test_an_animated_file_plays(
    addon: BlenderSession, manager: Manager, guides: Groom, tmp_path: Path, ending: str
) -> None:
    """At each frame hair is where the cache has it, on a head that nods with its roots.

    Nothing that Blender's own importer made is left.
    """
    cache = moving(guides)
    cache.save(tmp_path / "cache.npz")
    options = {"hair": "none"} if ending == ".glb" else {}
    path = written(
        manager, guides, tmp_path / f"hair{ending}", cache=tmp_path / "cache.npz", **options
    )
    seen = addon.call(
        "addon.moving", path=path, python=sys.executable, frames=list(range(FRAMES)), fill=0
    )
    assert seen["range"] == [0, FRAMES - 1]
    np.testing.assert_allclose(seen["hair"], z_up(cache.points), atol=NEAR)
    turns = cache.head_from_rest
    assert seen["added"]["objects"] == 2
    assert seen["added"]["armatures"] == 0
    if ending != ".abc":  # which has no head: that under the hair is hairkit's own
        rest = guides.head.vertices
        skin = np.einsum("tij,vj->tvi", turns[:, :3, :3], rest) + turns[:, None, :3, 3]
        np.testing.assert_allclose(seen["head"], z_up(skin), atol=2 * NEAR)


def test_a_simulation_of_guides_moves_all_hair(
    addon: BlenderSession, groom: Groom, tmp_path: Path
) -> None:
    """A cache of the guides of a groom of guides and hair; the head has the cache's motion."""
    cache = nodding(groom, 4)
    cache.save(tmp_path / "cache.npz")
    groom.save(tmp_path / "groom.npz")
    assert not guide_mask(groom.strands).all()
    seen = addon.call(
        "addon.moving", path=tmp_path / "groom.npz", simulation=tmp_path / "cache.npz",
        python=sys.executable, frames=[0, 1, 2, 3],
    )  # fmt: skip
    turns = cache.head_from_rest
    for name, rest in (("hair", groom.strands.points), ("head", groom.head.vertices)):
        wanted = np.einsum("tij,vj->tvi", turns[:, :3, :3], rest) + turns[:, None, :3, 3]
        np.testing.assert_allclose(seen[name], z_up(wanted), atol=NEAR)


@pytest.mark.parametrize("by", ["object", "bone"])
def test_hair_is_simulated_on_the_head_of_the_scene(
    addon: BlenderSession, stored: Path, guides: Groom, by: str
) -> None:
    """Roots stay on a head that keys or a bone turn; tips lag behind; lengths stay.

    The bone, which stays at the origin, turns what the keys have shifted.
    """
    frames, whole = list(range(5, 15)), by == "object"
    keys = [(5, 0.0, 0.0), (14, 0.1, 40.0 if whole else 0.0)]
    seen = addon.call(
        "addon.simulated", path=stored, python=sys.executable, keys=keys, frames=frames, edit=0.0,
        bone=[] if whole else [(5, 0.0), (14, 40.0)],
    )  # fmt: skip
    hair, strands = seen["hair"], guides.strands
    np.testing.assert_allclose(hair[0], z_up(strands.points), atol=NEAR)
    turn = np.radians(40.0)
    z = np.array([[np.cos(turn), -np.sin(turn), 0], [np.sin(turn), np.cos(turn), 0], [0, 0, 1]])
    shift = np.array([0.1, 0, 0]) @ (np.eye(3) if whole else z.T)
    skin = z_up(guides.head.vertices) @ z.T + shift
    np.testing.assert_allclose(seen["head"][-1], skin, atol=2 * NEAR)
    rigid = z_up(strands.points) @ z.T + shift
    first, last = strands.offsets[:-1], strands.offsets[1:] - 1
    np.testing.assert_allclose(hair[-1, first], rigid[first], atol=2 * NEAR)
    assert np.linalg.norm(hair[-1, last] - rigid[last], axis=1).max() > 0.01
    rest = lengths(z_up(strands.points)[None], strands)
    np.testing.assert_allclose(lengths(hair, strands) / rest, 1, atol=0.02)


def test_a_shake_moves_the_head_too(addon: BlenderSession, stored: Path, guides: Groom) -> None:
    """A head that stands still is shaken with its hair, which nodes fill, and keeps it."""
    seen = addon.call(
        "addon.simulated", path=stored, python=sys.executable, keys=[], frames=list(range(1, 9)),
        edit=0.0, shake="yaw:30:2", fill=300,
    )  # fmt: skip
    assert np.ptp(seen["head"], axis=0).max() > 0.01
    points = np.stack([hair.reshape(-1, POINTS, 3) for hair in seen["hair"]])
    for head, hair in zip(seen["head"], points, strict=True):
        scalp = cKDTree(head[guides.head.scalp > 0])
        assert scalp.query(hair[:, 0])[0].max() < 0.01
    assert np.ptp(points[:, :, -1], axis=0).max() > 0.01


def test_what_was_combed_in_blender_is_simulated(
    addon: BlenderSession, stored: Path, guides: Groom
) -> None:
    """Points that were edited are where the simulation starts."""
    seen = addon.call(
        "addon.simulated", path=stored, python=sys.executable, keys=[], frames=[1, 2], edit=0.03
    )
    free = np.delete(np.arange(len(guides.strands.points)), guides.strands.offsets[:-1])
    raised = z_up(guides.strands.points)[free] + np.array([0, 0, 0.03])
    np.testing.assert_allclose(seen["hair"][0][free], raised, atol=NEAR)


def test_without_hair_of_its_own_the_simulation_says_what_to_select(
    addon: BlenderSession,
) -> None:
    """One line, nothing simulated."""
    line = addon.call("addon.refusal", operator="simulate", python=sys.executable)
    assert line == "Error: select hair that the menu hairkit has added, on its head"


def test_progress_is_read_from_lines_of_steps(addon: BlenderSession) -> None:
    """A line of a step is its share, others none."""
    shares = addon.call("addon.progress", lines=["simulate 3/12", "scene    0.12 s", ""])
    assert shares == [0.25, None, None]
