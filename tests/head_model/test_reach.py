"""Laws of the region between guides: whole heads are covered, parts of a head stay parts."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial import cKDTree

from hairkit.grooming.densify import densify
from hairkit.grooming.prepare_export import dense_groom
from hairkit.head_model.reach import Reach
from hairkit.head_model.scalp import sample_roots
from hairkit.head_model.template import default_head
from hairkit.testing import bristle_groom
from hairkit.types.groom import Groom
from hairkit.viewer.draw.hair_data import HairBody


@pytest.mark.parametrize("guides", [25, 600])
def test_hair_between_guides_of_a_whole_head_is_where_it_would_be_without_them(guides: int) -> None:
    """Evenly spread guides reach all of the scalp: not one root is refused."""
    head = default_head()
    own, dense = sample_roots(head, guides), sample_roots(head, 5_000, seed=1)
    assert Reach.of(own.positions).covers(dense.positions).all()
    free = sample_roots(head, 500, first=guides)
    bound = sample_roots(head, 500, first=guides, guides=own)
    np.testing.assert_array_equal(free.positions, bound.positions)


def _part(kind: str) -> Groom:
    """Return the strands of the bristling ball that a fringe or a mohawk has."""
    groom = bristle_groom()
    x, y, z = groom.strands.roots.T
    return groom.select(np.abs(x) < 0.02 if kind == "mohawk" else (z > 0.05) & (y < 0.08))


@pytest.mark.parametrize("kind", ["fringe", "mohawk"])
def test_part_of_a_head_stays_a_part(kind: str) -> None:
    """Hair of a fringe or mohawk grows no farther from the guides than they are from each other.

    `render`, exports with `hairs=` and the viewer make it.
    """
    guides = _part(kind)
    tree = cKDTree(guides.strands.roots)
    spacing = tree.query(guides.strands.roots, k=5)[0][:, 1:].max()
    body = HairBody.of(guides, 1000)
    course = np.einsum("sk,skc->sc", body.weights, body.guide_rest[body.followed][:, :, 0])
    for roots in (
        densify(guides, 1000).roots,
        dense_groom(guides, 1000).strands.roots,
        course + body.edges[:, 0],
    ):
        assert len(roots) == 1000
        assert tree.query(roots)[0].max() < 1.6 * spacing
    whole = cKDTree(bristle_groom().strands.roots)
    assert tree.query(whole.data)[0].max() > 3 * spacing  # most of the scalp is far from them


def test_a_stray_guide_grows_no_more_than_others() -> None:
    """One guide far from all others widens the region by its neighbourhood only."""
    even = np.stack(np.meshgrid(np.arange(8.0), np.arange(8.0), [0.0]), axis=-1).reshape(-1, 3)
    reach = Reach.of(0.005 * np.concatenate([even, [[60.0, 0, 0]]]))
    assert reach.covers([[0.3 - 0.01, 0, 0]]).all()
    assert not reach.covers([[0.3 - 0.05, 0, 0]]).any()


def test_hair_grows_under_guides_that_stand_off_the_scalp() -> None:
    """A beard's hair grows where its guides are, below the scalp, and nowhere else."""
    groom = bristle_groom()
    x, y, z = groom.head.vertices[groom.head.faces].mean(axis=1).T
    chin = np.flatnonzero((y < -0.02) & (z > 0.04)).astype(np.int32)
    few = groom.select(np.arange(len(groom.strands)) < len(chin))
    middle = np.full((len(chin), 3), 1 / 3, np.float32)
    shift = np.stack([x, y, z], axis=1)[chin] - few.strands.roots
    points = few.strands.points + np.repeat(shift, few.strands.counts, axis=0)
    strands = type(few.strands)(points, few.strands.offsets)
    beard = Groom(strands, groom.head, chin, middle)
    roots = densify(beard, 600).roots
    assert roots[:, 1].max() < 0.02
    assert roots[:, 2].min() > 0.0


def test_guides_in_tufts_keep_their_tufts() -> None:
    """Guides that share their roots still grow hair: a few millimetres about each tuft."""
    tufts = np.repeat([[0.0, 0, 0], [0.05, 0, 0]], 6, axis=0)
    reach = Reach.of(tufts)
    assert reach.covers([[0.002, 0, 0], [0.048, 0, 0]]).all()
    assert not reach.covers([[0.02, 0, 0]]).any()
