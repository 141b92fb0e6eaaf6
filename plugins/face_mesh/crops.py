"""Square crops of a photo at any angle, and the face mesh that the network finds in them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import cv2
import numpy as np

from hairkit.arrays import Float32Array, Float64Array, UInt8Array
from hairkit.nets.model_folder import find_model
from hairkit.nets.net_process import NetProcess

from .landmark_table import MESH, MESH_POINTS

EDGE = 192
"""Pixels of the crop that the mesh network wants."""
MARGIN = 1.5
"""Edge of a crop over the longer side of the face in it, as the network was trained."""
RIGHT_EYE, LEFT_EYE = 33, 263
"""Mesh points at the outer corners of the subject's eyes."""
_WOBBLES = (
    (0.0, 0.0, 1.0, 0.0), (0.04, 0.02, 1.08, 6.0), (-0.04, 0.03, 0.94, -6.0),
    (0.02, -0.04, 1.0, 3.0), (-0.02, -0.02, 1.04, -3.0), (0.03, 0.0, 0.97, -6.0),
    (-0.03, 0.04, 1.0, 6.0), (0.0, -0.03, 1.08, 0.0),
)  # fmt: skip
"""Shifts right and down in edges of the crop, zooms, and clockwise turns in degrees: what the
detector itself errs by."""


@dataclass(frozen=True)
class Crop:
    """A square of a photo."""

    centre: tuple[float, float]
    """Pixels of the photo."""
    size: float
    """Edge, pixels of the photo."""
    angle: float
    """Clockwise angle of its upper edge in the photo, radians."""
    mirrored: bool = False

    def matrix(self) -> Float64Array:
        """Return the affine map (2, 3) from pixels of the crop to pixels of the photo."""
        scale, mirror = self.size / EDGE, -1.0 if self.mirrored else 1.0
        across = scale * mirror * np.array([np.cos(self.angle), np.sin(self.angle)])
        down = scale * np.array([-np.sin(self.angle), np.cos(self.angle)])
        turn = np.stack([across, down], axis=1)
        return np.column_stack([turn, np.array(self.centre) - turn @ [EDGE / 2, EDGE / 2]])


def crop_around(mesh: Float64Array) -> Crop:
    """Return the crop around a mesh (468, 3), its upper edge along the line of the eyes."""
    eyes = mesh[LEFT_EYE, :2] - mesh[RIGHT_EYE, :2]
    angle = float(np.arctan2(eyes[1], eyes[0]))
    turn = np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])
    along = mesh[:, :2] @ turn.T
    low, high = along.min(axis=0), along.max(axis=0)
    x, y = turn.T @ ((low + high) / 2)
    return Crop((float(x), float(y)), MARGIN * float((high - low).max()), angle)


def refine_crop(image: UInt8Array, crop: Crop, nets: NetProcess) -> Crop:
    """Return the crop around the mesh that is found in a crop."""
    return crop_around(find_mesh(image, [crop], nets)[0][0])


def wobble(crop: Crop, count: int) -> list[Crop]:
    """Return `count` shifted and zoomed copies of a crop, then their mirror images.

    The mirror images are those that the mirrored photo would give.
    """
    copies = [replace(crop, mirrored=mirrored) for mirrored in (False, True) for _ in range(count)]
    return [_moved(copy, *_WOBBLES[k % count]) for k, copy in enumerate(copies)]


def _moved(crop: Crop, right: float, below: float, zoom: float, turn_deg: float) -> Crop:
    """Return a crop shifted to its own right and down by shares of its edge, zoomed and turned."""
    turn = np.radians(-turn_deg if crop.mirrored else turn_deg)
    x, y = crop.matrix() @ [EDGE * (right + 0.5), EDGE * (below + 0.5), 1.0]
    angle = crop.angle + float(turn)
    return replace(crop, centre=(float(x), float(y)), size=zoom * crop.size, angle=angle)


def find_mesh(
    image: UInt8Array, crops: Sequence[Crop], nets: NetProcess
) -> tuple[Float64Array, Float64Array]:
    """Return meshes (C, 468, 3) in pixels of the photo, and how surely each is a face (C,), 0..1.

    The third coordinate is depth away from the camera, pixels, its zero near the head's middle. In
    a mirrored crop the network takes left for right: its points come in the mirrored order.
    """
    path = find_model(MESH)
    if path is None:
        raise FileNotFoundError(MESH)
    maps = [crop.matrix() for crop in crops]
    batch = np.stack([_cut(image, matrix) for matrix in maps])
    points, presence = nets.run(path, batch)
    meshes = points.reshape(-1, MESH_POINTS, 3).astype(np.float64)
    for mesh, matrix, crop in zip(meshes, maps, crops, strict=True):
        mesh[:, :2] = mesh[:, :2] @ matrix[:, :2].T + matrix[:, 2]
        mesh[:, 2] *= crop.size / EDGE
    return meshes, 1 / (1 + np.exp(-presence.reshape(-1).astype(np.float64)))


def _cut(image: UInt8Array, matrix: Float64Array) -> Float32Array:
    """Return a crop (192, 192, 3) in 0..1; OpenCV counts pixels from the first one's middle."""
    centred = matrix.copy()
    centred[:, 2] += matrix[:, :2] @ [0.5, 0.5] - 0.5
    cut = cv2.warpAffine(
        image, centred, (EDGE, EDGE), flags=cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP
    )
    return np.asarray(cut, np.float32) / np.float32(255)
