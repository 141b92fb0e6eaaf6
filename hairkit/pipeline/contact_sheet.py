"""One picture that tells how a groom came about: photos, masks, orientation, hull, guides, hair."""

from __future__ import annotations

import os
from collections.abc import Iterable, Sequence
from dataclasses import replace

import cv2
import numpy as np
import numpy.typing as npt

from hairkit.arrays import Float32Array, Int32Array, UInt8Array
from hairkit.cameras.depth_raster import front_values, mesh_depth
from hairkit.field.isosurface import volume_surface
from hairkit.grooming.densify import densify
from hairkit.imaging.picture_file import write_picture
from hairkit.pipeline.figure import AMBER, GREEN, RED, Figure
from hairkit.rendering import Lights, draw_views
from hairkit.rendering.framebuffer import SUPERSAMPLE, average_samples, supersample_camera
from hairkit.rendering.picture import backdrop
from hairkit.types.camera import Camera
from hairkit.types.capture import Capture
from hairkit.types.evidence import Evidence
from hairkit.types.groom import Groom
from hairkit.types.mask import HAIR, PERSON, Mask
from hairkit.types.orientation import OrientationMap
from hairkit.types.skin_look import SkinLook
from hairkit.types.volume import Hull

TILE_WIDTH = 160
"""Width of one picture on the sheet, pixels."""
GAP = 4
"""Pixels between pictures."""
HEADER = 24
"""Height of the line of view names, pixels."""
HEALTH_LINE = 20
"""Height of a line of health, pixels."""
HAIRS = 2500
"""Strands of the hair in the last row: a pixel of a tile is millimetres wide."""
LEAST_WIDTH = 920
"""Width of a sheet of few photos, pixels, for the lines of health."""
WIDER = np.float32(3)
"""Factor of their width: they stand for all of the hair."""
HAIR_POINTS = 20
"""Points of each of them."""
GUIDE_STEP = 0.002
"""Metres between the points that guides are drawn as."""
CLAY = np.array((168, 162, 156))
"""sRGB of hull and head where they face the camera, whose light is at the lens."""
_LEVELS = np.indices((5, 5, 5)).reshape(3, -1).T / 4
"""(125, 3) colours of a guide's direction: red runs left and right, green front and back, blue up
and down, as in tractography."""
_DARKER = 0.55
"""Brightness of every other guide, so that neighbours can be told apart."""
KEY_DIRECTION, RIM_DIRECTION = (0.4, 0.8, 0.6), (-0.4, 0.7, -0.6)
"""Towards the lights: one before the face, one behind the head, both from above."""
KEY, SKY, GROUND = (1.3, 1.26, 1.2), (1.15, 1.15, 1.17), (0.72, 0.71, 0.7)
"""Linear RGB of lights, sky and floor, chosen so that skin has the brightness that it has in the
photos of evenly lit rooms."""
EXPOSURE = 0.68
"""Factor of all light in these pictures."""
_STUDIO = Lights.studio(KEY_DIRECTION, RIM_DIRECTION, EXPOSURE)
LIGHTS = replace(_STUDIO, key_colour=KEY, rim_colour=KEY, sky_colour=SKY, ground_colour=GROUND)
LOOK = SkinLook(mean_free_path=(0.0, 0.0, 0.0))
"""Skin that scatters no light sideways: a pixel is as wide as light goes in the flesh."""
PAPER, INK = 250, 60
_HAIR_TINT, _PERSON_TINT = (232, 60, 132), (70, 130, 235)
_HAIR_OPACITY, _PERSON_OPACITY = 0.6, 0.35
"""Shares of the tints over the grey photo, which stays visible through them."""
_FONT, _FONT_SCALE, _BOX_GREY = cv2.FONT_HERSHEY_SIMPLEX, 0.45, 40
"""The letters of names, ten pixels high, and the grey behind those on pictures."""
_DOT_PX = 5
"""Radius of a light before a line of health."""
_LIGHT_COLOURS = {GREEN: (60, 160, 70), AMBER: (235, 160, 30), RED: (215, 50, 45)}
_ROWS = ("photo", "mask", "orientation", "hull", "guides", "hair")


def write_contact_sheet(
    path: str | os.PathLike[str],
    capture: Capture,
    evidence: Evidence,
    groom: Groom,
    health: Sequence[Figure] = (),
) -> None:
    """Write the sheet to `path` (PNG): one column a view, one row a stage, health below.

    Masks and orientation maps may have any size; they are shown over the photos of `capture`.
    """
    write_picture(path, contact_sheet(capture, evidence, groom, health), 1)


