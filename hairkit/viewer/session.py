"""The state of the viewer: a simulated groom, the view of it, and display settings.

A session does not use OpenGL or windows; `actions` change it, `preview` draws it.
"""

from __future__ import annotations

import time
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from hairkit.arrays import Float32Array, Float64Array
from hairkit.errors import InputError
from hairkit.grooming.brushed_hair import Hair
from hairkit.grooming.brushes import BRUSHES
from hairkit.io.capture_reader import EDITS
from hairkit.manager import Manager
from hairkit.pipeline.open_groom import groom_path, load_groom
from hairkit.simulation.simulator import Measures, Surroundings
from hairkit.stages import UNEDITED
from hairkit.types.camera import Camera
from hairkit.types.edits import Brush
from hairkit.types.groom import Groom
from hairkit.viewer.brushing import NAMES, Brushing
from hairkit.viewer.draw.hair_data import HairBody, choose_shares, split_guides
from hairkit.viewer.head_motion import HeadMotion
from hairkit.viewer.layers import Layers
from hairkit.viewer.orbit_camera import OrbitView
from hairkit.viewer.picking import GrabbedLock
from hairkit.viewer.recording import Recorder
from hairkit.viewer.simulation import TunableSimulator

STEP = 1 / 60
"""Time step of the simulator in scripts and films, seconds."""
TICK, MOST_TICKS = 1 / 120, 4
"""In a window a picture is one step of a few ticks: seconds, and how many of them at most."""
HAIRS = 10_000
"""Strands drawn by default."""
MAX_WIND = 60.0
"""Highest wind speed, m/s."""
MAX_TURBULENCE = 5.0
"""Highest RMS speed of gusts over the mean speed."""
FLOOR_GAP = 0.03
"""Distance of the floor below groom and head, metres."""


@dataclass
class Wind:
    """Settings of the wind."""

    blowing: bool = False
    speed: float = 4.0
    """Metres per second."""
    azimuth: float = 90.0
    """Degrees where it comes from: 0 front, 90 the subject's left."""
    turbulence: float = 0.4
    """RMS speed of gusts over the mean speed."""

    def velocity(self) -> Float64Array:
        """Return the mean velocity (3,), world, metres per second."""
        if not self.blowing:
            return np.zeros(3)
        angle = np.radians(self.azimuth)
        return -self.speed * np.array([np.sin(angle), 0.0, np.cos(angle)])


@dataclass
class Shown:
    """Display settings."""

    hairs: int = HAIRS
    guides_only: bool = False
    colours: str = "hair"
    layers: set[str] = field(default_factory=lambda: {"head", "torso"})
    opacity: float = 0.8
    """Opacity of the photos."""
    exposure: float = 0.75
    light: float = 0.0
    """Degrees by which the lights are turned round the head, seen from above to the right."""
    backdrop: str = "grey"
    aperture: float = 0.0
    """Diameter of the lens of still pictures, metres; 0 is sharp everywhere."""
    wipe: float | None = None
    """Share of the picture's width that shows the photo; None: no comparison."""
    help: bool = False
    panel: bool = True
    numbers: bool = True
    option: int = 0
    """Index of the simulator option that the keyboard changes."""
    through: str | None = None
    """Name of the photo whose camera is used; None: the orbit camera."""


