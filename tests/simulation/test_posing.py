"""Laws of full hair at a frame of its guides' simulation."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from rich_groom import rich_groom

import hairkit
from hairkit.errors import InputError
from hairkit.grooming.densify import densify
from hairkit.grooming.guide_weights import guide_mask
from hairkit.head_model.template import default_head
from hairkit.rendering.framing import framing_cameras
from hairkit.rendering.head import bust_solid
from hairkit.simulation.motion import turn_about
from hairkit.simulation.obstacles import groom_bodies
from hairkit.simulation.posing import pose_groom, pose_hair, pose_torso
from hairkit.simulation.rigid_motion import inverse_motion, transform_points
from hairkit.synth import grow
from hairkit.testing import bristle_groom
from hairkit.types.groom import Groom
from hairkit.types.point_cache import PointCache

TURN = np.array([[0, 0, 1, 0.1], [0, 1, 0, 0.02], [-1, 0, 0, 0], [0, 0, 0, 1]], np.float64)
"""A quarter turn about the vertical, with a shift."""


def still(groom: Groom) -> PointCache:
    """Return a cache of the guides at rest on the head, which then turns with them."""
    guides = groom.strands.select(guide_mask(groom.strands)).points
    points = np.stack([guides, transform_points(TURN, guides)]).astype(np.float32)
    return PointCache(points, np.arange(2) / 60, np.stack([np.eye(4), TURN]))


def test_hair_at_rest_turns_with_the_head_as_one() -> None:
    """Locks that do not move on the head are the same locks in every frame."""
    groom = bristle_groom()
    hair = densify(groom, 3 * len(groom.strands))
    cache = still(groom)
    for frame, motion in enumerate(cache.head_from_rest):
        posed = pose_hair(groom, hair, cache, frame).points
        assert np.abs(posed - transform_points(motion, hair.points)).max() < 1e-5


def test_strands_that_are_not_simulated_follow() -> None:
    """A cache of the guides alone poses all strands of the groom."""
    groom = rich_groom()
    assert not guide_mask(groom.strands).all()
    posed = pose_groom(groom, still(groom), 1).strands.points
    assert np.abs(posed - transform_points(TURN, groom.strands.points)).max() < 1e-5


def test_hair_that_follows_keeps_its_length_and_out_of_the_head() -> None:
    """Guides that lean to one side, through the head, take no other hair into it."""
    groom = bristle_groom()
    hair = densify(groom, 3 * len(groom.strands))
    cache = still(groom)
    strands = groom.strands
    aside = strands.roots[strands.strand_of_point]
    aside = aside + strands.arc_lengths()[:, None] * np.float32([1, 0, 0])
    posed = pose_hair(groom, hair, replace(cache, points=np.stack([aside, aside])), 0)
    ratio = posed.lengths() / hair.lengths()
    made = np.arange(len(hair)) >= len(groom.strands)
    assert abs(ratio[made] - 1).max() < 0.01
    bodies = groom_bodies(groom)
    inner = (bodies.at(hair.points)[0] > 0.001) & made[hair.strand_of_point]
    assert bodies.at(aside)[0].min() < -0.005
    assert bodies.at(posed.points)[0][inner].min() > -0.0025


def test_neck_and_shoulders_jump_with_the_head() -> None:
    """A head that is only moved takes neck and bust along; one that nods leaves the bust."""
    groom = grow("straight", default_head(), 20, 0)
    cache, jump = still(groom), np.array([0.1, 0.15, -0.2])
    motion = np.eye(4)
    motion[:3, 3] = jump
    moved = replace(cache, head_from_rest=np.stack([np.eye(4), motion]))
    shown, torso = pose_groom(groom, moved, 1), pose_torso(groom, moved, 1)
    assert np.abs(shown.head.vertices - groom.head.vertices - jump).max() < 1e-6
    rest, bust = bust_solid(groom.head), bust_solid(groom.head, motion=torso)
    assert rest is not None
    assert bust is not None
    assert np.abs(bust.vertices - rest.vertices - jump).max() < 1e-6
    nod = turn_about(groom.head.joints[1].astype(np.float64), ("pitch", 0.5))
    nods = replace(cache, head_from_rest=np.stack([np.eye(4), nod]))
    np.testing.assert_array_equal(pose_torso(groom, nods, 1), np.eye(4))


def test_a_jump_seen_by_a_camera_that_jumps_is_the_still_picture() -> None:
    """Head, neck, shoulders and hair go along as one."""
    groom = grow("straight", default_head(), 20, 0)
    motion = np.eye(4)
    motion[:3, 3] = [0.1, 0.15, -0.2]
    points = np.stack([groom.strands.points, transform_points(motion, groom.strands.points)])
    heads = np.stack([np.eye(4), motion])
    cache = PointCache(points.astype(np.float32), np.arange(2) / 60, heads)
    near = np.concatenate([groom.head.vertices, groom.strands.points])
    [camera] = framing_cameras(near, [(25.0, 5.0)], 96, 96)
    along = replace(camera, camera_from_head=camera.camera_from_head @ inverse_motion(motion))
    first, second = (
        hairkit.render(groom, camera=view, hairs=300, cache=cache, frame=frame).astype(float)
        for frame, view in enumerate((camera, along))
    )
    assert np.abs(first - second).mean() < 0.5


def test_another_grooms_cache_is_refused() -> None:
    """Frames that the cache lacks and points of other guides are told."""
    groom = bristle_groom()
    with pytest.raises(InputError, match="2 frames"):
        pose_groom(groom, still(groom), 2)
    with pytest.raises(InputError, match="guides have"):
        pose_groom(groom, still(rich_groom()), 0)
