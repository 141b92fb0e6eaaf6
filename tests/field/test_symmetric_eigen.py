"""Laws of the closed-form eigenvectors."""

from __future__ import annotations

import numpy as np

from hairkit.field.symmetric_eigen import smallest_eigenvectors
from hairkit.types.volume import outer_products, symmetric_matrices


def test_equals_its_numpy_twin(rng: np.random.Generator) -> None:
    """Vectors, up to sign, and gaps are those of `numpy.linalg.eigh`."""
    planes = outer_products(rng.normal(size=(500, 4, 3))).sum(axis=1)
    vectors, gaps = smallest_eigenvectors(planes)
    values, axes = np.linalg.eigh(symmetric_matrices(planes))
    np.testing.assert_allclose(gaps, values[:, 1] - values[:, 0], atol=1e-9)
    clear = gaps > 1e-3
    agreement = np.abs(np.sum(vectors * axes[:, :, 0], axis=1))
    np.testing.assert_allclose(agreement[clear], 1, atol=1e-8)


def test_one_plane_leaves_a_vector_in_it_and_no_gap(rng: np.random.Generator) -> None:
    """With one normal the two smallest eigenvalues are 0: any vector of the plane, gap 0."""
    normals = rng.normal(size=(50, 3))
    vectors, gaps = smallest_eigenvectors(outer_products(normals))
    np.testing.assert_allclose(np.linalg.norm(vectors, axis=1), 1, atol=1e-9)
    np.testing.assert_allclose(gaps, 0, atol=1e-6)
    across = np.sum(vectors * normals, axis=1) / np.linalg.norm(normals, axis=1)
    np.testing.assert_allclose(across, 0, atol=1e-3)


def test_nothing_gives_a_unit_vector() -> None:
    """A zero tensor and a multiple of the identity have every direction: one comes back."""
    six = np.array([[0.0] * 6, [2.0, 2.0, 2.0, 0.0, 0.0, 0.0]])
    vectors, gaps = smallest_eigenvectors(six)
    np.testing.assert_allclose(np.linalg.norm(vectors, axis=1), 1)
    np.testing.assert_allclose(gaps, 0, atol=1e-12)
