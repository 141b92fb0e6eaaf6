"""Pictures of heads and strands for notebooks, drawn by OpenCV without OpenGL.

Faces and segments are drawn from back to front (painter's algorithm), each in one grey or colour.
"""

from __future__ import annotations

import base64
from collections.abc import Sequence
from dataclasses import dataclass
from html import escape
from typing import TYPE_CHECKING, Protocol, Self

import numpy as np
import numpy.typing as npt

from hairkit.arrays import Float64Array, UInt8Array

if TYPE_CHECKING:
    from hairkit.types.camera import Camera

WIDTH, HEIGHT = 240, 320
"""Pixels of one view of a preview."""
PHOTO_HEIGHT = 160
"""Pixels of a photo, or of what its camera sees."""
AZIMUTHS = (0.0, 90.0, 180.0)
"""Views of a head or groom: front, left, back, degrees."""
MOST_STRANDS = 400
"""Strands drawn at most, evenly chosen."""
BACKDROP, SKIN, HAIR = 232, (176, 150, 132), (92, 66, 48)
"""Grey, and sRGB of a surface that faces the camera and of a strand across the view."""
_SKIN_IN_SHADE = 0.35
"""Share of its colour that a surface seen edge-on keeps."""
_DARKEST_STRAND, _STRAND_RANGE = 0.7, 0.6
"""Least factor of the hair's colour, and how much it varies: neighbours can be told apart."""
_HAIR_END_ON = 0.3
"""Share of its colour that a strand keeps that runs along the view."""
_GOLDEN_RATIO = (1 + 5**0.5) / 2
"""Its multiples spread evenly modulo 1: neighbouring strands differ in brightness."""
_MARGIN = 1.1
_FAR = 1e5
"""Pixels beyond which nothing is drawn, so that fixed-point coordinates cannot overflow."""
_FIXED_BITS = 4
"""OpenCV draws at coordinates with so many bits below the pixel."""


class Surface(Protocol):
    """A mesh, such as a head or a bust: vertices (V, 3), metres, and faces (F, 3)."""

    @property
    def vertices(self) -> npt.NDArray[np.float32]: ...
    @property
    def faces(self) -> npt.NDArray[np.int32]: ...


class Lines(Protocol):
    """What a preview needs of strands, see `Strands`."""

    @property
    def points(self) -> npt.NDArray[np.float32]: ...
    @property
    def strand_of_point(self) -> npt.NDArray[np.int64]: ...
    def __len__(self) -> int: ...
    def select(self, indices: npt.NDArray[np.int64]) -> Self: ...
    def segments(self) -> tuple[npt.NDArray[np.float32], npt.NDArray[np.int64]]: ...


class Previewed:
    """A type that a notebook shows as a picture with its `repr` below."""

    def preview(self) -> UInt8Array | None:
        """Return a picture (H, W, 3) uint8 RGB; None where there is nothing to show."""
        raise NotImplementedError

    def _repr_png_(self) -> bytes | None:
        picture = self.preview()
        return None if picture is None else png(picture)

    def _repr_html_(self) -> str:
        data, text = self._repr_png_(), escape(repr(self))
        if data is None:
            return f"<code>{text}</code>"
        source = base64.b64encode(data).decode()
        return f'<img src="data:image/png;base64,{source}" alt="{text}"><br><code>{text}</code>'


def png(picture: UInt8Array) -> bytes:
    """Return a picture (H, W, 3) RGB as the content of a PNG file."""
    import cv2

    return cv2.imencode(".png", picture[..., ::-1])[1].tobytes()


def row(pictures: Sequence[UInt8Array], height: int = HEIGHT) -> UInt8Array:
    """Return pictures (H, W, 3) side by side, scaled to one height."""
    import cv2

    scaled = [
        cv2.resize(p, (max(1, round(p.shape[1] * height / p.shape[0])), height), None, 0, 0, 3)
        for p in pictures
    ]
    return np.concatenate([np.asarray(p, np.uint8) for p in scaled], axis=1)


def draw_turn(head: Surface | None, strands: Lines | None) -> UInt8Array | None:
    """Return front, left and back of a head, of strands or of both, in one scale."""
    clouds = [] if head is None else [head.vertices]
    clouds += [] if strands is None or not len(strands) else [strands.points]
    if not clouds:
        return None
    return row([draw_view(camera, head, strands) for camera in _turn(np.concatenate(clouds))])


def draw_view(
    camera: Camera | _TurnView, head: Surface | None, strands: Lines | None = None
) -> UInt8Array:
    """Return a picture (H, W, 3) of a head and strands as a camera sees them."""
    parts = [_faces(camera, head)] if head is not None else []
    parts += [_segments(camera, strands)] if strands is not None else []
    polygons = [polygon for part in parts for polygon in part[0]]
    depths = np.concatenate([part[1] for part in parts])
    colours = np.concatenate([part[2] for part in parts])
    picture = np.full((camera.height, camera.width, 3), BACKDROP, np.uint8)
    for index in np.argsort(-depths, kind="stable"):
        _paint(picture, polygons[index], tuple(colours[index].tolist()))
    return picture


