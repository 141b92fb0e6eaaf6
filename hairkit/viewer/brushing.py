"""Brushes in the viewer: strokes over the guides, shown at once and kept beside the photos."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from hairkit.arrays import Float64Array
from hairkit.grooming.brushed_hair import Hair
from hairkit.grooming.brushes import BRUSHES, brush_hair, edit_groom
from hairkit.types.camera import Camera
from hairkit.types.edits import Brush, Edit, Edits, read_edits
from hairkit.types.groom import Groom
from hairkit.viewer.picking import nearest_point

NAMES = ("none", *BRUSHES)
LOOKED_AT = 40_000
"""Points of guides, evenly, of which the one under the brush is looked for."""
ASIDE = 0.06
"""Metres from a place of the brush within which the next one is on hair that is seen."""


@dataclass
class Brushing:
    """A brush over a groom, and its strokes: those that are done, and one under way."""

    before: Groom
    """The groom without strokes."""
    path: Path
    """File of the strokes."""
    setting: Brush
    hair: Hair
    """The guides as they are drawn, at rest."""
    undone: list[Edit] = field(default_factory=list)
    _lifted: Hair | None = None
    """The same before the stroke under way; None while the brush is up."""
    _way: list[Float64Array] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.strokes = list(read_edits(self.path).strokes)

    @property
    def groom(self) -> Groom:
        """The groom after all strokes that are done."""
        return edit_groom(self.before, Edits(tuple(self.strokes)))

    @property
    def down(self) -> bool:
        """Whether a stroke is under way."""
        return self._lifted is not None

    @property
    def rows(self) -> Float64Array:
        """The guides (G, m, 3) that are drawn, metres."""
        return self.hair.points if self._lifted is None else self.hair.over(self._lifted)[0]

    @property
    def told(self) -> str:
        """What the brush is, in words."""
        now, sides = self.setting, ", both sides" if self.setting.mirror else ""
        size = f"{100 * now.radius:.1f} cm on {now.group}{sides}"
        return f"brush {now.brush}, {size}; {len(self.strokes)} strokes in {self.path}"

    def lead(self, camera: Camera, pixel: tuple[float, float]) -> bool:
        """Lead the brush to a pixel; return whether there is anything, or was at its beginning."""
        place = self._under(camera, pixel)
        if place is None:
            return False
        self._lifted = self._lifted or self.hair.copy()
        self._way.append(place)
        if self.setting.brush == "comb":  # piece by piece it does what it does in one go
            brush_hair(self.hair, Edit(np.array(self._way[-2:]), self.setting))
        else:
            self.hair = self._lifted.copy()
            brush_hair(self.hair, Edit(np.array(self._way), self.setting))
        return True

    def lift(self) -> None:
        """End the stroke, if one is under way, and keep it."""
        if self._lifted is not None:
            self.strokes.append(Edit(np.array(self._way), self.setting))
            self.undone, self._way, self.hair, self._lifted = [], [], self._lifted, None
            brush_hair(self.hair, self.strokes[-1])
            Edits(tuple(self.strokes)).write(self.path)

    def step(self, by: int) -> bool:
        """Take the last stroke back (-1) or do it again (1); return whether there was one."""
        source, target = (self.strokes, self.undone)[::-by]
        if not source:
            return False
        target.append(source.pop())
        Edits(tuple(self.strokes)).write(self.path)
        return True

    def _under(self, camera: Camera, pixel: tuple[float, float]) -> Float64Array | None:
        """Return the place (3,) of hair, or of skin to plant on, at a pixel.

        A stroke goes no farther in depth than across, and at its own depth where nothing is.
        """
        on_hair = self.setting.group == "hair"
        every = self.hair.points.reshape(-1, 3)
        points = every[:: 1 + len(every) // LOOKED_AT] if on_hair else self.before.head.vertices
        for axis, at in enumerate(self._way[-1] if self._way else ()):  # not at hair elsewhere
            points = points[np.abs(points[:, axis] - at) < ASIDE]
        picked = nearest_point(camera, points.astype(np.float32), pixel)
        depth = None if picked is None else float(camera.depth(points[picked]))
        if self._way:
            last = float(camera.depth(self._way[-1]))
            most = float(np.linalg.norm(camera.unproject(pixel, np.float64(last)) - self._way[-1]))
            depth = float(np.clip(last if depth is None else depth, last - most, last + most))
        return None if depth is None else camera.unproject(pixel, np.float64(depth))
