"""Laws of the masks that are mended together."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
from hairkit_plugins import head_prior

from hairkit.head_model.template import default_head
from hairkit.types.camera import Camera
from hairkit.types.capture import Capture, View
from hairkit.types.mask import BACKGROUND, HAIR, PERSON, Mask
from hairkit.types.scene import Scene

WIDTH, HEIGHT = 180, 240
SKIN, BROWN, WALL = (205, 155, 130), (60, 45, 35), (150, 165, 175)


def set_up() -> tuple[Capture, tuple[Mask, ...], Scene]:
    """Return four views of the default head with a dark scalp, and masks that say so."""
    head = default_head()
    views, masks, cameras = [], [], []
    rng = np.random.default_rng(5)
    points = head.vertices[(head.scalp > 0.5)]
    for index in range(4):
        camera = Camera.on_turn(90.0 * index, distance=0.8, focal=500, width=WIDTH, height=HEIGHT)
        single = Scene(("one",), (camera,), head)
        labels = np.full((HEIGHT, WIDTH), BACKGROUND, np.uint8)
        depth = head_prior.mark_bare_head(single.head, camera)
        u, v = camera.project(1.06 * points).T.astype(int)
        labels[depth > 0.5] = PERSON
        labels[v.clip(0, HEIGHT - 1), u.clip(0, WIDTH - 1)] = HAIR
        picture = np.zeros((HEIGHT, WIDTH, 3))
        for label, colour in {HAIR: BROWN, PERSON: SKIN, BACKGROUND: WALL}.items():
            picture[labels == label] = colour
        picture += rng.normal(0, 4, picture.shape)
        image = np.clip(picture, 0, 255).astype(np.uint8)
        views.append(View(str(index), 90.0 * index, image))
        masks.append(Mask(labels, True))
        cameras.append(camera)
    scene = Scene(tuple("0123"), tuple(cameras), head)
    return Capture(tuple(views)), tuple(masks), scene


def refine(capture: Capture, masks: tuple[Mask, ...], scene: Scene) -> tuple[Mask, ...]:
    return head_prior.refine_masks(capture=capture, masks=masks, scene=scene).views


def test_masks_and_strokes_of_the_user_are_kept() -> None:
    """Views that came with a mask or strokes keep their masks, others are labelled again."""
    capture, masks, scene = set_up()
    views = list(capture.views)
    views[0] = replace(views[0], mask_path=Path("0.png"))
    views[2] = replace(views[2], strokes_path=Path("2.json"))
    refined = refine(replace(capture, views=tuple(views)), masks, scene)
    assert [new is old for new, old in zip(refined, masks, strict=True)][::2] == [True, True]
    assert all(new.alpha is not None for new in refined[1::2])


def test_all_masks_given_are_returned_as_they_are() -> None:
    """Nothing is computed where every mask is the user's."""
    capture, masks, scene = set_up()
    views = tuple(replace(view, mask_path=Path("a.png")) for view in capture.views)
    assert refine(replace(capture, views=views), masks, scene) == masks


def test_equal_photos_have_equal_masks() -> None:
    """Nothing is left to chance, and the order in which threads end does not matter."""
    first, second = refine(*set_up()), refine(*set_up())
    for one, other in zip(first, second, strict=True):
        assert np.array_equal(one.labels, other.labels)


def test_hair_apart_from_the_scalp_on_bare_skin_is_dropped() -> None:
    """An island of hair on the face is person; hair that reaches off the bare head remains."""
    labels = np.full((40, 60), PERSON, np.uint8)
    labels[5:10, 10:50] = HAIR
    labels[25:30, 10:15] = HAIR
    bare = np.zeros((40, 60), np.float32)
    bare[8:] = 1
    kept = head_prior._without_islands(labels, bare)
    assert (kept[5:10, 10:50] == HAIR).all()
    assert (kept[20:] == PERSON).all()


def test_hair_that_no_other_view_confirms_is_dropped() -> None:
    """A spot off the scalp goes where other views show none there, a lock of hair in 3D remains."""
    _, masks, scene = set_up()
    labels = [mask.labels.copy() for mask in masks]
    chin = np.array([0.0, -0.11, 0.12])  # a beard: only the view from the left takes it for hair
    lock = np.array([0.0, -0.1, -0.12])  # hangs behind the neck; views from the sides and the back
    spots: dict[tuple[int, str], tuple[slice, slice]] = {}
    for view, name, place in (
        (1, "chin", chin),
        (1, "lock", lock),
        (2, "lock", lock),
        (3, "lock", lock),
    ):
        u, v = scene.cameras[view].project(place).astype(int)
        spots[view, name] = (slice(v - 4, v + 5), slice(u - 4, u + 5))
        labels[view][v - 7 : v + 8, u - 7 : u + 8] = PERSON
        labels[view][spots[view, name]] = HAIR
    kept = head_prior._as_others_see(labels, scene)
    assert (kept[1][spots[1, "chin"]] == PERSON).all()
    for view in (1, 2, 3):
        assert (kept[view][spots[view, "lock"]] == HAIR).all()


def test_a_hole_in_the_hair_is_filled_where_others_see_hair() -> None:
    """A highlight that one view takes for skin goes, a bald spot that all see stays, and so does
    what is below the brows."""
    _, masks, scene = set_up()
    points = scene.head.vertices
    whorl = points[np.linalg.norm(points - [0.06, 0.05, -0.06], axis=1).argmin()]
    for seen_by in ([2], range(4)):
        labels = [mask.labels.copy() for mask in masks]
        for view in seen_by:
            u, v = scene.cameras[view].project(whorl).astype(int)
            labels[view][v - 3 : v + 4, u - 3 : u + 4] = PERSON
        u, v = scene.cameras[2].project(whorl).astype(int)
        kept = head_prior._as_others_see(labels, scene)[2][v - 3 : v + 4, u - 3 : u + 4]
        assert (kept == (HAIR if seen_by == [2] else PERSON)).all()
    labels = [mask.labels.copy() for mask in masks]
    for view in (2, 0, 1):  # an ear, the last one seen
        u, v = scene.cameras[view].project(np.array([0.08, -0.06, -0.01])).astype(int)
        labels[view][v - 7 : v + 8, u - 7 : u + 8] = HAIR
    labels[1][v - 3 : v + 4, u - 3 : u + 4] = PERSON
    ear = head_prior._as_others_see(labels, scene)[1][v - 3 : v + 4, u - 3 : u + 4]
    assert (ear == PERSON).all()


def test_clothes_larger_than_the_hair_are_no_hair() -> None:
    """What does not reach the scalp needs other views, however large it is; the hair needs none."""
    _, masks, scene = set_up()
    labels = [mask.labels.copy() for mask in masks]
    jacket = labels[0]
    hair = jacket == HAIR
    below = np.nonzero(hair.any(axis=1))[0][-1] + 8
    jacket[below - 6 :] = PERSON
    jacket[below:] = HAIR
    assert (jacket[below:] == HAIR).sum() > (jacket[: below - 6] == HAIR).sum()
    kept = head_prior._as_others_see(labels, scene)[0]
    assert (kept[below:] == PERSON).all()
    assert (kept[: below - 6] == HAIR).sum() > 0.95 * (jacket[: below - 6] == HAIR).sum()
