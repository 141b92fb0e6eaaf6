"""A small synthetic head with hair, for tests of plugins: the arguments of every stage.

The head is a ball of 10 cm radius, the hair a shell around its upper half, combed straight down.
Eight cameras see it, 45 degrees apart. Nothing here is random.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any, get_type_hints

import cv2
import numpy as np

from hairkit.arrays import BoolArray, Float32Array
from hairkit.field.growth_prior import measure_scalp_distance
from hairkit.io.capture_reader import TURN
from hairkit.stages import OF_HOOK
from hairkit.types.camera import Camera
from hairkit.types.capture import Capture, View
from hairkit.types.edits import Brush, Edit, Edits
from hairkit.types.evidence import Evidence
from hairkit.types.face import Face
from hairkit.types.groom import Groom
from hairkit.types.head import Capsules, Head, Roots
from hairkit.types.mask import BACKGROUND, HAIR, PERSON, Mask
from hairkit.types.orientation import OrientationMap, wrap_angle
from hairkit.types.person import Person
from hairkit.types.scene import Scene
from hairkit.types.skin import Texture
from hairkit.types.strands import Strands
from hairkit.types.texture_example import TextureExample
from hairkit.types.volume import Hull, OrientationField, VoxelGrid, outer_products

VIEW_NAMES = tuple(TURN)
"""Views of the nominal turn, 45 degrees apart, towards the subject's left."""
_WIDTH, _HEIGHT = 96, 128
"""Pixels of a photo."""
_FOCAL = 200.0
"""Focal length, pixels: the ball and its hair fill half of the picture's height."""
_DISTANCE = 0.6
"""Metres from a camera to the middle of the ball."""
_BETWEEN_VIEWS = 45.0
"""Degrees from one camera to the next."""
_BALL, _HAIR = 0.1, 0.125
"""Radii of the head and of the outer surface of its hair, metres."""
_HULL_EDGE = 0.3
"""Edge of the cube of voxels around ball and hair, metres."""
_GREY = 110
"""Mean grey of the stripes, of 255."""
_FINE_STRIPES, _COARSE_STRIPES = (60, 6), (20, 17)
"""Amplitude in grey levels and period in pixels: strands, and locks of them."""
_NECK = -0.1
"""Height of the neck's joint, metres; the root is as far below it as the head's joint above."""
_TEXTURE, _TEXTURE_STRIPES, _EXAMPLE_STRIPES = 64, 20.0, 70.0
"""Edge of a texture in pixels, and the directions of its stripes and its example's, degrees."""
_BRISTLE, _BRISTLE_POINTS = 0.03, 5
"""Length of the straight strands in metres, and their points."""


def stage_arguments(stage: str, folder: Path | None = None) -> dict[str, Any]:
    """Return the arguments of a stage hook without `options`, all of the same small head.

    Parameters
    ----------
    stage
        Name of the hook: `orient`.
    folder
        An empty folder for the photos of `capture`, or the file of `export_groom` or
        `import_groom`.
    """
    capture, scene = turn_capture(), turn_scene()
    masks = tuple(ball_mask(camera) for camera in scene.cameras)
    if stage == "capture":
        return {"source": _write_photos(folder, capture), "max_edge": _HEIGHT}
    if stage in ("make_simulator", "export_groom", "import_groom"):
        return _groom_arguments(stage, folder)
    if stage == "enhance_texture":
        return _texture_arguments()
    hull = shell_hull()
    every: dict[str, Any] = {
        "capture": capture,
        "view": capture.views[0],
        "faces": (Face.absent(),) * len(masks),
        "persons": tuple(ball_person(mask) for mask in masks),
        "mask": masks[0],
        "masks": masks,
        "head": scene.head,
        "scene": scene,
        "start": None,
        "orientations": tuple(combed_orientation(mask) for mask in masks),
        "hull": hull,
        "field": combed_field(hull.grid),
        "scalp_distance": measure_scalp_distance(scene.head, hull),
        "roots": scalp_roots(scene.head),
        "groom": bristle_groom(),
        "edits": Edits((Edit(np.eye(3, dtype=np.float32) * _HAIR, Brush("comb")),)),
    }
    kinds = get_type_hints(Evidence)
    return {name: every[name] if name in every else kinds[name]() for name in OF_HOOK[stage].takes}


