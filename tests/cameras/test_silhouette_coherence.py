"""Laws of silhouette coherence; the kernel against a plain search along each ray."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.ndimage import map_coordinates
from scipy.spatial.transform import Rotation
from turntable import Turntable, turntable

from hairkit import Mask
from hairkit.arrays import Float64Array
from hairkit.cameras.landmark_equations import CameraArrays
from hairkit.cameras.outlines import Outlines
from hairkit.cameras.silhouette_coherence import CAP, REACH, _search_rays, coherence
from hairkit.cameras.turn_fit import Silhouettes, TurnOptions

MIDDLE = np.full(8, 0.7)


@pytest.fixture(scope="module")
def bust() -> Turntable:
    """A head seen by cameras off the turn."""
    return turntable(np.random.default_rng(3))


@pytest.fixture(scope="module")
def outlines(bust: Turntable) -> Outlines:
    """Its silhouettes."""
    return Outlines.of(bust.masks, 30)


def _arrays(bust: Turntable) -> CameraArrays:
    cameras = bust.cameras
    return (
        np.stack([camera.rotation for camera in cameras]),
        np.stack([camera.translation for camera in cameras]),
        np.array([camera.focal for camera in cameras]),
        np.stack([camera.centre for camera in cameras]),
    )


def _searched(bust: Turntable, outlines: Outlines) -> Float64Array:
    """Return the best depth's smallest signed distance by trying 4,000 depths a ray."""
    depths = np.linspace(MIDDLE[0] - REACH, MIDDLE[0] + REACH, 4000)
    values = []
    for point, own in zip(outlines.points, outlines.views, strict=True):
        places = bust.cameras[own].unproject(np.tile(point, (len(depths), 1)), depths)
        worst = np.full(len(depths), CAP)
        for view, camera in enumerate(bust.cameras):
            if view == own:
                continue
            x, y = (camera.project(places) * outlines.scale - 0.5).T
            height, width = outlines.fields[view].shape
            field = map_coordinates(outlines.fields[view], [y, x], order=1, mode="nearest")
            beyond = np.maximum(np.maximum(-x, x - width + 1), 0)
            beyond += np.maximum(np.maximum(-y, y - height + 1), 0)
            worst = np.minimum(worst, field + beyond / outlines.scale)
        values.append(worst.max())
    return np.array(values)


def test_the_kernel_finds_what_a_plain_search_finds(bust: Turntable, outlines: Outlines) -> None:
    """All rays agree to a third of a pixel with 4,000 depths tried: the search misses no depth."""
    value, _ = coherence(outlines, *_arrays(bust), MIDDLE, softness=0.05)
    want = _searched(bust, outlines)
    assert (value < want + 0.1).all()
    assert (value > want - 0.3).all()


def test_values_do_not_jump(bust: Turntable, outlines: Outlines) -> None:
    """Cameras that move by a micrometre change no ray by a twentieth of a pixel."""
    rotation, translation, focal, centre = _arrays(bust)
    before, _ = coherence(outlines, rotation, translation, focal, centre, MIDDLE)
    moved = translation + np.random.default_rng(1).normal(0, 1e-6, translation.shape)
    after, _ = coherence(outlines, rotation, moved, focal, centre, MIDDLE)
    doubtful = before < 10
    assert doubtful.sum() > 20
    assert np.abs(after - before)[doubtful].max() < 0.05


def test_true_cameras_are_coherent_and_wrong_ones_are_not(
    bust: Turntable, outlines: Outlines
) -> None:
    """With the cameras that took the pictures no ray misses by more than a pixel or so."""
    rotation, translation, focal, centre = _arrays(bust)
    value, _ = coherence(outlines, rotation, translation, focal, centre, MIDDLE)
    assert value.min() > -1.5
    moved = translation.copy()
    moved[2, 1] += 0.02
    wrong, _ = coherence(outlines, rotation, moved, focal, centre, MIDDLE)
    assert wrong.min() < -5


def test_fewer_rays_have_the_same_values(bust: Turntable, outlines: Outlines) -> None:
    """One in three contour points, by the kernel that is compiled for all of them."""
    cameras = _arrays(bust)
    value, slope = coherence(outlines, *cameras, MIDDLE)
    compiled = list(_search_rays.signatures)
    few, few_slopes = coherence(outlines.thinned(3), *cameras, MIDDLE)
    np.testing.assert_array_equal(few, value[::3])
    np.testing.assert_array_equal(few_slopes, slope[::3])
    assert _search_rays.signatures == compiled


