"""Laws of the hair between the guides."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from hairkit.errors import InputError
from hairkit.grooming.densify import densify
from hairkit.testing import bristle_groom
from hairkit.types.groom import HairMaterial
from hairkit.types.strands import Strands


def fan(count: int, points: int = 20, seed: int = 0) -> Strands:
    """Guides 10 cm long that hang from a line and lean more to the right along it."""
    x = np.sort(np.random.default_rng(seed).uniform(-0.05, 0.05, count))
    t = np.linspace(0, 0.1, points)
    return Strands.from_list(
        [np.stack([a + a * 6 * t, -t * (1 - 0.5 * abs(a)), 0 * t], axis=1) for a in x]
    )


@given(count=st.integers(1, 12), wanted=st.integers(1, 60), seed=st.integers(0, 99))
def test_guides_come_first_and_the_count_is_kept(count: int, wanted: int, seed: int) -> None:
    """There are as many strands as asked for, never fewer than guides, and the guides lead."""
    guides = fan(count)
    hair = densify(guides, wanted, seed)
    assert len(hair) == max(count, wanted)
    assert np.allclose(hair.points[: len(guides.points)], guides.points, atol=1e-6)
    if wanted > count:
        assert hair.guide is not None
        assert hair.guide.tolist() == [True] * count + [False] * (wanted - count)


def test_equal_guides_give_that_guide_everywhere() -> None:
    """Between equal guides the new hair has their shape, moved to its own root."""
    shape = np.stack([np.sin(np.linspace(0, 3, 30)), -np.linspace(0, 4, 30), 0 * np.ones(30)], 1)
    guides = Strands.from_list([0.02 * shape + [x, 0, 0] for x in (0, 0.01, 0.02, 0.03)])
    even = guides.resampled(30).points.reshape(4, 30, 3)
    hair = densify(guides, 40, scatter=0.0)
    new = hair.points.reshape(-1, 30, 3)[4:]
    assert np.allclose(new - new[:, :1], (even - even[:, :1])[:1], atol=2e-5)


def test_new_roots_are_where_they_were_asked_for() -> None:
    """Given roots are kept exactly; on a groom they lie on the scalp."""
    roots = np.array([[0.01, 0, 0], [-0.03, 0, 0]])
    assert np.allclose(densify(fan(9), 11, roots=roots).roots[9:], roots)
    groom = bristle_groom()
    hair = densify(groom, len(groom.strands) + 300)
    radius = np.linalg.norm(hair.roots, axis=1)
    assert (np.abs(radius - 0.1) < 0.003).all()
    assert hair.roots[:, 1].min() > -0.02


def test_a_parting_is_not_filled() -> None:
    """Where guides fall to two sides, every new strand falls to one of them."""
    t = np.linspace(0, 0.1, 16)
    guides = Strands.from_list(
        [
            np.stack([x + np.sign(x) * t, -0.3 * t, 0 * t + z], axis=1)
            for x in (-0.012, -0.004, 0.004, 0.012)
            for z in (0.0, 0.01, 0.02)
        ]
    )
    hair = densify(guides, 400, seed=3, scatter=0.0)
    lean = (hair.tips - hair.roots)[:, 0]
    assert (np.abs(lean) > 0.09).all()


def test_hair_is_as_long_as_its_guides() -> None:
    """Mixing leaning guides shortens nothing: lengths stay within the guides' range."""
    guides = fan(30)
    lengths = densify(guides, 500, scatter=0.0).lengths()
    assert lengths.min() > 0.97 * guides.lengths().min()
    assert lengths.max() < 1.03 * guides.lengths().max()


def test_waves_survive_mixing() -> None:
    """Guides that wave out of phase give hair that waves as much, not their flat mean."""
    t = np.linspace(0, 1, 60)
    guides = Strands.from_list(
        [
            np.stack(
                [0.004 * np.sin(40 * t + p) * np.minimum(5 * t, 1) + x, -0.2 * t, 0 * t], axis=1
            )
            for x, p in zip(np.linspace(0, 0.02, 9), np.arange(9) * 2.0, strict=True)
        ]
    )
    hair = densify(guides, 200, scatter=0.0)
    wave = hair.points.reshape(-1, 60, 3)[9:, 15:50, 0].std(axis=1)
    assert wave.mean() > 0.8 * guides.points.reshape(-1, 60, 3)[:, 15:50, 0].std(axis=1).mean()


def test_equal_seeds_give_equal_hair() -> None:
    """The same seed gives the same bytes, another seed other hair."""
    first, again, other = (densify(fan(20), 200, seed) for seed in (1, 1, 2))
    assert first.points.tobytes() == again.points.tobytes()
    assert first.points.tobytes() != other.points.tobytes()


def test_widths_come_from_the_material() -> None:
    """Roots are as wide as the material says, tips thinner."""
    hair = densify(fan(5), 50, material=HairMaterial(width=1e-4))
    assert hair.widths is not None
    widths = hair.widths.reshape(50, -1)
    assert np.allclose(widths[:, 0], 1e-4)
    assert (widths[:, -1] < widths[:, 0]).all()


def test_impossible_input_is_named() -> None:
    """No guides, or too few roots, give one line."""
    with pytest.raises(InputError, match="no guides"):
        densify(Strands(np.zeros((0, 3)), np.zeros(1)), 10)
    with pytest.raises(InputError, match="2 roots are given, expected at least 5"):
        densify(fan(5), 10, roots=np.zeros((2, 3)))
