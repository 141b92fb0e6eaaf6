"""The option panel, drawn by imgui-bundle; optional, since every control also has a key or action.

imgui-bundle bundles its own GLFW, and the module `glfw` uses that one if imgui-bundle is imported
first: import both through `load_windowing` only.
"""

from __future__ import annotations

import contextlib
import importlib
import textwrap
import typing
from collections.abc import Callable, Mapping
from typing import Any

from hairkit.errors import RenderError
from hairkit.options import OptionInfo, describe
from hairkit.types.edits import Brush
from hairkit.viewer.actions.actions import LOOKS
from hairkit.viewer.actions.presets import preset_names, presets_path
from hairkit.viewer.brushing import NAMES, Brushing
from hairkit.viewer.draw.backdrop import BACKDROPS
from hairkit.viewer.draw.colouring import COLOURINGS
from hairkit.viewer.layers import BILLBOARDS
from hairkit.viewer.preview import Preview
from hairkit.viewer.session import Session

WIDTH, NARROW = 340, 680
"""Pixels; in a window narrower than the second the panel is folded at first."""
LABELS = 116.0
"""Width of the names beside sliders, pixels."""
HINT = 48
"""Characters in a line of a tooltip."""
NAME_WIDTH = 0.4 * WIDTH
"""Width of the field for a preset's name, pixels; leaves room for the button beside it."""
HAIRS = (100, 50_000)
"""Range of the slider for the drawn strands; the action `hairs` goes further."""
LENSES = 60.0
"""Upper end of the slider for the lens, millimetres; the action `lens` goes further."""
EXPOSURES = (0.1, 3.0)
"""Range of the slider for the exposure; the action `exposure` goes further."""
WIND_RANGES = (
    ("speed", 0.0, 20.0, "%.1f m/s", "Wind speed."),
    (
        "azimuth",
        -180.0,
        180.0,
        "%.0f deg",
        "Where the wind comes from: 0 front, 90 the subject's left.",
    ),
    ("turbulence", 0.0, 2.0, "%.2f", "RMS gusts over the mean wind speed."),
)
"""Name, range, number format and tooltip of the sliders for the wind."""
NOD = 15.0
"""Amplitude of the nod and tilt buttons, degrees, as of their keys."""

Perform = Callable[[str, Mapping[str, object]], None]


def load_windowing() -> Any:
    """Return the module glfw; imports imgui-bundle before it if that is installed."""
    with contextlib.suppress(ImportError):
        importlib.import_module("imgui_bundle")
    try:
        return importlib.import_module("glfw")
    except ImportError as error:
        raise RenderError(f"no window: {error}; pip install glfw") from error


class Panel:
    """Sliders and buttons over the picture; does nothing without imgui-bundle."""

    missing: str
    """Why the panel is missing and what to install; empty if it is there."""

    def __init__(self, window: Any) -> None:
        self._imgui, self._backend, self.missing = _load(window)
        self.covered = 0
        """Pixels of the window's right edge that the panel covers."""
        self._shown = False
        self._size: tuple[int, int] | None = None
        self._preset = "preset"

    @property
    def wants_mouse(self) -> bool:
        """True while the mouse is over the panel."""
        return self._shown and bool(self._imgui.get_io().want_capture_mouse)

    @property
    def wants_keys(self) -> bool:
        """True while text is entered."""
        return self._shown and bool(self._imgui.get_io().want_text_input)

    def listen(self) -> None:
        """Receive character events, which the window does not use."""
        if self._backend is not None:
            import glfw

            glfw.set_char_callback(self._backend.window, self._backend.char_callback)

    def on_key(self, key: int, event: int, mods: int) -> None:
        """Forward a key event."""
        if self._backend is not None:
            self._backend.keyboard_callback(self._backend.window, key, 0, event, mods)

    def on_button(self, button: int, event: int) -> None:
        """Forward a mouse button event."""
        if self._backend is not None:
            self._backend.mouse_button_callback(self._backend.window, button, event, 0)

    def on_move(self, x: float, y: float) -> None:
        """Forward the mouse position."""
        if self._backend is not None:
            self._backend.mouse_callback(self._backend.window, x, y)

    def on_scroll(self, right: float, up: float) -> None:
        """Forward a wheel event."""
        if self._backend is not None:
            self._backend.scroll_callback(self._backend.window, right, up)

    def draw(self, session: Session, preview: Preview, perform: Perform) -> None:
        """Draw the panel and perform the actions of its controls."""
        imgui = self._imgui
        self._shown = imgui is not None and session.shown.panel and not session.shown.help
        if not self._shown:
            self.covered = 0
            return
        self._backend.process_inputs()
        imgui.new_frame()
        when = imgui.Cond_.first_use_ever if session.size == self._size else imgui.Cond_.always
        self._size = session.size
        width = WIDTH if session.size[0] >= NARROW else WIDTH // 2
        imgui.set_next_window_pos((session.size[0] - width - 8, 8), when)
        imgui.set_next_window_size((width, session.size[1] - 16), when)
        imgui.set_next_window_collapsed(session.size[0] < NARROW, when)
        unfolded = bool(imgui.begin("hairkit")[0])
        left = int(imgui.get_window_pos().x)
        beside = unfolded and left > session.size[0] // 2  # not if it was moved elsewhere
        self.covered = max(session.size[0] - left, 0) if beside else 0
        imgui.push_item_width(-LABELS)
        if imgui.collapsing_header("View", imgui.TreeNodeFlags_.default_open):
            _draw_view(imgui, session, perform)
        if imgui.collapsing_header("Wind and head", imgui.TreeNodeFlags_.default_open):
            _draw_wind_and_head(imgui, session, perform)
        if imgui.collapsing_header("Brush"):
            _draw_brush(imgui, session.brushing, perform)
        title = f"Simulator {session.simulation.plugin}"
        if imgui.collapsing_header(title, imgui.TreeNodeFlags_.default_open):
            for info in session.simulation.infos:
                value = session.simulation.value(info.name)
                _draw_option(imgui, info, value, "option", perform)
            self._preset = _draw_presets(imgui, session, self._preset, perform)
        imgui.pop_item_width()
        imgui.end()
        imgui.render()
        self._backend.render(imgui.get_draw_data())


