"""Laws of the hair between the guides."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial import cKDTree

from hairkit.errors import InputError, OptionError
from hairkit.evaluation.strand_statistics import deeper_than
from hairkit.grooming.densify import densify
from hairkit.grooming.locks import TAPER, LockOptions
from hairkit.head_model.template import default_head
from hairkit.options import make_options
from hairkit.synth import grow
from hairkit.synth.growth import StyleName
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
    hair = densify(guides, 40, locks=None)
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
    hair = densify(guides, 400, seed=3, locks=None)
    lean = (hair.tips - hair.roots)[:, 0]
    assert (np.abs(lean) > 0.09).all()


def test_hair_is_as_long_as_its_guides() -> None:
    """Mixing leaning guides shortens nothing: lengths stay within the guides' range."""
    guides = fan(30)
    lengths = densify(guides, 500, locks=None).lengths()
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
    hair = densify(guides, 200, locks=None)
    wave = hair.points.reshape(-1, 60, 3)[9:, 15:50, 0].std(axis=1)
    assert wave.mean() > 0.8 * guides.points.reshape(-1, 60, 3)[:, 15:50, 0].std(axis=1).mean()


def test_equal_seeds_give_equal_hair() -> None:
    """The same seed gives the same bytes, another seed other hair."""
    first, again, other = (densify(fan(20), 200, seed) for seed in (1, 1, 2))
    assert first.points.tobytes() == again.points.tobytes()
    assert first.points.tobytes() != other.points.tobytes()


def test_widths_come_from_the_material() -> None:
    """Roots are as wide as the material says, give or take; every strand thins to its tip, and
    strays are thinner."""
    material = HairMaterial(width=1e-4)
    strays = densify(fan(5), 500, material=material, locks=LockOptions(stray=1)).widths
    assert strays is not None
    assert strays.reshape(500, -1)[5:, 0].max() < 0.6e-4
    hair = densify(fan(5), 500, material=material, locks=LockOptions(stray=0))
    assert hair.widths is not None
    widths = hair.widths.reshape(500, -1)
    assert abs(widths[:, 0].mean() / 1e-4 - 1) < 0.01
    assert widths[:, 0].std() > 1e-5
    assert (np.diff(widths, axis=1) <= 0).all()
    assert np.allclose(widths[:, -1] / widths[:, 0], 1 - TAPER)


def test_hair_thins_and_shortens_at_the_hairline() -> None:
    """Hair at the edge of the guides' roots is thinner and shorter than inside of it."""
    groom = bristle_groom()
    count, wanted = len(groom.strands), len(groom.strands) + 3000
    calm = LockOptions(stray=0, scatter=0, uneven=0, to_lock=0, to_wisp=0)
    thin, even = (densify(groom, wanted, locks=replace(calm, rim=r)) for r in (0.5, 0.0))
    assert np.array_equal(thin.roots, even.roots)
    up = even.roots[count:, 1]  # bristles cover the upper half of a ball
    rim, inside = up < np.quantile(up, 0.05), up > np.quantile(up, 0.3)
    assert thin.widths is not None
    assert even.widths is not None
    widths = (thin.widths / even.widths).reshape(wanted, -1)[:, 0]
    for share in (widths[count:], (thin.lengths() / even.lengths())[count:]):
        assert share[rim].mean() < 0.88
        assert share[inside].mean() > 0.95