def contact_sheet(
    capture: Capture, evidence: Evidence, groom: Groom, health: Sequence[Figure] = ()
) -> UInt8Array:
    """Return the sheet (H, W, 3) RGB that `write_contact_sheet` writes."""
    first = evidence.scene.cameras[0]
    size = TILE_WIDTH, round(TILE_WIDTH * first.height / first.width)
    photos = [_fit(view.image, size, PAPER) for view in capture.views]
    cameras = [camera.fitted(*size) for camera in evidence.scene.cameras]
    groom = _with_small_maps(_with_few_guides(groom))
    rows = (
        photos,
        [mask_picture(photo, mask) for photo, mask in zip(photos, evidence.masks, strict=True)],
        [_hsv_picture(map_, size) for map_ in evidence.orientations],
        _hull_pictures(evidence.hull, cameras),
        _guide_pictures(groom, cameras),
        _hair_pictures(groom, cameras),
    )
    pictures = _arrange(rows, [view.name for view in capture.views], size)
    return np.concatenate([pictures, _health_lines(health, pictures.shape[1])])


def _with_few_guides(groom: Groom) -> Groom:
    """Return the groom with as many guides as the last row has hairs; the first cover the scalp."""
    few = np.arange(len(groom.strands)) < HAIRS
    return groom if few.all() else groom.select(few)


def _with_small_maps(groom: Groom) -> Groom:
    """Return the groom with textures as fine as heads on the sheet are, where they are finer."""
    if groom.head.maps is None:
        return groom
    small = {name: map_.at_eighth() for name, map_ in groom.head.maps.present().items()}
    fine = {name: map_ for name, map_ in small.items() if len(map_.pixels) >= TILE_WIDTH}
    return replace(groom, head=replace(groom.head, maps=replace(groom.head.maps, **fine)))


def _fit(image: npt.NDArray[np.uint8], size: tuple[int, int], around: int = 0) -> UInt8Array:
    """Return the whole picture in the middle of one of a width and height, one grey around."""
    scale = min(size[0] / image.shape[1], size[1] / image.shape[0])
    inner = round(scale * image.shape[1]), round(scale * image.shape[0])
    left, top = (np.array(size) - inner) // 2
    result = np.full((size[1], size[0], *image.shape[2:]), around, np.uint8)
    part = result[top : top + inner[1], left : left + inner[0]]
    part[:] = cv2.resize(image, inner, interpolation=cv2.INTER_AREA)
    return result


def mask_picture(photo: UInt8Array, mask: Mask) -> UInt8Array:
    """Return the photo, hair tinted pink and the rest of the person blue."""
    size = (photo.shape[1], photo.shape[0])
    hair, person = (
        _fit((mask.labels == label) * np.uint8(255), size)[..., None] / 255 * opacity
        for label, opacity in ((HAIR, _HAIR_OPACITY), (PERSON, _PERSON_OPACITY))
    )
    grey = photo.mean(axis=2, keepdims=True) * (1 - hair - person)
    return np.asarray(grey + hair * _HAIR_TINT + person * _PERSON_TINT).astype(np.uint8)