def _load(window: Any) -> tuple[Any, Any, str]:
    try:
        imgui = importlib.import_module("imgui_bundle").imgui
        backends = importlib.import_module("imgui_bundle.python_backends.glfw_backend")
    except ImportError as error:
        return None, None, f"no option panel ({error}); pip install 'hairkit[viewer]'"
    imgui.create_context()
    imgui.get_io().set_ini_filename("")  # leave no file behind
    imgui.get_io().config_windows_move_from_title_bar_only = (
        True  # else a drag beside a slider moves the panel
    )
    return imgui, backends.GlfwRenderer(window, attach_callbacks=False), ""


def _draw_view(imgui: Any, session: Session, perform: Perform) -> None:
    looks = [(name, "look", {"name": name}) for name in LOOKS]
    _buttons(imgui, perform, *looks, ("all", "frame", {}))
    shown = session.shown
    _pick(imgui, perform, "colours", "by", [*COLOURINGS], shown.colours)
    _set(perform, "guides", "only", imgui.checkbox("guides only", shown.guides_only))
    _set(perform, "hairs", "count", imgui.slider_int("hairs", shown.hairs, *HAIRS))
    _hint(imgui, "Strands drawn, including guides; lowered if frames take too long.")
    slider = imgui.slider_float
    _set(perform, "exposure", "value", slider("exposure", shown.exposure, *EXPOSURES))
    _draw_scene(imgui, session, perform)
    if shown.layers & set(BILLBOARDS):
        _set(perform, "opacity", "value", slider("opacity", shown.opacity, 0.0, 1.0))
        _hint(imgui, "Opacity of the photos.")
    for name in session.layers.available:
        _set(perform, "layer", "on", imgui.checkbox(name, name in shown.layers), name=name)


def _draw_scene(imgui: Any, session: Session, perform: Perform) -> None:
    shown, slider = session.shown, imgui.slider_float
    _set(perform, "light", "degrees", slider("light", shown.light, -180.0, 180.0, "%.0f deg"))
    _hint(imgui, "Turns the lights round the head.")
    _pick(imgui, perform, "backdrop", "name", [*BACKDROPS], shown.backdrop)
    opening = slider("lens", 1e3 * shown.aperture, 0.0, LENSES, "%.0f mm")
    _set(perform, "lens", "aperture", opening)
    _hint(imgui, "Diameter of the lens: depth of field while nothing moves.")
    if "photos" in session.layers.available:
        found = imgui.checkbox("photo beside the hair", shown.wipe is not None)
        _set(perform, "wipe", "on", found)


