"""Laws of the person in a photo."""

from __future__ import annotations

import numpy as np
import pytest

from hairkit.errors import InputError
from hairkit.types.person import Person

ALPHA = np.arange(12, dtype=np.uint8).reshape(3, 4)


@pytest.mark.parametrize("hair", [ALPHA[::-1].copy(), np.zeros((0, 0), np.uint8)])
def test_turns_and_parts_keep_hair_on_the_person(hair: np.ndarray) -> None:
    """Both maps follow the photo; where there is no map of hair none appears."""
    person = Person(ALPHA, hair)
    assert np.array_equal(person.turned(1).alpha, np.rot90(ALPHA, -1))
    assert np.array_equal(person.turned(1).hair, np.rot90(hair, -1))
    assert np.array_equal(person.part(np.s_[1:, :2]).alpha, ALPHA[1:, :2])
    assert person.part(np.s_[1:, :2]).hair.shape == ((2, 2) if hair.size else (0, 0))


def test_hair_of_another_size_is_refused() -> None:
    """The map of hair has the size of the person's."""
    with pytest.raises(InputError, match=r"person hair: \(2, 2\), expected \(3, 4\)"):
        Person(ALPHA, np.zeros((2, 2), np.uint8))
