"""Laws of winding: straight strands become helices of the measured radius, pitch and slant."""

from __future__ import annotations

import numpy as np
import pytest

from hairkit.arrays import Float64Array
from hairkit.grooming.wind_waves import add_waves
from hairkit.types.camera import Camera
from hairkit.types.strands import Strands
from hairkit.types.waves import Waves


def hanging(
    spacing: float = 0.02, rows: int = 4, length: float = 0.3, points: int = 200
) -> Strands:
    """Straight strands that hang from a square of roots, `spacing` metres apart."""
    x, z = np.meshgrid(*[spacing * np.arange(rows)] * 2)
    roots = np.stack([x.ravel(), 0 * x.ravel(), z.ravel()], axis=-1)[:, None]
    axis = np.linspace(0, length, points)[None, :, None] * np.array([0.0, -1.0, 0.0])
    wound = (roots + axis).astype(np.float32)
    offsets = np.arange(rows**2 + 1) * points
    return Strands(wound.reshape(-1, 3), offsets, root_uv=roots[:, 0, [0, 2]].astype(np.float32))


def about_axes(strands: Strands) -> tuple[Float64Array, Float64Array]:
    """Distance from the vertical axis and unwrapped azimuth, (S, M) each, of all points."""
    points = strands.points.reshape(len(strands), -1, 3).astype(np.float64)
    offset = points - points[:, :1]
    azimuth = np.unwrap(np.arctan2(offset[..., 0], offset[..., 2])[:, 1:], axis=1)
    return np.hypot(offset[..., 0], offset[..., 2]), azimuth


@pytest.mark.parametrize("slant", [0.4, -0.4, 0.0])
def test_wound_strands_keep_roots_and_run_at_the_radius(slant: float) -> None:
    """Root, offsets and uv stay; beyond the ramp the axis is `radius` away, before it less."""
    straight, waves = hanging(), Waves(0.005, 0.04, slant)
    wound = add_waves(straight, waves, spread=0.0)
    np.testing.assert_allclose(wound.roots, straight.roots, atol=1e-7)
    np.testing.assert_array_equal(wound.offsets, straight.offsets)
    np.testing.assert_array_equal(wound.root_uv, straight.root_uv)
    distance, _ = about_axes(wound)
    arc = straight.arc_lengths().reshape(len(straight), -1)
    np.testing.assert_allclose(distance, 0.005 * np.clip(arc / 0.03, 0, 1), atol=1e-5)


@pytest.mark.parametrize("pitch", [0.02, 0.06])
def test_wound_strands_turn_once_in_a_pitch(pitch: float) -> None:
    """Over 30 cm a strand turns 0.3 / pitch times, at an even pace."""
    _, azimuth = about_axes(add_waves(hanging(), Waves(0.005, pitch, 0.3), spread=0.0))
    pace = np.abs(np.diff(azimuth, axis=1)) / (2 * np.pi) / (0.3 / 199)
    np.testing.assert_allclose(pace[:, 5:], 1 / pitch, rtol=0.02)


def test_the_other_handedness_is_the_mirror_image() -> None:
    """From the same start every strand turns as far to the other side."""
    first, second = (
        about_axes(add_waves(hanging(), Waves(0.005, 0.04, s), spread=0.0))[1] for s in (0.3, -0.3)
    )
    turned, back = (turn - turn[:, 10:11] for turn in (first, second))
    np.testing.assert_allclose(turned[:, 10:], -back[:, 10:], atol=0.01)
    assert np.unique(np.sign(turned[:, -1])).size == 1


def test_without_a_handedness_wisps_turn_either_way() -> None:
    """Some of many strands turn left, some right."""
    _, azimuth = about_axes(add_waves(hanging(rows=12), Waves(0.005, 0.04, 0.0)))
    assert set(np.sign(azimuth[:, -1] - azimuth[:, 10])) == {-1.0, 1.0}


