"""Laws of packed strands."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from hairkit.errors import DataError, InputError
from hairkit.types.strands import Strands


@st.composite
def bundles(draw: st.DrawFn) -> Strands:
    """A few strands of different point counts, wandering downwards, with every extra."""
    generator = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    counts = draw(st.lists(st.integers(2, 12), min_size=1, max_size=6))
    walks = [
        np.cumsum(generator.normal([0, -0.01, 0], 0.005, (count, 3)), axis=0) for count in counts
    ]
    strands = Strands.from_list(walks)
    return replace(
        strands,
        widths=generator.random(len(strands.points), np.float32),
        root_uv=generator.random((len(counts), 2), np.float32),
        group=np.arange(len(counts), dtype=np.int32),
        guide=np.arange(len(counts)) % 2 == 0,
    )


def distance_to_polyline(points: np.ndarray, line: np.ndarray) -> float:
    """Return the largest distance of any point (N, 3) from a polyline (M, 3)."""
    start, step = line[:-1], np.diff(line, axis=0)
    t = np.einsum("nmc,mc->nm", points[:, None] - start, step) / np.sum(step**2, axis=1)
    near = start + np.clip(t, 0, 1)[..., None] * step
    return float(np.linalg.norm(points[:, None] - near, axis=-1).min(axis=1).max())


def each(strands: Strands) -> list[np.ndarray]:
    """Return the strands as arrays, double precision."""
    return [part.astype(float) for part in np.split(strands.points, strands.offsets[1:-1])]


@given(bundles(), st.integers(2, 40))
def test_resampling_keeps_ends_and_stays_on_the_strand(strands: Strands, count: int) -> None:
    """Every strand has `count` points, the same root and tip, and no point off its old line."""
    new = strands.resampled(count)
    assert (new.counts == count).all()
    np.testing.assert_allclose(new.roots, strands.roots, atol=1e-6)
    np.testing.assert_allclose(new.tips, strands.tips, atol=1e-6)
    assert (new.lengths() <= strands.lengths() + 1e-5).all()
    for points, line in zip(each(new), each(strands), strict=True):
        assert distance_to_polyline(points, line) < 1e-5


@given(bundles())
def test_fine_resampling_keeps_the_length(strands: Strands) -> None:
    """With steps far below the bends the length is the same."""
    np.testing.assert_allclose(strands.resampled(2000).lengths(), strands.lengths(), rtol=0.01)


@given(st.lists(st.floats(0.001, 0.3), min_size=1, max_size=8), st.integers(2, 20))
def test_resampling_a_straight_strand_gives_equal_steps(steps: list[float], count: int) -> None:
    """Points are at equal arc length, whatever the old spacing was."""
    along = np.concatenate([[0.0], np.cumsum(steps)])
    way = np.array([2.0, -3.0, 6.0]) / 7
    new = Strands.from_list([along[:, None] * way, along[:, None] * way]).resampled(count)
    wanted = np.linspace(0, along[-1], count)[:, None] * way
    np.testing.assert_allclose(new.points, np.concatenate([wanted, wanted]), atol=2e-6)


@given(bundles(), st.floats(0.002, 0.05))
def test_resampling_by_length_never_exceeds_the_step(strands: Strands, step: float) -> None:
    """Neighbours are at most `step` apart along the strand, and no more points than needed."""
    new = strands.resampled_by_length(step)
    segments = new.counts - 1
    assert (strands.lengths() / segments <= step * (1 + 1e-6)).all()
    assert ((segments == 1) | (strands.lengths() > step * (segments - 1) * (1 - 1e-6))).all()


@given(bundles())
def test_resampling_keeps_what_belongs_to_a_strand(strands: Strands) -> None:
    """Groups, guides and root coordinates stay; widths stay within their old range."""
    new = strands.resampled(7)
    for name in ("root_uv", "group", "guide"):
        np.testing.assert_array_equal(getattr(new, name), getattr(strands, name))
    assert new.widths is not None
    assert strands.widths is not None
    assert new.widths.min() >= strands.widths.min() - 1e-6
    assert new.widths.max() <= strands.widths.max() + 1e-6


@given(bundles(), st.integers(2, 9))
def test_frames_are_resampled_as_the_strands_at_rest(strands: Strands, count: int) -> None:
    """Matter points: resampled, then stretched and moved is stretched and moved, then resampled."""
    frames = np.stack([strands.points, strands.points @ np.diag([1.0, 3.0, 0.2]) + 0.5])
    found = strands.moved_and_resampled(frames.astype(np.float32), count)
    rest = strands.resampled(count).points
    np.testing.assert_array_equal(found[0], rest)
    np.testing.assert_allclose(found[1], rest @ np.diag([1.0, 3.0, 0.2]) + 0.5, atol=1e-4)


@given(bundles(), st.data())
def test_selecting_gives_those_strands_in_that_order(strands: Strands, data: st.DataObject) -> None:
    """An index array permutes and repeats; a mask keeps the order."""
    index = data.draw(st.lists(st.integers(0, len(strands) - 1), max_size=8))
    picked = strands.select(np.array(index, int))
    assert len(picked) == len(index)
    for new, old in zip(each(picked) if index else [], index, strict=True):
        np.testing.assert_array_equal(new, each(strands)[old])
    mask = np.isin(np.arange(len(strands)), index)
    np.testing.assert_array_equal(
        strands.select(mask).points, strands.select(np.flatnonzero(mask)).points
    )


@given(bundles())
def test_arc_length_is_the_sum_of_segments(strands: Strands) -> None:
    """It is 0 at the root, grows along the strand and ends at the length."""
    vectors, first = strands.segments()
    assert len(vectors) == len(strands.points) - len(strands)
    arc = strands.arc_lengths()
    np.testing.assert_allclose(arc[first + 1] - arc[first], np.linalg.norm(vectors, axis=1), 1e-5)
    np.testing.assert_array_equal(arc[strands.offsets[:-1]], 0)
    total = np.bincount(strands.strand_of_point[first], np.linalg.norm(vectors, axis=1))
    np.testing.assert_allclose(strands.lengths(), total, rtol=1e-5)


@given(bundles())
def test_tangents_are_unit_and_run_to_the_tip(strands: Strands) -> None:
    """A tangent is its segment's direction; the tip has that of the last segment."""
    vectors, first = strands.segments()
    tangents = strands.tangents()
    np.testing.assert_allclose(np.linalg.norm(tangents, axis=1), 1, atol=1e-5)
    length = np.linalg.norm(vectors, axis=1, keepdims=True)
    np.testing.assert_allclose(tangents[first] * length, vectors, atol=1e-6)
    last = strands.offsets[1:] - 1
    np.testing.assert_array_equal(tangents[last], tangents[last - 1])