def striped_view(angle_deg: float, *, name: str = "front", azimuth_deg: float = 0.0) -> View:
    """Return a photo whose strands all run at `angle_deg`, from +x towards +y (y down)."""
    row, column = np.mgrid[:_HEIGHT, :_WIDTH] + 0.5
    angle = np.radians(angle_deg)
    across = -np.sin(angle) * column + np.cos(angle) * row
    grey = np.full_like(across, _GREY)
    for amplitude, period in (_FINE_STRIPES, _COARSE_STRIPES):
        grey = grey + amplitude * np.sin(2 * np.pi * across / period)
    image = np.repeat(grey[..., None], 3, axis=-1).astype(np.uint8)
    return View(name, azimuth_deg, image, focal_px=_FOCAL)


def turn_capture() -> Capture:
    """Return the eight photos of the turn, with upright stripes."""
    return Capture(
        tuple(
            striped_view(90.0, name=name, azimuth_deg=_BETWEEN_VIEWS * number)
            for number, name in enumerate(VIEW_NAMES)
        )
    )


def turn_scene() -> Scene:
    """Return the eight true cameras and the ball head."""
    cameras = tuple(
        Camera.on_turn(
            _BETWEEN_VIEWS * number, distance=_DISTANCE, focal=_FOCAL, width=_WIDTH, height=_HEIGHT
        )
        for number in range(len(VIEW_NAMES))
    )
    return Scene(VIEW_NAMES, cameras, ball_head())


def ball_head(rings: int = 12) -> Head:
    """Return a ball of 10 cm as a closed mesh of `2 * rings` meridians, its scalp above y = 0."""
    segments = 2 * rings
    polar = np.linspace(0, np.pi, rings + 1)[1:-1, None]
    around = np.linspace(0, 2 * np.pi, segments, endpoint=False)[None, :]
    y, ring = np.cos(polar) + 0 * around, np.sin(polar)
    sides = np.stack([ring * np.sin(around), y, ring * np.cos(around)], axis=-1).reshape(-1, 3)
    poles = np.array([[0.0, 1.0, 0.0]]), np.array([[0.0, -1.0, 0.0]])
    vertices = (_BALL * np.concatenate([poles[0], sides, poles[1]])).astype(np.float32)
    here = 1 + np.arange((rings - 2) * segments)
    beside = 1 + (here - 1) // segments * segments + here % segments
    first, last = 1 + np.arange(segments), len(vertices) - 1 - segments + np.arange(segments)
    faces = [
        np.stack([0 * first, first, np.roll(first, -1)], axis=-1),
        np.stack([here, here + segments, beside], axis=-1),
        np.stack([beside, here + segments, beside + segments], axis=-1),
        np.stack([last, np.full(segments, len(vertices) - 1), np.roll(last, -1)], axis=-1),
    ]
    centre = np.zeros((1, 3), np.float32)
    return Head(
        vertices,
        np.concatenate(faces),
        (0.5 + 0.5 * vertices[:, [0, 2]] / _BALL).astype(np.float32),
        (vertices[:, 1] > 0.0).astype(np.float32),
        None,
        np.array([[0, 2 * _NECK, 0], [0, _NECK, 0], [0, 0, 0]], np.float32),
        Capsules(centre, centre, np.full((1, 2), _BALL, np.float32)),
    )


def ball_mask(camera: Camera) -> Mask:
    """Return the true labels of the ball and its hair in a camera."""
    column, row = np.meshgrid(np.arange(camera.width) + 0.5, np.arange(camera.height) + 0.5)
    start, way = camera.rays(np.stack([column, row], axis=-1))
    nearest = start - way * np.sum(start * way, axis=-1, keepdims=True)
    distance = np.linalg.norm(nearest, axis=-1)
    labels = np.where(distance < _BALL, PERSON, BACKGROUND)
    labels[(distance < _HAIR) & (nearest[..., 1] > 0)] = HAIR
    return Mask(labels, True)


def ball_person(mask: Mask) -> Person:
    """Return the ball and its hair as a certain person."""
    return Person(np.where(mask.person, np.uint8(255), np.uint8(0)))


