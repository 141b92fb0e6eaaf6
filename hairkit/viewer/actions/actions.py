"""The actions of the viewer, with their keys: mouse, panel and scripts use them too.

>>> sorted(ACTIONS)[:3]
['backdrop', 'brush', 'brush_option']
"""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np

from hairkit.errors import InputError
from hairkit.options import OptionInfo, unknown_name
from hairkit.stages import renamed
from hairkit.viewer.actions import brush, scene  # register their actions
from hairkit.viewer.actions.presets import presets_path, read_preset, write_preset
from hairkit.viewer.actions.registry import ACTIONS, action, bindings, check_values, perform
from hairkit.viewer.draw.colouring import COLOURINGS
from hairkit.viewer.draw.hair_data import MAX_HAIRS
from hairkit.viewer.head_motion import MAX_TURN, Shake
from hairkit.viewer.picking import grab_lock, nearest_hair, surface_point
from hairkit.viewer.recording import Recorder, free_name
from hairkit.viewer.session import MAX_TURBULENCE, MAX_WIND, Session

__all__ = ["ACTIONS", "LOOKS", "bindings", "brush", "check_values", "perform", "scene"]
LOOKS = {"front": (0.0, 0.0), "side": (90.0, 0.0), "back": (180.0, 0.0), "top": (0.0, 89.0)}
"""Named views: azimuth and elevation, degrees."""
MAX_SECONDS = 3600.0
"""Longest `run` of a script."""
EXPOSURES = 0.05, 8.0


@action()
def orbit(session: Session, right: float = 0.0, up: float = 0.0) -> None:
    """Orbit the camera, by degrees to its right and up."""
    session.shown.through = None
    session.view = session.view.orbited(right, up)


@action()
def pan(session: Session, right: float = 0.0, down: float = 0.0) -> None:
    """Pan the picture, by fractions of its height."""
    session.shown.through = None
    session.view = session.view.panned(right, down)


@action(PAGE_UP={"factor": 1.15}, PAGE_DOWN={"factor": 1 / 1.15})
def zoom(session: Session, factor: float) -> None:
    """Zoom in or out."""
    if not factor > 0:
        raise InputError(f"zoom: factor is {factor}, expected a number above 0")
    session.shown.through = None
    session.view = session.view.zoomed(factor)


@action()
def recentre(session: Session, x: float, y: float) -> None:
    """Orbit around the point under a pixel."""
    camera = session.camera()
    simulator = session.simulation.simulator
    picked = nearest_hair(camera, simulator.points, simulator.strands.offsets, (x, y))
    point = (
        surface_point(camera, session.opened.groom.head, (x, y)) if picked is None else picked[1]
    )
    if point is not None:
        session.shown.through = None
        session.view = session.view.centred(point)


@action(N1={"name": "front"}, N3={"name": "side"}, N7={"name": "top"}, N9={"name": "back"})
def look(session: Session, name: str) -> None:
    """Look from the front, side, top or back."""
    if name not in LOOKS:
        raise InputError(unknown_name("view", name, LOOKS))
    azimuth, elevation = LOOKS[name]
    session.shown.through = None
    session.view = dataclasses.replace(session.view, azimuth=azimuth, elevation=elevation)


@action(HOME={})
def frame(session: Session) -> None:
    """Fit all of the hair into the picture."""
    session.frame()


@action(N={"step": 1}, B={"step": -1})
def through(session: Session, name: str = "", step: int = 0) -> None:
    """Look through the camera of the next or previous photo, or by name."""
    names = list(session.layers.cameras)
    if not names:
        raise InputError("no cameras of photos; open a folder that hairkit reconstruct wrote")
    if name and name not in names:
        raise InputError(unknown_name("view", name, names))
    if step:
        now = session.shown.through
        name = names[(names.index(now) + step) % len(names)] if now in names else names[0]
    session.shown.through = name or None


@action(SPACE={})
def pause(session: Session, on: bool | None = None) -> None:
    """Pause or resume the simulation."""
    session.paused = not session.paused if on is None else on


@action(PERIOD={})
def step(session: Session) -> None:
    """Pause, and simulate one step of 1/60 s."""
    session.paused = True
    session.step()


@action(R={})
def reset(session: Session) -> None:
    """Reset head and hair to rest."""
    session.reset()


@action()
def run(session: Session, seconds: float) -> None:
    """Simulate for some seconds; for scripts."""
    if not 0 <= seconds <= MAX_SECONDS:
        raise InputError(f"run: seconds is {seconds}, expected 0 to {MAX_SECONDS:g}")
    session.pending += seconds


@action(W={})
def wind(
    session: Session,
    on: bool | None = None,
    speed: float | None = None,
    azimuth: float | None = None,
    turbulence: float | None = None,
) -> None:
    """Turn the wind on or off."""
    air = session.wind
    air.blowing = not air.blowing if on is None else on
    air.speed = air.speed if speed is None else float(np.clip(speed, 0, MAX_WIND))
    air.azimuth = air.azimuth if azimuth is None else azimuth
    air.turbulence = (
        air.turbulence if turbulence is None else float(np.clip(turbulence, 0, MAX_TURBULENCE))
    )