def test_no_strands_is_a_bundle_too() -> None:
    """Everything works on nothing."""
    none = Strands.from_list([])
    assert len(none) == len(none.resampled(5)) == len(none.resampled_by_length(0.1)) == 0
    assert none.lengths().shape == (0,)
    assert none.tangents().shape == none.roots.shape == (0, 3)
    assert len(none.select(np.zeros(0, bool))) == 0


def test_a_strand_of_no_length_stays_in_its_place() -> None:
    """Points on top of one another do not become NaN."""
    strands = Strands.from_list([np.ones((3, 3)), np.zeros((2, 3))]).resampled(4)
    np.testing.assert_array_equal(strands.points, np.repeat([1.0, 0.0], 4)[:, None] * np.ones(3))
    assert np.isfinite(strands.tangents()).all()


@pytest.mark.parametrize("offsets", [[0, 4], [0, 2, 3, 6], [1, 6], [0, 6, 6], [], [0, 7, 6]])
def test_offsets_that_do_not_fit_are_refused(offsets: list[int]) -> None:
    """Offsets run from 0 to the number of points, two points or more a strand."""
    with pytest.raises(InputError):
        Strands(np.zeros((6, 3), np.float32), np.array(offsets, np.int64))


def test_extras_of_another_size_are_refused() -> None:
    """Widths are one a point, groups one a strand."""
    strands = Strands.from_list([np.zeros((3, 3))])
    for field in ("widths", "group", "guide", "root_uv"):
        with pytest.raises(InputError, match=field):
            replace(strands, **{field: np.zeros(7)})


def test_impossible_resampling_is_refused() -> None:
    """Fewer than two points and steps that are not above 0 are errors."""
    strands = Strands.from_list([np.zeros((3, 3))])
    with pytest.raises(InputError, match="at least 2 points"):
        strands.resampled(1)
    for step in (0.0, -1.0, float("nan")):
        with pytest.raises(InputError, match="step"):
            strands.resampled_by_length(step)


def test_an_index_gives_one_polyline() -> None:
    """`strands[i]` is what was packed as strand i; negative numbers count from the last."""
    lines = [np.arange(3.0 * n).reshape(n, 3) for n in (2, 4, 3)]
    strands = Strands.from_list(lines)
    for index in (0, 1, 2, -1, -3, np.int64(1)):
        np.testing.assert_array_equal(strands[index], lines[index])
    assert [len(line) for line in strands] == [2, 4, 3]
    for index in (3, -4):
        with pytest.raises(IndexError):
            strands[index]
    with pytest.raises(TypeError):
        strands["0"]  # type: ignore[index]


@pytest.mark.parametrize(
    ("points", "offsets", "reason"),
    [
        (np.zeros((4, 3), np.complex64), [0, 4], "strand points has complex numbers"),
        (np.zeros((4, 3)), [0.0, 1.5, 4.0], "strand offsets has numbers with fractions"),
    ],
)
def test_numbers_of_another_kind_are_refused(
    points: np.ndarray, offsets: list[float], reason: str
) -> None:
    """Nothing is cut off to make them fit."""
    with pytest.raises(DataError, match=reason):
        Strands(points, np.array(offsets))
