"""Laws of bare strands that become a groom: what lacks is made, and said."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pytest

from hairkit.errors import FormatError, InputError
from hairkit.grooming.adopt_strands import (
    ImportOptions,
    adopt,
    pack_strands,
    plain_widths,
    reverse_strands,
)
from hairkit.grooming.guide_weights import guide_mask
from hairkit.head_model.placement import find_place, place_head
from hairkit.head_model.scalp import evaluate, roots_at, sample_roots
from hairkit.head_model.template import default_head
from hairkit.io.coordinate_space import SpaceOptions
from hairkit.testing import bristle_groom
from hairkit.types.groom import HairMaterial
from hairkit.types.strands import Strands


@dataclass(frozen=True)
class Options(ImportOptions, SpaceOptions):
    """Options of a format without unit."""


def hair_on(scale: float = 1.0, shift: tuple[float, ...] = (0, 0, 0), count: int = 300) -> Strands:
    """Return hair that stands off the default head, scaled and moved with it."""
    roots = sample_roots(default_head(), count)
    along = np.linspace(0, 0.08, 6)[:, None]
    points = roots.positions[:, None] + along * roots.normals[:, None]
    moved = scale * points.reshape(-1, 3) + np.array(shift)
    return Strands(moved, np.arange(count + 1) * 6)


@pytest.mark.parametrize(
    ("scale", "shift"), [(1.0, (0, 0, 0)), (1.2, (0.02, 1.7, -0.03)), (0.85, (0, -0.4, 0.1))]
)
def test_the_default_head_is_put_where_hair_grew(
    scale: float, shift: tuple[float, ...], caplog: pytest.LogCaptureFixture
) -> None:
    """Size and place of the head that the hair was made on are found again, and said."""
    groom = adopt(hair_on(scale, shift), ImportOptions(), "a.hair")
    wanted = place_head(default_head(), scale, np.array(shift))
    assert np.abs(groom.head.vertices - wanted.vertices).max() < 0.008
    bound = evaluate(groom.head, groom.root_triangle, groom.root_barycentric)
    assert np.linalg.norm(bound - groom.strands.roots, axis=1).mean() < 0.004
    for lacking in ("no head", "no widths", "no root uv"):
        assert f"a.hair: {lacking}" in caplog.text


@pytest.mark.parametrize("side", [(1.0, 0.0, 0.0), (-1.0, 0.0, 0.0), (0.0, 1.0, 0.0)])
def test_a_patch_of_hair_lies_where_it_faces(side: tuple[float, ...]) -> None:
    """A few strands do not change the head's size, and grow out of it on the side they point to."""
    hair, head = hair_on(1.0, (0.0, 1.0, 0.0), 900), default_head()
    facing = (hair.tangents()[hair.offsets[:-1]] @ np.array(side)) > 0.93
    patch = hair.select(facing)
    place = find_place(head, patch)
    assert place.scale == 1.0
    middle = place.shift + head.vertices[head.scalp > 0.5].mean(axis=0)
    assert (patch.roots.mean(axis=0) - middle) @ np.array(side) > 0.03
    assert place.distance < 0.01


