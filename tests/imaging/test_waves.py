"""Laws of the waves measured in drawn photos."""

from __future__ import annotations

import functools
from dataclasses import replace

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import ndimage

from hairkit.arrays import Float64Array
from hairkit.imaging.waves import (
    COILS,
    LARGEST_SLOPE,
    USUAL_RADIUS,
    measure_waves,
    remove_slant,
)
from hairkit.types.camera import Camera
from hairkit.types.capture import Capture, View
from hairkit.types.mask import HAIR, Mask
from hairkit.types.orientation import OrientationMap, angle_between, wrap_angle
from hairkit.types.volume import ScalpDistance
from hairkit.types.waves import Waves

WIDTH, HEIGHT, PIXELS_PER_METRE = 0.2, 0.24, 1500.0
"""Of a made-up photo: metres, and its resolution."""
VIEWS = 4
SEGMENT = 0.0015
"""Length of the straight pieces of a drawn strand, metres."""


def orthographic(azimuth: float = 0.0, scale: float = PIXELS_PER_METRE) -> Camera:
    """Return a camera with so many pixels in a metre."""
    return Camera.on_turn(
        azimuth, focal=scale, width=round(WIDTH * scale), height=round(HEIGHT * scale),
        model="orthographic",
    )  # fmt: skip


@functools.cache
def drawing(radius: float, pitch: float, seed: int = 0, scale: float = PIXELS_PER_METRE) -> View:
    """Return a photo of hair that hangs in helices, near halves bright and in front of dark ones.

    Locks are 8 mm wide, and in phase within themselves.
    """
    rng = np.random.default_rng(seed)
    locks = rng.uniform(0, WIDTH, (60, 1))
    middle = (locks + rng.normal(0, 0.002, (60, 12))).ravel()
    phase = np.repeat(rng.uniform(0, 2 * np.pi, 60), 12) + rng.normal(0, 0.3, 720)
    turn = np.repeat(rng.choice([-1, 1], 60), 12)
    along = np.arange(-0.01, HEIGHT + 0.01, SEGMENT)
    angle = phase[:, None] + turn[:, None] * 2 * np.pi * along / pitch
    x = middle[:, None] + radius * np.cos(angle)
    places = scale * np.stack([x, np.broadcast_to(along, x.shape)], axis=-1)
    image = np.full((round(HEIGHT * scale), round(WIDTH * scale)), 60, np.uint8)
    depth = np.sin(angle)[:, :-1]
    strand, piece = np.unravel_index(np.argsort(depth, axis=None), depth.shape)
    fixed = np.rint(places * 16).astype(int)
    shade = 110 + 70 * depth + rng.normal(0, 12, len(x))[:, None]
    for s, k in zip(strand, piece, strict=True):
        cv2.line(
            image, fixed[s, k].tolist(), fixed[s, k + 1].tolist(), float(shade[s, k]), 1, 16, 4
        )
    return View("front", 0.0, np.repeat(image[..., None], 3, axis=-1))


def views_of(
    view: View, slants: list[float] | None = None, scale: float = PIXELS_PER_METRE
) -> tuple[Capture, list[OrientationMap], list[Mask], list[Camera]]:
    """Return a photo as that of every view, all of it hair, with maps of a slant (radians)."""
    shape = view.image.shape[:2]
    slants = slants or [0.0] * VIEWS
    maps = [
        OrientationMap(wrap_angle(np.full(shape, np.pi / 2 + slant)), np.ones(shape, np.float32))
        for slant in slants
    ]
    cameras = [orthographic(360 / VIEWS * k, scale) for k in range(VIEWS)]
    return Capture((view,) * VIEWS), maps, [Mask(np.full(shape, HAIR), True)] * VIEWS, cameras


@pytest.mark.parametrize(("radius", "pitch"), [(0.0068, 0.027), (0.008, 0.04), (0.004, 0.02)])
def test_radius_and_pitch_of_drawn_curls_are_found(radius: float, pitch: float) -> None:
    """The pitch within 10 percent, the radius within 35: the drawing shades crudely."""
    waves = measure_waves(*views_of(drawing(radius, pitch)))
    assert waves.pitch == pytest.approx(pitch, rel=0.1)
    assert waves.radius == pytest.approx(radius, rel=0.35)
    assert waves.curly


def test_waves_of_nine_centimetres_are_no_straight_hair() -> None:
    """Longer pitches than any curl's are measured as well."""
    waves = measure_waves(*views_of(drawing(0.012, 0.09)))
    assert waves.pitch == pytest.approx(0.09, rel=0.1)
    assert waves.radius == pytest.approx(0.012, rel=0.35)
    assert not waves.curly


def test_coils_wider_than_hot_rollers_are_none() -> None:
    """A radius of 3 cm is no curl's: tied hair measured so became a ball of wool."""
    assert measure_waves(*views_of(drawing(0.03, 0.06))) == Waves()


