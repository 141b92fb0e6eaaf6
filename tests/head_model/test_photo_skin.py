"""Laws of the skin from photos: it is what the photos show, whatever the views' exposures."""

from __future__ import annotations

from dataclasses import replace

import cv2
import numpy as np
import pytest

from hairkit.arrays import Float64Array, UInt8Array
from hairkit.cameras.depth_raster import head_depth
from hairkit.head_model import photo_skin
from hairkit.head_model.exposures import even_exposures
from hairkit.head_model.photo_skin import photograph_skin
from hairkit.head_model.skin_tones import extend_tones
from hairkit.head_model.template import default_head
from hairkit.types.camera import Camera
from hairkit.types.capture import Capture, View
from hairkit.types.head import Head
from hairkit.types.mask import BACKGROUND, HAIR, PERSON, Mask
from hairkit.types.scene import Scene

AZIMUTHS = (0.0, 45.0, 90.0, 180.0, 270.0, 315.0)
HAIR_ABOVE = 0.055
"""Metres above which the painted head has hair."""


def paint(points: Float64Array) -> Float64Array:
    """Return colours (N, 3) of places on the head, 0 to 255: skin with broad stripes."""
    wave = 25 * np.sin(points[:, :1] * 120) + 20 * np.cos(points[:, 1:2] * 90)
    return np.clip(np.array([185.0, 140.0, 115.0]) + wave * [1.0, 0.8, 0.7], 0, 255)


def shot(head: Head, azimuth: float, gain: float) -> tuple[Camera, UInt8Array, Mask]:
    """Return a camera, the photo that it takes of the painted head, and its labels."""
    camera = Camera.on_turn(azimuth, distance=0.9, focal=520.0, width=240, height=300)
    depth = head_depth(head, camera)
    seen = np.isfinite(depth)
    row, column = np.nonzero(seen)
    places = camera.unproject(np.column_stack([column, row]) + 0.5, depth[seen])
    photo = np.full((300, 240, 3), 90, np.uint8)
    labels = np.full((300, 240), BACKGROUND, np.uint8)
    hair = places[:, 1] > HAIR_ABOVE
    colours = np.where(hair[:, None], 20.0, gain * paint(places))
    photo[row, column] = np.rint(colours).clip(0, 255)
    labels[row, column] = np.where(hair, HAIR, PERSON)
    return camera, photo, Mask(labels, True)


@pytest.fixture(scope="module")
def painted() -> tuple[Capture, Scene, list[Mask]]:
    """Six photos of the painted default head, some of them darker."""
    head = default_head()
    gains = (1.0, 0.8, 1.0, 0.9, 1.0, 0.75)
    shots = [shot(head, azimuth, gain) for azimuth, gain in zip(AZIMUTHS, gains, strict=True)]
    names = tuple(f"{azimuth:.0f}" for azimuth in AZIMUTHS)
    views = tuple(
        View(name, float(name), photo) for name, (_, photo, _) in zip(names, shots, strict=True)
    )
    scene = Scene(names, tuple(camera for camera, _, _ in shots), head)
    return Capture(views), scene, [mask for _, _, mask in shots]


def test_seen_skin_is_what_was_painted(painted: tuple[Capture, Scene, list[Mask]]) -> None:
    """On the face the map is the paint but for one gain, although exposures differ by a quarter."""
    capture, scene, masks = painted
    maps = photograph_skin(capture, scene, masks)
    assert maps.albedo is not None
    head = scene.head
    face = (head.vertices[:, 2] > 0.05) & (np.abs(head.vertices[:, 1] + 0.05) < 0.07)
    assert head.landmark_vertices is not None
    eyes = head.vertices[head.landmark_vertices[36:48]]
    face &= np.linalg.norm(head.vertices[:, None] - eyes, axis=2).min(axis=1) > 0.012
    face[head.eye_vertices] = False
    found = 255 * maps.albedo.sample(head.uv[face])
    wanted = paint(head.vertices[face].astype(np.float64))
    ratio = np.median(found / wanted)
    off = np.abs(found / ratio - wanted)
    assert off.mean() < 4
    assert np.quantile(off, 0.95) < 12


def test_hair_is_not_in_the_skin(painted: tuple[Capture, Scene, list[Mask]]) -> None:
    """Where hair covers the head the map has the tone of skin, not the hair's."""
    capture, scene, masks = painted
    maps = photograph_skin(capture, scene, masks)
    assert maps.albedo is not None
    top = scene.head.vertices[:, 1] > HAIR_ABOVE + 0.01
    assert 255 * maps.albedo.sample(scene.head.uv[top]).min() > 60


