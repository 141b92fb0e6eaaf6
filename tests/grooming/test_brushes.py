"""Laws of the brushes over random hair on a ball."""

from __future__ import annotations

import json
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hairkit import Brush, Edit, Edits, Groom, Strands
from hairkit.errors import InputError
from hairkit.grooming.brushed_hair import CLEARANCE
from hairkit.grooming.brushes import BRUSHES, SHORTEST, edit_groom
from hairkit.head_model.scalp import bind
from hairkit.head_model.signed_distance import distance_to
from hairkit.testing import bristle_groom
from hairkit.types.edits import read_edits

GROOM = bristle_groom()
SHAPING = ("comb", "part", "puff", "smooth", "curl")
STRAIGHT = ("comb", "part", "puff", "smooth", "cut", "trim", "lengthen")
"""All that move points but curls, which turn one way on both sides."""


@st.composite
def strokes(draw: st.DrawFn, brushes: tuple[str, ...] = tuple(BRUSHES)) -> Edit:
    """A stroke over the hair of the ball, whose radius is 10 cm."""
    generator = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    ways = generator.normal(size=(draw(st.integers(1, 6)), 3)) * [0.3, 0.1, 0.3] + [0, 1, 0]
    path = 0.115 * ways / np.linalg.norm(ways, axis=1, keepdims=True)
    return Edit(path, Brush(draw(st.sampled_from(brushes)), draw(st.floats(0.01, 0.06))))


@settings(max_examples=40, deadline=None)
@given(st.lists(strokes(SHAPING), min_size=1, max_size=3))
def test_shaping_keeps_lengths_and_roots_and_stays_outside(edits: list[Edit]) -> None:
    """Comb, part, puff, smooth and curl keep every length; nothing goes into the head."""
    made = brushed(GROOM.strands, *edits)
    np.testing.assert_allclose(made.lengths(), GROOM.strands.lengths(), rtol=1e-4)
    np.testing.assert_array_equal(made.roots, GROOM.strands.roots)
    free = np.delete(made.points, made.offsets[:-1], axis=0)
    assert distance_to(GROOM.head, free).min() > -CLEARANCE / 2


@settings(max_examples=40, deadline=None)
@given(strokes(STRAIGHT))
def test_a_mirrored_stroke_is_the_mirror_of_the_other(edit: Edit) -> None:
    """A stroke does on one side what its mirror does on the other; with `mirror` it does both."""
    mirrored = Edit(edit.path * [-1, 1, 1], edit.setting)
    both = Edit(edit.path, replace(edit.setting, mirror=True))
    one, other, alike = (moved_halves(each) for each in (edit, mirrored, both))
    np.testing.assert_allclose(one[0], other[1] * [-1, 1, 1], atol=1e-4)
    np.testing.assert_allclose(alike[0], alike[1] * [-1, 1, 1], atol=1e-4)


def brushed(strands: Strands, *edits: Edit) -> Strands:
    """Return hair of the ball after strokes."""
    groom = Groom(strands, GROOM.head, *bind(strands.roots, GROOM.head))
    return edit_groom(groom, Edits(edits)).strands


def moved_halves(edit: Edit) -> np.ndarray[tuple[int, int, int, int], np.dtype[np.float32]]:
    """Return (2, S, M, 3) what becomes of hair right of the middle, and of its mirror image."""
    points = GROOM.strands.points.reshape(len(GROOM.strands), -1, 3)
    half = points[points[:, 0, 0] > 0.003] * [1.0, 1.0, 1.0]
    half[:, :, 2] += 1e-5 * np.arange(len(half))[:, None]  # no two neighbours are equally near
    hair = Strands.from_list([*half, *(half * [-1, 1, 1])])
    return brushed(hair, edit).points.reshape(2, len(half), -1, 3)


def test_a_comb_takes_hair_along() -> None:
    """Tips under the brush go where it goes, others stay to the last bit."""
    tip = GROOM.strands.tips[np.argmax(GROOM.strands.tips[:, 1])]
    path = tip + np.array([[0, 0, 0], [0.02, 0, 0]])
    made = brushed(GROOM.strands, Edit(path, Brush("comb", 0.03)))
    shift = made.tips - GROOM.strands.tips
    near = np.linalg.norm(GROOM.strands.tips - path[0], axis=1) < 0.012
    far = np.linalg.norm(GROOM.strands.points.reshape(len(made), -1, 3) - path[:1], axis=2)
    assert near.any()
    assert (shift[near, 0] > 0.005).all()
    assert not shift[far.min(axis=1) > 0.06].any()


def test_a_parting_sends_hair_to_both_sides() -> None:
    """Hair left of the line goes left, hair right of it right."""
    line = np.array([[0, 0.1, -0.05], [0, 0.112, 0], [0, 0.1, 0.05]])
    made = brushed(GROOM.strands, Edit(line, Brush("part", 0.04)))
    side, moved = made.roots[:, 0], (made.tips - GROOM.strands.tips)[:, 0]
    near = (np.abs(side) > 1e-3) & (np.abs(side) < 0.03) & (made.roots[:, 1] > 0.09)
    assert near.sum() >= 4
    assert (moved[near] * side[near] > 0).all()