@pytest.mark.parametrize("azimuth_deg", [0.0, 100.0, 230.0])
@pytest.mark.parametrize("slant_deg", [25.0, -25.0])
def test_a_camera_sees_wound_strands_slant_as_measured(
    azimuth_deg: float, slant_deg: float
) -> None:
    """The near halves of helices of radius `pitch tan(slant) / 4` slant by that, with its sign."""
    pitch = 0.04
    slant = np.radians(slant_deg)
    straight = hanging(rows=8, points=600)
    wound = add_waves(straight, Waves(pitch * np.tan(abs(slant)) / 4, pitch, slant), spread=0.0)
    camera = Camera.on_turn(azimuth_deg, focal=1500, width=300, height=360, model="orthographic")
    near = camera.to_camera(wound.points)[:, 2] < camera.to_camera(straight.points)[:, 2]
    near &= straight.arc_lengths() > 0.04
    run = np.diff(camera.project(wound.points), axis=0)[near[:-1]]
    run = run[run[:, 1] > 0]  # not from a tip to the next root
    assert np.degrees(np.arctan(-run[:, 0].mean() / run[:, 1].mean())) == pytest.approx(
        slant_deg, abs=2
    )


def test_radius_and_pitch_vary_from_wisp_to_wisp() -> None:
    """Their means stay; their standard deviations over many wisps are the usual shares."""
    straight = hanging(spacing=0.013, rows=16)
    distance, azimuth = about_axes(add_waves(straight, Waves(0.005, 0.04, 0.3)))
    radius, turned = distance[:, -1], np.abs(azimuth[:, -1] - azimuth[:, 40])
    assert radius.mean() == pytest.approx(0.005, rel=0.05)
    assert radius.std() / radius.mean() == pytest.approx(0.2, abs=0.05)
    assert turned.std() / turned.mean() == pytest.approx(0.1, abs=0.03)


def test_the_phase_changes_from_wisp_to_wisp() -> None:
    """Hair 0.2 mm apart is nearly in phase, hair 6 mm apart is not."""

    def spread(spacing: float) -> float:
        _, azimuth = about_axes(
            add_waves(hanging(spacing, rows=10), Waves(0.005, 0.04, 0.3), spread=0.0)
        )
        phase = np.exp(1j * azimuth[:, 100]).reshape(10, 10)
        return float(np.abs(np.diff(phase, axis=1)).mean())

    assert spread(0.0002) < 0.5
    assert spread(0.0061) > 1.0


@pytest.mark.parametrize("slant", [0.3, 0.0])
def test_a_strand_does_not_depend_on_how_many_others_there_are(slant: float) -> None:
    """Some of many strands, wound alone, are exactly those wound among all."""
    every, waves = hanging(0.001, rows=20), Waves(0.005, 0.04, slant)
    some = np.random.default_rng(0).permutation(len(every))[:30]
    alone, among = add_waves(every.select(some), waves), add_waves(every, waves).select(some)
    np.testing.assert_array_equal(alone.points, among.points)


def test_the_seed_alone_decides() -> None:
    """The same seed winds byte for byte the same; another one does not."""
    straight, waves = hanging(), Waves(0.005, 0.04, 0.3)
    first, second, other = (add_waves(straight, waves, seed).points for seed in (3, 3, 4))
    assert first.tobytes() == second.tobytes()
    assert np.abs(first - other).max() > 1e-3


def test_no_radius_no_pitch_or_no_strands_is_no_change() -> None:
    """Straight hair stays the very same object."""
    straight = hanging()
    none = Strands(np.zeros((0, 3), np.float32), np.zeros(1, np.int64))
    assert add_waves(straight, Waves()) is straight
    assert add_waves(straight, Waves(0.0, 0.04, 0.3)) is straight
    assert add_waves(straight, Waves(0.004, 0.0, 0.3)) is straight
    assert add_waves(none, Waves(0.004, 0.04, 0.3)) is none


def test_a_single_strand_is_wound_too() -> None:
    """One strand needs no neighbours."""
    distance, _ = about_axes(add_waves(hanging(rows=1), Waves(0.005, 0.04, 0.3), spread=0.0))
    assert distance[0, -1] == pytest.approx(0.005, abs=1e-5)
