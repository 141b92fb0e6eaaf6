"""Laws of what the viewer keeps and watches: pictures, recordings, changed files, runaway hair."""

from __future__ import annotations

import os
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest

from hairkit.errors import InputError, RenderError
from hairkit.imaging.picture_file import write_picture
from hairkit.manager import Manager
from hairkit.options import describe
from hairkit.rendering import context
from hairkit.rendering.context import renderer
from hairkit.testing import bristle_groom
from hairkit.viewer.actions.actions import perform
from hairkit.viewer.preview import Preview
from hairkit.viewer.recording import Recorder, free_name
from hairkit.viewer.session import TICK, Session
from hairkit.viewer.simulation import RigidHair
from hairkit.viewer.window.file_watcher import POLL_INTERVAL, FileWatcher, shader_files

PICTURE = np.full((48, 64, 3), (200, 60, 20), np.uint8)


def test_a_recording_holds_every_picture_in_order(tmp_path: Path) -> None:
    """An MP4 can be read again: as many pictures, of about the same colours."""
    path = tmp_path / "a.mp4"
    recorder = Recorder(path)
    for number in range(5):
        recorder.add(np.full((48, 64, 3), 40 * number + 20, np.uint8))
    recorder.close()
    video = cv2.VideoCapture(str(path))
    means = []
    while (found := video.read())[0]:
        means.append(float(np.mean(found[1])))
    video.release()
    np.testing.assert_allclose(means, [20, 60, 100, 140, 180], atol=6)


def test_a_folder_of_pictures_is_numbered(tmp_path: Path) -> None:
    """PNG files keep red red."""
    recorder = Recorder(tmp_path / "frames")
    recorder.add(PICTURE)
    recorder.add(PICTURE)
    recorder.close()
    read = cv2.imread(str(tmp_path / "frames" / "0001.png"))
    assert read is not None
    assert read[0, 0].tolist() == [20, 60, 200]
    with pytest.raises(InputError, match=r"expected an \.mp4 file or a folder"):
        Recorder(tmp_path / "a.avi")


def test_names_that_are_taken_get_a_number(tmp_path: Path) -> None:
    """Nothing is written over."""
    path = tmp_path / "a.png"
    assert free_name(path) == path
    write_picture(path, PICTURE)
    assert free_name(path) == tmp_path / "a_1.png"


def test_a_changed_file_is_noticed_once(tmp_path: Path) -> None:
    """After the next look it counts as seen; a file that comes later counts as a change."""
    path = tmp_path / "groom.npz"
    watch = FileWatcher([path])
    assert not watch.changed(POLL_INTERVAL + 1)
    path.write_bytes(b"1")
    assert not watch.changed(POLL_INTERVAL + 1.1)  # too early to look again
    assert watch.changed(2 * POLL_INTERVAL + 2)
    assert not watch.changed(3 * POLL_INTERVAL + 3)
    os.utime(path, ns=(1, 1))
    assert watch.changed(4 * POLL_INTERVAL + 4)


def test_all_shaders_of_the_viewer_are_watched() -> None:
    """A checkout's shaders are reloaded when they are saved."""
    names = {path.name for path in shader_files()}
    assert {"viewer_raster.comp", "marschner.glsl", "skin.frag"} <= names


