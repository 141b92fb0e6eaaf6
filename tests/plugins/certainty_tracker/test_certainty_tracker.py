"""Laws of the tracker's walk: in made-up fields around a ball of a head."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hairkit_plugins import certainty_tracker
from hairkit_plugins.certainty_tracker import Options
from tracked_ball import (
    CENTRES,
    DISTANCE,
    FREE,
    GRID,
    SPACING,
    UP,
    constant,
    crown,
    field_along,
    filled,
    polylines,
    roots_where,
    run,
)

from hairkit import parallel
from hairkit.arrays import Float64Array
from hairkit.testing import scalp_roots, turn_scene
from hairkit.types.strands import Strands
from hairkit.types.volume import Hull


def off_deg(strands: Strands, direction: Float64Array, after: float) -> Float64Array:
    """Angles of all segments that start beyond a share of the strand to a signed direction."""
    steps = np.diff(polylines(strands), axis=1)
    steps = steps[:, int(after * steps.shape[1]) :]
    cosine = steps @ direction / np.linalg.norm(steps, axis=2) / np.linalg.norm(direction)
    return np.degrees(np.arccos(np.clip(cosine, -1, 1)))


@pytest.mark.parametrize("direction", [[0.3, 0.8, 0.2], [-0.5, 0.7, -0.3], [0.0, 1.0, 0.0]])
def test_in_a_constant_field_strands_are_straight_along_it(direction: list[float]) -> None:
    """Away from the root every segment points the way the hair grows, within a degree."""
    along = np.array(direction) / np.linalg.norm(direction)
    roots = roots_where(lambda normals: normals @ along > 0.7)
    strands = run(constant(along), filled(), roots, FREE)
    assert len(roots) > 20
    assert off_deg(strands, along, after=0.5).max() < 1
    np.testing.assert_allclose(strands.lengths(), FREE.max_length, atol=0.006)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_the_growth_decides_which_way_a_field_is_followed(sign: float) -> None:
    """The tensors of both directions are the same; strands follow the growth."""
    sideways = sign * np.array([1.0, 0.0, 0.0])
    roots = roots_where(lambda normals: (np.abs(normals[:, 0]) < 0.2) & (normals[:, 1] > 0.5))
    strands = run(constant(sideways), filled(), roots, FREE)
    assert len(roots) > 4
    assert off_deg(strands, sideways, after=0.5).max() < 3


def test_every_root_has_its_strand() -> None:
    """As many strands as roots, in their order, each starts at its root; equal point counts."""
    roots = scalp_roots(turn_scene().head)
    strands = run(constant(-UP), filled(), roots, replace(Options(waves=False), points=40))
    assert len(strands) == len(roots)
    np.testing.assert_array_equal(strands.roots, roots.positions)
    np.testing.assert_array_equal(strands.root_uv, roots.uv)
    assert (strands.counts == 40).all()
    segments = np.linalg.norm(np.diff(polylines(strands), axis=1), axis=2)
    assert (segments > 0).all()


def test_a_root_where_nothing_is_known_still_has_a_strand() -> None:
    """Without field and hair around it a strand is one step long, and the push off the head."""
    empty = field_along(np.zeros(3), CENTRES[..., 1])
    far = filled(CENTRES[..., 1] < -0.2)
    options = replace(FREE, blind_steps=0, max_score=3)
    strands = run(empty, far, roots_where(crown), options)
    np.testing.assert_allclose(strands.lengths(), options.step * SPACING, atol=FREE.clearance)


def test_strands_end_where_the_hair_ends() -> None:
    """The uncertain steps beyond the last hair are cut off: tips are a step from its border."""
    hair = CENTRES[..., 1] < 0.17
    hull = replace(filled(hair), loose=hair & (DISTANCE > -SPACING))
    border = GRID.origin[1] + SPACING * np.ceil((0.17 - GRID.origin[1]) / SPACING - 0.5)
    for max_score in (1, 4, 8):
        options = replace(FREE, max_score=max_score)
        strands = run(constant(UP), hull, roots_where(crown), options)
        assert np.abs(strands.tips[:, 1] - border).max() < 1.1 * options.step * SPACING


def gap(thickness: float) -> Hull:
    """Hair above the crown with a layer of no hair in it."""
    y = CENTRES[..., 1]
    hair = (y < 0.16) | (y > 0.16 + thickness)
    return replace(filled(hair), loose=hair & (DISTANCE > -SPACING))


@pytest.mark.parametrize(("max_score", "crosses"), [(2, False), (4, False), (8, True), (20, True)])
def test_gaps_are_crossed_within_the_steps_that_may_be_uncertain(
    max_score: int, crosses: bool
) -> None:
    """Three cells of gap are six steps: a strand crosses it straight on, or ends before."""
    options = replace(FREE, max_score=max_score, max_length=0.12)
    strands = run(constant(UP), gap(0.03), roots_where(crown), options)
    tops = strands.tips[:, 1]
    assert ((tops > 0.2) if crosses else (tops < 0.17)).all()


def test_sharp_turns_are_uncertain() -> None:
    """The field bends by 70 degrees at a plane: followed when allowed, else the strand ends."""
    bent = np.array([np.sin(np.radians(70)), np.cos(np.radians(70)), 0.0])
    above = CENTRES[..., 1] > 0.16
    field = field_along(np.where(above[..., None], bent, UP), CENTRES @ (UP + bent))
    kind, strict = (
        run(field, filled(), roots_where(crown), replace(FREE, max_turn_deg=limit, inertia=0.0))
        for limit in (90, 25)
    )
    assert (kind.tips - kind.roots)[:, 0].min() > 0.02
    assert off_deg(kind, bent, after=0.9).max() < 2
    assert strict.tips[:, 1].max() < 0.18
    assert (strict.lengths() < 0.8 * kind.lengths()).all()


@pytest.mark.parametrize(("blind_steps", "arrives"), [(0, False), (8, True)])
def test_the_first_steps_may_be_blind(blind_steps: int, arrives: bool) -> None:
    """Hair that starts 4 cm over the scalp is reached only by strands that need not see at first.

    Without, they end at their first steps.
    """
    hair = DISTANCE > 0.04
    hull = replace(filled(hair), loose=(hair | (DISTANCE < 0.01)) & (DISTANCE > -SPACING))
    options = replace(FREE, blind_steps=blind_steps, max_score=2)
    strands = run(constant(UP), hull, roots_where(crown), options)
    lengths = strands.lengths()
    assert ((lengths > 0.1) if arrives else (lengths < 0.02)).all()


def test_no_strand_is_longer_than_allowed() -> None:
    """What pushing off the head adds is at most the clearance."""
    roots = roots_where(lambda normals: normals[:, 1] > 0.5)
    for limit in (0.02, 0.07):
        lengths = run(constant(UP), filled(), roots, replace(FREE, max_length=limit)).lengths()
        assert (lengths <= limit + FREE.clearance).all()
        assert (lengths > limit - FREE.step * SPACING).all()


def test_strands_that_meet_the_skin_of_the_hair_slide_along_it() -> None:
    """A field that leads out of a tube at 25 degrees: with sliding strands follow it to its end."""
    tube = np.hypot(CENTRES[..., 0], CENTRES[..., 2]) < 0.07
    hair = (tube & (CENTRES[..., 1] > 0)) & (CENTRES[..., 1] < 0.25)
    hull = replace(filled(hair), loose=hair & (DISTANCE > -SPACING))
    oblique = np.array([np.sin(np.radians(25)), np.cos(np.radians(25)), 0.0])
    options = replace(FREE, max_length=0.2)
    straight, sliding, never = (
        run(constant(oblique), hull, roots_where(crown), replace(options, **change))
        for change in ({}, {"slide_sine": 0.9}, {"slide_sine": 0.9, "slide_share": 0.0})
    )
    assert straight.tips[:, 1].max() < 0.25 + options.step * SPACING
    assert sliding.tips[:, 1].min() > straight.tips[:, 1].min() + 0.03
    assert (np.hypot(sliding.points[:, 0], sliding.points[:, 2]) < 0.07 + 1.5 * SPACING).all()
    np.testing.assert_array_equal(straight.points, never.points)


def test_without_sliding_the_skin_bends_nothing() -> None:
    """Through a slanted gap, which is entered again at an angle, a strand goes straight on."""
    plane = CENTRES @ np.array([0.6, 0.8, 0.0])
    hair = (plane < 0.13) | (plane > 0.16)
    hull = replace(filled(hair), loose=hair & (DISTANCE > -SPACING))
    options = replace(FREE, max_score=12)
    field = constant(UP)
    unknown = np.where(hair[..., None], field.tensor, 0)
    strands = run(replace(field, tensor=unknown), hull, roots_where(crown), options)
    reference = run(field, filled(), roots_where(crown), options)
    np.testing.assert_allclose(strands.points, reference.points, atol=2e-3)


@pytest.mark.parametrize("threads", [1, 3])
def test_the_number_of_threads_does_not_change_a_byte(
    monkeypatch: pytest.MonkeyPatch, threads: int
) -> None:
    """One thread and several give the strands of this machine's number of threads."""
    roots = scalp_roots(turn_scene().head)
    assert len(roots) > 3 * certainty_tracker.MIN_STRANDS
    expected = run(constant(-UP), filled(), roots, Options(waves=False)).points.tobytes()
    monkeypatch.setattr(parallel, "thread_count", lambda: threads)
    assert run(constant(-UP), filled(), roots, Options(waves=False)).points.tobytes() == expected
