"""Laws of the found turn: it depends on what the photos show, not on their order or position."""

from __future__ import annotations

import re
from contextlib import nullcontext
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hairkit_plugins.photo_turn import IN_ORDER, appearance, refuse
from hairkit_plugins.photo_turn.arrangement import Evidence, Placed, wrap
from hairkit_plugins.photo_turn.refuse import check_one_person, check_turn
from hairkit_plugins.photo_turn.search import UNEVEN_DEG, Search
from hypothesis import example, given, settings
from hypothesis import strategies as st
from shots import (
    CARELESS,
    EIGHT,
    HAIR,
    HEIGHT,
    SKIN,
    TWO_FRONTS,
    WIDTH,
    WITH_A_GAP,
    Shot,
    find,
    found_in_order,
    named,
    off,
    ring,
    shoot,
)

from hairkit import View
from hairkit.arrays import BoolArray, Float32Array, Float64Array
from hairkit.errors import InputError
from hairkit.imaging import hair_network
from hairkit.pipeline.figure import GREEN, RED
from hairkit.pipeline.health import assess_turn
from hairkit.types.face import Face
from hairkit.types.person import Person
from hairkit.types.turnaround import Turnaround, moved_photos


def _places(turn: Turnaround) -> tuple[Float64Array, BoolArray]:
    """Return azimuths and which photos are from above."""
    return turn.azimuth_deg, turn.above


@pytest.mark.parametrize("azimuths", [EIGHT, CARELESS], ids=["even", "careless"])
@given(first=st.integers(0, 7), reverse=st.booleans())
@settings(max_examples=8, deadline=None)
def test_neither_direction_nor_first_photo_matters(
    azimuths: tuple[float, ...], first: int, reverse: bool
) -> None:
    """Photos turned the other way, from any first one, are put in the same order and places."""
    shots = ring(azimuths)
    moved = np.roll(np.arange(8), first)[:: -1 if reverse else 1]
    want, got = found_in_order(azimuths), find([shots[i] for i in moved])
    assert off(want, shots).max() < 25
    assert np.array_equal(moved[got.order], want.order)
    assert np.array_equal(got.azimuth_deg, want.azimuth_deg[moved])
    assert [got.names[k] for k in got.order] == [want.names[k] for k in want.order]


def in_the_sun(shot: Shot) -> Shot:
    """Return a photo in which hair on the subject's right has the colour of skin, and is told."""
    inside, image = shot.person.alpha > 0, shot.view.image.copy()
    hair = inside & (image == HAIR).all(axis=2)
    image[hair & (np.arange(WIDTH) < WIDTH / 2)] = SKIN
    told = Person(shot.person.alpha, np.where(hair, 255, 0).astype(np.uint8))
    return replace(shot, view=replace(shot.view, image=image), person=told)


def test_hair_of_the_colour_of_skin_is_hair() -> None:
    """Where hair is told, its colour moves no photo: the turn is that of dark hair."""
    shots = ring(EIGHT)
    sunny = [in_the_sun(shot) for shot in shots]
    assert np.abs(wrap(find(sunny).azimuth_deg - found_in_order(EIGHT).azimuth_deg)).max() < 1
    untold = [replace(shot, person=Person(shot.person.alpha)) for shot in sunny]
    assert off(find(untold), shots).max() > off(find(sunny), shots).max()


def test_hair_that_only_the_hair_network_finds_is_no_skin(monkeypatch: pytest.MonkeyPatch) -> None:
    """The network for persons may see nobody in a head from behind, and so no hair."""
    shots = ring(EIGHT)
    sunny = [in_the_sun(shot) for shot in shots]
    hair = {shot.view.image.tobytes(): shot.person.hair[..., None] / 255 for shot in sunny}
    want = find(sunny).azimuth_deg
    untold = [replace(shot, person=Person(shot.person.alpha)) for shot in sunny]
    monkeypatch.setattr(appearance, "find_hair", lambda view: hair[view.image.tobytes()])
    assert np.abs(wrap(find(untold).azimuth_deg - want)).max() < 1


