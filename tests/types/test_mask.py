"""Laws of masks."""

from __future__ import annotations

import numpy as np
import pytest

from hairkit.errors import InputError
from hairkit.types.mask import BACKGROUND, HAIR, PERSON, Mask


def test_labels_split_the_picture() -> None:
    """Hair is 255 and part of the person; the background is neither."""
    mask = Mask(np.array([[HAIR, PERSON, BACKGROUND]], np.uint8), True)
    assert mask.hair.tolist() == [[True, False, False]]
    assert mask.person.tolist() == [[True, True, False]]


def test_other_values_are_refused() -> None:
    """A grey value is named, and what was wanted."""
    with pytest.raises(InputError, match="value 7, expected only 0, 128 and 255"):
        Mask(np.array([[HAIR, 7]], np.uint8), True)


def test_a_mask_without_hair_is_refused() -> None:
    """An empty mask cannot be worked on."""
    with pytest.raises(InputError, match="mask is empty"):
        Mask(np.full((2, 2), PERSON, np.uint8), True)


def test_a_colour_picture_is_no_mask() -> None:
    """Labels are one a pixel."""
    with pytest.raises(InputError, match="mask labels has shape"):
        Mask(np.full((2, 2, 3), HAIR, np.uint8), True)
