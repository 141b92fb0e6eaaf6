"""Laws of measured curls, on coils whose numbers are known."""

from __future__ import annotations

import numpy as np
import pytest

from hairkit.head_model.template import default_head
from hairkit.helices.curl import measure_curl
from hairkit.synth import grow
from hairkit.types.groom import HairMaterial
from hairkit.types.strands import Strands


def coil(
    radius: float,
    pitch: float,
    hand: int,
    rng: np.random.Generator,
    *,
    length: float = 0.25,
    noise: float = 0.0,
    bend: float = 2.0,
) -> np.ndarray:
    """Return a coil about an axis that bends by `bend` radians per metre, with a random phase."""
    s = np.arange(0, length, 0.002)
    phase = 2 * np.pi * s / pitch * hand + rng.uniform(0, 2 * np.pi)
    angle = bend * s
    axis = np.column_stack([(1 - np.cos(angle)) / bend, -np.sin(angle) / bend, 0 * s])
    side = np.column_stack([np.cos(angle), np.sin(angle), 0 * s])
    along = np.column_stack([np.sin(angle), -np.cos(angle), 0 * s])
    up = np.cross(along, side)
    points = axis + radius * (np.cos(phase)[:, None] * side + np.sin(phase)[:, None] * up)
    return points + rng.normal(0, noise, points.shape)


@pytest.mark.parametrize("hand", [1, -1])
@pytest.mark.parametrize(("radius", "pitch"), [(0.007, 0.034), (0.004, 0.02), (0.01, 0.06)])
@pytest.mark.parametrize("noise", [0.0, 0.0004])
def test_coils_are_measured(
    radius: float, pitch: float, hand: int, noise: float, rng: np.random.Generator
) -> None:
    """Radius and pitch to 10 %, the hand always, with and without noise on every point."""
    strands = Strands.from_list([coil(radius, pitch, hand, rng, noise=noise) for _ in range(6)])
    curl = measure_curl(strands)
    np.testing.assert_array_equal(curl.handedness, hand)
    np.testing.assert_allclose(np.median(curl.radius), radius, rtol=0.1)
    np.testing.assert_allclose(np.median(curl.pitch), pitch, rtol=0.1)


def test_straight_hair_has_no_curl(rng: np.random.Generator) -> None:
    """Bends, and noise on straight strands, are no curls."""
    strands = Strands.from_list([coil(0.0, 1.0, 1, rng, noise=0.0004) for _ in range(10)])
    curl = measure_curl(strands)
    assert curl.curled.sum() <= 1
    material = curl.written_to(HairMaterial())
    assert material.curl_radius == material.curl_pitch == 0


def test_waves_in_a_plane_have_no_hand(rng: np.random.Generator) -> None:
    """Amplitude and pitch are measured; handedness is 0."""
    s = np.arange(0, 0.3, 0.002)
    waves = [
        np.column_stack([0.005 * np.sin(2 * np.pi * s / 0.04 + shift), -s, 0 * s])
        for shift in rng.uniform(0, 6, 5)
    ]
    curl = measure_curl(Strands.from_list(waves))
    np.testing.assert_array_equal(curl.handedness, 0)
    np.testing.assert_allclose(curl.radius, 0.005, rtol=0.12)
    np.testing.assert_allclose(curl.pitch, 0.04, rtol=0.1)


def test_turning_the_strands_changes_nothing(rng: np.random.Generator) -> None:
    """Rotations keep all three numbers; a mirror turns the hand."""
    strands = Strands.from_list([coil(0.006, 0.03, 1, rng) for _ in range(4)])
    turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    turn *= np.linalg.det(turn)
    curl = measure_curl(strands)
    turned = measure_curl(Strands(strands.points @ turn.T.astype(np.float32), strands.offsets))
    np.testing.assert_allclose(turned.radius, curl.radius, rtol=0.01)
    np.testing.assert_array_equal(turned.handedness, curl.handedness)
    mirror = measure_curl(Strands(strands.points * np.float32([1, 1, -1]), strands.offsets))
    np.testing.assert_array_equal(mirror.handedness, -curl.handedness)


def test_a_curly_groom_says_so() -> None:
    """Procedural curly hair has about its style's curl in the material; straight hair none."""
    curly = grow("curly", default_head(), 60)
    material = measure_curl(curly.strands).written_to(curly.material)
    assert material.curl_pitch == pytest.approx(0.034, rel=0.3)
    assert 0.003 < material.curl_radius < 0.009
    straight = grow("straight", default_head(), 60)
    assert measure_curl(straight.strands).written_to(straight.material).curl_radius == 0
