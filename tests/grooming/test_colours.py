"""Colours along the strands: kept by what changes strands, mixed between guides, brushed on."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from hairkit import Brush, Edit, Edits, Groom
from hairkit.colour import linear_from_hex
from hairkit.errors import InputError
from hairkit.grooming.adopt_strands import ImportOptions, adopt
from hairkit.grooming.brushes import edit_groom
from hairkit.grooming.densify import densify
from hairkit.grooming.prepare_export import point_colours
from hairkit.rendering.picture import draw
from hairkit.testing import bristle_groom
from hairkit.types.camera import Camera

PLAIN = bristle_groom()
BLUE = "#2040f0"


def streaked() -> Groom:
    """Return hair whose left half is blue from its middle on."""
    strands, colours = PLAIN.strands, point_colours(PLAIN).copy()
    left = strands.roots[strands.strand_of_point, 0] > 0
    colours[left & (strands.arc_lengths() > strands.lengths().mean() / 2)] = [0, 0, 1]
    return replace(PLAIN, strands=replace(strands, colours=colours))


def dyed(groom: Groom, *edits: Edit) -> Groom:
    """Return the groom after strokes."""
    return edit_groom(groom, Edits(edits))


def test_strands_take_their_colours_along() -> None:
    """Selected and resampled, points have the colours of where they were."""
    strands = streaked().strands
    some, fine = strands.select(np.arange(3, 9)), strands.resampled(200)
    assert some.colours is not None
    assert fine.colours is not None
    assert strands.colours is not None
    first, last = strands.offsets[3], strands.offsets[9]
    np.testing.assert_array_equal(some.colours, strands.colours[first:last])
    np.testing.assert_allclose(fine.colours[::200], strands.colours[strands.offsets[:-1]])
    np.testing.assert_allclose(fine.colours[199::200], strands.colours[strands.offsets[1:] - 1])


def test_hair_between_guides_has_mixed_colours() -> None:
    """It is blue where its guides are, and nowhere where they are not."""
    hair = densify(streaked(), 3000)
    assert hair.colours is not None
    blue, x = hair.colours[hair.offsets[1:] - 1, 2], hair.roots[:, 0]
    assert blue[x > 0.02].min() > 0.99
    assert blue[x < -0.02].max() < 0.2
    plain = densify(PLAIN, 3000)
    assert plain.colours is None
    np.testing.assert_array_equal(plain.points, hair.points)


def test_a_dye_changes_the_colour_and_nothing_else() -> None:
    """In the middle of the stroke it is the colour itself, outside of the ball the old one."""
    tip = PLAIN.strands.tips[0]
    made = dyed(PLAIN, Edit(tip[None], Brush("dye", 0.02, colour=BLUE)))
    np.testing.assert_array_equal(made.strands.points, PLAIN.strands.points)
    before, after = point_colours(PLAIN), point_colours(made)
    away = np.linalg.norm(PLAIN.strands.points - tip, axis=1)
    np.testing.assert_array_equal(after[away > 0.02], before[away > 0.02])
    np.testing.assert_allclose(after[away < 1e-6], linear_from_hex(BLUE, "")[None], atol=1e-6)
    assert 0 < (away < 0.02).sum() < len(away)


def test_hair_without_dye_keeps_the_ramp() -> None:
    """Other brushes leave the colour to the material: hair that is cut has its tips' colour.

    Colours of its own stay where they were, so that dyed ends are cut off.
    """
    trim = Edit(np.zeros((0, 3)), Brush("trim", amount=0.01))
    assert dyed(PLAIN, trim).strands.colours is None
    own = dyed(streaked(), trim).strands.colours
    assert own is not None
    assert own[:, 2].max() < 0.5


def test_a_colour_that_is_none_is_refused() -> None:
    """The setting and what was said are named."""
    with pytest.raises(InputError, match="colour is 'blue', expected sRGB as #rrggbb"):
        Brush("dye", colour="blue")


def test_a_file_with_the_ramp_alone_brings_no_colours() -> None:
    """A material says as much; colours that it does not say are kept."""
    ramp = replace(PLAIN.strands, colours=point_colours(PLAIN))
    back = adopt(ramp, ImportOptions(), "a.hair", head=PLAIN.head)
    assert back.strands.colours is None
    np.testing.assert_allclose(back.material.tip_colour, PLAIN.material.tip_colour, atol=1e-6)
    kept = adopt(streaked().strands, ImportOptions(), "a.hair", head=PLAIN.head)
    assert kept.strands.colours is not None


def test_a_picture_shows_the_colours() -> None:
    """From the left hair is bluer than without them; from the right it is the same."""
    bluer = []
    for azimuth in (90.0, -90.0):
        camera = Camera.on_turn(azimuth, distance=0.6, focal=260.0, width=160, height=160)
        own, plain = (
            draw(densify(groom, 4000), PLAIN.head, camera).astype(int)
            for groom in (streaked(), PLAIN)
        )
        bluer.append(((own - plain)[..., 2] - (own - plain)[..., 0]).mean())
    assert bluer[0] > 5 * abs(bluer[1])
    assert bluer[0] > 5
