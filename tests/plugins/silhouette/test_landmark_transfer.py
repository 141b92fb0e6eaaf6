"""Laws of transferring landmarks to neighbouring views by template matching."""

from __future__ import annotations

import cv2
import numpy as np
import pytest
from hairkit_plugins.silhouette.landmark_transfer import PatchSettings, transfer_landmarks
from turntable import turntable

from hairkit import Camera, Capture, Head, View
from hairkit.arrays import Float64Array, UInt8Array
from hairkit.head_model.template import default_head

SIZE = (810, 1080)


def _spotted(camera: Camera, head: Head) -> UInt8Array:
    """Return a picture of the head with skin of random blotches, as a camera sees it."""
    image = np.full((SIZE[1], SIZE[0], 3), 128, np.uint8)
    shades = np.random.default_rng(0).integers(0, 255, len(head.vertices))
    facing = -(head.normals() * camera.view_direction(head.vertices)).sum(1)
    order = np.argsort(-camera.depth(head.vertices))
    pixels = camera.project(head.vertices)
    for vertex in order[facing[order] > 0.1]:
        x, y = pixels[vertex].round().astype(int).tolist()
        cv2.circle(image, (x, y), 4, (int(shades[vertex]),) * 3, -1)
    return image


def _pair(landmarks: bool) -> tuple[Capture, tuple[Camera, ...], Float64Array]:
    head = default_head()
    places = head.vertices[head.landmark_vertices].astype(np.float64)
    cameras = tuple(
        Camera.on_turn(azimuth, distance=0.7, focal=1400, width=SIZE[0], height=SIZE[1])
        for azimuth in (45.0, 90.0, 225.0)
    )
    views = tuple(
        View(
            str(index),
            camera.azimuth_deg,
            _spotted(camera, head),
            landmarks=camera.project(places) if index == 0 and landmarks else None,
        )
        for index, camera in enumerate(cameras)
    )
    return Capture(views), cameras, places


@pytest.mark.parametrize("error_deg", [0.0, 2.0])
def test_landmarks_are_found_where_the_neighbour_sees_them(error_deg: float) -> None:
    """Matches lie within a few pixels of the truth although the neighbour's camera is off."""
    capture, cameras, places = _pair(landmarks=True)
    believed = (cameras[0], _turned(cameras[1], error_deg), cameras[2])
    found = transfer_landmarks(capture, believed, default_head(), places, PatchSettings())
    assert len(found) >= 2
    assert set(found.view) == {1}
    assert (found.point >= 17).all()
    off = np.linalg.norm(found.pixel - cameras[1].project(places)[found.point], axis=1)
    assert np.median(off) < 3


def _turned(camera: Camera, degrees: float) -> Camera:
    return Camera.on_turn(
        camera.azimuth_deg + degrees, distance=0.7, focal=1400, width=SIZE[0], height=SIZE[1]
    )


def test_nothing_is_carried_without_landmarks() -> None:
    """A capture without landmarks gives none."""
    capture, cameras, places = _pair(landmarks=False)
    assert not len(transfer_landmarks(capture, cameras, default_head(), places, PatchSettings()))


def test_pictures_without_texture_match_nothing(rng: np.random.Generator) -> None:
    """Uniform pictures have no clear peak, so no landmark is made up."""
    table = turntable(rng)
    places = table.head.vertices[table.head.landmark_vertices].astype(np.float64)
    found = transfer_landmarks(table.capture, table.cameras, table.head, places, PatchSettings())
    assert not len(found)