def test_hair_taken_for_background_belongs_to_the_outline(monkeypatch: pytest.MonkeyPatch) -> None:
    """A head from behind of which the person's network sees the neck alone keeps its place."""
    shots = ring(CARELESS)
    want = found_in_order(CARELESS)

    def find_hair(view: View) -> Float32Array:
        return np.asarray((view.image == HAIR).all(axis=2, keepdims=True), np.float32)

    cut = [*shots]
    for i in np.flatnonzero([abs(shot.azimuth_deg) > 120 for shot in shots]):
        seen = np.where(find_hair(shots[i].view)[..., 0] > 0, 0, shots[i].person.alpha)
        cut[i] = replace(shots[i], person=Person(seen))
    monkeypatch.setattr(hair_network, "find_hair", find_hair)
    assert np.abs(wrap(find(cut).azimuth_deg - want.azimuth_deg)).max() < 1


@pytest.mark.parametrize(
    ("azimuths", "same"),
    [(EIGHT, 1e-9), (TWO_FRONTS, 2.0), (WITH_A_GAP, UNEVEN_DEG + 1)],
    ids=["even", "two fronts", "a gap"],
)
@given(seed=st.integers(0, 999))
@example(seed=10)
@settings(max_examples=5, deadline=None)
def test_shuffled_photos_are_sorted(azimuths: tuple[float, ...], same: float, seed: int) -> None:
    """Photos in no order, at uneven steps, get the places that they have in order.

    With two fronts the steps are told to two degrees: seed 41 is 1.7 off. With the gap they are as
    uneven as just counts as even, and in some orders they do.
    """
    shots = ring(azimuths)
    want = found_in_order(azimuths)
    moved = np.random.default_rng(seed).permutation(len(shots))
    found = find([shots[i] for i in moved])
    assert off(found, [shots[i] for i in moved]).max() < 25
    assert np.abs(wrap(found.azimuth_deg - want.azimuth_deg[moved])).max() < same


def test_a_speck_for_a_person_silences_one_photo_alone() -> None:
    """A photo in which the person was not found is put where the others leave room."""
    shots = ring(EIGHT)
    speck = np.zeros((HEIGHT, WIDTH), np.uint8)
    speck[90:93, 70:72] = 255
    shots[3] = replace(shots[3], person=Person(speck))
    moved = [shots[i] for i in (4, 1, 6, 3, 0, 7, 5, 2)]
    assert off(find(moved), moved).max() < 25


def test_frames_of_a_video_stay_in_the_order_of_time() -> None:
    """Without outlines only time tells apart what shows no face; the direction is still found."""
    for way in (1, -1):
        shots = [replace(s, person=Person.absent()) for s in ring(EIGHT)[::way]]
        found = find(shots, Path("turn.mp4"))
        assert off(found, shots).max() < 25


