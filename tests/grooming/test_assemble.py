"""Strands, head and photos make a groom: bound, coloured, without what is no strand."""

from __future__ import annotations

import logging
from dataclasses import replace

import numpy as np
import pytest

from hairkit.colour import linear_from_srgb, srgb_from_linear
from hairkit.errors import InputError
from hairkit.grooming.assemble import assemble_groom
from hairkit.grooming.photo_colours import DEPTH, LIGHT, TIP_SHADE, measure_colour
from hairkit.testing import ball_head, ball_mask, scalp_roots, striped_view, turn_scene
from hairkit.types.capture import View
from hairkit.types.head import Roots
from hairkit.types.mask import Mask
from hairkit.types.strands import Strands

HEAD, ROOTS = ball_head(), scalp_roots(ball_head())
VIEW, MASK = striped_view(90.0), ball_mask(turn_scene().cameras[0])


def bristles(lengths: np.ndarray) -> Strands:
    """Two-point strands of the lengths (N,) along the normals of the first N roots."""
    tips = ROOTS.positions[: len(lengths)] + lengths[:, None] * ROOTS.normals[: len(lengths)]
    points = np.stack([ROOTS.positions[: len(lengths)], tips], axis=1)
    return Strands(points.reshape(-1, 3), 2 * np.arange(len(lengths) + 1))


def test_every_strand_stays_bound_to_its_root(caplog: pytest.LogCaptureFixture) -> None:
    """Strands without length go, with their binding; the rest starts where its root is bound."""
    lengths = np.full(len(ROOTS), 0.05)
    lengths[::7] = 0.0
    with caplog.at_level(logging.WARNING, "hairkit"):
        groom = assemble_groom([VIEW], [MASK], HEAD, ROOTS, bristles(lengths))
    gone = np.count_nonzero(lengths == 0)
    assert len(groom.strands) == len(ROOTS) - gone
    assert f"{gone} of {len(ROOTS)} roots gave no strand" in caplog.text
    corners = HEAD.vertices[HEAD.faces[groom.root_triangle]]
    bound = np.einsum("sc,sck->sk", groom.root_barycentric, corners)
    assert bound == pytest.approx(groom.strands.roots, abs=1e-6)
    assert np.array_equal(groom.strands.root_uv, ROOTS.uv[lengths > 0])
    assert groom.strands.guide.all()
    assert groom.strands.widths == pytest.approx(groom.material.width)


@pytest.mark.parametrize(
    ("lengths", "reason"),
    [
        (np.zeros(len(ROOTS)), "none of .* roots gave a strand"),
        (np.full(len(ROOTS) - 1, 0.1), "expected one each"),
    ],
)
def test_no_strands_are_no_groom(lengths: np.ndarray, reason: str) -> None:
    """A tracker that gives nothing, or not one strand a root, is an error of one line."""
    with pytest.raises(InputError, match=reason):
        assemble_groom([VIEW], [MASK], HEAD, ROOTS, bristles(lengths))


def two_colours(upper: np.ndarray, lower: np.ndarray) -> tuple[list[View], list[Mask]]:
    """A photo of hair of two linear colours (3,), before white, and its mask."""
    image = np.full((90, 60, 3), 255, np.uint8)
    labels = np.zeros((90, 60), np.uint8)
    labels[20:80, 15:45] = 255
    for rows, colour in ((slice(20, 50), upper), (slice(50, 80), lower)):
        image[rows, 15:45] = np.rint(255 * srgb_from_linear(np.asarray(colour)))
    return [replace(VIEW, image=image, photo_size=(60, 90))], [Mask(labels, True)]


def test_colour_is_the_hairs_own() -> None:
    """The hue comes from hair only; tips in the usual shade have the colour of the roots."""
    colour = np.array([0.2, 0.12, 0.06])
    material = measure_colour(*two_colours(colour, TIP_SHADE * colour))
    root, drawn = material.root_colour, colour**DEPTH  # pictures deepen colours
    assert root / root.sum() == pytest.approx(drawn / drawn.sum(), rel=0.02)
    assert material.tip_colour == pytest.approx(root, rel=0.02)


