"""Laws of wind and of what hair may not go into."""

from __future__ import annotations

import numpy as np

from hairkit.head_model.signed_distance import distance_to
from hairkit.simulation.obstacles import capsule_distance, head_obstacles
from hairkit.simulation.wind import air_velocity
from hairkit.testing import ball_head
from hairkit.types.head import Capsules

WIND = np.array([3.0, 0.0, 1.0])


def test_gusts_are_free_of_divergence(rng: np.random.Generator) -> None:
    """Central differences of the velocity sum to nothing against their own size."""
    points, step = rng.uniform(-0.3, 0.3, (50, 3)), 1e-5
    slopes = np.stack(
        [
            (air_velocity(points + d, 0.7, WIND, 0.5) - air_velocity(points - d, 0.7, WIND, 0.5))
            / (2 * step)
            for d in step * np.eye(3)
        ],
        axis=1,
    )
    divergence = np.trace(slopes, axis1=1, axis2=2)
    assert np.abs(divergence).max() < 1e-6 * np.abs(slopes).max()


def test_gusts_have_the_strength_asked_for(rng: np.random.Generator) -> None:
    """Over places and times their mean is the wind, their root mean square the share of it."""
    points = rng.uniform(-20, 20, (4000, 3))
    gusts = np.concatenate([air_velocity(points, t, WIND, 0.3) - WIND for t in (0.0, 11.0, 37.0)])
    speed = np.linalg.norm(WIND)
    assert np.linalg.norm(gusts.mean(axis=0)) < 0.03 * speed
    assert abs(np.sqrt((gusts**2).sum(axis=1).mean()) / (0.3 * speed) - 1) < 0.05


def test_gusts_repeat_and_differ_by_seed() -> None:
    """Equal seeds are equal gusts; no turbulence is the mean; time changes the gusts smoothly."""
    at = np.zeros((1, 3))
    assert (air_velocity(at, 1.0, WIND, 0.3, 4) == air_velocity(at, 1.0, WIND, 0.3, 4)).all()
    assert (air_velocity(at, 1.0, WIND, 0.3, 4) != air_velocity(at, 1.0, WIND, 0.3, 5)).any()
    assert (air_velocity(at, 1.0, WIND, 0.0) == WIND).all()
    change = air_velocity(at, 1.001, WIND, 0.3) - air_velocity(at, 1.0, WIND, 0.3)
    assert 0 < np.abs(change).max() < 0.5


def test_obstacles_are_the_head_and_its_capsules(rng: np.random.Generator) -> None:
    """Near the surface distance and direction are those of the union, to a fifth of a cell."""
    head = ball_head()
    obstacles = head_obstacles(head)
    way = rng.normal(size=(200, 3))
    way /= np.linalg.norm(way, axis=1, keepdims=True)
    points = way * rng.uniform(0.09, 0.12, (200, 1))
    distance, normal = obstacles.at(points)
    exact = np.minimum(distance_to(head, points), capsule_distance(head.capsules, points))
    np.testing.assert_allclose(distance, exact, atol=0.2 * obstacles.grid.spacing)
    assert ((normal * way).sum(axis=1) > 0.95).all()
    assert (obstacles.at(np.full((1, 3), 5.0))[0] >= 1.0).all()


def test_a_capsule_is_balls_between_balls() -> None:
    """On the axis' side the radius is mixed, beyond its ends it is a ball's."""
    one = Capsules([[0, 0, 0]], [[1, 0, 0]], [[0.1, 0.3]])
    points = np.array([[0.5, 1.0, 0], [-1.0, 0, 0], [2.0, 0, 0], [0.0, 0, 0]])
    np.testing.assert_allclose(capsule_distance(one, points), [0.8, 0.9, 0.7, -0.1], atol=1e-6)
