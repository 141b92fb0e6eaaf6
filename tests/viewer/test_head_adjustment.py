"""Laws of the head placed by hand."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from hairkit.api import sample_capture
from hairkit.errors import InputError
from hairkit.io.capture_toml import HeadEntry, head_entry, read_capture_file, write_head_entry
from hairkit.manager import Manager
from hairkit.testing import ball_head
from hairkit.types.camera import Camera
from hairkit.viewer.actions.actions import perform
from hairkit.viewer.head_adjustment import EDGE, Adjustment, Rerun
from hairkit.viewer.session import Session

angles = st.floats(-80, 80)
ways = st.floats(-0.2, 0.2)


@pytest.fixture
def adjustment(manager: Manager) -> Adjustment:
    """The sample capture before the ball head, nothing known."""
    return Adjustment.of(manager, sample_capture(EDGE), ball_head(), {})


@given(st.floats(0.5, 2.0), st.tuples(angles, angles, angles), st.tuples(ways, ways, ways))
def test_a_written_pose_is_read_as_the_same_similarity(
    tmp_path_factory: pytest.TempPathFactory,
    scale: float,
    rotation: tuple[float, float, float],
    translation: tuple[float, float, float],
) -> None:
    """`[head]` to matrix to `[head]` keeps the pose."""
    path = tmp_path_factory.mktemp("pose") / "capture.toml"
    write_head_entry(path, HeadEntry(scale, rotation, translation))
    first = read_capture_file(path).head_pose
    assert first is not None
    write_head_entry(path, head_entry(first))
    second = read_capture_file(path).head_pose
    assert second is not None
    np.testing.assert_allclose(second, first, atol=1e-6)


def test_what_else_capture_toml_says_stays(tmp_path: Path) -> None:
    """Only the table [head] is replaced: entries, views and comments around it stay."""
    path = tmp_path / "capture.toml"
    path.write_text(
        "orthographic = true # as drawn\n[head]\nscale = 3.0\n\n[[views]]\nname = 'front'\n"
    )
    write_head_entry(path, HeadEntry(1.1, (0.0, 5.0, 0.0), (0.0, 0.01, 0.0)))
    found = read_capture_file(path)
    assert found.orthographic
    assert found.views[0].name == "front"
    assert "# as drawn" in path.read_text()
    assert found.head_pose is not None
    assert np.cbrt(np.linalg.det(found.head_pose[:3, :3])) == pytest.approx(1.1)


def test_moving_the_head_moves_it_in_the_photo(adjustment: Adjustment) -> None:
    """To the right and up in the photo that is looked through, back away from it."""
    middle = adjustment.head.vertices.mean(axis=0)
    before = adjustment.cameras()["left"]
    adjustment.move(before, 0.02, 0.01, 0.0)
    after = adjustment.cameras()["left"]
    (x0, y0), (x1, y1) = before.project(middle), after.project(middle)
    assert x1 - x0 == pytest.approx(0.02 * before.focal / before.depth(middle), rel=1e-6)
    assert y0 - y1 == pytest.approx(0.01 * before.focal / before.depth(middle), rel=1e-6)
    adjustment.move(after, 0.0, 0.0, 0.05)
    assert adjustment.cameras()["left"].depth(middle) == pytest.approx(
        before.depth(middle) - 0.05, rel=1e-6
    )


def test_a_larger_head_is_seen_larger_about_its_middle(adjustment: Adjustment) -> None:
    """Its outline grows by the factor; its middle stays in the photo."""
    middle = adjustment.head.vertices.mean(axis=0)
    before = adjustment.cameras()["front"]
    adjustment.grow(1.2)
    after = adjustment.cameras()["front"]
    np.testing.assert_allclose(after.project(middle), before.project(middle), atol=1e-6)
    side = middle + np.float32([0.05, 0, 0])
    wide = (after.project(side) - after.project(middle))[0]
    assert wide / (before.project(side) - before.project(middle))[0] == pytest.approx(1.2, rel=1e-3)


def test_turning_a_head_and_back_changes_nothing(adjustment: Adjustment) -> None:
    """Turns are about the head's middle, which stays where it is seen."""
    middle = adjustment.head.vertices.mean(axis=0)
    pose = adjustment.pose.copy()
    before = adjustment.cameras()["front"].project(middle)
    adjustment.turn("yaw", 20.0)
    np.testing.assert_allclose(adjustment.cameras()["front"].project(middle), before, atol=1e-6)
    adjustment.turn("yaw", -20.0)
    np.testing.assert_allclose(adjustment.pose, pose, atol=1e-12)


def test_it_begins_where_the_cameras_were_found(manager: Manager, adjustment: Adjustment) -> None:
    """Cameras of a turn seen from a head that is placed elsewhere give that place."""
    adjustment.move(adjustment.cameras()["front"], 0.03, -0.02, 0.01)
    adjustment.turn("yaw", 8.0)
    found = adjustment.cameras()
    again = Adjustment.of(manager, sample_capture(EDGE), ball_head(), found)
    np.testing.assert_allclose(again.pose, adjustment.pose, atol=1e-6)


def test_it_begins_where_photos_show_the_head(manager: Manager, adjustment: Adjustment) -> None:
    """Other focal lengths and distances give the pose that keeps the head's place in the photos."""
    found = {
        name: replace(camera, focal=1.3 * camera.focal, camera_from_head=farther(camera, 1.3))
        for name, camera in adjustment.cameras().items()
    }
    cameras = Adjustment.of(manager, sample_capture(EDGE), ball_head(), found).cameras()
    points = ball_head().vertices[::7]
    for name, camera in found.items():
        gap = np.linalg.norm(camera.project(points) - cameras[name].project(points), axis=1)
        assert gap.max() < 0.03 * camera.width


def farther(camera: Camera, times: float) -> np.ndarray:
    """Return where a camera is so many times as far from the origin."""
    matrix = camera.camera_from_head.copy()
    matrix[:3, 3] *= times
    return matrix


def test_without_photos_there_is_nothing_to_adjust(session: Session) -> None:
    """One line says how to name them; the other actions ask to begin first."""
    with pytest.raises(InputError, match="--capture"):
        perform(session, "adjust")
    for name in ("head_move", "head_turn", "head_save", "reconstruct"):
        with pytest.raises(InputError, match="start with the action adjust"):
            perform(session, name)


def test_a_reconstruction_that_fails_says_why(tmp_path: Path) -> None:
    """The child's last line is the error's."""
    rerun = Rerun.start(tmp_path / "nothing", tmp_path / "out", ())
    rerun.wait()
    assert not rerun.running
    with pytest.raises(InputError, match="reconstruction failed: hairkit:"):
        rerun.check()


def test_leaving_the_adjustment_shows_what_was_shown_before(
    session: Session, adjustment: Adjustment, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Photos, their opacity, the view and the time are as they were; doing it twice is once."""
    monkeypatch.setattr(Adjustment, "of", lambda *_: adjustment)
    monkeypatch.setattr(session.layers, "capture", str(adjustment.folder))
    monkeypatch.setattr(session.layers, "_manager", adjustment.manager)
    shown = session.shown
    before = (session.paused, shown.opacity, shown.through, set(shown.layers))
    perform(session, "adjust")
    perform(session, "adjust", {"on": True})
    assert session.paused
    assert "photos" in shown.layers
    assert shown.through in session.photo_cameras
    perform(session, "adjust")
    assert (session.paused, shown.opacity, shown.through, shown.layers) == before
