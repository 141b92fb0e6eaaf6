"""What the kernels that draw on the processor share: the camera, the lights, and the hair."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from hairkit.arrays import Float32Array, Int32Array, Int64Array, UInt32Array
from hairkit.rendering.gl_camera import DepthRange, clip_from_camera
from hairkit.rendering.light import Lights
from hairkit.simulation.vectors import Frame, Vector
from hairkit.types.camera import Camera
from hairkit.types.volume import VoxelGrid

Int8Array = npt.NDArray[np.int8]


class Projection(NamedTuple):
    """A camera in the head frame."""

    clip: tuple[Frame, Frame, Frame, Frame]
    """Rows of clip_from_head."""
    forward: Vector
    """Optical axis, unit."""
    offset: np.float32
    """Depth of the head frame's origin, metres."""
    width: np.float32
    """Pixels."""
    height: np.float32
    """Pixels."""
    focal: np.float32
    """Focal length, pixels; pixels per metre of an orthographic camera."""
    perspective: bool


class Lamp(NamedTuple):
    """A directional light."""

    direction: Vector
    """Towards it, head frame, unit."""
    colour: Vector
    """Linear RGB."""


class Shading(NamedTuple):
    """What points are lit by, and where they are seen from."""

    eye: Vector
    """Camera centre, head frame, metres."""
    forward: Vector
    """Optical axis, unit."""
    perspective: np.float32
    """1 perspective, 0 orthographic."""
    key: Lamp
    rim: Lamp
    ground: Vector
    """Light from below, linear RGB."""
    sky: Vector
    """Light from above, linear RGB."""
    exposure: np.float32
    origin: Vector
    """Lowest corner of the light volume, metres."""
    per_metre: np.float32
    """Its cells in a metre."""
    volume: Float32Array
    """(Z, Y, X, 4) transmittance towards key and rim light, visible share of the sky."""


class Guides(NamedTuple):
    """G guides of m points as they are now."""

    points: Float32Array
    """(G, m, 3) metres."""
    turns: Float32Array
    """(G, 5, M) rotation (w, x, y, z) and stretch of the segment to each point since rest."""


class HairData(NamedTuple):
    """S strands of m points at rest; M is the multiple of the kernels' lanes that holds m."""

    followed: Int32Array
    """(S, 3) guides of each strand, the nearest first."""
    weights: Float32Array
    """(S, 3) their weights, sum 1."""
    edges: Float32Array
    """(S, 3, M) from the mean of the guides' roots to the root, and from point to point, metres."""
    widths: Float32Array
    """(S, m) diameters, metres."""


class HairState(NamedTuple):
    """What the passes over the strands hand on."""

    places: Float32Array
    """(S, m, 3) metres, head frame."""
    seen: Float32Array
    """(S, m, 4) pixel x and y, depth-buffer depth, axial depth; the last is below 0 behind."""
    looks: Float32Array
    """(S, m, 4) colour, and transmittance towards the camera."""
    hidden: Int8Array
    """(S, m) places of the stroke from each point that are behind meshes, see `count_hidden`."""
    reach: Float32Array
    """(S, 2) the columns of pixels in between which a strand is drawn."""


class ViewCells(NamedTuple):
    """Opacity of hair in cells of the view: depth slices of tiles of the picture."""

    filled: UInt32Array
    """(chunks, SLICES, tiles y, tiles x) opacity that a chunk of the strands adds."""
    opacity: Float32Array
    """(SLICES + 1, tiles y, tiles x) optical depth before each slice."""
    used: Int64Array
    """(4,) tiles that the last picture left filled: first column and row, and the ends of both."""


class Chunks(NamedTuple):
    """Scratch of the chunks of strands that threads place apart."""

    way: Float32Array
    """(chunks, 3, M) segments of the strand at hand, metres."""
    corners: Float32Array
    """(chunks, 4) lowest x and y, highest x and y of the chunk, pixels."""


class Strokes(NamedTuple):
    """How the strands of a picture are drawn."""

    camera: Projection
    near: np.float32
    """Depth of the first slice of the view cells, metres."""
    slices_per_metre: np.float32
    dimming: np.float32
    """Share of the optical depth before a strand that dims it."""
    wider: np.float32
    """Drawn over true width."""
    hairs: int
    """Strands that are drawn."""
    smooth: bool
    """Whether strokes are antialiased."""


class Columns(NamedTuple):
    """The columns of the picture that hair may cover, column by column.

    Most hair hangs, so that a stroke's pixels lie side by side in memory.
    """

    solid: Float32Array
    """(W, H) depth buffer of meshes."""
    left: np.float32
    """First column."""
    beside: np.float32
    """How far strokes reach beside their ends at most, pixels."""
    sums: Float32Array
    """(at least W H, 4) colour times weight, and weight."""


class HairShading(NamedTuple):
    """What strands are shaded by."""

    light: Shading
    colours: Float32Array
    """(S, m, 3) linear RGB."""
    random: Float32Array
    """(S,) in [0, 1)."""
    around: Vector
    """Light of the sky that hair scatters, linear RGB."""
    by_direction: bool
    """Whether hair is coloured by its direction."""
    tones: Float32Array
    """(TONES,) tones of radiance, see `tone_table`."""


def project_from(camera: Camera, depth: DepthRange) -> Projection:
    """Return a camera for kernels."""
    matrix = clip_from_camera(camera, depth) @ camera.camera_from_head
    return Projection(
        tuple(map(_tuple, matrix)),
        _tuple(camera.forward),
        np.float32(camera.translation[2]),
        np.float32(camera.width),
        np.float32(camera.height),
        np.float32(camera.focal),
        camera.model == "perspective",
    )


def shading_of(camera: Camera, lights: Lights, grid: VoxelGrid, volume: Float32Array) -> Shading:
    """Return the lights, and the light volume (Z, Y, X, 4) on a grid, for kernels."""
    return Shading(
        _tuple(camera.position),
        _tuple(camera.forward),
        np.float32(camera.model == "perspective"),
        Lamp(_tuple(lights.key_direction), _tuple(lights.key_colour)),
        Lamp(_tuple(lights.rim_direction), _tuple(lights.rim_colour)),
        _tuple(lights.ground_colour),
        _tuple(lights.sky_colour),
        np.float32(lights.exposure),
        _tuple(grid.origin),
        np.float32(1 / grid.spacing),
        volume,
    )


def _tuple(values: npt.ArrayLike) -> Any:
    """Return numbers that stay in registers."""
    return tuple(np.asarray(values, np.float32))