def test_strands_shadow_and_collar_are_not_in_the_skin(
    painted: tuple[Capture, Scene, list[Mask]],
) -> None:
    """Strands that the mask misses, their orange shadow and a green collar leave even skin."""
    capture, scene, masks = painted
    views = []
    for view, camera in zip(capture.views, scene.cameras, strict=True):
        depth = head_depth(scene.head, camera)
        row, column = np.nonzero(np.isfinite(depth))
        places = camera.unproject(np.column_stack([column, row]) + 0.5, depth[row, column])
        height = places[:, 1] - HAIR_ABOVE
        colours = np.tile([185.0, 140.0, 115.0], (len(places), 1))
        colours[height > -0.035] *= [0.9, 0.75, 0.62]
        colours[(height > -0.02) & (np.arange(len(places)) % 3 == 0)] = 30
        colours[places[:, 1] < scene.head.joints[1, 1] - 0.01] = [60, 110, 80]
        photo = view.image.copy()
        photo[row, column] = np.where((height > 0)[:, None], 20, colours)
        views.append(replace(view, image=photo))
    albedo = photograph_skin(replace(capture, views=tuple(views)), scene, masks).albedo
    assert albedo is not None
    skin = np.ones(len(scene.head.vertices), bool)
    skin[scene.head.eye_vertices] = False
    assert scene.head.landmark_vertices is not None
    inner = scene.head.vertices[scene.head.landmark_vertices[17:]]
    for point in inner:  # brows and lips of the head's own skin are where no view sees skin
        skin &= np.linalg.norm(scene.head.vertices - point, axis=1) > 0.03
    found = np.log(255 * albedo.sample(scene.head.uv[skin]))
    assert found.std(axis=0).max() < 0.04
    assert abs(np.median(found[:, 0] - found[:, 1]) - np.log(185 / 140)) < 0.05


def test_without_skin_the_head_keeps_its_own(
    painted: tuple[Capture, Scene, list[Mask]],
) -> None:
    """Photos that show only hair leave the head's own albedo as it is."""
    capture, scene, masks = painted
    covered = [Mask(np.where(m.labels == PERSON, HAIR, m.labels), True) for m in masks]
    found = photograph_skin(capture, scene, covered).albedo
    own = scene.head.maps
    assert found is not None
    assert own is not None
    assert own.albedo is not None
    uv = scene.head.uv
    assert np.abs(found.sample(uv) - own.albedo.sample(uv)).mean() < 0.01


def test_a_view_that_sees_next_to_nothing_changes_nothing() -> None:
    """A view whose weight vanishes beside another's neither fails nor shows in the colours."""
    photo, whole = grey_view()
    faint = whole._replace(weight=1e-9 * whole.weight, coarse=whole.coarse + 100)
    alone, _ = photo_skin._blend([whole], [photo], np.ones((1, 3)))
    both, _ = photo_skin._blend([whole, faint], [photo, photo + 100], np.ones((2, 3)))
    np.testing.assert_allclose(both, alone, atol=1e-3)


def grey_view() -> tuple[UInt8Array, photo_skin._Seen]:
    """An even photo, and the view that sees all of it straight on."""
    size = photo_skin.COARSE
    photo = np.full((size, size, 3), 120, np.uint8)
    row, column = np.indices((size, size)).astype(np.float32)
    weight = np.ones((size, size), np.float32)
    return photo, photo_skin._Seen(weight, column, row, photo.astype(np.float32))


def test_the_face_is_of_one_view() -> None:
    """That which sees the features best draws them, beside views that see other parts better."""
    photo, aside = grey_view()
    spotted = photo.copy()
    spotted[::8] = 60
    features = np.zeros(aside.weight.shape, np.bool_)
    features[200:300, 200:300] = True
    front = np.where(features, 1.2, 0.8).astype(np.float32)
    shown = aside._replace(weight=front, coarse=spotted.astype(np.float32))
    alone, _ = photo_skin._blend([shown], [spotted], np.ones((1, 3)))
    views = photo_skin._one_face([shown, aside], features, False)
    both, _ = photo_skin._blend(views, [spotted, photo], np.ones((2, 3)))
    spots, wanted = (
        np.abs(np.diff(colours[..., 0], axis=0)).max(axis=0) for colours in (both, alone)
    )
    np.testing.assert_allclose(spots, wanted, rtol=0.1)


