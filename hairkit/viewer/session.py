"""What the user sees and changes: a groom in motion, the view of it, and what is shown with it.

A session knows nothing of OpenGL or windows; `actions` change it, `preview` draws it.
"""

from __future__ import annotations

import time
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from hairkit.arrays import Float32Array, Float64Array
from hairkit.errors import InputError
from hairkit.manager import Manager
from hairkit.simulation.simulator import Measures, Surroundings
from hairkit.types.camera import Camera
from hairkit.viewer.draw.hair_data import GuideSampler, HairBody, split_guides
from hairkit.viewer.head_adjustment import Adjustment, Rerun
from hairkit.viewer.head_motion import HeadMotion
from hairkit.viewer.layers import Layers
from hairkit.viewer.opening import Opened, open_path
from hairkit.viewer.orbit_camera import OrbitView
from hairkit.viewer.picking import Hold
from hairkit.viewer.recording import Recorder
from hairkit.viewer.simulation import Tuned

STEP = 1 / 60
"""Seconds of one step of the simulator as the session asks for it."""
HAIRS = 10_000


@dataclass
class Wind:
    """The air around the head."""

    blowing: bool = False
    speed: float = 4.0
    """Metres per second."""
    azimuth: float = 90.0
    """Degrees, where it comes from: 0 in front, 90 from the subject's left."""
    turbulence: float = 0.4

    def velocity(self) -> Float64Array:
        """Return (3,) metres per second, world."""
        if not self.blowing:
            return np.zeros(3)
        angle = np.radians(self.azimuth)
        return -self.speed * np.array([np.sin(angle), 0.0, np.cos(angle)])