class Session:
    """One groom in the viewer."""

    def __init__(
        self,
        manager: Manager,
        path: Path,
        *,
        size: tuple[int, int] = (1280, 720),
        simulator: str | None = None,
        hairs: int = HAIRS,
        capture: str | None = None,
        seed: int = 0,
        reading: Mapping[str, object] | None = None,
        guides_first: bool = False,
    ) -> None:
        """Open `path`; `reading` are options of the plugin that imports it.

        If `guides_first`, there is no hair between the guides until `fill_in`.
        """
        self.manager = manager
        self.size = size
        self._simulator = simulator
        self._capture = capture
        self._first, self._reading = path, reading or {}
        self.seed = seed
        self.wind, self.shown = Wind(), Shown(hairs=hairs)
        self.paused = False
        self.grabbed_lock: GrabbedLock | None = None
        self.picked: int | None = None
        self.brushing: Brushing | None = None
        """The brush that is taken, while which nothing moves."""
        self.message = ""
        self.pending = 0.0
        """Seconds that a script still has to simulate."""
        self.screenshots: list[Path] = []
        """Files to write the next picture to."""
        self.recorder: Recorder | None = None
        self.covered = 0
        """Pixels at the right edge of the picture that the panel covers."""
        self.max_seconds: float | None = None
        """Time that the simulation of a picture may take, seconds, in one step: slow machines show
        slow motion. None: as many steps as the picture needs, as for scripts."""
        self.steps = 0
        """Simulation steps since the groom was opened."""
        self._time_debt = 0.0
        self._ticks = MOST_TICKS
        """Longest step of a picture at present, ticks."""
        self.overwrite = False
        """True overwrites existing screenshots and recordings."""
        self.finished = False
        self._unfilled = guides_first
        self.open(path)

    def open(self, path: Path) -> None:
        """Open another groom and fit it into the picture."""
        self._take(open_path(path, self.manager, self._reading_of(path)))
        self.frame()

    def reload(self) -> None:
        """Reload the file; keep view, wind and options."""
        path = self.opened.path
        self._retake(open_path(path, self.manager, self._reading_of(path)))

    def _retake(self, opened: Opened) -> None:
        values = dict(self.simulation.values)
        self._take(opened)
        if values:
            self.simulation.replace(values)

    def take_brush(self, name: str) -> None:
        """Take a brush over the groom at rest, with the strokes that are kept; `none`: put away."""
        now, opened = self.brushing, self.opened
        if name == NAMES[0]:
            if now is not None:
                self._retake(replace(opened, groom=now.groom))
        elif now is not None:
            now.setting = replace(now.setting, brush=name, amount=BRUSHES[name].amount)
        else:
            last, photos = self.layers.last, Path(self.layers.capture or "")
            before = last.latest(UNEDITED) if last.has(UNEDITED) else opened.groom
            path = (
                photos if self.layers.capture and photos.is_dir() else opened.path.parent
            ) / EDITS
            first = Brush(name, amount=BRUSHES[name].amount)
            self.brushing = Brushing(before, path, first, Hair.of(self.drawn))
            self.show_strokes()

    def show_strokes(self) -> None:
        """Show the groom after the strokes, at rest, under the brush."""
        if (now := self.brushing) is not None:
            self._retake(replace(self.opened, groom=now.groom))
            self.brushing, now.hair = now, Hair.of(self.drawn)

    def _reading_of(self, path: Path) -> Mapping[str, object]:
        """Return the import options of a file; known for the first one only."""
        return self._reading if path == self._first else {}

    def frame(self) -> None:
        """Fit groom and head into the picture, from the front and a little to the side."""
        groom = self.opened.groom
        points = np.concatenate([groom.strands.points, groom.head.vertices])
        self.view = OrbitView.around(points, self._free(self.size[0]) / self.size[1])
        self.floor = float(points[:, 1].min()) - FLOOR_GAP
        self.shown.through = None

    @property
    def world_from_head(self) -> Float64Array:
        """(4, 4) pose of the head."""
        return self.motion.matrix()

    def camera(self, size: tuple[int, int] | None = None) -> Camera:
        """Return the camera of the picture, world frame."""
        width, height = size or self.size
        through, free = self.shown.through, self._free(width)
        if through is not None and through in self.layers.cameras:
            return replace(self.layers.cameras[through].fitted(free, height), width=width)
        return self.view.camera(width, height, free)

    def _free(self, width: int) -> int:
        """Return how many columns of a picture of that width the panel leaves free."""
        return max(width - round(self.covered * width / self.size[0]), 1)

    def advance(self, seconds: float) -> None:
        """Simulate `seconds`, unless paused or under a brush."""
        if self.paused or self.brushing is not None:
            return
        self._time_debt += seconds
        before = self.steps
        if self.max_seconds is not None:
            self._step_once(self.max_seconds)
        while self.max_seconds is None and self._time_debt >= STEP * (1 - 1e-6):
            self._time_debt -= STEP
            self._step()
        if self.steps > before:
            self.check_stability()

    def step(self) -> None:
        """Simulate one step."""
        self._step()
        self.check_stability()

    def _step_once(self, most: float) -> None:
        """Simulate the time of a picture in one step, a shorter one if the last took over `most`.

        Steps are whole ticks, so that simulators can keep what they prepare for a length.
        """
        ticks = min(int(self._time_debt / TICK + 1e-6), self._ticks)
        if ticks == 0:
            return
        began = time.perf_counter()
        self._step(ticks * TICK)
        slow = time.perf_counter() - began > most
        self._ticks = max(ticks // 2, 1) if slow else min(2 * self._ticks, MOST_TICKS)
        self._time_debt = min(self._time_debt - ticks * TICK, TICK)

    def _step(self, seconds: float = STEP) -> None:
        self.motion.advance(seconds)
        surroundings = Surroundings(
            head_from_rest=self.world_from_head,
            wind=self.wind.velocity(),
            turbulence=self.wind.turbulence,
            grabs=() if self.grabbed_lock is None else self.grabbed_lock.grabs(),
        )
        self.simulation.simulator.advance(seconds, surroundings)
        self.steps += 1

    def check_stability(self) -> None:
        """Reset head and hair if a point is not finite."""
        if not np.isfinite(self.simulation.simulator.points).all():
            self.reset()
            self.message = "the simulation diverged and was reset to rest; use more substeps"

    def reset(self) -> None:
        """Reset head and hair to rest."""
        self.motion.stop()
        self.grabbed_lock = None
        self._time_debt = 0.0
        self.simulation.simulator.reset(np.eye(4))

    def guide_rows(self) -> Float32Array:
        """Return the present guides (G, m, 3), head frame, metres."""
        if self.brushing and len(shown := self.brushing.rows) == len(self.body.guides):
            return shown.astype(np.float32)
        matrix = self.world_from_head.astype(np.float32)
        rows = self.simulation.points.reshape(-1, len(self._shares), 3)
        return np.asarray((rows - matrix[:3, 3]) @ matrix[:3, :3], np.float32)

    def measures(self) -> Measures:
        """Return the simulator's read-outs."""
        return self.simulation.simulator.measure()

    def set_hairs(self, count: int) -> None:
        """Set the number of strands drawn, including guides."""
        self.shown.hairs = count
        if count > len(self.body) and self._own is None:
            self._make_body()

    def _take(self, opened: Opened) -> None:
        self._guides, self._own = split_guides(opened.groom)
        self.opened = opened
        self._shares = choose_shares(self._guides.strands)
        strands = self._guides.strands.resampled_at(self._shares)  # no more than is drawn
        self.drawn = replace(self._guides, strands=strands)
        self.simulation = TunableSimulator(self.manager, self.drawn, self._simulator)
        self.motion = HeadMotion(opened.groom.head.joints[1].astype(np.float64))
        self.layers = Layers(self.manager, opened.results, self._capture)
        self.grabbed_lock = self.picked = self.brushing = None
        self.steps, self._time_debt = 0, 0.0
        self._make_body()

    def fill_in(self) -> None:
        """Make the hair between the guides."""
        self._unfilled = False
        self._make_body()

    def _make_body(self) -> None:
        hairs = max(0 if self._unfilled else self.shown.hairs, len(self._guides.strands))
        self.body = HairBody.of(self._guides, hairs, self._own, self.seed, self._shares)


@dataclass(frozen=True, eq=False)
class Opened:
    """A groom and where it came from."""

    groom: Groom
    path: Path
    results: Path | None
    """The folder that `hairkit reconstruct` wrote, if the groom is in one."""


def open_path(path: Path, manager: Manager, settings: Mapping[str, object] | None = None) -> Opened:
    """Open a groom.npz, a folder that holds one, or a file that an import plugin reads.

    `settings` are options of the import plugin.

    Raises
    ------
    InputError
        The file does not exist, no plugin reads it, or it holds no strands.
    """
    path = groom_path(path)
    groom = load_groom(manager, path, settings)
    if not len(groom.strands):
        raise InputError(f"{path}: holds no strands, expected at least one; open another file")
    results = path.parent if (path.parent / "work").is_dir() else None
    return Opened(groom, path, results)