def test_the_named_head_is_taken(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    """A head of a groom file stays where it is when roots are on it; else it is moved to them."""
    groom = bristle_groom()
    groom.save(tmp_path / "groom.npz")
    options = ImportOptions(head=tmp_path / "groom.npz")
    same = adopt(groom.strands, options, "a.hair")
    assert np.array_equal(same.head.vertices, groom.head.vertices)
    far = replace(groom.strands, points=groom.strands.points + np.float32([0, 1.7, 0]))
    moved = adopt(far, options, "a.hair")
    shift = moved.head.vertices - groom.head.vertices
    assert np.abs(shift - [0, 1.7, 0]).max() < 0.03
    assert "is moved by" in caplog.text


def test_roots_show_the_scalp_of_a_head_that_marks_none(tmp_path: Path) -> None:
    """A plain mesh under its hair is taken where it is: hair grows on it where roots are."""
    groom = bristle_groom()
    lines = [f"v {x} {y + 1.6} {z}" for x, y, z in groom.head.vertices.tolist()]
    lines += ["f " + " ".join(str(n + 1) for n in face) for face in groom.head.faces.tolist()]
    (tmp_path / "plain.obj").write_text("\n".join(lines))
    there = replace(groom.strands, points=groom.strands.points + np.float32([0, 1.6, 0]))
    found = adopt(there, ImportOptions(head=tmp_path / "plain.obj"), "a.hair")
    np.testing.assert_allclose(
        found.head.vertices[:, 1] - 1.6, groom.head.vertices[:, 1], atol=1e-6
    )
    np.testing.assert_allclose(roots_at(found.head, found.root_triangle, found.root_barycentric)
                               .positions, there.roots, atol=1e-5)  # fmt: skip
    height = groom.head.vertices[:, 1]
    assert (found.head.scalp[height < -0.05] == 0).all()
    assert (found.head.scalp[(height > 0.02) & (height < 0.099)] == 1).all()
    far = replace(there, points=there.points + np.float32([0.5, 0, 0]))
    with pytest.raises(InputError, match="has no scalp"):
        adopt(far, ImportOptions(head=tmp_path / "plain.obj"), "a.hair")


def test_another_unit_is_asked_for() -> None:
    """Hair in centimetres read as metres is refused with a scale that then works."""
    with pytest.raises(
        InputError, match=r"give metres per unit of the file: scale=(\S+)"
    ) as caught:
        adopt(hair_on(100.0), Options(), "a.hair")
    guess = float(str(caught.value).rpartition("=")[2])
    assert 0.003 < guess < 0.03
    adopt(hair_on(100.0 * guess), Options(), "a.hair")
    with pytest.raises(InputError, match="scale=") as caught:
        adopt(hair_on(0.01), Options(axis="y_up_centimetres"), "a.hair")
    assert 0.3 < float(str(caught.value).rpartition("=")[2]) < 3


def test_a_few_strands_far_off_do_not_change_the_unit() -> None:
    """Roots left at the origin by some tool are not taken for the size of the head."""
    hair = hair_on(1.0, (0.0, 1.7, 0.0), 300)
    points = hair.points.copy()
    points[:6] -= points[0]
    adopt(replace(hair, points=points), ImportOptions(), "a.hair")


def test_hair_drawn_from_tip_to_root_is_said_and_turned(caplog: pytest.LogCaptureFixture) -> None:
    """Tips on the head and roots off it are warned of; `reverse` puts them right, and only then."""
    hair = hair_on()
    head, wrong = default_head(), reverse_strands(hair)
    adopt(wrong, ImportOptions(), "a.hair", head=head)
    assert "set reverse=true" in caplog.text
    caplog.clear()
    look = HairMaterial(np.zeros(3), np.ones(3))
    back = adopt(wrong, ImportOptions(reverse=True), "a.hair", look, head)
    assert np.array_equal(back.strands.points, hair.points)
    assert np.array_equal(back.material.root_colour, [1, 1, 1])
    adopt(hair, ImportOptions(), "a.hair", head=head)
    assert "reverse" not in caplog.text


def test_turning_over_twice_changes_nothing(rng: np.random.Generator) -> None:
    """Points and widths go together, strand by strand."""
    counts = rng.integers(2, 7, 30)
    offsets = np.concatenate([[0], np.cumsum(counts)])
    strands = Strands(rng.random((offsets[-1], 3)), offsets, rng.random(offsets[-1]))
    once = reverse_strands(strands)
    assert np.array_equal(once.roots, strands.tips)
    assert once.widths is not None
    assert strands.widths is not None
    assert np.array_equal(once.widths[offsets[:-1]], strands.widths[offsets[1:] - 1])
    assert np.array_equal(reverse_strands(once).points, strands.points)


def test_strands_without_length_are_dropped(caplog: pytest.LogCaptureFixture) -> None:
    """They are counted; a file of nothing else is refused."""
    hair = hair_on()
    points = hair.points.copy()
    points[:12] = points[0]
    groom = adopt(replace(hair, points=points), ImportOptions(), "a.hair")
    assert len(groom.strands) == len(hair) - 2
    assert "2 strands without length dropped" in caplog.text
    with pytest.raises(FormatError, match="none of its 300 strands has any length"):
        adopt(replace(hair, points=0 * points), ImportOptions(), "a.hair")


def test_packing_drops_strands_of_one_point(caplog: pytest.LogCaptureFixture) -> None:
    """Numbers of the kept strands and their rows are told; wild points are refused."""
    counts = np.array([1, 3, 0, 2])
    points = np.arange(18, dtype=np.float32).reshape(6, 3)
    strands, kept = pack_strands(points, counts, "a.hair")
    assert kept.tolist() == [1, 3]
    assert strands.offsets.tolist() == [0, 3, 5]
    assert np.array_equal(strands.points, points[np.repeat(counts >= 2, counts)])
    assert "2 strands of fewer than two points dropped" in caplog.text
    for bad in (np.nan, np.inf, 1e30):
        with pytest.raises(FormatError, match="expected hair on a head"):
            pack_strands(np.full((2, 3), bad, np.float32), np.array([2]), "a.hair")
    with pytest.raises(FormatError, match="no strand of two"):
        pack_strands(points[:1], np.array([1]), "a.hair")


def test_widths_are_plain_numbers() -> None:
    """Below 0 becomes 0; what is no number or wider than the world is refused."""
    widths = plain_widths(np.array([-1.0, 0.02]), 0.01, "a.hair")
    assert np.allclose(widths, [0, 2e-4])
    for bad in (np.nan, np.inf, 3e38):
        with pytest.raises(FormatError, match="a thickness is no number"):
            plain_widths(np.array([bad], np.float32), 100.0, "a.hair")


def test_the_mean_width_becomes_the_look(caplog: pytest.LogCaptureFixture) -> None:
    """Widths that a file has are taken without a word."""
    hair = hair_on()
    groom = adopt(replace(hair, widths=np.full(len(hair.points), 5e-5)), ImportOptions(), "a.hair")
    assert groom.material.width == pytest.approx(5e-5)
    assert "widths" not in caplog.text


def test_strands_that_are_all_no_guides_become_guides(caplog: pytest.LogCaptureFixture) -> None:
    """Programs that know no guides write 0 everywhere; a groom without guides helps nobody."""
    strands = replace(bristle_groom().strands, guide=np.zeros(len(bristle_groom().strands), bool))
    groom = adopt(strands, ImportOptions(), "file")
    assert guide_mask(groom.strands).all()
    assert "no strand is marked as a guide" in caplog.text


def test_a_named_unit_is_taken_at_its_word(caplog: pytest.LogCaptureFixture) -> None:
    """With `scale` given, hair of any size is read; what would be usual is said."""
    groom = adopt(hair_on(0.01), Options(scale=0.01), "a.hair")
    assert float(np.ptp(groom.strands.roots, axis=0).max()) < 0.03
    assert "would make it so" in caplog.text
