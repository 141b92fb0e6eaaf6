"""Inputs and interfaces of the renderers."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np

from hairkit.arrays import Float32Array, Float64Array
from hairkit.rendering.gl_camera import DepthRange
from hairkit.rendering.light import Lights
from hairkit.types.camera import Camera

if TYPE_CHECKING:
    import moderngl

    from hairkit.viewer.draw.hair_data import HairBody
    from hairkit.viewer.draw.lines import LineSet

FULL_LOOK = 50_000
"""Fewer strands are drawn wider, so that they cover the head as this many would."""
FEW = 10_000
"""Fewer strands than this are locks: their width grows faster, with the power `LOCK_GROWTH`."""
LOCK_GROWTH, WIDEST = 0.75, 80.0
"""That power of what they lack of `FEW`, chosen by eye, and the largest widening."""
DEEPEST = float(np.sqrt(FULL_LOOK * FEW))
"""Strands times widening from which more of them do not lie in deeper shade: those of 10,000. The
cells of the view are coarser than dense hair, of which they would show the foremost scraps only."""


@dataclass(frozen=True)
class HairLook:
    """Appearance of the hair in one frame."""

    hairs: int
    """Number of strands, the guides first."""
    smooth: bool
    """True antialiases strands; False is faster."""
    by_direction: bool = False
    wider: float | None = None
    """Drawn over true width; None: from the number of strands."""

    @property
    def times_wider(self) -> float:
        """Drawn over true width."""
        if self.wider is not None:
            return self.wider
        hairs = max(self.hairs, 1)
        locks = max(FEW / hairs, 1.0) ** LOCK_GROWTH
        return float(np.clip(np.sqrt(FULL_LOOK / max(hairs, FEW)) * locks, 1.0, WIDEST))

    @property
    def dimming(self) -> float:
        """Share of the optical depth in front of a strand that dims it; 1 for few strands."""
        return min(1.0, DEEPEST / max(self.hairs * self.times_wider, 1.0))


@dataclass(frozen=True)
class HairView:
    """The camera of the hair and its depth ranges."""

    camera: Camera
    """Head frame, at the size of the frame."""
    depth: DepthRange
    """Range of the depth buffer."""
    hair_depth: DepthRange
    """Range of the hair alone."""


@dataclass(frozen=True)
class FrameInputs:
    """The inputs of one frame, apart from what stays on the GPU."""

    camera: Camera
    """World frame, at the size of the frame."""
    world_from_head: Float64Array
    """(4, 4) pose of the head."""
    guide_rows: Float32Array | None
    """(G, m, 3) guides, head frame, metres; None: as before."""
    hair: HairLook | None
    """None: no hair."""
    show_head: bool = True
    floor: float = -0.4
    """Height of the floor, world, metres."""
    exposure: float = 0.75
    light_turn: float = 0.0
    """Angle by which the lights are turned round the head, radians."""
    backdrop: str = "grey"
    """One of `backdrop.BACKDROPS`."""
    whole_light: bool = False
    """True updates the whole light volume in this frame, for still pictures."""
    same_light: bool = False
    """True leaves the light volume as it is, for another sample of a still picture."""
    fine_skin: bool = False
    """True diffuses the light in skin and draws all its maps, for still pictures."""
    lines: tuple[tuple[LineSet, bool], ...] = ()
    """Line sets, and for each whether it moves with the head."""
    billboards: tuple[str, ...] = ()
    """Names of the billboards to draw."""
    billboard_opacity: float = 1.0
    solids: tuple[str, ...] = ()
    """Names of the other meshes to draw."""
    world_from_torso: Float64Array = field(default_factory=lambda: np.eye(4))
    """(4, 4) motion since rest of meshes that do not move with the head."""


@dataclass(frozen=True)
class MeshScene:
    """Inputs of a frame, and what meshes are lit by."""

    inputs: FrameInputs
    camera: Camera
    """Head frame, at the size of the frame."""
    depth: DepthRange
    """Range of the depth buffer."""
    lights: Lights
    light: Any
    """Light volume of the renderer's kind, bound as texture 0."""


@dataclass(frozen=True)
class HairScene:
    """Lights, occluders and target of the hair."""

    view: HairView
    look: HairLook
    lights: Lights
    light: Any
    """Light volume of the renderer's kind, bound as texture 0."""
    meshes: Any
    """Layer of meshes of the renderer's kind, which hide hair behind them."""
    target: moderngl.Framebuffer
    """The picture, of one texture."""


class HairDrawer(Protocol):
    """A hair renderer: `hair_gpu.HairPass` or `hair_cpu.SoftHairPass`."""

    body: HairBody

    def release(self) -> None:
        """Free all GPU objects."""

    def places(self) -> Any:
        """Return the last positions (S, m, 3) of the hair, metres: a float32 buffer or array."""

    def move_guides(self, rows: Float32Array) -> Float32Array:
        """Move the guides to `rows` (G, m, 3), head frame, metres; return them as points (N, 3)."""

    def place(self, view: HairView, look: HairLook) -> None:
        """Interpolate the hair from the guides and accumulate its opacity by depth."""

    def draw(self, scene: HairScene) -> None:
        """Draw the meshes into the picture, and over them hair that is nearer."""