def test_slopes_are_derivatives(bust: Turntable, outlines: Outlines) -> None:
    """Small motions of all cameras change most doubtful values as the slopes say."""
    rotation, translation, focal, centre = _arrays(bust)
    rng = np.random.default_rng(5)
    motion = rng.normal(0, 3e-5, (8, 7))

    def value(sign: float) -> Float64Array:
        turns = np.stack([Rotation.from_rotvec(sign * m[:3]).as_matrix() for m in motion])
        moved = np.einsum("vij,vj->vi", turns, translation) + sign * motion[:, 3:6]
        zoomed = focal * np.exp(sign * motion[:, 6])
        return coherence(outlines, turns @ rotation, moved, zoomed, centre, MIDDLE)[0]

    middle, slope = coherence(outlines, rotation, translation, focal, centre, MIDDLE)
    doubtful = middle < 3
    got = (value(1) - value(-1)) / 2
    want = (slope * motion).sum((1, 2))
    scale = np.abs(got[doubtful]).max()
    assert doubtful.sum() > 20
    assert np.mean(np.abs(got - want)[doubtful] < 0.15 * scale) > 0.75


def test_the_crown_is_found(bust: Turntable, outlines: Outlines) -> None:
    """The top of every silhouette is where the head's highest points are seen."""
    top, _, width = outlines.heads.T
    for camera, row in zip(bust.cameras, top, strict=True):
        highest = camera.project(bust.head.vertices)[:, 1].min()
        assert abs(row - highest) < 5
    assert (width > 60).all()


def test_a_smaller_picture_keeps_its_pixels(bust: Turntable, outlines: Outlines) -> None:
    """Rows cut off one picture's bottom leave the other views' distances as they are, and no
    outline lies below it."""
    labels = [mask.labels for mask in bust.masks]
    labels[0] = labels[0][:-100]
    cut = Outlines.of([Mask(part, True) for part in labels], 30)
    assert np.array_equal(cut.fields[1:], outlines.fields[1:])
    rows = cut.points[cut.views == 0, 1]
    assert len(rows) > 15
    assert rows.max() < len(labels[0])


def test_shoulders_that_one_mask_misses_are_no_evidence(bust: Turntable) -> None:
    """Where one person ends at the chin, no view has contour points much farther down."""
    labels = [mask.labels.copy() for mask in bust.masks]
    first, middle, width = Outlines.of(bust.masks, 30).heads[2]
    labels[2][round(first + 1.3 * width) :] = 0
    labels[2][-20:, round(middle) :] = 128  # a piece of the person, without the head
    cut = Outlines.of([Mask(part, True) for part in labels], 30)
    depth = (cut.points[:, 1] - cut.heads[cut.views, 0]) / cut.heads[cut.views, 2]
    assert depth.max() < 1.35
    assert np.bincount(cut.views, minlength=len(labels)).min() > 20
    assert Outlines.of(bust.masks, 30).points[:, 1].max() > first + 1.5 * width


def test_a_picture_full_of_hair_has_no_outline() -> None:
    """A mask without an edge gives no contour points and finite distances."""
    outlines = Outlines.of([Mask(np.full((40, 30), 255, np.uint8), True)], 10)
    assert len(outlines.points) == 0
    assert np.isfinite(outlines.fields).all()


def test_silhouettes_in_another_order_are_those_of_masks_in_that_order(bust: Turntable) -> None:
    """Fields, contour points and bare outlines move with their views."""
    order, options = np.roll(np.arange(len(bust.masks))[::-1], 2), TurnOptions()
    moved = Silhouettes.of(bust.masks, bust.head, options).arranged(order)
    wanted = Silhouettes.of(tuple(bust.masks[k] for k in order), bust.head, options)
    for name in ("fields", "points", "views", "heads"):
        assert np.array_equal(getattr(moved.outlines, name), getattr(wanted.outlines, name))
    assert moved.cranium is not None
    assert wanted.cranium is not None
    assert np.array_equal(moved.cranium.fields, wanted.cranium.fields)