@action(
    LEFT={"degrees": -15.0},
    RIGHT={"degrees": 15.0},
    UP={"faster": 1.0},
    DOWN={"faster": -1.0},
    U={"gustier": 0.1},
    SHIFT_U={"gustier": -0.1},
)
def wind_change(
    session: Session, degrees: float = 0.0, faster: float = 0.0, gustier: float = 0.0
) -> None:
    """Change the wind's direction (degrees), speed (m/s) or turbulence."""
    air = session.wind
    azimuth = (air.azimuth + degrees + 180.0) % 360.0 - 180.0
    gusts = round(air.turbulence + gustier, 6)
    wind(session, on=True, speed=air.speed + faster, azimuth=azimuth, turbulence=gusts)


@action(S={}, SHIFT_S={"axis": "pitch", "degrees": 15.0}, X={"axis": "roll", "degrees": 15.0})
def shake(
    session: Session,
    axis: str = "yaw",
    degrees: float = 20.0,
    hertz: float = 1.5,
    seconds: float = 2.0,
) -> None:
    """Shake the head about yaw, pitch or roll."""
    if axis not in session.motion.turn:
        raise InputError(unknown_name("axis", axis, session.motion.turn))
    session.motion.shakes.append(Shake(axis, float(np.radians(degrees)), hertz, seconds))


@action(
    J={"yaw": -20.0}, L={"yaw": 20.0}, I={"pitch": -10.0}, K={"pitch": 10.0}, Y={"straight": True}
)
def turn(
    session: Session,
    yaw: float = 0.0,
    pitch: float = 0.0,
    roll: float = 0.0,
    straight: bool = False,
) -> None:
    """Turn the head right, left, up or down, or straighten it."""
    for axis, degrees in (("yaw", yaw), ("pitch", pitch), ("roll", roll)):
        now = 0.0 if straight else session.motion.turn[axis]
        session.motion.turn[axis] = float(np.clip(now + np.radians(degrees), -MAX_TURN, MAX_TURN))


@action()
def grab(session: Session, x: float, y: float) -> None:
    """Grab the lock of hair under a pixel."""
    simulator = session.simulation.simulator
    offsets = simulator.strands.offsets
    session.grabbed_lock = grab_lock(session.camera(), simulator.points, offsets, (x, y))
    if session.grabbed_lock is None:
        session.message = "no hair under the mouse"


@action()
def drag(session: Session, x: float, y: float) -> None:
    """Drag the grabbed lock to a pixel."""
    if session.grabbed_lock is not None:
        session.grabbed_lock = session.grabbed_lock.moved(session.camera(), (x, y))


@action()
def release(session: Session) -> None:
    """Release the grabbed lock."""
    session.grabbed_lock = None


@action()
def pick(session: Session, x: float, y: float) -> None:
    """Show the length and stretch of the guide under a pixel; none beside hair."""
    simulator, strands = session.simulation.simulator, session.simulation.simulator.strands
    picked = nearest_hair(session.camera(), simulator.points, strands.offsets, (x, y))
    session.picked = None if picked is None else int(strands.strand_of_point[picked[0]])


@action(LEFT_BRACKET={"times": 0.8}, RIGHT_BRACKET={"times": 1.25})
def hairs(session: Session, count: int = 0, times: float = 1.0) -> None:
    """Draw fewer or more strands."""
    wanted = count or round(session.shown.hairs * times)
    session.set_hairs(int(np.clip(wanted, len(session.body.guides), MAX_HAIRS)))
    session.message = f"{session.shown.hairs} hairs"


@action(G={})
def guides(session: Session, only: bool | None = None) -> None:
    """Show only the guides."""
    session.shown.guides_only = not session.shown.guides_only if only is None else only


@action(D={})
def colours(session: Session, by: str = "") -> None:
    """Colour by hair, direction, length, stretch, curvature, group or confidence."""
    if by and by not in COLOURINGS:
        raise InputError(unknown_name("colouring", by, COLOURINGS))
    known = COLOURINGS if session.layers.has_confidence else COLOURINGS[:-1]
    if by and by not in known:
        raise InputError("no confidence to show; open a folder that hairkit reconstruct wrote")
    now = known.index(session.shown.colours) if session.shown.colours in known else -1
    session.shown.colours = by or known[(now + 1) % len(known)]
    session.message = f"coloured by {session.shown.colours}"