def test_a_parting_can_be_moved() -> None:
    """Hair that is combed over to the right lies left of a new line right of it; it keeps its
    lengths, and lies flat."""
    away = Brush("comb", 0.06, 1.0)
    over = np.array([[0.06, 0.13, 0], [0, 0.135, 0], [-0.06, 0.13, 0]])
    combed = brushed(GROOM.strands, *3 * [Edit(over, away)])
    line = np.array([[-0.02, 0.1, -0.05], [-0.02, 0.112, 0], [-0.02, 0.1, 0.05]])
    made = brushed(combed, Edit(line, Brush("part", 0.06, 0.005)))
    root = combed.roots
    near = (root[:, 0] > -0.018) & (root[:, 0] < 0.005) & (np.abs(root[:, 2]) < 0.04)
    near &= root[:, 1] > 0.08
    before, after = ((each.tips - root)[near, 0] for each in (combed, made))
    assert (before < -0.01).sum() >= 3
    assert (after > 0).all()
    np.testing.assert_allclose(after, -before, atol=0.012)
    np.testing.assert_allclose(made.lengths(), combed.lengths(), rtol=1e-4)


def test_lengths_are_cut_and_grown() -> None:
    """A trim leaves no strand longer, a cut ends where the brush is, growing adds its amount."""
    everywhere = np.zeros((0, 3))
    trimmed = brushed(GROOM.strands, Edit(everywhere, Brush("trim", amount=0.01)))
    np.testing.assert_allclose(trimmed.lengths(), 0.01, rtol=1e-4)
    longer = brushed(GROOM.strands, Edit(everywhere, Brush("lengthen", amount=0.05)))
    np.testing.assert_allclose(longer.lengths(), GROOM.strands.lengths() + 0.05, rtol=1e-4)
    ball = Edit(GROOM.strands.tips[:1], Brush("cut", 0.02))
    cut = brushed(GROOM.strands, ball)
    away = np.linalg.norm(cut.points - ball.path, axis=1) / ball.setting.radius
    kept = cut.arc_lengths() > SHORTEST
    assert cut.lengths()[0] < GROOM.strands.lengths()[0] - 0.01
    assert away[kept].min() > 0.99


def test_hair_of_all_lengths_is_taken() -> None:
    """Strands of other point counts are made even; no stroke changes nothing at all."""
    bare = [GROOM.strands[k][: 2 + k % 4] for k in range(len(GROOM.strands))]
    strands = Strands.from_list(bare)
    assert brushed(strands) is strands
    made = brushed(strands, Edit(np.zeros((0, 3)), Brush("puff")))
    assert len(set(made.counts)) == 1
    np.testing.assert_allclose(made.lengths(), strands.lengths(), rtol=1e-4)


def test_a_path_of_any_length_ends() -> None:
    """A path of 1e30 m by the finest brush is walked in bounded time."""
    far = np.array([[1e30, 0, 0], [0, 0.1, 0], [-1e30, 0, 0]])
    made = brushed(GROOM.strands, Edit(far, Brush("comb", 0.001)))
    np.testing.assert_array_equal(made.points, GROOM.strands.points)


def test_edits_are_kept_in_a_file(tmp_path: Path) -> None:
    """What is written comes back; every fault names the file and the stroke."""
    cut, everywhere = Brush("cut", 0.02, mirror=True), np.zeros((0, 3))
    edits = Edits((Edit(np.eye(3), cut), Edit(everywhere, Brush())))
    path = tmp_path / "edits.json"
    assert not read_edits(path)
    path.write_text(json.dumps({"strokes": edits.values()}))
    back = read_edits(path)
    assert back.values() == edits.values()
    for strokes_, words in (
        ("[7]", "stroke 1: expected an object"),
        ('[{"brush": "comb", "path": [[0, 0]]}]', "stroke 1: the path"),
        ('[{"path": [["x", 0, 0]]}]', "stroke 1: the path"),
        ('[{"path": [[1e999, 0, 0]]}]', "stroke 1: the path"),
        ('[{"radius": -1}]', "radius"),
        ("{}", "expected a list"),
        (str([{}] * 1001), "at most 1000 strokes"),
    ):
        path.write_text(f'{{"strokes": {strokes_}}}')
        with pytest.raises(InputError, match=words) as caught:
            read_edits(path)
        assert str(path) in str(caught.value)
    path.write_text("[")
    with pytest.raises(InputError, match=r"expected JSON"):
        read_edits(path)
    with pytest.raises(InputError, match="no brush 'combb'"):
        edit_groom(GROOM, Edits((Edit(np.eye(3), Brush("combb")),)))


@pytest.mark.parametrize("page", ["touching_up.md", "tutorials/batch.md"])
def test_the_scripts_of_the_docs_run(
    page: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """What they show trims the hair of the files that they name."""
    text = (Path(__file__).parents[2] / "docs" / page).read_text()
    [script] = [each for each in re.findall("```python\n(.*?)```", text, re.S) if "trim" in each]
    monkeypatch.chdir(tmp_path)
    for folder in ("out", "results/anna"):
        (tmp_path / folder).mkdir(parents=True)
        GROOM.save(tmp_path / folder / "groom.npz")
    exec(script.replace("0.03", "0.01"), {})
    [made] = tmp_path.rglob("short.npz")
    assert Groom.load(made).strands.lengths().max() < 0.01 + 1e-6
