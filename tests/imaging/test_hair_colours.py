"""Laws of the colours that photos of one person share."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from hairkit.arrays import Float32Array, UInt8Array
from hairkit.imaging.hair_colours import ALL_PHOTOS, HairPrior, label_colours
from hairkit.types.mask import HAIR, PERSON

SKIN, BROWN, BLUE, GREY = (205, 155, 130), (70, 50, 38), (40, 60, 120), (160, 170, 180)
"""Colours of skin, of hair, of a coat and of a backdrop."""
SIZE = 96
ROWS = {"hair": slice(0, 24), "jaw": slice(24, 48), "coat": slice(48, 72), "wall": slice(72, 96)}
SURE = {"hair": (0.96, 0.02, 0.02), "coat": (0.02, 0.96, 0.02), "wall": (0.02, 0.02, 0.96)}


def photo(jaw: tuple[int, int, int]) -> UInt8Array:
    """Return a picture of four bands: hair, a jaw of a colour, a coat and a wall."""
    picture = np.zeros((SIZE, SIZE, 3))
    for name, colour in {"hair": BROWN, "jaw": jaw, "coat": BLUE, "wall": GREY}.items():
        picture[ROWS[name]] = colour
    picture += np.random.default_rng(3).normal(0, 5, picture.shape)
    return np.clip(picture, 0, 255).astype(np.uint8)


def prior(jaw: tuple[int, int, int], hair: float, *, frontal: bool) -> HairPrior:
    """Return what is known of a photo whose jaw a network calls hair with a probability."""
    probability = np.zeros((SIZE, SIZE, 3), np.float32)
    for name, share in (SURE | {"jaw": (hair, 0.98 - hair, 0.02)}).items():
        probability[ROWS[name]] = share
    region: Float32Array = np.zeros((SIZE, SIZE), np.float32)
    region[ROWS["jaw"]] = 1
    nothing = 0 * region
    return HairPrior(photo(jaw), probability, region if frontal else nothing, region, nothing)


def hairy(labels: UInt8Array) -> float:
    """Return the share of the jaw's inner rows that is hair."""
    return float((labels[30:42] == HAIR).mean())


def test_a_beard_seen_in_front_is_none_in_profile() -> None:
    """Landmarks show that brown on the jaw is a beard; the profile's brown jaw is then no hair."""
    front, profile = (
        prior(BROWN, 0.05, frontal=True), prior(BROWN, 0.9, frontal=False),
    )  # fmt: skip
    labels = label_colours([front, profile], ALL_PHOTOS)
    assert hairy(labels[0]) < 0.05
    assert hairy(labels[1]) < 0.05


def test_hair_hangs_over_a_shaven_jaw() -> None:
    """Where the face is known as skin, brown before the jaw remains hair."""
    front, profile = (
        prior(SKIN, 0.02, frontal=True), prior(BROWN, 0.9, frontal=False),
    )  # fmt: skip
    assert hairy(label_colours([front, profile], ALL_PHOTOS)[1]) > 0.95


def test_hair_of_the_colours_of_the_coat_is_hair_where_no_clothes_are() -> None:
    """Of two brown bands that a network calls clothes, the one on the upper head is hair."""
    front, dark = (prior(SKIN, 0.02, frontal=True), prior(BROWN, 0.1, frontal=False))  # fmt: skip
    picture = dark.image.copy()
    picture[ROWS["coat"]] = picture[ROWS["jaw"]]
    coat = replace(dark, image=picture, bare=0 * dark.bare)
    assert hairy(label_colours([front, coat], ALL_PHOTOS)[1]) < 0.05
    upper = replace(coat, upper=dark.bare)
    labels = label_colours([front, upper], ALL_PHOTOS)[1]
    assert hairy(labels) > 0.95
    assert (labels[ROWS["coat"]][4:-4] == PERSON).all()


@pytest.mark.parametrize("repeated", [2, 3])
def test_the_order_of_photos_does_not_matter(repeated: int) -> None:
    """The photos of a person are a set: their order changes next to no label."""
    photos = [prior(BROWN, 0.05, frontal=True), *[prior(SKIN, 0.3, frontal=False)] * repeated]
    forward = label_colours(photos, ALL_PHOTOS)
    backward = label_colours(photos[::-1], ALL_PHOTOS)[::-1]
    for first, second in zip(forward, backward, strict=True):
        assert (first != second).mean() < 0.02
