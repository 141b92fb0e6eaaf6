"""Simulate and draw a session frame by frame, in a window or headless."""

from __future__ import annotations

import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import cv2
import numpy as np

from hairkit.arrays import UInt8Array
from hairkit.imaging.picture_file import write_picture
from hairkit.rendering.context import Renderer
from hairkit.rendering.gl_camera import NEAREST
from hairkit.rendering.head import Solid, bust_solid, head_solid
from hairkit.simulation.rigid_motion import follow_head
from hairkit.types.camera import Camera
from hairkit.viewer.draw.colouring import point_values, ramp
from hairkit.viewer.draw.frame import FrameRenderer
from hairkit.viewer.draw.frame_budget import LEVELS, Budget, Quality
from hairkit.viewer.draw.interface import FrameInputs, HairLook
from hairkit.viewer.draw.lines import LineSet
from hairkit.viewer.draw.still import Lens, Still, sample_camera
from hairkit.viewer.layers import BILLBOARDS
from hairkit.viewer.picking import surface_point
from hairkit.viewer.recording import free_name
from hairkit.viewer.session import Session
from hairkit.viewer.window.hud import Readings

GUIDE_WIDTH_SCALE = 7.0
"""Width of guides shown alone over that of hair."""
MIN_SMOOTH = 4_000
"""Up to this many strands are always drawn with antialiased edges, which is cheap for few."""
MEASURE_EVERY = 12
"""Frames between two measurements of stretch and energy."""
PICKED_COLOUR = (1.0, 0.85, 0.1)
"""sRGB of the picked guide."""
TIME_SMOOTHING = 0.2
"""Weight of the newest frame in the displayed times."""
SAMPLE = Quality(False, 1.0, 1.0)
"""Quality of a sample of a still picture: many of them are smooth together."""
WIPE_EDGE = 2
"""Width of the line between photo and hair, pixels."""
MIN_EDGE = 16
"""Smallest edge of the picture, pixels, in a window that is almost closed."""


