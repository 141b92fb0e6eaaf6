"""Laws of the cranium on bare outlines."""

from __future__ import annotations

import numpy as np
import pytest
from turntable import Turntable, bald_masks, turntable

from hairkit.arrays import Float64Array
from hairkit.cameras.outlines import Outlines
from hairkit.head_model.cranium import Cranium
from hairkit.types.mask import Mask


@pytest.fixture(scope="module")
def bust() -> Turntable:
    """A head seen by cameras off the turn."""
    return turntable(np.random.default_rng(6))


def _cameras(bust: Turntable) -> tuple[Float64Array, Float64Array]:
    rotation = np.stack([camera.rotation for camera in bust.cameras])
    return rotation, np.stack([camera.translation for camera in bust.cameras])


def test_the_rim_lies_on_the_outline(bust: Turntable) -> None:
    """Seen by the true cameras, points on the rim above the ears lie on the outline to 1.5 px."""
    outlines = Outlines.of(bust.masks, 10)
    cranium = Cranium.of(bust.head, bald_masks(bust.masks), outlines.scale)
    view, point, share = cranium.rims(_cameras(bust))
    for index, camera in enumerate(bust.cameras):
        rim = point[(view == index) & (share > 0.9)]
        rim = rim[cranium.points[rim, 1] > 0.02]
        assert len(rim) > 2
        column, row = (camera.project(cranium.points[rim]) * outlines.scale).astype(int).T
        assert np.abs(outlines.fields[index][row, column]).max() < 1.5 / outlines.scale


def test_outlines_are_bare_where_no_hair_is_near(bust: Turntable) -> None:
    """Every rim point of a bald head is bare, none within hair's reach, none off the picture."""
    hairy, bald = (
        Cranium.of(bust.head, masks, 1.0) for masks in (bust.masks, bald_masks(bust.masks))
    )
    view, point, _ = hairy.rims(_cameras(bust))
    cameras = [bust.cameras[index] for index in view]
    pixels = np.stack([c.project(p) for c, p in zip(cameras, hairy.points[point], strict=True)])
    assert bald.bare(view, pixels).all()
    crown = pixels[:, 1] < np.array([camera.project([0.0, 0.05, 0.0])[1] for camera in cameras])
    assert crown.any()
    assert not hairy.bare(view, pixels)[crown].any()
    assert not bald.bare(view, pixels + 1e4).any()


def test_photos_cut_to_other_sizes_tell_the_same(bust: Turntable) -> None:
    """A smaller picture of the same camera moves nothing: hair stays where it is."""
    scale = 0.5
    height, width = bust.masks[0].labels.shape
    cut = tuple(
        Mask(mask.labels[: height - 20 * k], mask.person_known) for k, mask in enumerate(bust.masks)
    )
    whole, part = (Cranium.of(bust.head, masks, scale) for masks in (bust.masks, cut))
    rows, columns = np.mgrid[: height - 20 * len(cut) : 4, :width:4]
    pixels = np.stack([columns.ravel(), rows.ravel()], axis=1) + 0.5
    for k in range(len(cut)):
        view = np.full(len(pixels), k)
        assert 0 < (whole.bare(view, pixels) == 0).sum() < len(pixels)
        assert np.array_equal(whole.bare(view, pixels), part.bare(view, pixels))
