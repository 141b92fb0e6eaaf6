"""Laws of the head's shapes: symmetric, of known size, and two adults and a child of them."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial import cKDTree

from hairkit.errors import InputError
from hairkit.head_model.identity import BASE_SHAPES, MODES, blend_head, identity_modes
from hairkit.head_model.template import default_head
from hairkit.types.head import Head


def _landmark(head: Head, number: int) -> np.ndarray:
    assert head.landmark_vertices is not None
    return head.vertices[head.landmark_vertices[number]]


def _face_height(head: Head) -> float:
    """From the root of the nose to the chin, metres."""
    return float(_landmark(head, 27)[1] - _landmark(head, 8)[1])


def test_modes_are_symmetric_and_millimetres() -> None:
    """Each mode moves both sides alike, and no vertex by more than 2 cm."""
    head, modes = default_head(), identity_modes()
    assert modes.shape == (len(MODES), len(head.vertices), 3)
    mirror = np.float32([-1, 1, 1])
    apart, other = cKDTree(head.vertices).query(head.vertices * mirror)
    near = apart < 0.0005
    assert near.sum() > 100
    for mode in modes:
        size = np.linalg.norm(mode, axis=1).max()
        assert 0.001 < size < 0.02
        assert np.abs(mode[near] - mode[other[near]] * mirror).max() < 0.25 * size


def test_a_deviation_is_what_was_measured() -> None:
    """One deviation of a measure changes it by its spread in millimetres."""
    average = default_head()
    for name, spread, measure in (
        ("face_height", 6.6, _face_height),
        ("eyes_apart", 3.2, lambda head: _landmark(head, 42)[0] - _landmark(head, 39)[0]),
        ("mouth_breadth", 4.0, lambda head: _landmark(head, 54)[0] - _landmark(head, 48)[0]),
    ):
        changed = measure(blend_head({name: 1.0})) - measure(average)
        assert 1e3 * changed == pytest.approx(spread, rel=0.35), name


def test_two_adults_and_a_child_differ_as_people_do() -> None:
    """A man's head is larger than a woman's; a child's face is small for its cranium."""
    woman, man, child = (blend_head({name: 1.0}) for name in BASE_SHAPES)
    breadth = {name: float(np.ptp(head.vertices[head.scalp > 0.5][:, 0])) for name, head in
               (("woman", woman), ("man", man), ("child", child))}  # fmt: skip
    assert breadth["man"] > breadth["woman"]
    average = _face_height(default_head()) / np.ptp(default_head().vertices[:, 0])
    assert _face_height(child) / np.ptp(child.vertices[:, 0]) < 0.9 * average
    half = blend_head({"man": 0.5, "child": 0.5})
    assert _face_height(child) < _face_height(half) < _face_height(man)
    assert np.array_equal(child.uv, default_head().uv)


def test_unknown_shapes_are_one_line() -> None:
    """A name that is no shape is refused, with those that there are."""
    with pytest.raises(InputError, match="no shape of the head is named 'elf'; there are woman"):
        blend_head({"elf": 1.0})