def test_views_that_do_not_agree_show_no_waves() -> None:
    """The shading of locks repeats at another length in each photo; one that differs among four
    does not hide the waves of the others."""
    pitches = (0.027, 0.045, 0.06, 0.033)
    photos = [drawing(0.0068, pitch) for pitch in pitches]
    _, maps, masks, cameras = views_of(photos[0])
    assert measure_waves(Capture(tuple(photos)), maps, masks, cameras) == Waves()
    same = Capture((photos[0], photos[0], photos[2], photos[0]))
    assert measure_waves(same, maps, masks, cameras).pitch == pytest.approx(0.027, rel=0.1)


def curtains(view: View) -> tuple[Capture, list[OrientationMap], list[Mask], list[Camera]]:
    """Return one photo of which only two strips are hair, as beside a face."""
    labels = np.zeros(view.image.shape[:2], np.uint8)
    for left in (0.01, 0.13):
        labels[:, round(left * PIXELS_PER_METRE) : round((left + 0.05) * PIXELS_PER_METRE)] = HAIR
    capture, maps, _, cameras = views_of(view)
    return replace(capture, views=capture.views[:1]), maps[:1], [Mask(labels, True)], cameras[:1]


@pytest.mark.parametrize(("radius", "pitch"), [(0.0065, 0.06), (0.006, 0.05)])
def test_curtains_of_one_photo_are_as_wavy_as_their_slope_says(radius: float, pitch: float) -> None:
    """No patch for the pitch fits in: radius and pitch are usual ones of the measured slope."""
    waves = measure_waves(*curtains(drawing(radius, pitch)))
    assert waves.radius == pytest.approx(USUAL_RADIUS)
    assert waves.radius / waves.pitch == pytest.approx(radius / pitch, rel=0.5)


def test_straight_curtains_of_one_photo_have_no_waves() -> None:
    """Their slope is that of straight hair."""
    assert measure_waves(*curtains(drawing(0.0, 0.05))) == Waves()


@pytest.mark.parametrize("blur", [0.0, 1.5])
def test_texture_of_one_photo_is_that_of_coils_unless_it_is_short(blur: float) -> None:
    """What runs in all directions alike, fine or coarse, is noise in hair of 4 cm."""
    view = drawing(0.0, 0.05)
    noise = np.random.default_rng(0).integers(0, 255, view.image.shape, np.uint8)
    image = cv2.GaussianBlur(noise, (0, 0), blur) if blur else noise
    views = curtains(replace(view, image=np.asarray(image, np.uint8)))
    least = np.zeros((1, 1, 1), np.float32)
    assert measure_waves(*views, ScalpDistance(least, 0.04)) == Waves()
    assert measure_waves(*views, ScalpDistance(least, 0.06)) == COILS


def test_short_curtains_of_one_photo_have_no_waves() -> None:
    """Hair of 9 cm is too short to be waved without a pitch, that of 15 cm is not."""
    views = curtains(drawing(0.0065, 0.04))
    least = np.zeros((1, 1, 1), np.float32)
    assert measure_waves(*views, ScalpDistance(least, 0.09)) == Waves()
    assert measure_waves(*views, ScalpDistance(least, 0.15)).radius > 0


def test_hair_shorter_than_two_turns_has_no_waves() -> None:
    """What repeats every 27 mm in the picture of hair of 40 mm is no wave of it."""
    views = views_of(drawing(0.0068, 0.027))
    short, long = (ScalpDistance(np.zeros((1, 1, 1), np.float32), n) for n in (0.04, 0.07))
    assert measure_waves(*views, short) == Waves()
    assert measure_waves(*views, long) == measure_waves(*views) != Waves()


def test_the_pitch_is_in_metres_whatever_the_size_of_the_pictures() -> None:
    """Photos of another size show the same waves."""
    small, large = (
        measure_waves(*views_of(drawing(0.0068, 0.027, scale=scale), scale=scale))
        for scale in (1200.0, 2400.0)
    )
    assert small.pitch == pytest.approx(large.pitch, rel=0.05)
    assert small.radius == pytest.approx(large.radius, rel=0.35)


def test_mirrored_and_darkened_photos_show_the_same_curls() -> None:
    """Nothing in the measurement prefers a side or a brightness."""
    view = drawing(0.0068, 0.027)
    waves = measure_waves(*views_of(view))
    mirrored = replace(view, image=view.image[:, ::-1])
    dark = replace(view, image=(0.5 * view.image).astype(np.uint8))
    for other in (mirrored, dark):
        found = measure_waves(*views_of(other))
        assert found.pitch == pytest.approx(waves.pitch, rel=0.02)
        assert found.radius == pytest.approx(waves.radius, rel=0.1)


def test_straight_hair_and_a_grey_picture_have_no_waves() -> None:
    """Lines without coils, and no lines, are straight hair."""
    straight = drawing(0.0, 0.03)
    for image in (straight.image, np.full_like(straight.image, 90)):
        assert measure_waves(*views_of(replace(straight, image=image))) == Waves()