def test_hair_is_as_bright_as_photographed() -> None:
    """Under the usual light the mean of roots and tips is that of the photo's sRGB values."""
    upper, lower = np.array([0.2, 0.12, 0.06]), np.array([0.05, 0.03, 0.02])
    views, masks = two_colours(upper, lower)
    material = measure_colour(views, masks)
    seen = linear_from_srgb(views[0].image[masks[0].hair].mean(axis=0) / 255).mean()
    drawn = LIGHT * (material.root_colour.mean() + material.tip_colour.mean()) / 2
    assert drawn == pytest.approx(seen, rel=0.01)


def test_sheen_is_not_the_hairs_colour() -> None:
    """White highlights on a twentieth of dark hair make its colour brighter by less than half,
    which doubles the mean of linear light."""
    colour = np.array([0.05, 0.03, 0.02])
    views, masks = two_colours(colour, colour)
    plain = measure_colour(views, masks).root_colour
    image = views[0].image.copy()
    image[20:80:4, 15:45:5] = 255
    shiny = measure_colour([replace(views[0], image=image)], masks).root_colour
    assert (shiny < 1.5 * plain).all()
    light = linear_from_srgb(image[masks[0].hair] / 255).mean()
    assert light > 2 * colour.mean()


def test_dyed_tips_keep_their_hue() -> None:
    """The lower colour is the tip's but for its brightness; brighter tips come out brighter."""
    upper, lower = np.array([0.3, 0.2, 0.1]), np.array([0.08, 0.02, 0.02])
    tip = measure_colour(*two_colours(upper, lower)).tip_colour
    drawn = lower**DEPTH
    assert tip / tip.sum() == pytest.approx(drawn / drawn.sum(), rel=0.03)
    brighter = measure_colour(*two_colours(upper, 1.5 * lower)).tip_colour
    assert (brighter > 1.15 * tip).all()


@pytest.mark.parametrize("brightness", [1.0, 2.0])
def test_bright_tips_are_as_photographed(brightness: float) -> None:
    """Shade makes nothing brighter: hair in flat light, or with bleached tips, stays as it is."""
    colour = np.array([0.2, 0.12, 0.06])
    material = measure_colour(*two_colours(colour, brightness * colour))
    assert material.tip_colour == pytest.approx(brightness * material.root_colour, rel=0.02)


def test_a_single_hair_pixel_has_a_colour() -> None:
    """Hair thinner than the edge that is left out still gives a colour."""
    labels = np.zeros(VIEW.image.shape[:2], np.uint8)
    labels[5, 5] = 255
    material = measure_colour([VIEW], [Mask(labels, True)])
    assert material.root_colour == pytest.approx(linear_from_srgb(VIEW.image[5, 5] / 255) / LIGHT)


def test_black_pixels_are_black_hair() -> None:
    """Hair without any light is no division by 0."""
    material = measure_colour(*two_colours(np.zeros(3), np.zeros(3)))
    assert not material.root_colour.any()
    assert not material.tip_colour.any()


def test_roots_and_strands_have_one_order() -> None:
    """Reordering roots and strands alike reorders the groom and changes nothing else."""
    order = np.random.default_rng(0).permutation(len(ROOTS))
    strands = bristles(np.linspace(0.01, 0.1, len(ROOTS)))
    names = ("positions", "normals", "uv", "triangle", "barycentric")
    shuffled = Roots(*(getattr(ROOTS, name)[order] for name in names))
    first = assemble_groom([VIEW], [MASK], HEAD, ROOTS, strands)
    second = assemble_groom([VIEW], [MASK], HEAD, shuffled, strands.select(order))
    assert np.array_equal(second.strands.points, first.strands.select(order).points)
    assert np.array_equal(second.root_triangle, first.root_triangle[order])
