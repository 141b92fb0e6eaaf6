"""Laws of the window until its first picture, of its texts, and of its keys."""

from __future__ import annotations

import threading
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from hairkit.errors import InputError
from hairkit.simulation.simulator import Surroundings
from hairkit.viewer.actions.actions import bindings, perform
from hairkit.viewer.draw.colouring import COLOURINGS, legend, point_values
from hairkit.viewer.session import Session
from hairkit.viewer.window import hud, splash
from hairkit.viewer.window.keyboard import CONTROL, SHIFT, key_name
from hairkit.viewer.window.splash import AbandonedError, WaitScreen, warm_up

glfw = pytest.importorskip("glfw")


class Screen:
    """Stands for glfw and its window: keeps titles, and what is asked of it."""

    KEY_ESCAPE, PRESS = glfw.KEY_ESCAPE, glfw.PRESS

    def __init__(self, at_each_look: Any = lambda screen: None) -> None:
        self.titles: list[str] = []
        self.closed = False
        self.on_key: Any = None
        self._at_each_look = at_each_look

    def set_key_callback(self, window: object, called: Any) -> None:
        """Keep the listener."""
        self.on_key = called

    def set_window_title(self, window: object, title: str) -> None:
        """Keep the title."""
        self.titles.append(title)

    def poll_events(self) -> None:
        """Let the user do something."""
        self._at_each_look(self)

    def window_should_close(self, window: object) -> bool:
        """Tell whether the user has closed it."""
        return self.closed


@pytest.fixture
def waiting(monkeypatch: pytest.MonkeyPatch) -> Any:
    """Make what waits on a screen that draws nothing."""
    monkeypatch.setattr(WaitScreen, "_show", lambda *_: None)
    return lambda screen: WaitScreen(screen, None)


def test_work_is_done_aside_and_its_result_comes_back(waiting: Any) -> None:
    """In another thread; what it raises is raised here."""
    wait = waiting(Screen())
    assert wait.run("counting", lambda: threading.current_thread()) is not threading.main_thread()
    with pytest.raises(InputError, match="no such file"):
        wait.run("opening", lambda: (_ for _ in ()).throw(InputError("no such file")))


@pytest.mark.parametrize("way", ["close", "escape", "interrupt"])
def test_a_user_who_leaves_is_not_kept_waiting(waiting: Any, way: str) -> None:
    """Neither Escape nor closing nor Ctrl-C waits for the end of the work."""

    def leave(screen: Screen) -> None:
        if way == "interrupt":
            raise KeyboardInterrupt
        if way == "escape":
            screen.on_key(None, screen.KEY_ESCAPE, 0, screen.PRESS, 0)
        screen.closed = way == "close"

    end = threading.Event()
    with pytest.raises(AbandonedError):
        waiting(Screen(leave)).run("compiling", lambda: end.wait(60))
    end.set()


def test_warming_up_leaves_the_hair_at_rest(session: Session) -> None:
    """Wind and a hand were felt once, so that nothing is compiled later; nothing of it is left."""
    simulator = session.simulation.simulator
    rest, felt = simulator.points.copy(), []
    advance = simulator.advance

    def listening(seconds: float, around: Surroundings) -> None:
        felt.append((bool(around.wind.any()), len(around.grabs)))
        advance(seconds, around)

    simulator.advance = listening  # type: ignore[method-assign]
    warm_up(session)
    assert felt == [(True, 0), (True, 1)]
    np.testing.assert_array_equal(simulator.points, rest)


def test_lines_break_where_the_window_ends() -> None:
    """No line is wider than asked for, and no word is lost."""
    text = "a long message of many words that does not fit into a window as narrow as this one"
    lines = hud.wrap_text(text, 200)
    assert len(lines) > 2
    assert " ".join(lines) == text
    assert all(hud._width(line, 1.0) <= 200 for line in lines)


def test_the_help_sheet_fits_a_window_of_the_usual_size() -> None:
    """All of it is inside the picture: nothing at its lower and right border."""
    image = np.zeros((720, 1280, 4), np.uint8)
    hud._write_sheet(image, hud.help_lines())
    assert not image[-12:, :, 3].any()
    assert not image[:, -12:, 3].any()


def test_colours_of_guides_have_a_legend(session: Session) -> None:
    """Every colouring but that of hair says what it shows; strands of two points are no trouble."""
    rows = session.body.guide_rest
    for by in COLOURINGS:
        assert bool(legend(by, rows, rows)) == (by != "hair")
        for some in (rows, rows[:, :2]):
            values = point_values(by, some, some, None) if by != "hair" else np.zeros(1)
            assert np.isfinite(values).all()


def test_confidence_is_not_shown_where_there_is_none(session: Session) -> None:
    """It is refused by name, and the key goes past it."""
    with pytest.raises(InputError, match="no confidence to show"):
        perform(session, "colours", {"by": "confidence"})
    seen = []
    for _ in range(2 * len(COLOURINGS)):
        perform(session, "colours")
        seen.append(session.shown.colours)
    assert set(seen) == set(COLOURINGS) - {"confidence"}


def test_shift_and_control_make_keys_of_their_own() -> None:
    """A capital letter is another key; plus stays plus."""
    assert key_name(glfw, glfw.KEY_S, 0) == "S"
    assert key_name(glfw, glfw.KEY_S, SHIFT) == "SHIFT_S"
    assert key_name(glfw, glfw.KEY_S, CONTROL) == "CTRL_S"
    assert key_name(glfw, glfw.KEY_EQUAL, SHIFT) == "EQUAL"
    assert {"S", "SHIFT_S", "CTRL_S"} <= set(bindings())


def test_the_waiting_window_says_how_long_it_waits(
    waiting: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The title counts seconds and is the plain one again at the end."""
    screen, clock = Screen(), iter(range(1000))
    monkeypatch.setattr(splash, "time", SimpleNamespace(monotonic=lambda: float(next(clock))))
    end = threading.Event()
    screen._at_each_look = lambda one: end.set() if len(one.titles) > 2 else None
    waiting(screen).run("compiling", lambda: end.wait(60))
    assert screen.titles[0].startswith("hairkit: compiling, ")
    assert screen.titles[-1] == "hairkit"
