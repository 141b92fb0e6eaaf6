"""Laws of the programs that train the network of depths; those in PyTorch where it is installed."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from hairkit.field.hair_depth import CHANNELS, GRID, LAYERS
from hairkit.imaging.unet import shipped_weights
from training.hair_depth.grooms import CLOTHES, POINTS, SKIN, STRANDS, random_shape


@pytest.mark.parametrize("seed", [0, 4])
def test_random_grooms_hang_about_their_head(seed: int) -> None:
    """Strands begin at the skin, nothing is far off, and a seed gives the same groom again."""
    shape = random_shape(seed)
    assert shape.hair.shape == (STRANDS, POINTS, 3)
    assert (shape.skin.shape, shape.clothes.shape) == ((SKIN, 3), (CLOTHES, 3))
    gap = np.linalg.norm(shape.hair[:50, None, 0] - shape.skin, axis=-1).min(axis=1)
    assert gap.max() < 0.006
    assert np.abs(shape.hair - shape.middle).max() < 0.7
    assert np.array_equal(shape.hair, random_shape(seed).hair)


def test_captures_whose_hair_is_the_same_are_left_out_together() -> None:
    """Those whose names begin alike; one more training leaves out all."""
    pytest.importorskip("torch", reason="training needs PyTorch, which is not installed")
    from training.hair_depth.train import folds

    found = folds(["straight_long", "straight_ortho", "wavy"])
    assert found == {
        "": [], "-synth": [1, 2, 3], "-without-straight": [1, 2], "-without-wavy": [3],
    }  # fmt: skip


def test_views_are_drawn_and_a_network_is_trained(tmp_path: Path) -> None:
    """A step gives finite weights of the shipped ones' shapes; masks and depths agree."""
    torch = pytest.importorskip("torch", reason="training needs PyTorch, which is not installed")
    from training.hair_depth import train
    from training.hair_depth.views import Shapes

    shapes = Shapes([random_shape(1)], "cpu")
    features, depths = shapes.draw(torch.zeros(2, dtype=torch.long), torch.Generator())
    assert features.shape == (2, CHANNELS, GRID, GRID)
    assert depths.shape == (2, LAYERS, GRID, GRID)
    assert torch.equal(torch.isfinite(depths[:, 0]), features[:, 0] > 0)
    first, last = depths.nan_to_num().unbind(1)
    assert (first <= last).all()
    assert not (features[:, 0] * features[:, 1]).any()
    words = ["-o", str(tmp_path / "w.npz"), "--grooms", "2", "--views", "4", "--steps", "1"]
    train.main([*words, "--workers", "1"])
    written: Any = np.load(tmp_path / "w.npz")
    assert all(np.isfinite(written[name]).all() for name in written)
    shipped = shipped_weights("field", "hair_depth.npz")
    assert {name: written[name].shape for name in written} == {
        name: value.shape for name, value in shipped.items()
    }