def test_hair_gathers_in_locks_that_guides_alone_place() -> None:
    """Towards the tips hair of any seed is nearer to some wisp, roots stay, and tips are uneven."""
    guides, roots = curtain(), np.random.default_rng(0).uniform(-0.05, 0.05, (600, 3))
    roots[:, 1] = 0
    straight = LockOptions(stray=0, scatter=0, uneven=0, to_lock=0, to_wisp=0)
    gathered = replace(straight, to_lock=0.9, to_wisp=0.9, lock=0.03, wisp=0.01)
    loose, tight = (
        densify(guides, 600 + len(guides), roots=roots, locks=locks).select(
            np.arange(len(guides), 600 + len(guides))
        )
        for locks in (straight, gathered)
    )
    assert np.allclose(tight.roots, loose.roots)
    assert nearest(tight.tips) < 0.7 * nearest(loose.tips)
    again = densify(guides, 300 + len(guides), 7, roots=-roots, locks=gathered)
    other = again.select(np.arange(len(guides), 300 + len(guides))).tips
    assert nearest(other, tight.tips) < 0.7 * nearest(other, loose.tips)
    uneven = densify(guides, 600 + len(guides), roots=roots, locks=replace(straight, uneven=0.3))
    shares = uneven.lengths()[len(guides) :] / loose.lengths()
    assert 0.69 < shares.min() < 0.75
    assert np.median(shares) > 0.9


def test_stray_hairs_lead_outwards() -> None:
    """Stray hairs leave the others, never towards the middle of the head."""
    groom = bristle_groom()
    count = len(groom.strands)
    plain, stray = (
        densify(groom, count + 400, locks=LockOptions(stray=share, scatter=scatter, uneven=0))
        for share, scatter in ((0.0, 0.0), (1.0, 0.002))
    )
    before, after = plain.tips[count:], stray.tips[count:]
    assert np.linalg.norm(after, axis=1).min() > 0.1  # the head's radius
    assert np.linalg.norm(after - before, axis=1).mean() > 0.002


def test_locks_keep_a_parting() -> None:
    """With locks, too, hair on both sides of a parting falls to its own side."""
    t = np.linspace(0, 0.1, 16)
    sides = [x for x in np.linspace(-0.03, 0.03, 8) for _ in range(5)]
    guides = Strands.from_list(
        [
            np.stack([x + np.sign(x) * t, -0.3 * t, 0 * t + 0.01 * k], axis=1)
            for k, x in enumerate(sides)
        ]
    )
    hair = densify(guides, 400, locks=LockOptions(stray=0, scatter=0, rim=0))
    assert (np.sign(hair.tips[:, 0]) == np.sign((hair.tips - hair.roots)[:, 0])).all()
    assert np.abs((hair.tips - hair.roots)[:, 0]).min() > 0.06


@pytest.mark.parametrize("style", ["straight", "curly", "short"])
def test_hair_stays_out_of_the_head(style: StyleName) -> None:
    """Locks and stray hairs lead no more than one point in ten thousand under the skin."""
    groom = grow(style, default_head(), 600)
    hair = densify(groom, 3000)
    assert deeper_than(groom.head, hair.points, 0.002).mean() < 1e-4


@pytest.mark.parametrize(("name", "value"), [("wisp", 0), ("to_lock", 2), ("stray", -1)])
def test_options_of_locks_have_limits(name: str, value: object) -> None:
    """What is out of bounds is refused by name."""
    with pytest.raises(OptionError, match=name):
        make_options(LockOptions, {name: value}, "locks")


def curtain() -> Strands:
    """Guides 20 cm long that hang from a square of 10 cm, 1 cm apart."""
    t = np.linspace(0, 0.2, 24)
    places = np.linspace(-0.05, 0.05, 11)
    return Strands.from_list(
        [np.stack([x + 0 * t, -t, z + 0 * t], axis=1) for x in places for z in places]
    )


def nearest(points: np.ndarray, others: np.ndarray | None = None) -> float:
    """Return the median distance from points to the nearest others; None: of themselves."""
    distance = cKDTree(points if others is None else others).query(points, k=2)[0]
    return float(np.median(distance[:, 1 if others is None else 0]))


def test_impossible_input_is_named() -> None:
    """No guides, or too few roots, give one line."""
    with pytest.raises(InputError, match="no guides"):
        densify(Strands(np.zeros((0, 3)), np.zeros(1)), 10)
    with pytest.raises(InputError, match="2 roots are given, expected at least 5"):
        densify(fan(5), 10, roots=np.zeros((2, 3)))