class Preview:
    """Draws a session; use it inside `renderer()` only."""

    def __init__(
        self, gl: Renderer, session: Session, budget: Budget | None = None, soft: bool | None = None
    ) -> None:
        """Draw within a frame budget (None: best quality); `soft` as in `FrameRenderer`."""
        self.gl = gl
        self.soft = soft
        self.session = session
        self.budget = budget or Budget(0.0)
        self.readings = Readings(renderer=gl.description)
        self.written: list[Path] = []
        """Paths of the screenshots and recordings written so far."""
        self._frame_renderer: FrameRenderer | None = None
        self._drawn: tuple[object, object] = (None, None)
        self._kept: dict[str, list[str]] = {}
        self._lines: dict[str, LineSet | None] = {}
        self._photo: tuple[object, UInt8Array] | None = None
        self._still = Still()
        self._pictures = 0
        self._times: dict[str, float] = {}

    @property
    def frame_renderer(self) -> FrameRenderer:
        """The frame renderer of the session's groom."""
        session = self.session
        now = (session.opened, session.body)
        if self._frame_renderer is None or self._drawn[0] is not now[0]:
            self.release()
            groom = session.opened.groom
            solid = head_solid(groom.head, groom.material)
            self._frame_renderer = FrameRenderer(self.gl, solid, session.body, self.soft)
        elif self._drawn[1] is not now[1]:
            self._frame_renderer.replace_body(session.body)
        self._drawn = now
        return self._frame_renderer

    def release(self) -> None:
        """Free all GPU objects."""
        if self._frame_renderer is not None:
            self._frame_renderer.release()
        self._frame_renderer, self._kept, self._lines = None, {}, {}

    def restart(self) -> None:
        """Recompile all shaders; keep the old ones if one does not compile."""
        self.gl.recompile_programs()
        self.release()

    def frame(self, seconds: float, *, still: bool = False) -> None:
        """Simulate `seconds`, draw, and write pending screenshots and the recording.

        `still` draws at the best quality, whatever the budget; a screenshot is a still picture.
        """
        began = time.perf_counter()
        self.session.advance(seconds)
        simulated = time.perf_counter()
        shot = bool(self.session.screenshots)
        if shot:
            self._still.clear()
            while self.refine(fine=True):
                pass
        else:
            self.draw(still=still)
        self._save_picture()
        drawn = time.perf_counter()
        if not (shot or still):
            brush = self.session.brushing
            self.budget.hurried = brush is not None and brush.down
            self.budget.record(drawn - simulated, simulated - began)
        self._update_readings(simulated - began, drawn - simulated)

    def refine(self, *, fine: bool = False) -> bool:
        """Add a sample to the still picture of the present state; return whether more are wanted.

        Does nothing once the picture is complete; `draw` begins another one. `fine` diffuses the
        light in skin where hair is drawn on the CPU too, which takes seconds there.
        """
        count = self._still.count
        if count == 0:
            self._lens = self._focus()
        if count < self._lens.samples:
            camera = sample_camera(self.session.camera(), self._lens, count)
            fine = fine or not self.frame_renderer.soft
            self._draw(SAMPLE, camera, first=count == 0, fine=fine)
            self.frame_renderer.write(self._still.add(self.picture()))
            self._compare()
        return self._still.count < self._lens.samples

    def _focus(self) -> Lens:
        """Return the lens, focused on the head at the middle of the picture."""
        session = self.session
        camera = session.camera()
        found = surface_point(camera, session.opened.groom.head, camera.centre)
        focus = session.view.distance if found is None else float(camera.depth(found))
        return Lens(session.shown.aperture, max(focus, NEAREST))

    def draw(self, *, still: bool = False) -> None:
        """Draw the present state of the session."""
        self._still.clear()
        quality = LEVELS[0] if still else self.budget.quality
        width, height = (max(round(n * quality.scale), MIN_EDGE) for n in self.session.size)
        self._draw(quality, self.session.camera((width, height)), first=still)
        self._compare()

    def _draw(self, quality: Quality, camera: Camera, *, first: bool, fine: bool = False) -> None:
        """Draw a picture, or a sample of a still one, whose `first` brings the light up to date."""
        frame_renderer, session = self.frame_renderer, self.session
        rows = session.guide_rows()
        look = self._look(quality.smooth, quality.share, sample=quality is SAMPLE)
        overlays = self._overlays(rows)
        billboards = self._load_billboards(frame_renderer)
        solids = self._load_solids(frame_renderer)
        frame_renderer.draw(
            FrameInputs(
                camera,
                session.world_from_head,
                rows,
                look,
                show_head="head" in session.shown.layers,
                floor=session.floor,
                exposure=session.shown.exposure,
                light_turn=float(np.radians(session.shown.light)),
                backdrop=session.shown.backdrop,
                whole_light=first,
                same_light=quality is SAMPLE and not first,
                fine_skin=fine,
                lines=overlays,
                billboards=billboards,
                billboard_opacity=session.shown.opacity,
                solids=solids,
                world_from_torso=follow_head(
                    np.eye(4), session.world_from_head, session.motion.pivot
                ),
            )
        )
        self._hairs = 0 if look is None else look.hairs
        if not np.isfinite(frame_renderer.cloud).all():
            session.check_stability()

    def picture(self) -> UInt8Array:
        """Return the last picture (H, W, 3) RGB, at the size at which it was drawn."""
        return self.frame_renderer.read()

    def _look(self, smooth: bool, share: float, *, sample: bool) -> HairLook | None:
        session, shown = self.session, self.session.shown
        guides = len(session.body.guides)
        if shown.colours not in ("hair", "direction"):
            return None
        count = guides if shown.guides_only else min(shown.hairs, len(session.body))
        count = max(round(count * (1.0 if shown.guides_only else share)), 1)
        return HairLook(
            count,
            smooth or (count <= MIN_SMOOTH and not sample),
            by_direction=shown.colours == "direction",
            wider=GUIDE_WIDTH_SCALE if shown.guides_only else None,
        )

    def _overlays(self, rows: Any) -> tuple[tuple[LineSet, bool], ...]:
        """Return line sets, and for each whether it moves with the head."""
        session = self.session
        lines: list[tuple[LineSet, bool]] = []
        if session.shown.colours not in ("hair", "direction"):
            rest = session.body.guide_rest
            given = session.layers.confidence(rest)
            if session.shown.colours == "group":
                group = session.body.guides.group
                other = np.zeros(len(rest)) if group is None else np.minimum(group, 1)
                given = np.repeat(0.5 + 0.5 * other[:, None], rest.shape[1], axis=1)
            values = point_values(session.shown.colours, rows, rest, given)
            lines.append((_guide_lines(rows, ramp(values)), True))
        if session.picked is not None:
            one = rows[session.picked : session.picked + 1]
            colour = np.broadcast_to(np.array(PICKED_COLOUR, np.float32), one.shape)
            lines.append((_guide_lines(one, colour), True))
        finders = {"cameras": session.layers.frusta, "field": session.layers.field_lines}
        for name, find in finders.items():
            if name in session.shown.layers:
                if name not in self._lines:
                    self._lines[name] = find()
                found = self._lines[name]
                if found is not None:
                    lines.append((found, name == "field"))
        return tuple(lines)

    def _load_billboards(self, frame_renderer: FrameRenderer) -> tuple[str, ...]:
        session, names = self.session, []
        for layer in BILLBOARDS:
            if layer not in session.shown.layers:
                continue
            if layer not in self._kept:
                billboards = session.layers.billboards(layer)
                for name, board in billboards.items():
                    frame_renderer.upload_billboard(f"{layer}/{name}", board)
                self._kept[layer] = list(billboards)
            only = session.shown.through
            names += [f"{layer}/{n}" for n in self._kept[layer] if only is None or n == only]
        return tuple(names)

    def _load_solids(self, frame_renderer: FrameRenderer) -> tuple[str, ...]:
        session = self.session
        groom = session.opened.groom
        finders: dict[str, Callable[[], Solid | None]] = {
            "hull": session.layers.hull,
            "torso": lambda: bust_solid(groom.head, groom.strands),
        }
        names = [name for name in finders if name in session.shown.layers]
        for name in names:
            if name not in self._kept:
                solid = finders[name]()
                self._kept[name] = [] if solid is None else [name]
                if solid is not None:
                    frame_renderer.upload_solid(name, solid)
        return tuple(kept for name in names for kept in self._kept[name])

    def _compare(self) -> None:
        """Cover the left of the picture with the photo whose camera it is seen through."""
        session, frame_renderer = self.session, self.frame_renderer
        wipe, name = session.shown.wipe, session.shown.through
        if wipe is None or name is None or name not in session.layers.photos:
            return
        width, height = frame_renderer.framebuffer.size
        now, taken = session.camera((width, height)), session.layers.cameras[name]
        scale = now.focal / taken.focal
        left, top = np.rint(now.centre - taken.centre * scale).astype(int).tolist()
        size = round(taken.width * scale), round(taken.height * scale)
        if self._photo is None or self._photo[0] != (session.opened, name, size):
            image = cv2.resize(session.layers.photos[name], size, interpolation=cv2.INTER_AREA)
            self._photo = (session.opened, name, size), np.asarray(image, np.uint8)
        edge = int(np.clip(round(wipe * width), 0, width - WIPE_EDGE))
        photo = self._photo[1][: height - top, : max(edge - left, 0)]
        if photo.size:
            frame_renderer.write(photo, left, top)
        frame_renderer.write(np.full((height, WIPE_EDGE, 3), 255, np.uint8), edge)

    def _save_picture(self) -> None:
        session = self.session
        if session.recorder is None and not session.screenshots:
            return
        picture = self.picture()
        if session.recorder is not None:
            session.recorder.add(picture)
        for path in session.screenshots:
            free = path if session.overwrite else free_name(path)
            write_picture(free, picture, durable=False)
            self.written.append(free)
            session.message = f"wrote {free}"
        session.screenshots = []

    def _update_readings(self, simulated: float, drawn: float) -> None:
        self._pictures += 1
        for name, value in (("simulate", simulated), ("draw", drawn)):
            before = self._times.get(name, value)
            self._times[name] = before + TIME_SMOOTHING * (value - before)
        readings = self.readings
        stretch, energy = readings.stretch, readings.energy
        if self._pictures % MEASURE_EVERY == 1:
            measures = self.session.measures()
            stretch = measures.stretch
            energy = measures.kinetic_energy + measures.potential_energy
        self.readings = Readings(
            1 / max(self._times["simulate"] + self._times["draw"], 1e-6),
            1e3 * self._times["simulate"],
            1e3 * self._times["draw"],
            stretch,
            energy,
            self._hairs,
            self.frame_renderer.framebuffer.width / self.session.size[0],
            readings.renderer,
        )


def _guide_lines(rows: Any, colours: Any) -> LineSet:
    count, points = rows.shape[:2]
    rgba = np.ones((count * points, 4), np.float32)
    rgba[:, :3] = np.asarray(colours, np.float32).reshape(-1, 3)
    return LineSet(rows.reshape(-1, 3), np.arange(count + 1) * points, rgba)
