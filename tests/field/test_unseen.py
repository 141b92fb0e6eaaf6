"""Laws of directions and marks of hair that photos do not see."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from ball import ball_evidence

from hairkit.arrays import Float64Array
from hairkit.field.growth_prior import whorl_direction
from hairkit.field.unseen import (
    FALLING,
    FLOW_WEIGHT,
    add_flow,
    add_surface_planes,
    group_seen,
    measure_ways,
)
from hairkit.testing import ball_head
from hairkit.types.camera import Camera
from hairkit.types.mask import HAIR, Mask
from hairkit.types.scene import Scene
from hairkit.types.strands import CONTINUED, SEEN, Strands
from hairkit.types.volume import XX, YY, ZZ, Hull, VoxelGrid
from tests.support import tied_ball


def shell() -> Hull:
    """Hair of 3 cm all around a ball of 10 cm."""
    grid = VoxelGrid.around(np.full(3, -0.16), np.full(3, 0.16), 0.008)
    far = np.linalg.norm(grid.centres(), axis=-1).astype(np.float32)
    hair = (far > 0.1) & (far < 0.13)
    return Hull(grid, hair, hair, far - np.float32(0.1))


def test_the_surface_lies_across_its_normal() -> None:
    """Of a ball's hair the added plane is normal to the radius, in proportion to what is seen."""
    hull = shell()
    planes = np.zeros((int(hull.loose.sum()), 6))
    assert not add_surface_planes(planes, hull, 1.0).any()
    planes[:, XX] = 1.0
    added = add_surface_planes(planes, hull, 1.0) - planes
    at = hull.grid.centres_of(hull.loose).astype(np.float64)
    outward = at / np.linalg.norm(at, axis=1, keepdims=True)
    edge = np.linalg.norm(at, axis=1) > 0.12
    assert np.allclose(added[edge][:, [XX, YY, ZZ]] / 0.5, outward[edge] ** 2, atol=0.15)


def test_unseen_hair_runs_to_the_tips() -> None:
    """Where nothing is certain the direction is the slope; certain cells keep theirs."""
    hull = shell()
    growth = -hull.grid.centres()[..., 1].astype(np.float32)
    count = int(hull.loose.sum())
    tensor, sure = np.zeros((count, 6), np.float32), np.zeros(count, np.float32)
    tensor[:, XX] = 1
    sure[::2] = 1
    mixed, weight = add_flow(ball_head(), hull, growth, 1.0, tensor, sure)
    assert mixed[1::2, YY] == pytest.approx(1.0, abs=1e-5)
    assert mixed[::2, XX].min() > 0.9
    assert weight[1::2] == pytest.approx(FLOW_WEIGHT)


def test_short_hair_that_is_not_seen_lies_along_the_head() -> None:
    """Its tips are all of the surface, so that the way to them leads off the head: below the crown
    it turns down instead, the more the farther it is from the skin."""
    hull = shell()
    count = int(hull.loose.sum())
    nothing = np.zeros((count, 6), np.float32), np.zeros(count, np.float32)
    at = hull.grid.centres_of(hull.loose).astype(np.float64)
    side = np.abs(at[:, 1]) < 0.03
    low, high = (
        side & (np.abs(np.linalg.norm(at, axis=1) - far) < 0.005) for far in (0.105, 0.125)
    )
    down = [
        add_flow(ball_head(), hull, hull.head_distance, share, *nothing)[0][:, YY]
        for share in (0.0, 1.0)
    ]
    assert down[0][high].mean() > down[0][low].mean() > 0.4
    above = (at[:, 1] > 0.03) & (at[:, 1] < 0.05)  # the nape
    assert down[1][above].mean() < 0.2


def test_long_hair_that_is_not_seen_falls_below_the_nape() -> None:
    """Wherever the tips are: above it hair runs to them."""
    hull = shell()
    count = int(hull.loose.sum())
    nothing = np.zeros((count, 6), np.float32), np.zeros(count, np.float32)
    aside = hull.grid.centres()[..., 0].astype(np.float32)
    at = hull.grid.centres_of(hull.loose)
    down = add_flow(ball_head(), hull, aside, 1.0, *nothing)[0][:, YY]
    nape = ball_head().vertices[ball_head().scalp > 0.5, 1].min()
    assert down[at[:, 1] < nape].min() > 0.9
    assert down[at[:, 1] > nape + FALLING].max() < 0.1


@pytest.mark.parametrize("back", [True, False])
def test_hair_combed_back_in_a_front_photo_ends_behind(back: bool) -> None:
    """Its way leads from the forehead to the hindmost scalp; other short hair ends everywhere."""
    camera, hull = tied_ball.cameras()[0], tied_ball.tied_hull()
    thin = (
        (hull.head_distance > 0) & (hull.head_distance < 0.012) & (hull.grid.centres()[..., 1] > 0)
    )
    hull = replace(hull, dense=thin, loose=thin)

    def comb(points: Float64Array) -> Float64Array:
        outward = points / np.linalg.norm(points, axis=1, keepdims=True)
        down = whorl_direction(tied_ball.HEAD, points, outward)
        return np.cross(outward, down) if back else down

    mask, seen = tied_ball.drawn(camera, comb)
    scene = Scene(("front",), (camera,), tied_ball.HEAD)
    ways = measure_ways(scene, hull, (mask,), (seen,))
    forehead, behind = hull.grid.sample(ways.values, [[0, 0.03, 0.1], [0, 0.03, -0.1]])
    assert (ways.hair_length > 0.15) == back
    assert (behind - forehead > 0.1) == back


def test_strands_before_a_camera_are_seen() -> None:
    """Strands in front of the head are seen, those behind it and outside of the mask are not."""
    camera = Camera.on_turn(0.0, distance=1.0, focal=400.0, width=160, height=160)
    down = np.linspace(0.03, -0.03, 8)
    lines = [np.stack([0 * down + x, down, 0 * down + z], axis=1) for x, z in
             ((0.0, 0.128), (0.0, -0.128), (0.11, 0.05))]  # fmt: skip
    strands = Strands(np.concatenate(lines).astype(np.float32), np.arange(4) * 8)
    labels = np.zeros((160, 160), np.uint8)
    labels[:, 60:100] = HAIR
    scene = Scene(("front",), (camera,), ball_head())
    evidence = replace(ball_evidence(), scene=scene, masks=(Mask(labels, True),), hull=shell())
    found = group_seen(strands, evidence)
    assert found.group is not None
    assert found.group.tolist() == [SEEN, CONTINUED, CONTINUED]