@pytest.mark.parametrize("symmetric", [True, False])
def test_half_a_brow_comes_from_its_mirror_image_not_from_another_view(symmetric: bool) -> None:
    """Where the face's view sees the other half of the features, no view shows this one; beside
    the features, and on heads without symmetry, other views do."""
    _, aside = grey_view()
    size = photo_skin.COARSE
    features = np.zeros((size, size), np.bool_)
    features[200:300, 100:-100] = True
    half = np.where(np.arange(size) < size // 2, 3.0, 0.0) * np.ones((size, 1))
    shown = aside._replace(weight=half.astype(np.float32))
    other = photo_skin._one_face([aside, shown], features, symmetric)[0].weight
    assert not other[:, : size // 2].any()
    right = other[:, size // 2 :]
    assert right[~features[:, size // 2 :]].all()
    assert right[features[:, size // 2 :]].any() != symmetric


def test_gains_make_views_agree() -> None:
    """Views that are multiples of one picture are evened, by gains whose mean logarithm is 0."""
    generator = np.random.default_rng(3)
    picture = generator.uniform(40, 200, (20, 20, 3)).astype(np.float32)
    weights = [generator.uniform(0.2, 1, (20, 20)).astype(np.float32) for _ in range(3)]
    true = np.array([[1.0, 1.0, 1.0], [0.7, 0.8, 0.9], [1.3, 1.1, 1.0]])
    gains = even_exposures([picture * each.astype(np.float32) for each in true], weights)
    apart = np.ptp(np.log(gains * true), axis=0)
    assert (apart < 0.15 * np.ptp(np.log(true), axis=0)).all()
    assert abs(np.average(np.log(gains), axis=0, weights=[w.sum() for w in weights])).max() < 1e-6


def test_extended_values_stay_and_reach_everywhere() -> None:
    """A constant stays a constant; values far from all weights are those of the nearest side."""
    weight = np.zeros((64, 64), np.float32)
    weight[10:20, 10:20] = 1
    constant = extend_tones(np.full((64, 64, 3), 0.7, np.float32), weight)
    np.testing.assert_allclose(constant, 0.7, atol=1e-4)
    weight[50:60, 50:60] = 1
    values = np.zeros((64, 64, 3), np.float32)
    values[40:, 40:] = 1
    found = extend_tones(values, weight)[..., 0]
    assert found[15, 15] < 0.01
    assert found[55, 55] > 0.99
    assert found[2, 2] < 0.1
    assert found[62, 62] > 0.9


def test_a_head_without_maps_gets_one(painted: tuple[Capture, Scene, list[Mask]]) -> None:
    """A user's head without a picture gets its skin from the photos all the same."""
    capture, scene, masks = painted
    plain = replace(scene, head=replace(scene.head, maps=None))
    maps = photograph_skin(capture, plain, masks)
    assert maps.albedo is not None
    assert maps.albedo.pixels.shape == (photo_skin.SIZE, photo_skin.SIZE, 3)


@pytest.mark.parametrize("edge", [photo_skin.COARSE, 128])
def test_rows_enlarged_by_strips_are_those_enlarged_at_once(edge: int) -> None:
    """No seams: a strip knows the rows beside it."""
    picture = np.random.default_rng(4).random((edge, 9), dtype=np.float32)
    strips = [photo_skin._enlarge_rows(picture, rows) for rows in photo_skin._strips()]
    times = photo_skin.SIZE // edge
    whole = cv2.resize(picture, None, fx=times, fy=times, interpolation=cv2.INTER_LINEAR)
    np.testing.assert_allclose(np.concatenate(strips), whole, atol=1e-6)


def test_a_photo_with_gaps_adds_its_pixels_once_each() -> None:
    """Skin above and below hair: what lies in between stays, each pixel has its share."""
    edge, times = photo_skin.COARSE, photo_skin.SIZE // photo_skin.COARSE
    share = np.zeros((edge, edge), np.float32)
    share[10:14, 20:40] = 0.5
    share[-30:-20, 60:90] = 1.0
    zeros = np.zeros((edge, edge), np.float32)
    view = photo_skin._Seen(share, zeros, zeros, np.zeros((edge, edge, 3), np.uint8))
    colours = np.zeros((photo_skin.SIZE, photo_skin.SIZE, 3), np.float32)
    gain = np.array([1.0, 0.5, 2.0], np.float32)
    photo_skin._add_photo(colours, view, np.full((8, 8, 3), 100, np.uint8), gain, share)
    size = (photo_skin.SIZE, photo_skin.SIZE)
    whole = cv2.resize(share, size, interpolation=cv2.INTER_LINEAR)
    rows = slice(10 * times, -20 * times)  # those with a share, and what is between
    expected = 100 * whole[rows, :, None] * gain
    np.testing.assert_allclose(colours[rows], expected, atol=1e-3)
    assert colours[: 8 * times].max() == colours[-18 * times :].max() == 0
    assert (edge - 44) * times > photo_skin.STRIP  # the gap holds a whole strip