def combed_orientation(mask: Mask) -> OrientationMap:
    """Return vertical strands, with confidence 1 on all hair."""
    upright = np.full(mask.labels.shape, np.pi / 2)
    return OrientationMap(wrap_angle(upright), mask.hair.astype(np.float32))


def shell_hull(spacing: float = 0.01) -> Hull:
    """Return the shell of hair around the upper half of the ball, as cells."""
    grid = VoxelGrid.around(np.full(3, -_HULL_EDGE / 2), np.full(3, _HULL_EDGE / 2), spacing)
    distance, shell = _shell(grid, _HAIR)
    return Hull(grid, shell, _shell(grid, _HAIR + spacing)[1], distance)


def combed_field(grid: VoxelGrid) -> OrientationField:
    """Return the field of hair combed along the ball, straight down, on a hull's grid."""
    centres = grid.centres().astype(np.float64)
    out = centres / np.linalg.norm(centres, axis=-1, keepdims=True)
    down = np.array([0.0, -1.0, 0.0]) + out * out[..., 1:2]
    down /= np.maximum(np.linalg.norm(down, axis=-1, keepdims=True), 1e-9)
    growth = np.arccos(np.clip(out[..., 1], -1, 1)) * _HAIR
    confidence = _shell(grid, _HAIR)[1].astype(np.float32)
    tensor = outer_products(down).astype(np.float32)
    return OrientationField(grid, tensor, confidence, growth.astype(np.float32))


def scalp_roots(head: Head) -> Roots:
    """Return one root in the middle of every face of the scalp."""
    triangle = np.flatnonzero((head.scalp[head.faces] > 0.5).all(axis=1)).astype(np.int32)
    barycentric = np.full((len(triangle), 3), 1 / 3, np.float32)
    corners = head.faces[triangle]
    normals = head.normals()[corners].mean(axis=1)
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    positions, uv = head.vertices[corners].mean(axis=1), head.uv[corners].mean(axis=1)
    return Roots(positions, normals, uv, triangle, barycentric)


def bristle_groom() -> Groom:
    """Return straight strands of 3 cm along the scalp's normals, bound to the ball head."""
    head = ball_head()
    roots = scalp_roots(head)
    along = np.linspace(0.0, _BRISTLE, _BRISTLE_POINTS, dtype=np.float32)[None, :, None]
    points = roots.positions[:, None] + along * roots.normals[:, None]
    offsets = np.arange(len(roots) + 1) * _BRISTLE_POINTS
    strands = Strands(points.reshape(-1, 3), offsets, root_uv=roots.uv)
    return Groom(strands, head, roots.triangle, roots.barycentric)


def _shell(grid: VoxelGrid, radius: float) -> tuple[Float32Array, BoolArray]:
    centres = grid.centres().astype(np.float64)
    distance = np.linalg.norm(centres, axis=-1)
    hair = (distance > _BALL) & (distance < radius) & (centres[..., 1] > 0)
    return (distance - _BALL).astype(np.float32), hair


def _texture_arguments() -> dict[str, Any]:
    """Return stripes as the texture, and stripes of another direction as its example."""
    texture, filtered = (
        Texture.encode(striped_view(angle).image[:_TEXTURE, :_TEXTURE])
        for angle in (_TEXTURE_STRIPES, _EXAMPLE_STRIPES)
    )
    return {"texture": texture, "example": TextureExample(filtered)}


def _write_photos(folder: Path | None, capture: Capture) -> str:
    """Write the photos as `front.png`, ... and return their folder."""
    if folder is None:
        raise ValueError("stage_arguments('capture') needs a folder to put the photos in")
    for view in capture.views:
        cv2.imwrite(str(folder / f"{view.name}.png"), view.image[..., ::-1])
    return str(folder)


def _groom_arguments(stage: str, folder: Path | None) -> dict[str, Any]:
    groom = bristle_groom()
    if stage == "make_simulator":
        return {"groom": groom}
    if folder is None:
        raise ValueError(f"stage_arguments({stage!r}) needs a folder to put the file in")
    if stage == "export_groom":
        return {"groom": groom, "path": folder / "groom.out"}
    groom.save(folder / "groom.npz")
    return {"path": folder / "groom.npz"}
