"""Laws of the procedural grooms."""

from __future__ import annotations

import numpy as np
import pytest

from hairkit.errors import InputError
from hairkit.head_model.scalp import evaluate
from hairkit.head_model.template import default_head
from hairkit.synth import STYLES, StyleName, grow
from hairkit.synth.bust import Bust, Obstacle


@pytest.mark.parametrize("style", list(STYLES))
def test_a_groom_grows_from_the_scalp_and_stays_out_of_the_body(style: StyleName) -> None:
    """Roots lie where they are bound, no point lies in head or torso, lengths are the style's."""
    head = default_head()
    groom = grow(style, head, 250, seed=2)
    bound = evaluate(head, groom.root_triangle, groom.root_barycentric)
    assert np.allclose(groom.strands.roots, bound, atol=1e-6)
    distance = Obstacle.of(head, Bust.under(head)).at(groom.strands.points)[0]
    assert distance.min() > -0.002
    lengths = groom.strands.lengths()
    assert 0.4 * STYLES[style].length < lengths.mean() < 1.8 * STYLES[style].length
    assert (lengths > 0.005).all()


def test_hair_falls_away_from_its_parting() -> None:
    """Over the forehead hair left of the parting ends on the left, right of it on the right."""
    groom = grow("straight", default_head(), 800, seed=1)
    roots, tips = groom.strands.roots, groom.strands.tips
    front = (roots[:, 2] > 0.03) & (np.abs(roots[:, 0]) > 0.01)
    assert front.sum() > 40
    assert (np.sign(tips[front, 0]) == np.sign(roots[front, 0])).mean() > 0.95


def test_styles_differ_as_their_names_say() -> None:
    """Short hair is short, curls wind: the way along the strand is far longer than the crow's."""
    head = default_head()
    grooms = {name: grow(name, head, 150, seed=3) for name in ("straight", "short", "curly")}

    def winding(name: str) -> float:
        strands = grooms[name].strands.select(np.arange(150))
        points = strands.points.reshape(150, -1, 3)
        quarter = points.shape[1] // 4
        straight = np.linalg.norm(points[:, 3 * quarter] - points[:, 2 * quarter], axis=1)
        arc = strands.arc_lengths().reshape(150, -1)
        return float(np.mean((arc[:, 3 * quarter] - arc[:, 2 * quarter]) / straight))

    assert grooms["short"].strands.lengths().mean() < 0.05
    assert winding("curly") > 1.3
    assert winding("straight") < 1.1


def test_equal_seeds_grow_equal_hair() -> None:
    """The same seed gives the same bytes, another seed other hair."""
    head = default_head()
    first, again, other = (grow("wavy", head, 80, seed) for seed in (5, 5, 6))
    assert first.strands.points.tobytes() == again.strands.points.tobytes()
    assert first.strands.points.tobytes() != other.strands.points.tobytes()


def test_unknown_styles_and_numbers_are_named() -> None:
    """A style that does not exist is answered with those that do."""
    with pytest.raises(InputError, match="no style 'mohawk'; styles: straight, wavy"):
        grow("mohawk", default_head())  # type: ignore[arg-type]
    with pytest.raises(InputError, match="0 strands asked for"):
        grow("short", default_head(), 0)