def test_runaway_hair_is_put_back_to_rest(
    session: Session, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A simulator that gives no numbers any more does not take the viewer with it."""
    simulator = session.simulation.simulator
    rest = simulator.points.copy()

    def explode(seconds: float, surroundings: object) -> None:
        simulator.points = np.full_like(rest, np.nan)  # type: ignore[misc]

    monkeypatch.setattr(simulator, "advance", explode)
    session.advance(0.05)
    np.testing.assert_array_equal(session.simulation.simulator.points, rest)
    assert "diverged" in session.message


def test_a_picture_is_one_step_at_most(session: Session, monkeypatch: pytest.MonkeyPatch) -> None:
    """As long as the picture, if that is fast enough; slow steps become shorter: slow motion."""
    steps: list[float] = []
    monkeypatch.setattr(session.simulation.simulator, "advance", lambda dt, _: steps.append(dt))
    session.max_seconds = 1.0
    for count in range(1, 31):
        session.advance(1 / 37)
        assert len(steps) == count
    assert sum(steps) == pytest.approx(30 / 37, abs=2 * TICK)
    assert {round(step / TICK, 6) for step in steps} <= {1, 2, 3, 4}
    session.max_seconds = 0.0  # no step is fast enough
    for _ in range(4):
        session.advance(1 / 10)
    assert steps[-1] == pytest.approx(TICK)


def test_no_more_points_are_simulated_than_are_drawn(
    swaying_manager: Manager, tmp_path: Path
) -> None:
    """Guides of hundreds of points are simulated with the few that pictures show."""
    groom = bristle_groom()
    replace(groom, strands=groom.strands.resampled(300)).save(tmp_path / "fine.npz")
    session = Session(swaying_manager, tmp_path / "fine.npz", size=(160, 120), hairs=600)
    body = session.body
    assert len(session.simulation.simulator.points) == len(groom.strands) * body.points_each
    assert body.points_each < 20
    np.testing.assert_array_equal(session.guide_rows(), body.guide_rest)


def test_without_a_simulator_hair_goes_rigidly_with_the_head(session: Session) -> None:
    """Points keep their places in the head's frame, and read-outs say that all is calm."""
    still = RigidHair(session.opened.groom)
    matrix = np.eye(4)
    matrix[:3, 3] = (0.1, 0.0, -0.2)
    still.reset(matrix)
    moved = still.points - session.opened.groom.strands.points
    np.testing.assert_allclose(moved, np.broadcast_to(matrix[:3, 3], moved.shape), atol=1e-6)
    assert still.measure().stretch == 0


def test_every_option_can_be_changed_by_keys(session: Session) -> None:
    """Each kind of option has a next value, and within its bounds."""
    for info in describe(type(session.simulation.simulator.options)):
        before = session.simulation.value(info.name)
        for steps in (1, -1, 200, -400):
            value = session.simulation.step_option(info.name, steps)
            perform(session, "option", {"name": info.name, "value": value})  # is within bounds
        perform(session, "option", {"name": info.name, "value": before})
        assert session.simulation.step_option(info.name, 1) != before


def test_a_broken_shader_leaves_the_picture_as_it_was(
    session: Session, monkeypatch: pytest.MonkeyPatch
) -> None:
    """While a shader is being written the old ones draw on; when it compiles they are replaced."""
    with renderer() as gl:
        preview = Preview(gl, session)
        preview.draw()
        before, program = preview.picture(), gl.program("viewer_screen", "viewer_studio")
        with monkeypatch.context() as patch:
            patch.setattr(context, "shader_source", lambda name: "#version 430\nvoid main() { oh")
            with pytest.raises(RenderError, match="does not compile"):
                preview.restart()
        preview.draw()
        assert (preview.picture() == before).all()
        assert gl.program("viewer_screen", "viewer_studio") is program
        preview.restart()
        preview.draw()
        assert (preview.picture() == before).all()
        assert gl.program("viewer_screen", "viewer_studio") is not program
        preview.release()


def test_the_first_picture_needs_neither_simulator_nor_hair_between_guides(
    swaying_manager: Manager, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Guides are drawn first; all hair, which comes then, is as if it had been made at once."""
    path = tmp_path / "groom.npz"
    bristle_groom().save(path)
    made: list[object] = []
    call = Manager.call
    monkeypatch.setattr(Manager, "call", lambda *a, **k: (made.append(a[1]), call(*a, **k))[1])
    first = Session(swaying_manager, path, size=(160, 120), hairs=200, guides_first=True)
    assert len(first.body) == len(first.body.guides)
    with renderer() as gl:
        preview = Preview(gl, first)
        preview.draw()
        first.fill_in()
        preview.draw()
        preview.release()
    assert "make_simulator" not in made
    whole = Session(swaying_manager, path, size=(160, 120), hairs=200)
    np.testing.assert_array_equal(first.body.edges, whole.body.edges)
    np.testing.assert_array_equal(first.guide_rows(), whole.guide_rows())
    rows = first.guide_rows()
    assert len(first.simulation.simulator.points) == rows.size // 3
    np.testing.assert_allclose(first.guide_rows(), rows, atol=1e-6)