@dataclass(frozen=True)
class _TurnView:
    """An orthographic camera on the turn; types without cameras need not import `Camera`."""

    azimuth: float
    """Radians."""
    middle: npt.NDArray[np.floating]
    """(3,) point in the picture's middle, metres."""
    scale: float
    """Pixels per metre."""
    width: int = WIDTH
    height: int = HEIGHT

    def project(self, points: npt.ArrayLike) -> Float64Array:
        """Return pixels (..., 2) of points (..., 3)."""
        local = np.asarray(points, np.float64) - self.middle
        right = np.array([np.cos(self.azimuth), 0.0, -np.sin(self.azimuth)])
        pixels = np.stack([local @ right, -local[..., 1]], axis=-1) * self.scale
        return pixels + np.array([self.width, self.height]) / 2

    def view_direction(self, points: npt.ArrayLike) -> Float64Array:
        """Return the unit direction (..., 3) of view at points (..., 3)."""
        forward = -np.array([np.sin(self.azimuth), 0.0, np.cos(self.azimuth)])
        return np.broadcast_to(forward, np.shape(points))

    def depth(self, points: npt.ArrayLike) -> Float64Array:
        """Return the distance (...,) of points (..., 3) along the view."""
        return np.asarray((np.asarray(points, np.float64) * self.view_direction(points)).sum(-1))


def _turn(points: npt.NDArray[np.float32]) -> list[_TurnView]:
    """Return views around points (N, 3) that show them all."""
    low, high = points.min(axis=0), points.max(axis=0)
    half = np.maximum((high - low) / 2, 1e-6) * _MARGIN
    scale = float(min(WIDTH / 2 / max(half[0], half[2]), HEIGHT / 2 / half[1]))
    return [_TurnView(np.radians(azimuth), (low + high) / 2, scale) for azimuth in AZIMUTHS]


_Primitives = tuple[npt.NDArray[np.int32], Float64Array, Float64Array]
"""Corners (N, K, 2) in fixed-point pixels, depths (N,) and sRGB colours (N, 3)."""


def _faces(camera: Camera | _TurnView, head: Surface) -> _Primitives:
    """Return the faces that look at the camera, brighter the more they do."""
    corners = head.vertices.astype(np.float64)[head.faces]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-20)
    middle = corners.mean(axis=1)
    facing = -(normal * camera.view_direction(middle)).sum(axis=1)
    seen = facing > 0
    colours = np.outer(_SKIN_IN_SHADE + (1 - _SKIN_IN_SHADE) * facing[seen], SKIN)
    return _to_fixed_point(camera.project(corners[seen])), camera.depth(middle[seen]), colours


def _segments(camera: Camera | _TurnView, strands: Lines) -> _Primitives:
    """Return the segments of strands, darker along the view than across it."""
    if len(strands) > MOST_STRANDS:
        strands = strands.select(np.linspace(0, len(strands) - 1, MOST_STRANDS).astype(np.int64))
    vector, first = strands.segments()
    ends = np.stack([strands.points[first], strands.points[first + 1]], axis=1)
    middle = ends.mean(axis=1)
    along = vector / np.maximum(np.linalg.norm(vector, axis=1, keepdims=True), 1e-20)
    cosine = (along * camera.view_direction(middle)).sum(axis=1)
    tint = _DARKEST_STRAND + _STRAND_RANGE * (_GOLDEN_RATIO * strands.strand_of_point[first] % 1)
    sine = np.sqrt(np.clip(1 - cosine**2, 0, 1))
    colours = np.outer(tint * (_HAIR_END_ON + (1 - _HAIR_END_ON) * sine), HAIR)
    return _to_fixed_point(camera.project(ends)), camera.depth(middle), colours


def _to_fixed_point(pixels: Float64Array) -> npt.NDArray[np.int32]:
    """Return pixel coordinates as OpenCV takes them: it counts from the first pixel's middle."""
    bounded = np.clip(np.nan_to_num(pixels - 0.5, nan=-_FAR), -_FAR, _FAR)
    fixed: npt.NDArray[np.int32] = np.rint(bounded * 2**_FIXED_BITS).astype(np.int32)
    return fixed


def _paint(picture: UInt8Array, corners: npt.NDArray[np.int32], colour: tuple[float, ...]) -> None:
    import cv2

    if len(corners) == 2:
        first, last = corners.tolist()
        cv2.line(picture, first, last, colour, 1, cv2.LINE_AA, _FIXED_BITS)
    else:
        cv2.fillConvexPoly(picture, corners, colour, cv2.LINE_8, _FIXED_BITS)