@pytest.mark.parametrize("count", [4, 5, 6, 10, 12, 36])
def test_any_number_of_photos_is_placed(count: int) -> None:
    """Even turns of 4 to 36 photos are found, begun anywhere."""
    shots = ring(np.round(np.arange(count) * 360 / count + 360 / count * 0.3))
    shots = shots[count // 3 :] + shots[: count // 3]
    found = find(shots)
    assert off(found, shots).max() < 15
    assert len(set(found.names)) == count


def test_neighbours_of_twelve_that_change_places_are_another_turn() -> None:
    """They are 30 degrees apart; a turn by half a step is none, nor one of eight by 20 degrees."""
    level, even = np.zeros(12, bool), np.arange(12) * 30.0
    changed = even[[0, 1, 2, 3, 5, 4, *range(6, 12)]]
    assert moved_photos(even, level, changed, level).nonzero()[0].tolist() == [4, 5]
    assert not moved_photos(even, level, even + 15, level).any()
    assert not moved_photos(even[:8], level[:8], even[:8] + 20, level[:8]).any()


def test_any_photo_is_tried_in_any_place_of_the_order() -> None:
    """The places stay; nothing that is known moves."""
    shots = ring(EIGHT)
    evidence = Evidence.of([shot.face for shot in shots])
    fixed = np.arange(8) == 2
    azimuth = np.array([shot.azimuth_deg for shot in shots])
    tried = Search(evidence, np.arange(8), fixed).near(Placed(azimuth, fixed & ~fixed, azimuth, 0))
    orders = {tuple(np.argsort(each.azimuth_deg % 360)) for each in tried}
    assert (0, 1, 2, 4, 5, 3, 6, 7) in orders
    assert all(each.azimuth_deg[2] == azimuth[2] for each in tried)


@pytest.mark.parametrize("place", [0, 3, 8])
def test_a_photo_from_above_is_told_apart(place: int) -> None:
    """One photo from above, anywhere among eight level ones, leaves their places as they are."""
    shots = ring(EIGHT)
    shots.insert(place, shoot(5.0, 62.0))
    found = find(shots)
    assert found.order[-1] == place
    assert found.elevation_deg[place] > 40
    assert np.delete(off(found, shots), place).max() < 10
    assert found.names[place] == "top"


def test_a_photo_that_fits_nowhere_else_is_doubted() -> None:
    """Without a face nobody knows that a photo is from above: the summary says how it was found."""
    found = find([*ring(EIGHT), shoot(5.0, 62.0)])
    assert any("IMG_8.jpg is taken for one from above" in doubt for doubt in found.doubts)
    assert {figure.light for figure in assess_turn(found)} - {GREEN}


def test_a_tie_is_told() -> None:
    """Where only faces are known, shuffled photos may change places: the margin is one."""
    shots = [replace(shot, person=Person.absent()) for shot in ring(EIGHT)]
    found = find([shots[i] for i in (4, 1, 6, 3, 0, 7, 5, 2)])
    assert found.margin == pytest.approx(1.0, abs=0.01)
    assert found.others
    assert all(moved_photos(*_places(found), *_places(each)).any() for each in found.others)
    assert RED in {figure.light for figure in assess_turn(found)}


@pytest.mark.parametrize("way", [1, -1])
def test_the_order_of_the_files_breaks_ties(way: int) -> None:
    """Photos are mostly taken one after another around the head."""
    shots = [replace(shot, person=Person.absent()) for shot in ring(EIGHT)][::way]
    found = find(shots)
    assert off(found, shots).max() < 10
    assert found.margin == pytest.approx(1 + IN_ORDER / 8, abs=0.05)


def test_the_order_of_the_files_yields_to_what_photos_show() -> None:
    """Two photos that changed their numbers are put back."""
    shots = [ring(CARELESS)[i] for i in (0, 1, 2, 4, 3, 5, 6, 7)]
    assert off(find(shots), shots).max() < 25


def test_the_elevation_of_the_ring_is_that_of_the_faces() -> None:
    """A turn photographed from above the head is placed there, photos without faces too."""
    shots = [shoot(azimuth, 18.0) for azimuth in EIGHT]
    assert (find(shots).elevation_deg > 7).all()
    assert (np.abs(found_in_order(EIGHT).elevation_deg) < 3).all()


def test_names_are_believed() -> None:
    """Views that are named keep their azimuths and names, also when they are not even."""
    azimuths = [azimuth + 9 for azimuth in EIGHT]
    found = find(named(ring(EIGHT), azimuths))
    assert found.azimuth_deg.tolist() == azimuths
    assert found.names == tuple(f"n{i}" for i in range(8))


def test_names_that_faces_contradict_are_not() -> None:
    """Left and right confused: the faces are believed, and the summary names a wrong photo."""
    shots = named(ring(EIGHT), [-azimuth for azimuth in EIGHT])
    found = find(shots)
    assert off(found, shots).max() < 10
    assert "is no view 'n" in found.summary
    assert "the faces are believed" in found.summary


def test_the_summary_tells_direction_and_every_step() -> None:
    """The last gap counts, too, and photos in no order have no direction."""
    assert "turn to the subject's left, steps 45 to 45 degrees" in found_in_order(EIGHT).summary
    assert "turn to the subject's right, steps" in find(ring(EIGHT[::-1])).summary
    assert re.search("to (8[789]|9[0-3]) degrees", find(ring(EIGHT[:7])).summary)
    mixed = [ring(EIGHT)[i] for i in (0, 5, 7, 2, 1, 6, 4, 3)]
    assert "to the subject's" not in find(mixed).summary


def test_without_faces_the_order_stays_and_the_summary_says_so() -> None:
    """Where no model looked, an unnamed turn is taken as read, with a word about it."""
    shots = [replace(s, face=Face.absent(), person=Person.absent()) for s in ring(EIGHT[::-1])]
    found = find(shots)
    assert np.allclose(found.azimuth_deg, EIGHT)
    assert "nobody checked" in found.summary


def copies() -> list[Shot]:
    """Eight copies of one photo, some brighter."""
    shot = shoot(0.0)
    brighter = np.clip(shot.view.image * 1.2, 0, 255).astype(np.uint8)
    return [
        replace(shot, view=replace(shot.view, image=brighter if i % 2 else shot.view.image))
        for i in range(8)
    ]


@pytest.mark.parametrize("azimuths", [(20.0,), (0.0, 45.0), (-45.0, 0.0, 40.0)])
def test_photos_of_one_side_are_where_their_faces_say(azimuths: tuple[float, ...]) -> None:
    """One or two photos, and more that all show the face, are no turn and are not refused."""
    turn = find(ring(azimuths))
    assert np.abs(wrap(turn.azimuth_deg - np.array(azimuths))).max() < 5
    assert not np.isfinite(turn.margin)


@pytest.mark.parametrize("azimuths", [(0.0, 45.0, 90.0), (0.0, -45.0, -90.0), (-40.0, 0.0, 90.0)])
def test_a_profile_beside_two_faces_is_not_the_back(azimuths: tuple[float, ...]) -> None:
    """Three of one side are no turn, though one shows no face; with the back they are."""
    assert np.abs(wrap(find(ring(azimuths)).azimuth_deg - np.array(azimuths))).max() < 10
    back = find(ring([*azimuths[:2], 180.0]))
    assert abs(wrap(back.azimuth_deg[2] - 180.0)) < 35


def test_one_photo_without_face_needs_a_name() -> None:
    """A lone photo from behind is refused in one line, and taken where its name tells the view."""
    with pytest.raises(InputError, match="no face is found"):
        find(ring([180.0]))
    found = find(named(ring([180.0]), [180.0]))
    assert found.azimuth_deg.tolist() == [180.0]
    assert found.summary == "one photo"


def test_photos_before_one_wall_are_no_copies() -> None:
    """Small heads in large, equal surroundings are compared, not the surroundings."""
    shots = []
    for shot in ring(EIGHT):
        photo = np.zeros((HEIGHT, 5 * WIDTH, 3), np.uint8)
        photo[:, 3 * WIDTH :] = 255
        photo[:, 2 * WIDTH : 3 * WIDTH] = shot.view.image
        alpha = np.pad(shot.person.alpha, ((0, 0), (2 * WIDTH, 2 * WIDTH)))
        marks = shot.face.landmarks + np.array([2 * WIDTH, 0]) * shot.face.sure
        view = replace(shot.view, image=photo, photo_size=(5 * WIDTH, HEIGHT))
        face = replace(shot.face, landmarks=marks)
        shots.append(replace(shot, view=view, face=face, person=Person(alpha)))
    assert off(find(shots), shots).max() < 25


def two_people() -> list[Shot]:
    """Eight photos, the last four of somebody in another shirt."""
    shots = []
    for index, shot in enumerate(ring(EIGHT)):
        image = shot.view.image.copy()
        rows = np.nonzero(shot.person.alpha.any(axis=1))[0]
        low = (shot.person.alpha > 0) & (np.arange(HEIGHT)[:, None] > rows[-1] - 25)
        image[low] = (40, 60, 160) if index < 4 else (170, 40, 40)
        shots.append(replace(shot, view=replace(shot.view, image=image)))
    return shots


def test_hair_alone_wears_no_clothes() -> None:
    """Of some persons from behind hair and neck are found: the neck is no shirt."""
    shots = two_people()
    for index in (4, 5, 6, 7):
        alpha = shots[index].person.alpha.copy()
        top = np.nonzero(alpha.any(axis=1))[0][0]
        alpha[top + 75 :] = 0
        neck = (alpha > 0) & (np.arange(HEIGHT)[:, None] > top + 60)
        image = shots[index].view.image.copy()
        image[neck] = (170, 40, 40)
        view = replace(shots[index].view, image=image)
        shots[index] = replace(shots[index], view=view, person=Person(alpha))
    assert off(find(shots), shots).max() < 45


def test_hair_over_the_chest_is_no_shirt() -> None:
    """Waist-long hair whose ends have another colour than the crown is still hair."""
    shots = [replace(s, person=Person(s.person.alpha, s.person.alpha)) for s in two_people()]
    find(shots)  # is not refused


REFUSED = {
    "IMG_4.jpg: wears other clothes than IMG_0.jpg": two_people,
    "a copy of IMG_": copies,
}


@pytest.mark.parametrize("reason", REFUSED)
def test_what_is_no_turn_is_refused(reason: str) -> None:
    """One line names a photo and says why."""
    with pytest.raises(InputError, match=reason) as caught:
        find(REFUSED[reason]())
    assert "IMG_" in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(("other", "refused"), [((-0.41, 0.58), False), ((0.41, 0.58), True)])
def test_one_shirt_in_light_and_shadow(other: tuple[float, float], refused: bool) -> None:
    """The sheen of a blue shirt is paler than its shadow by the window; a red one is another."""
    views = [shot.view for shot in ring(EIGHT)]
    clothes = np.array([(-0.32, 0.38)] * 4 + [other] * 4)
    with pytest.raises(InputError, match="other clothes") if refused else nullcontext():
        check_one_person(views, clothes)


def test_a_face_far_from_its_place_is_refused() -> None:
    """Where a face looks elsewhere than the best turn has it, that photo is no part of the turn."""
    views = [shot.view for shot in ring(EIGHT)]
    nowhere = np.zeros(8, np.bool_)
    yaw, away = np.full(8, np.nan), np.zeros(8)
    yaw[5], away[5] = 10.0, 60.0
    with pytest.raises(InputError, match=r"turned by 10 degrees.*room at -50"):
        check_turn(views, Placed(wrap(np.array(EIGHT)), nowhere, away, 9.0), yaw, None)


@pytest.mark.parametrize(("alike", "refused"), [(0.93, False), (0.97, True)])
def test_dark_heads_are_alike_yet_no_copies(
    alike: float, refused: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A black bob on dark skin is much the same from all sides; copies are more so."""
    views = [shot.view for shot in ring(EIGHT)]
    monkeypatch.setattr(refuse, "thumbnails_alike", lambda *_: np.full((8, 8), alike))
    with pytest.raises(InputError) if refused else nullcontext():
        assert refuse.find_copies(views, [None] * 8) == []


def test_two_equal_photos_are_told() -> None:
    """One repeated photo is no harm: the summary names the pair."""
    shots = ring(EIGHT)
    assert "IMG_8.jpg equals IMG_0.jpg" in find([*shots, shots[0]]).summary
