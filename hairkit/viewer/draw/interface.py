"""What the passes that draw hair are told, and what they have in common."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np

from hairkit.arrays import Float32Array
from hairkit.rendering.gl_camera import DepthRange
from hairkit.rendering.light import Lights
from hairkit.types.camera import Camera

if TYPE_CHECKING:
    import moderngl

    from hairkit.viewer.draw.hair_data import HairBody

GuidePlaces = Any
"""(G, m, 3) float32: an array, or a moderngl buffer for drawers by shaders."""
FULL_LOOK = 50_000
"""Fewer hairs are drawn wider, so that they cover the head as this many would."""
WIDEST = 5.0


@dataclass(frozen=True)
class HairLook:
    """How the hair is drawn in one picture."""

    hairs: int
    """Strands drawn, the guides first."""
    smooth: bool
    """True: strokes have soft edges; False is faster."""
    root_colour: tuple[float, float, float]
    tip_colour: tuple[float, float, float]
    by_direction: bool = False
    wider: float | None = None
    """How many times wider than they are strands are drawn; None: by their number."""

    @property
    def times_wider(self) -> float:
        """How many times wider strands are drawn."""
        if self.wider is not None:
            return self.wider
        return float(np.clip(np.sqrt(FULL_LOOK / max(self.hairs, 1)), 1.0, WIDEST))


@dataclass(frozen=True)
class HairView:
    """Where hair is looked at from."""

    camera: Camera
    """In the head frame, at the picture's size."""
    depth: DepthRange
    """Of the depth buffer."""
    hair_depth: DepthRange
    """That holds the hair alone."""


@dataclass(frozen=True)
class HairScene:
    """What placed hair is drawn in."""

    view: HairView
    look: HairLook
    lights: Lights
    light: Any
    """What of the lights reaches each place, of the drawer's own kind; texture 0 holds it."""
    solids: moderngl.Framebuffer
    """Whose depth hides hair."""
    solid_depth: moderngl.Texture
    """That depth."""
    target: moderngl.Framebuffer
    """The picture, with everything in it that stands behind hair."""


class HairDrawer(Protocol):
    """A pass that draws hair: `hair_pass.HairPass` by shaders, `soft_hair.SoftHairPass` without."""

    body: HairBody

    def release(self) -> None:
        """Free what is held by OpenGL."""

    def places(self) -> Any:
        """Return (S, m, 3) float32 where the hair was last placed, metres: a buffer or an array."""

    def move_guides(self, rows: GuidePlaces) -> Float32Array:
        """Put the guides at `rows` (G, m, 3), head frame, metres; return points around them.

        The points (N, 3) are the rows, or corners of a box around them where only the graphics card
        knows these.
        """

    def place(self, view: HairView, look: HairLook) -> None:
        """Place the hair and find what of it hides what."""

    def draw(self, scene: HairScene) -> None:
        """Draw the placed hair over the picture, hidden by the solids."""