def _hsv_picture(map_: OrientationMap, size: tuple[int, int]) -> UInt8Array:
    """Return hue for the angle and brightness for the confidence."""
    every = max(1, map_.angle.shape[1] // (2 * size[0]))
    angle, sure = map_.angle[::every, ::every], np.sqrt(map_.confidence[::every, ::every])
    hsv = np.stack([angle * (180 / np.pi), np.full_like(angle, 200), sure * 255], axis=-1)
    rgb = cv2.cvtColor(hsv.astype(np.uint8), cv2.COLOR_HSV2RGB)
    return _fit(np.asarray(rgb, np.uint8), size)


def _hull_pictures(hull: Hull, cameras: Sequence[Camera]) -> list[UInt8Array]:
    """Return the dense cells from each camera, as clay."""
    vertices, faces, _ = volume_surface(hull.grid, hull.dense, step=2)  # a pixel is two cells
    fine = [supersample_camera(camera, SUPERSAMPLE) for camera in cameras]
    clay = [_clay(vertices, faces, camera) for camera in fine]
    return [average_samples(*each) for each in zip(clay, cameras, strict=True)]


def _guide_pictures(groom: Groom, cameras: Sequence[Camera]) -> list[UInt8Array]:
    """Return the guides from each camera, coloured by direction, on a head of clay."""
    strands, head = groom.strands.resampled_by_length(GUIDE_STEP), groom.head
    level = np.rint(4 * np.abs(strands.tangents()[:, [0, 2, 1]])).astype(np.int64)
    other = np.repeat(np.arange(len(strands)) % 2, strands.counts)
    values = (1 + level @ (25, 5, 1) + len(_LEVELS) * other).astype(np.uint8)
    colours = 255 * np.concatenate([_LEVELS, _DARKER * _LEVELS])
    pictures = []
    for camera in cameras:
        fine = supersample_camera(camera, SUPERSAMPLE)
        picture = _clay(head.vertices, head.faces, fine)
        front = front_values(fine, strands.points, values, head)
        picture[front > 0] = colours[front[front > 0] - 1]
        pictures.append(average_samples(picture, camera))
    return pictures


def _clay(vertices: Float32Array, faces: Int32Array, camera: Camera) -> UInt8Array:
    """Return a picture (H, W, 3) of a mesh, as bright as it faces the camera (Lambert 1760)."""
    depth, picture = mesh_depth(vertices, faces, camera), backdrop(camera)
    shown = np.isfinite(depth)
    down, right = np.gradient(np.where(shown, depth, depth[shown].max(initial=0)))
    facing = 1 / np.hypot(1, camera.pixels_per_metre * np.hypot(down, right))
    picture[shown] = facing[shown, None] * CLAY
    return picture


def _hair_pictures(groom: Groom, cameras: Sequence[Camera]) -> list[UInt8Array]:
    """Return pictures of the groom's hair on its head."""
    hair = densify(groom, HAIRS).resampled(HAIR_POINTS)
    assert hair.widths is not None  # densify gives them
    return draw_views(
        replace(hair, widths=WIDER * hair.widths),
        groom.head,
        cameras,
        material=groom.material,
        lights=LIGHTS,
        bust=True,
        skin=LOOK,
    )


def _arrange(
    rows: Iterable[Sequence[UInt8Array]], names: Sequence[str], size: tuple[int, int]
) -> UInt8Array:
    width, height = size
    count = len(names)
    sheet_width = max(count * (width + GAP) + GAP, LEAST_WIDTH)
    sheet = np.full((HEADER + len(_ROWS) * (height + GAP), sheet_width, 3), PAPER, np.uint8)
    for column, name in enumerate(names):
        _write(sheet, name, (GAP + column * (width + GAP) + 2, HEADER - 8), INK)
    for index, tiles in enumerate(rows):
        top = HEADER + index * (height + GAP)
        for column, tile in enumerate(tiles):
            left = GAP + column * (width + GAP)
            sheet[top : top + height, left : left + width] = tile
        _write(sheet, _ROWS[index], (GAP + 5, top + 15), 255, boxed=True)
    return sheet


def _health_lines(health: Sequence[Figure], width: int) -> UInt8Array:
    """Return one line a figure, (H, width, 3), with a dot of its light before it."""
    paper = np.full((len(health) * HEALTH_LINE, width, 3), PAPER, np.uint8)
    for index, figure in enumerate(health):
        middle = (index * HEALTH_LINE) + HEALTH_LINE // 2
        dot = (GAP + _DOT_PX, middle)
        cv2.circle(paper, dot, _DOT_PX, _LIGHT_COLOURS[figure.light], cv2.FILLED, cv2.LINE_AA)
        _write(paper, figure.line(), (GAP + 4 * _DOT_PX, middle + _DOT_PX), INK)
    return paper


def _write(
    sheet: UInt8Array, text: str, at: tuple[int, int], grey: int, boxed: bool = False
) -> None:
    if boxed:
        (width, height), _ = cv2.getTextSize(text, _FONT, _FONT_SCALE, 1)
        low = (at[0] - 4, at[1] + 6)
        high = (at[0] + width + 4, at[1] - height - 4)
        cv2.rectangle(sheet, low, high, (_BOX_GREY,) * 3, cv2.FILLED)
    cv2.putText(sheet, text, at, _FONT, _FONT_SCALE, (grey,) * 3, 1, cv2.LINE_AA)