def _draw_presets(imgui: Any, session: Session, name: str, perform: Perform) -> str:
    """Draw the controls of presets; return the name in the text field."""
    imgui.separator()
    imgui.set_next_item_width(NAME_WIDTH)
    _, name = imgui.input_text("##name", name)
    imgui.same_line()
    if imgui.button("save preset") and name.strip():
        perform("preset_save", {"name": name.strip()})
    for found in preset_names(presets_path(session.opened.path)):
        if imgui.button(f"load {found}"):
            perform("preset_load", {"name": found})
    if imgui.button("defaults"):
        perform("option_defaults", {})
    return str(name)


def _draw_wind_and_head(imgui: Any, session: Session, perform: Perform) -> None:
    air = session.wind
    _set(perform, "wind", "on", imgui.checkbox("wind", air.blowing))
    for name, low, high, shape, hint in WIND_RANGES:
        found = imgui.slider_float(name, float(getattr(air, name)), low, high, shape)
        _set(perform, "wind", name, found, on=air.blowing)
        _hint(imgui, hint)
    _buttons(
        imgui,
        perform,
        ("shake", "shake", {}),
        ("nod", "shake", {"degrees": NOD, "axis": "pitch"}),
        ("tilt", "shake", {"degrees": NOD, "axis": "roll"}),
        ("reset", "reset", {}),
        ("resume" if session.paused else "pause", "pause", {}),
    )


def _draw_brush(imgui: Any, now: Brushing | None, perform: Perform) -> None:
    taken = NAMES[0] if now is None else now.setting.brush
    _pick(imgui, perform, "brush", "name", [*NAMES], taken)
    if now is not None:
        for info in describe(Brush)[1:]:
            _draw_option(imgui, info, getattr(now.setting, info.name), "brush_option", perform)
        _buttons(imgui, perform, ("undo", "undo", {}), ("redo", "undo", {"by": 1}))


def _draw_option(imgui: Any, info: OptionInfo, value: Any, action: str, perform: Perform) -> None:
    """Draw the slider, check box or list of one option, which an action sets."""
    kind = typing.get_args(info.type) or (info.type,)
    shape = f"%.4g {info.unit}" if info.unit and "%" not in info.unit else "%.4g"
    changed = False
    if info.choices:
        names = [str(choice) for choice in info.choices]
        changed, place = imgui.combo(info.name, info.choices.index(value), names)
        value = info.choices[place]
    elif bool in kind:
        changed, value = imgui.checkbox(info.name, bool(value))
    elif int in kind and value is not None:
        first, last = int(info.low or 0), min(int(info.high or 1000), 10_000)
        changed, value = imgui.slider_int(info.name, int(value), first, last)
    elif float in kind and value is not None:
        low = info.low if info.low is not None else 0.0
        high = info.high if info.high is not None else max(10 * float(value), 1.0)
        flags = imgui.SliderFlags_.logarithmic if high > 1000 * max(low, 1e-9) > 0 else 0
        changed, value = imgui.slider_float(info.name, float(value), low, high, shape, flags)
        value = float(f"{value:.6g}")  # sliders are float32
    elif str(value).startswith("#"):
        levels = [level / 255 for level in bytes.fromhex(value[1:])]
        changed, levels = imgui.color_edit3(info.name, levels)
        value = "#" + bytes(round(255 * min(max(level, 0), 1)) for level in levels).hex()
    else:
        imgui.text(f"{info.name}: {value}")
    _hint(imgui, info.doc)
    if changed:
        perform(action, {"name": info.name, "value": value})


def _set(perform: Perform, action: str, key: str, found: Any, **more: object) -> None:
    """Perform an action with the value of a control that was changed."""
    changed, value = found
    if changed:
        perform(action, {**more, key: value})


def _pick(imgui: Any, perform: Perform, action: str, key: str, names: list[str], now: str) -> None:
    """Draw the list of an action's names."""
    changed, place = imgui.combo(action, names.index(now), names)
    _set(perform, action, key, (changed, names[place]))


def _buttons(imgui: Any, perform: Perform, *row: tuple[str, str, Mapping[str, object]]) -> None:
    """Draw a row of buttons: label, action and its values."""
    for number, (label, action, values) in enumerate(row):
        if number:
            imgui.same_line()
        if imgui.button(label):
            perform(action, values)


def _hint(imgui: Any, text: str) -> None:
    """Show a tooltip for the last item while the mouse is over it."""
    if imgui.is_item_hovered():
        imgui.set_tooltip("\n".join(textwrap.wrap(text, HINT)))