@dataclass
class Shown:
    """What is drawn, and how."""

    hairs: int = HAIRS
    guides_only: bool = False
    colours: str = "hair"
    layers: set[str] = field(default_factory=lambda: {"head"})
    opacity: float = 0.8
    """Of the photos in space."""
    exposure: float = 0.75
    help: bool = False
    panel: bool = True
    numbers: bool = True
    option: int = 0
    """The option that the keyboard changes."""
    through: str | None = None
    """Name of the photo whose camera the user looks through."""


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
        capture: Path | None = None,
        seed: int = 0,
        reading: Mapping[str, object] | None = None,
    ) -> None:
        """Open `path`; `reading` are options of the plugin that imports it."""
        self.manager = manager
        self.size = size
        self._simulator = simulator
        self._capture = capture
        self._first, self._reading = path, reading or {}
        self.seed = seed
        self.wind, self.shown = Wind(), Shown(hairs=hairs)
        self.paused = False
        self.hold: Hold | None = None
        self.picked: int | None = None
        self.message = ""
        self.pending = 0.0
        """Seconds that a script still wants to see."""
        self.screenshots: list[Path] = []
        """Files that the next picture is written to."""
        self.recorder: Recorder | None = None
        self.adjustment: Adjustment | None = None
        self.adjusted: dict[str, Camera] | None = None
        """The head against the photos, while it is placed by hand."""
        self.rerun: Rerun | None = None
        """The reconstruction that goes on."""
        self.most_seconds: float | None = None
        """A picture's simulation ends after the step that takes it beyond this: on slow machines
        hair moves slower instead of stopping. None simulates all, which scripts want."""
        self.steps = 0
        """Steps since the groom was opened."""
        self._behind = 0.0
        self.on_card = False
        """True while the guides are drawn from where shaders left them."""
        self.overwrite = False
        """True lets screenshots take the place of older ones of the same name."""
        self.finished = False
        self.open(path)

    def open(self, path: Path) -> None:
        """Show another groom, from its best side."""
        self._take(open_path(path, self.manager, self._reading_of(path)))
        self.frame()

    def reload(self) -> None:
        """Read the file again; view, wind and options stay."""
        values = dict(self.tuned.values)
        path = self.opened.path
        self._take(open_path(path, self.manager, self._reading_of(path)))
        if self.tuned.infos:
            self.tuned.replace(values)

    def _reading_of(self, path: Path) -> Mapping[str, object]:
        """Return the import options of a file: those of the first one, no others are known."""
        return self._reading if path == self._first else {}

    def frame(self) -> None:
        """Look at all of it, from the front and a little to the side."""
        groom = self.opened.groom
        points = np.concatenate([groom.strands.points, groom.head.vertices])
        self.view = OrbitView.around(points, self.size[0] / self.size[1])
        self.floor = float(points[:, 1].min()) - 0.03
        self.shown.through = None

    @property
    def world_from_head(self) -> Float64Array:
        """(4, 4) where the head is."""
        return self.motion.matrix()

    def camera(self, size: tuple[int, int] | None = None) -> Camera:
        """Return the camera of the picture, world."""
        width, height = size or self.size
        through = self.shown.through
        if through is not None and through in self.photo_cameras:
            return fitted(self.photo_cameras[through], width, height)
        return self.view.camera(width, height)

    @property
    def photo_cameras(self) -> dict[str, Camera]:
        """Cameras of the photos by view name: as found, or as the head is being placed."""
        return self.layers.cameras if self.adjusted is None else self.adjusted

    def adjust(self, on: bool) -> None:
        """Begin to place the head by hand, or leave it; raises `InputError` without photos."""
        before = None if self.adjustment is None else self.adjustment.before
        self.adjustment, self.adjusted = None, None
        if before is not None:  # what the adjustment has changed goes back
            self.paused, self.shown.opacity = before.paused, before.opacity
            self.shown.through = before.through
            if not before.photos:
                self.shown.layers.discard("photos")
        if on:
            folder = self.layers.capture
            if folder is None:
                raise InputError("the photos are not here; name their folder by --capture")
            self.adjustment = Adjustment.of(
                self.manager, folder, self.opened.groom.head, self.layers.cameras
            )
            self.place_head()
        elif self.shown.through not in self.layers.cameras:
            self.shown.through = None

    def place_head(self) -> None:
        """Take over the pose of the adjustment."""
        if self.adjustment is not None:
            self.adjusted = self.adjustment.cameras()

    def look_after_rerun(self) -> None:
        """Tell how a reconstruction goes on; show what it has made when it ends."""
        if self.rerun is None:
            return
        self.message = f"reconstructing: {self.rerun.progress}"
        if self.rerun.running:
            return
        rerun, self.rerun = self.rerun, None
        rerun.wait()
        rerun.check()
        self.adjust(False)
        self.reload()
        self.message = "reconstructed from the head as it was placed"

    def advance(self, seconds: float) -> None:
        """Let time pass, unless paused."""
        if self.paused:
            return
        self._behind += seconds
        before, began = self.steps, time.perf_counter()
        while self._behind >= STEP * (1 - 1e-6):
            self._behind -= STEP
            self._step()
            if self.most_seconds is not None and time.perf_counter() - began > self.most_seconds:
                self._behind = 0.0
        if self.steps > before and not self.on_card:
            self.look_for_runaways()

    def step(self) -> None:
        """Let one step of time pass."""
        self._step()
        self.look_for_runaways()

    def _step(self) -> None:
        self.motion.advance(STEP)
        surroundings = Surroundings(
            head_from_rest=self.world_from_head,
            wind=self.wind.velocity(),
            turbulence=self.wind.turbulence,
            grabs=() if self.hold is None else self.hold.grabs(),
        )
        self.tuned.simulator.advance(STEP, surroundings)
        self.steps += 1

    def look_for_runaways(self) -> None:
        """Put hair that is nowhere any more back to rest."""
        if not np.isfinite(self.tuned.simulator.points).all():
            self.reset()
            self.message = "the simulation became unstable and was put back to rest"

    def reset(self) -> None:
        """Put head and hair back to rest."""
        self.motion.stop()
        self.hold = None
        self._behind = 0.0
        self.tuned.simulator.reset(np.eye(4))

    def guide_rows(self) -> Float32Array:
        """Return (G, m, 3) the present guides in the head frame."""
        matrix = self.world_from_head.astype(np.float32)
        rows = self._sampler(self.tuned.simulator.points)
        return np.asarray((rows - matrix[:3, 3]) @ matrix[:3, :3], np.float32)

    def guide_buffer(self) -> Any:
        """Return the same as a moderngl buffer, None where the simulator does not keep hair there.

        A simulator that computes by shaders has `rows_buffer(before, part)` (see the one of `pbd`);
        use it inside `renderer()`.
        """
        made = getattr(self.tuned.simulator, "rows_buffer", None)
        buffer = None if made is None else made(self._sampler.before, self._sampler.part)
        self.on_card = buffer is not None
        return buffer

    def measures(self) -> Measures:
        """Return the simulator's read-outs."""
        return self.tuned.simulator.measure()

    def set_hairs(self, count: int) -> None:
        """Draw so many strands, the guides among them."""
        self.shown.hairs = count
        if count > len(self.body) and self._own is None:
            self._make_body()

    def _take(self, opened: Opened) -> None:
        guides, self._own = split_guides(opened.groom)
        self.opened = opened
        self.tuned = Tuned(self.manager, guides, self._simulator)
        self.motion = HeadMotion(opened.groom.head.joints[1].astype(np.float64))
        self.adjustment, self.adjusted = None, None
        self.layers = Layers(opened.results, self._capture)
        self.hold = self.picked = None
        self.steps, self._behind = 0, 0.0
        self._make_body()

    def _make_body(self) -> None:
        groom, strands = self.opened.groom, self.tuned.simulator.strands
        hairs = max(self.shown.hairs, len(strands))
        self.body = HairBody.of(strands, groom.head, groom.material, hairs, self._own, self.seed)
        self._sampler = GuideSampler(strands, self.body.shares)


def fitted(camera: Camera, width: int, height: int) -> Camera:
    """Return a photo's camera for a picture of another shape: all of the photo is in it."""
    scale = min(width / camera.width, height / camera.height)
    focal, centre = camera.focal * scale, camera.centre * scale
    spare = np.array([width - camera.width * scale, height - camera.height * scale]) / 2
    return Camera(camera.camera_from_head, focal, centre + spare, width, height, camera.model)