def test_hair_that_runs_in_all_directions_alike_is_tightly_coiled(rng: np.random.Generator) -> None:
    """A texture without direction or repeats is that of coils which no photo of a head resolves; a
    texture of one direction is not, nor is hair that few views show."""

    def textured(across: float, along: float) -> View:
        shape = (round(HEIGHT * PIXELS_PER_METRE), round(WIDTH * PIXELS_PER_METRE))
        spots = cv2.GaussianBlur(rng.normal(size=shape), (0, 0), across, sigmaY=along)
        grey = np.clip(90 + 40 * spots / spots.std(), 0, 255).astype(np.uint8)
        return View("front", 0.0, np.repeat(grey[..., None], 3, axis=-1))

    capture, maps, masks, cameras = views_of(textured(1.2, 1.2))
    views = tuple(replace(v, image=textured(1.2, 1.2).image) for v in capture.views)
    capture = replace(capture, views=views)
    assert measure_waves(capture, maps, masks, cameras) == COILS
    assert measure_waves(*views_of(textured(1.5, 9))) == Waves()
    bald = Mask(
        np.where(np.arange(masks[0].labels.size) < 9, HAIR, 0).reshape(maps[0].angle.shape), True
    )
    assert measure_waves(capture, maps, [*masks[:1], *[bald] * 3], cameras) != COILS


def locks(ways: Float64Array) -> View:
    """Return a photo of locks 2.5 cm wide with strands side by side, at these angles."""
    y, x = np.mgrid[: round(HEIGHT * PIXELS_PER_METRE), : round(WIDTH * PIXELS_PER_METRE)]
    edge = 0.025 * PIXELS_PER_METRE
    lock = (x // edge + 8 * (y // edge)).astype(int) % len(ways)
    strands = ndimage.gaussian_filter1d(
        np.random.default_rng(0).normal(size=5000), 1.5, mode="wrap"
    )
    way = ways[lock]
    across = 100 * lock + y * np.cos(way) - x * np.sin(way)
    shade = np.interp(across % 5000, np.arange(5000), strands)
    grey = np.clip(90 + 40 * shade / strands.std(), 0, 255).astype(np.uint8)
    return View("front", 0.0, np.repeat(grey[..., None], 3, axis=-1))


def test_locks_in_all_directions_are_no_coils() -> None:
    """Strands that lie side by side have no steep curls, however their locks lie: neither in a turn
    nor in one photo, where no pitch is seen."""
    rng = np.random.default_rng(1)
    every = locks(rng.permutation(np.linspace(0, np.pi, 80, endpoint=False)))
    assert measure_waves(*views_of(every)) != COILS
    flat = locks(rng.permutation(np.linspace(-0.5, 0.5, 80)))
    waves = measure_waves(*curtains(flat))
    assert 2 * np.pi * waves.radius == pytest.approx(LARGEST_SLOPE * waves.pitch)


def test_too_little_hair_is_not_measured() -> None:
    """Where no square is filled there is nothing to measure."""
    capture, maps, _, cameras = views_of(drawing(0.0068, 0.027))
    labels = np.zeros(maps[0].angle.shape, np.uint8)
    labels[:40] = HAIR
    assert measure_waves(capture, maps, [Mask(labels, True)] * VIEWS, cameras) == Waves()


@pytest.mark.parametrize("slant_deg", [-20.0, 8.0, 25.0])
def test_the_slant_of_all_views_is_found_with_its_sign(slant_deg: float) -> None:
    """Its sign is the handedness."""
    waves = measure_waves(*views_of(drawing(0.0068, 0.027), [np.radians(slant_deg)] * VIEWS))
    assert np.degrees(waves.slant) == pytest.approx(slant_deg, abs=0.5)
    assert waves.handedness == np.sign(slant_deg)


def test_slants_that_cancel_between_views_are_no_slant() -> None:
    """Hair that falls to the left in one view falls to the right in the opposite one."""
    waves = measure_waves(*views_of(drawing(0.0068, 0.027), [0.3, -0.3] * (VIEWS // 2)))
    assert waves.slant == 0
    assert waves.handedness == 0
    assert waves.pitch == pytest.approx(0.027, rel=0.1)


@given(st.floats(-1.5, 1.5))
@settings(max_examples=20)
def test_taking_off_the_slant_turns_every_angle_by_it(slant: float) -> None:
    """Putting it back gives the map again; confidence stays, and 0 changes nothing."""
    angle = wrap_angle(np.linspace(0, 3.1, 35).reshape(5, 7))
    found = OrientationMap(angle, np.linspace(0, 1, 35, dtype=np.float32).reshape(5, 7))
    without = remove_slant(found, Waves(0.01, 0.03, slant))
    np.testing.assert_allclose(angle_between(without.angle, angle - slant), 0, atol=1e-5)
    again = remove_slant(without, Waves(0.01, 0.03, -slant))
    np.testing.assert_allclose(angle_between(again.angle, angle), 0, atol=1e-5)
    np.testing.assert_array_equal(without.confidence, found.confidence)
    assert remove_slant(found, Waves(0.01, 0.03, 0.0)) is found