@action(
    F2={"name": "photos"},
    F3={"name": "masks"},
    F4={"name": "orientation"},
    F6={"name": "cameras"},
    F7={"name": "hull"},
    F8={"name": "field"},
    F9={"name": "head"},
    F10={"name": "torso"},
)
def layer(session: Session, name: str, on: bool | None = None) -> None:
    """Show or hide photos, masks, orientation, cameras, hull, field, head, torso."""
    session.layers.check(name)
    layers = session.shown.layers
    shown = name not in layers if on is None else on
    layers.add(name) if shown else layers.discard(name)


@action(E={"times": 1.15}, SHIFT_E={"times": 1 / 1.15})
def exposure(session: Session, value: float | None = None, times: float = 1.0) -> None:
    """Raise or lower the exposure."""
    wanted = times * (session.shown.exposure if value is None else value)
    session.shown.exposure = float(np.clip(wanted, *EXPOSURES))


@action(O={"more": 0.1}, SHIFT_O={"more": -0.1})
def opacity(session: Session, value: float | None = None, more: float = 0.0) -> None:
    """Raise or lower the opacity of the photos, 0 to 1."""
    wanted = more + (session.shown.opacity if value is None else value)
    session.shown.opacity = float(np.clip(wanted, 0.0, 1.0))


@action()
def option(session: Session, name: str, value: object) -> None:
    """Set an option of the simulator."""
    session.simulation.set(name, value)


@action(TAB={"by": 1}, SHIFT_TAB={"by": -1})
def option_next(session: Session, by: int = 1) -> None:
    """Select the option that + and - change."""
    session.shown.option += by
    _show_option(session)


@action(EQUAL={"steps": 1}, MINUS={"steps": -1}, KP_ADD={"steps": 1}, KP_SUBTRACT={"steps": -1})
def option_change(session: Session, steps: int = 1) -> None:
    """Change the selected option by steps."""
    name = _selected_option(session).name
    session.simulation.set(name, session.simulation.step_option(name, steps))
    _show_option(session)


@action(CTRL_S={})
def preset_save(session: Session, name: str = "preset") -> None:
    """Save the simulator's options under a name, beside the groom."""
    path = presets_path(session.opened.path)
    values = {k: v for k, v in session.simulation.values.items() if v is not None}
    write_preset(path, name, {"simulator": session.simulation.plugin, "options": values})
    session.message = f"saved to {path}"


@action(CTRL_L={})
def preset_load(session: Session, name: str = "preset") -> None:
    """Load the options saved under a name."""
    preset = read_preset(presets_path(session.opened.path), name)
    own = session.simulation.plugin
    plugin = preset.get("simulator", own)
    if plugin != own:
        advice = f"run hairkit view with --simulator {plugin}{renamed(plugin)}"
        raise InputError(f"preset {name!r} is for the simulator {plugin!r}, not {own!r}; {advice}")
    session.simulation.replace(dict(preset.get("options", {})))
    session.message = f"loaded preset {name}"


@action(CTRL_D={})
def option_defaults(session: Session) -> None:
    """Reset all options of the simulator to their defaults."""
    session.simulation.replace({})
    session.message = f"defaults of {session.simulation.plugin}"


@action(P={})
def screenshot(session: Session, file: str = "hairkit.png") -> None:
    """Save the picture to hairkit.png, or hairkit_1.png if that exists."""
    session.screenshots.append(Path(file))


@action(V={})
def record(session: Session, on: bool | None = None, file: str = "hairkit.mp4") -> None:
    """Start or stop recording to an .mp4 file or a folder of PNG files."""
    wanted = session.recorder is None if on is None else on
    if session.recorder is not None:
        session.recorder.close()
        session.message = f"wrote {session.recorder.count} frames to {session.recorder.path}"
        session.recorder = None
    if wanted:
        path = Path(file)
        session.recorder = Recorder(path if session.overwrite else free_name(path))


@action(H={})
def help_sheet(session: Session, on: bool | None = None) -> None:
    """Show or hide the keys."""
    session.shown.help = not session.shown.help if on is None else on


@action(F1={})
def panel(session: Session, on: bool | None = None) -> None:
    """Show or hide the option panel."""
    session.shown.panel = not session.shown.panel if on is None else on


@action(T={})
def numbers(session: Session, on: bool | None = None) -> None:
    """Show or hide the read-outs."""
    session.shown.numbers = not session.shown.numbers if on is None else on


@action()
def open_file(session: Session, file: str) -> None:
    """Open another groom; a file dropped on the window does the same."""
    session.open(Path(file))


@action(F5={})
def reload(session: Session) -> None:
    """Reload the groom from its file."""
    session.reload()


@action(ESCAPE={})
def leave(session: Session) -> None:
    """Close the viewer."""
    session.finished = True


def _show_option(session: Session) -> None:
    info = _selected_option(session)
    session.message = f"{info.name} = {session.simulation.value(info.name)}   {info.doc}"


def _selected_option(session: Session) -> OptionInfo:
    infos = session.simulation.infos
    if not infos:
        raise InputError(f"the simulator {session.simulation.plugin!r} has no options to change")
    return infos[session.shown.option % len(infos)]
