"""Laws of what every exporter does first."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pytest
from rich_groom import rich_groom, with_degenerate

from hairkit.errors import InputError
from hairkit.grooming.prepare_export import (
    AnimationOptions,
    ExportOptions,
    complete_groom,
    dense_groom,
    point_colours,
    prepare_export,
    shorter_than,
)
from hairkit.head_model.scalp import evaluate
from hairkit.testing import bristle_groom
from hairkit.types.point_cache import PointCache
from hairkit.types.strands import Strands


@dataclass(frozen=True)
class Animated(ExportOptions, AnimationOptions):
    """Options of an exporter that animates."""


def test_every_strand_is_in_one_choice() -> None:
    """Guides and hair together are all, in order."""
    groom = rich_groom()
    parts = {
        choice: prepare_export(groom, ExportOptions(strands=choice)).groom.strands
        for choice in ("all", "guides", "hair")
    }
    assert parts["guides"].guide is not None
    assert parts["guides"].guide.all()
    assert parts["hair"].guide is not None
    assert not parts["hair"].guide.any()
    assert len(parts["guides"]) + len(parts["hair"]) == len(parts["all"]) == len(groom.strands)
    assert np.array_equal(parts["all"].points, groom.strands.points)


def test_completing_fills_what_lacks_and_changes_nothing_else() -> None:
    """Defaults are the material's width, the head's uv, group 0 and guides; what is there stays."""
    bare = bristle_groom()
    full = complete_groom(replace(bare, strands=Strands(bare.strands.points, bare.strands.offsets)))
    assert np.all(full.strands.widths == np.float32(bare.material.width))
    assert np.allclose(full.strands.root_uv, bare.strands.root_uv, atol=1e-6)
    assert full.strands.group is not None
    assert not full.strands.group.any()
    assert full.strands.guide is not None
    assert full.strands.guide.all()
    rich = rich_groom()
    assert complete_groom(rich) is rich


def test_degenerate_strands_are_dropped_and_counted(caplog: pytest.LogCaptureFixture) -> None:
    """What is bound to a strand goes with it."""
    groom = with_degenerate(rich_groom())
    ready = prepare_export(groom, ExportOptions()).groom
    assert len(ready.strands) == len(groom.strands) - 1
    assert np.array_equal(ready.root_triangle, groom.root_triangle[1:])
    assert np.array_equal(ready.strands.root_uv, groom.strands.root_uv[1:])
    assert "1 strands without length are not written" in caplog.text


def test_length_is_told_by_few_segments_as_by_all(rng: np.random.Generator) -> None:
    """A first segment that is long enough decides; a short one, or none, does not."""
    steps = rng.choice([0.0, 2e-6, 1.0], (200, 6, 3), p=[0.4, 0.5, 0.1])
    points = np.cumsum(steps, axis=1).reshape(-1, 3)
    strands = Strands(points, np.arange(201) * 6)
    for length in (1e-9, 1e-5, 1.5):
        assert np.array_equal(shorter_than(strands, length), strands.lengths() < length)


def test_nothing_to_write_is_refused() -> None:
    """A groom of guides alone has no hair to write."""
    with pytest.raises(InputError, match="strands=hair"):
        prepare_export(bristle_groom(), ExportOptions(strands="hair"))


def test_dense_grooms_begin_with_the_guides() -> None:
    """Hair is added up to the number, bound to the head, equal for equal seeds."""
    groom = rich_groom()
    dense = dense_groom(groom, 200, 3)
    guides = groom.select(np.asarray(groom.strands.guide))
    assert len(dense.strands) == 200
    assert np.array_equal(np.flatnonzero(dense.strands.guide), np.arange(len(guides.strands)))
    bound = evaluate(dense.head, dense.root_triangle, dense.root_barycentric)
    assert np.allclose(bound, dense.strands.roots, atol=1e-5)
    again = dense_groom(groom, 200, 3).strands.points
    assert np.array_equal(dense.strands.points, again)


def test_colours_run_from_root_to_tip() -> None:
    """The ends have the material's colours exactly; between them nothing leaves their range."""
    groom = rich_groom()
    groom = replace(groom, strands=replace(groom.strands, colours=None))
    colours, ends = point_colours(groom), groom.strands.offsets
    look = groom.material
    assert np.array_equal(colours[ends[:-1]], np.tile(look.root_colour, (len(ends) - 1, 1)))
    assert np.array_equal(colours[ends[1:] - 1], np.tile(look.tip_colour, (len(ends) - 1, 1)))
    assert (colours >= look.root_colour - 1e-6).all()
    assert (colours <= look.tip_colour + 1e-6).all()


def test_a_cache_comes_along_for_the_strands_that_are_written(tmp_path: Path) -> None:
    """Frames belong to the kept strands, and hair moves as rigidly as its guides do."""
    groom = rich_groom()
    guides = groom.select(np.asarray(groom.strands.guide)).strands.points
    shift = np.array([0.0, 0.01, 0.02], np.float32)
    motion = np.tile(np.eye(4), (2, 1, 1))
    motion[1, :3, 3] = shift
    cache = PointCache(np.stack([guides, guides + shift]), np.array([0.0, 0.1]), motion)
    cache.save(tmp_path / "cache.npz")
    for choice, hairs in (("all", 0), ("guides", 0), ("hair", 0), ("all", 400), ("hair", 400)):
        options = Animated(strands=choice, hairs=hairs, cache=tmp_path / "cache.npz")
        ready = prepare_export(groom, options)
        assert ready.cache is not None
        rest = ready.groom.strands.points
        assert np.allclose(ready.cache.points[0], rest, atol=1e-7)
        assert np.allclose(ready.cache.points[1], rest + shift, atol=1e-6)
    with pytest.raises(InputError, match="a cache of"):
        prepare_export(bristle_groom(), Animated(cache=tmp_path / "cache.npz"))


def test_hair_that_follows_its_guides_stays_out_of_the_head(tmp_path: Path) -> None:
    """Guides that fold into the head take no hair with them."""
    groom = bristle_groom()
    guides = groom.strands.points
    through = 2 * np.repeat(groom.strands.roots, groom.strands.counts, axis=0) - guides
    still = np.tile(np.eye(4), (2, 1, 1))
    PointCache(np.stack([guides, through]), np.array([0, 0.1]), still).save(tmp_path / "cache.npz")
    count = len(groom.strands) + 300
    ready = prepare_export(
        groom, Animated(strands="hair", hairs=count, cache=tmp_path / "cache.npz")
    )
    assert ready.cache is not None
    rest, blown = (np.linalg.norm(frame, axis=1) for frame in ready.cache.points)
    assert np.linalg.norm(through, axis=1).min() < rest.min() - 0.02
    assert blown.min() > rest.min() - 0.003
