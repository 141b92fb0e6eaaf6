"""Laws of the actions: everything a user can do, done without a window."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np
import pytest

from hairkit.errors import HairkitError, InputError, OptionError
from hairkit.viewer.actions.actions import ACTIONS, LOOKS, bindings, perform
from hairkit.viewer.actions.presets import presets_path, write_preset
from hairkit.viewer.session import STEP, Session

NEEDS_RESULTS = ("layer", "through", "preset_load", "wipe")
NEEDS_BRUSH = ("brush_option", "undo")


def tip_pixel(session: Session, strand: int) -> tuple[float, float]:
    """Return where a guide's point before its tip is seen."""
    simulator = session.simulation.simulator
    point = simulator.points[simulator.strands.offsets[strand + 1] - 1]
    x, y = session.camera().project(point)
    return float(x), float(y)


def front_strand(session: Session) -> int:
    """Return the guide whose tip is nearest to the camera."""
    simulator = session.simulation.simulator
    tips = simulator.points[simulator.strands.offsets[1:] - 1]
    return int(np.argmin(session.camera().depth(tips)))


def test_every_action_says_what_it_does_and_no_key_does_two_things() -> None:
    """Help sheet and manual are made from the table."""
    keys = [key for action in ACTIONS.values() for key in action.keys]
    assert len(keys) == len(set(keys))
    assert all(action.doc.endswith(".") for action in ACTIONS.values())
    assert all(name == action.name for name, action in ACTIONS.items())


@pytest.mark.parametrize("key", sorted(bindings()))
def test_every_key_can_be_pressed(session: Session, key: str, tmp_path: Path) -> None:
    """A key does its action, or says in one line why not here."""
    name, values = bindings()[key]
    if name == "record":
        values = {"file": str(tmp_path / "frames")}
    needs_results = name in NEEDS_RESULTS + NEEDS_BRUSH and key not in ("F9", "F10")
    if needs_results:
        with pytest.raises(HairkitError) as caught:
            perform(session, name, values)
        assert "\n" not in str(caught.value)
    else:
        perform(session, name, values)


def test_unknown_actions_and_refused_values_are_named(session: Session) -> None:
    """A mistake in a script gives one line with what was meant."""
    with pytest.raises(InputError, match=r"no action 'orbitt'.*did you mean 'orbit'"):
        perform(session, "orbitt")
    with pytest.raises(OptionError, match=r"orbit: .*no option 'left'"):
        perform(session, "orbit", {"left": 3.0})
    with pytest.raises(OptionError, match=r"orbit: option right is 'far'"):
        perform(session, "orbit", {"right": "far"})
    with pytest.raises(InputError, match="zoom: missing value of factor"):
        perform(session, "zoom")
    with pytest.raises(InputError, match="expected a number above 0"):
        perform(session, "zoom", {"factor": -1.0})


@pytest.mark.parametrize("name", sorted(LOOKS))
def test_named_views_look_from_there(session: Session, name: str) -> None:
    """The camera is where the view's name says, as far away as before."""
    far = session.view.distance
    perform(session, "look", {"name": name})
    camera = session.camera()
    assert camera.azimuth_deg == pytest.approx(LOOKS[name][0], abs=1e-6)
    assert camera.elevation_deg == pytest.approx(LOOKS[name][1], abs=1e-6)
    assert session.view.distance == far


def test_wind_blows_tips_away_and_roots_not(session: Session) -> None:
    """Wind from the left moves tips to the right; without wind they go back."""
    simulator = session.simulation.simulator
    rest = simulator.points.copy()
    perform(session, "wind", {"on": True, "speed": 5.0, "azimuth": 90.0})
    session.advance(0.1)
    moved = session.simulation.simulator.points - rest
    offsets = simulator.strands.offsets
    assert (moved[offsets[1:] - 1, 0] < -0.01).all()
    np.testing.assert_allclose(moved[offsets[:-1]], 0, atol=1e-6)
    perform(session, "wind", {"on": False})
    session.advance(0.1)
    np.testing.assert_allclose(session.simulation.simulator.points, rest, atol=1e-6)


def test_a_shaken_head_takes_its_hair_along_in_its_own_frame(session: Session) -> None:
    """Rigid hair does not move against the head: the drawn rows, head frame, stay."""
    rows = session.guide_rows()
    perform(session, "shake", {"axis": "yaw", "degrees": 40.0})
    session.advance(0.4)
    assert np.abs(session.world_from_head - np.eye(4)).max() > 0.01
    np.testing.assert_allclose(session.guide_rows(), rows, atol=1e-6)
    perform(session, "reset")
    assert np.array_equal(session.world_from_head, np.eye(4))


