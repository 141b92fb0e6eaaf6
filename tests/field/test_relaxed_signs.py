"""Signs that are settled all at once."""

import numpy as np
from scipy import sparse

from hairkit.field.relaxed_signs import relaxed_signs


def chain(cosines: np.ndarray) -> sparse.csr_matrix:
    """Return the matrix of a chain of directions with cosines (N - 1,) between neighbours."""
    return sparse.diags([cosines, cosines], [1, -1]).tocsr()


def test_a_patch_with_wrong_wishes_is_turned_whole() -> None:
    """Ten weak wishes in a row are wrong, and agree with each other: votes one by one keep them."""
    wish = np.ones(40)
    wish[15:25] = -0.1
    np.testing.assert_array_equal(relaxed_signs(wish, chain(np.full(39, 3.0))), np.ones(40))


def test_directions_measured_backwards_are_turned(rng: np.random.Generator) -> None:
    """Opposite neighbours couple by a negative cosine; a few sure wishes settle all others."""
    true = np.where(rng.random(60) < 0.5, -1.0, 1.0)
    wish = np.where(np.arange(60) % 20 == 0, true, 0.0)
    cosines = 0.9 * true[:-1] * true[1:]
    np.testing.assert_array_equal(relaxed_signs(wish, chain(cosines)), true)


def test_a_strong_wish_stands_against_weak_neighbours() -> None:
    """Without coupling each follows its wish; directions that wish nothing stay as they are."""
    wish = np.array([1.0, -1.0, 1.0])
    weak = chain(np.full(2, 0.05))
    np.testing.assert_array_equal(relaxed_signs(wish, weak), wish)
    np.testing.assert_array_equal(relaxed_signs(np.zeros(3), weak), np.ones(3))
    np.testing.assert_array_equal(relaxed_signs(np.ones(1), sparse.csr_matrix((1, 1))), [1.0])
