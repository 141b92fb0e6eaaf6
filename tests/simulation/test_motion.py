"""Laws of head motion."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from hairkit.errors import InputError
from hairkit.simulation import HeadMotion, add_shakes, quaternion, read_motion, static_motion
from hairkit.testing import ball_head


@given(st.integers(0, 2**32 - 1))
def test_matrix_and_quaternion_are_each_others_inverse(seed: int) -> None:
    """From a quaternion to its matrix and back is the same turn."""
    q = quaternion.normalize(np.random.default_rng(seed).normal(size=(5, 4)))
    again = quaternion.from_matrix(quaternion.to_matrix(q))
    np.testing.assert_allclose(np.abs((again * q).sum(axis=1)), 1.0, atol=1e-12)


def test_swings_bring_one_vector_to_the_other(rng: np.random.Generator) -> None:
    """The smallest turn maps start to end, for opposite vectors too."""
    start = quaternion.normalize(rng.normal(size=(20, 3)))
    end = quaternion.normalize(rng.normal(size=(20, 3)))
    end[0], end[1] = -start[0], start[1]
    np.testing.assert_allclose(
        quaternion.rotate(quaternion.shortest_arc(start, end), start), end, atol=1e-9
    )


def test_a_shake_begins_at_rest_and_keeps_the_neck() -> None:
    """At time 0 nothing has moved; the neck joint never does; every motion is rigid."""
    head = ball_head()
    motion = add_shakes(["yaw:20:1.5", "roll:5:0.7"], head)
    np.testing.assert_allclose(motion(0.0), np.eye(4), atol=1e-12)
    for time in (0.1, 0.5, 1.7):
        moved = motion(time)
        np.testing.assert_allclose(moved[:3, :3] @ moved[:3, :3].T, np.eye(3), atol=1e-12)
        neck = moved[:3, :3] @ head.joints[1] + moved[:3, 3]
        np.testing.assert_allclose(neck, head.joints[1], atol=1e-7)


def test_a_shake_reaches_its_angle_and_stops() -> None:
    """A quarter of a swing after the start is over, yaw turns +Z towards +X by the degrees."""
    motion = add_shakes(["yaw:20:1:2"])
    turned = motion(1.25)[:3, :3] @ [0.0, 0.0, 1.0]
    assert np.degrees(np.arctan2(turned[0], turned[2])) == pytest.approx(20.0, abs=1e-6)
    np.testing.assert_allclose(motion(2.0), np.eye(4), atol=1e-12)


@pytest.mark.parametrize("text", ["yaw", "yaw:a:1", "spin:20:1", "yaw:20:1000", "yaw:20:1:2:3"])
def test_other_texts_are_no_shake(text: str) -> None:
    """The error names the text and what was wanted."""
    with pytest.raises(InputError, match="expected AXIS:DEGREES:HERTZ"):
        add_shakes([text])


def test_keyframes_are_met_and_smooth() -> None:
    """The motion goes through its keys; velocity has no jump at them."""
    keys = np.stack([add_shakes(["yaw:30:1"])(t) for t in (0.0, 0.25, 0.6, 0.9)])
    keys[2, :3, 3] = [0.1, 0.0, 0.0]
    times = np.array([0.0, 0.5, 1.0, 2.0])
    motion = HeadMotion(times, keys)
    for time, key in zip(times, keys, strict=True):
        np.testing.assert_allclose(motion(float(time)), key, atol=1e-9)
    before, at, after = (motion(0.5 + d) for d in (-1e-5, 0.0, 1e-5))
    np.testing.assert_allclose((after - at), (at - before), atol=1e-8)


def test_json_gives_the_motion_it_says(tmp_path: Path) -> None:
    """Matrices and turned frames are both read."""
    path = tmp_path / "head.json"
    frames = [{"time": 0}, {"time": 1, "turn_deg": [0, 90, 0], "move": [0.1, 0, 0]}]
    path.write_text(json.dumps({"frames": frames}))
    moved = read_motion(path)(1.0)
    np.testing.assert_allclose(moved @ [0, 0, 1, 1], [1.1, 0, 0, 1], atol=1e-12)
    path.write_text(json.dumps({"times": [0.0], "head_from_rest": [np.eye(4).ravel().tolist()]}))
    np.testing.assert_allclose(read_motion(path)(5.0), static_motion()(0.0))


@pytest.mark.parametrize(
    "text",
    ["", "[]", "{}", '{"times": [0], "head_from_rest": [[1]]}', '{"frames": [{"time": "x"}]}',
     '{"times": [0, 0], "head_from_rest": []}', '{"frames": [{"time": 0, "move": [NaN, 0, 0]}]}',
     "[" * 5000],
)  # fmt: skip
def test_other_files_are_refused_in_one_line(tmp_path: Path, text: str) -> None:
    """Whatever is not a motion is an `InputError` that names the file."""
    path = tmp_path / "head.json"
    path.write_text(text)
    with pytest.raises(InputError, match=r"head\.json"):
        read_motion(path)