def test_grabbed_hair_follows_the_mouse_and_is_let_go(session: Session) -> None:
    """The held point is seen under the mouse, wherever that goes; afterwards it goes back."""
    strand = front_strand(session)
    x, y = tip_pixel(session, strand)
    perform(session, "grab", {"x": x, "y": y})
    assert session.grabbed_lock is not None
    perform(session, "drag", {"x": x + 20.0, "y": y - 10.0})
    session.advance(0.1)
    held = session.grabbed_lock.points[
        np.argmin(np.linalg.norm(session.grabbed_lock.offsets, axis=1))
    ]
    seen = session.camera().project(session.simulation.simulator.points[held])
    np.testing.assert_allclose(seen, [x + 20, y - 10], atol=1.0)
    perform(session, "release")
    session.advance(0.1)
    assert session.grabbed_lock is None
    np.testing.assert_allclose(tip_pixel(session, strand), (x, y), atol=1e-3)


def test_grabbing_beside_the_hair_holds_nothing(session: Session) -> None:
    """The corner of the picture has no hair."""
    perform(session, "grab", {"x": 1.0, "y": 1.0})
    assert session.grabbed_lock is None
    assert session.message


def test_the_guide_under_the_mouse_is_picked(session: Session) -> None:
    """Its number is known; beside the hair nothing is."""
    strand = front_strand(session)
    x, y = tip_pixel(session, strand)
    perform(session, "pick", {"x": x, "y": y})
    assert session.picked == strand
    perform(session, "pick", {"x": 1.0, "y": 1.0})
    assert session.picked is None


def test_recentring_puts_the_point_into_the_middle(session: Session) -> None:
    """What was double-clicked is at the centre of the picture afterwards."""
    strand = front_strand(session)
    x, y = tip_pixel(session, strand)
    perform(session, "recentre", {"x": x, "y": y})
    np.testing.assert_allclose(tip_pixel(session, strand), (80, 60), atol=0.1)


def test_paused_time_stands_still_and_steps_are_sixtieths(session: Session) -> None:
    """A step lets one sixtieth of a second pass, a pause none."""
    perform(session, "pause", {"on": True})
    session.advance(0.5)
    assert session.simulation.simulator.time == 0
    perform(session, "step")
    assert session.simulation.simulator.time == pytest.approx(STEP)


def test_time_is_the_same_in_small_and_large_portions(session: Session) -> None:
    """The number of steps goes with the time, not with the pictures."""
    for _ in range(50):
        session.advance(0.02)
    assert session.steps == 60


def test_options_are_checked_changed_by_keys_and_kept_as_presets(session: Session) -> None:
    """Sliders, keys and scripts change the simulator's own options; presets bring them back."""
    perform(session, "option", {"name": "lean", "value": 0.05})
    assert session.simulation.simulator.options.lean == 0.05
    with pytest.raises(OptionError, match="lean is 7"):
        perform(session, "option", {"name": "lean", "value": 7})
    with pytest.raises(InputError, match="did you mean 'lean'"):
        perform(session, "option", {"name": "leen", "value": 1.0})
    perform(session, "option_next")
    perform(session, "option_change", {"steps": 2})
    assert session.simulation.value("turns") == 5
    perform(session, "option_next")
    perform(session, "option_change")
    assert session.simulation.value("mode") == "hard"
    perform(session, "preset_save", {"name": "windy day"})
    assert presets_path(session.opened.path).is_file()
    session.simulation.replace({})
    assert session.simulation.value("lean") == 0.01
    perform(session, "preset_load", {"name": "windy day"})
    assert session.simulation.values == {"lean": 0.05, "turns": 5, "mode": "hard"}
    with pytest.raises(InputError, match="no preset 'calm'"):
        perform(session, "preset_load", {"name": "calm"})
    write_preset(presets_path(session.opened.path), "old", {"simulator": "pbd", "options": {}})
    with pytest.raises(InputError, match="--simulator pbd; what was pbd is rods since"):
        perform(session, "preset_load", {"name": "old"})


def test_reloading_keeps_view_and_options(session: Session) -> None:
    """A groom that was written again is seen as the old one was."""
    perform(session, "option", {"name": "lean", "value": 0.02})
    perform(session, "orbit", {"right": 33.0})
    view = session.view
    perform(session, "reload")
    assert session.view == view
    assert session.simulation.simulator.options == dataclasses.replace(
        session.simulation.simulator.options, lean=0.02
    )
