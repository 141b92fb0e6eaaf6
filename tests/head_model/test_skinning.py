"""A head's skin weights: a partition of one, rigid where hair grows."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from hairkit.head_model.skinning import HEAD_JOINT, head_weights
from hairkit.head_model.template import default_head
from hairkit.testing import ball_head


def test_weights_are_a_partition_of_one() -> None:
    """No weight is negative and every row sums to 1."""
    for head in (default_head(), ball_head()):
        weights = head_weights(head)
        assert weights.shape == (len(head.vertices), 3)
        assert weights.min() >= 0
        np.testing.assert_allclose(weights.sum(axis=1), 1.0, atol=1e-6)


def test_hair_grows_where_the_head_is_rigid() -> None:
    """Scalp and chin follow the head joint alone."""
    head = default_head()
    weights = head_weights(head)[:, HEAD_JOINT]
    assert (weights[head.scalp >= 0.5] == 1.0).all()
    assert head.landmark_vertices is not None
    assert (weights[head.landmark_vertices] > 0.98).all()


def test_the_cut_of_the_neck_stays_with_the_body() -> None:
    """The lowest vertices follow the head joint not at all, and the root most."""
    head = default_head()
    lowest = head.vertices[:, 1] < head.vertices[:, 1].min() + 0.005
    weights = head_weights(head)[lowest]
    assert (weights[:, HEAD_JOINT] == 0).all()
    assert (weights[:, 0] > 0.5).all()


def test_weights_change_little_along_an_edge() -> None:
    """Neighbours differ by no more than the blend's slope allows: skin does not tear."""
    head = default_head()
    edges = np.concatenate([head.faces[:, [0, 1]], head.faces[:, [1, 2]], head.faces[:, [2, 0]]])
    a, b = head_weights(head)[edges].astype(np.float64).transpose(1, 0, 2)
    assert np.abs(a - b).max() < 0.5


def test_joints_in_one_place_give_finite_weights() -> None:
    """A head whose joints are unknown is rigid or not, but never not a number."""
    head = replace(ball_head(), joints=np.zeros((3, 3), np.float32))
    weights = head_weights(head)
    assert np.isfinite(weights).all()
    np.testing.assert_allclose(weights.sum(axis=1), 1.0, atol=1e-6)
