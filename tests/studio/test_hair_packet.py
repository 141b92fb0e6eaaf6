"""Laws of the block of bytes that brings a groom into the page."""

from __future__ import annotations

import json
import struct
from dataclasses import replace
from pathlib import Path
from typing import Any

import cv2
import numpy as np

from hairkit.grooming.densify import densify
from hairkit.head_model.template import default_head
from hairkit.rendering.picture import draw_views
from hairkit.studio import hair_packet
from hairkit.studio.hair_packet import (
    HAIRS,
    LIGHTS,
    MAGIC,
    POINTS,
    SKIN_EDGE,
    packet_of,
    write_packet,
)
from hairkit.studio.result_page import result_page
from hairkit.synth import grow
from hairkit.types.camera import Camera
from hairkit.types.groom import Groom
from hairkit.types.skin import SkinMaps, Texture

LEVELS = 10
"""Tolerance of a mean colour, in levels of 255: strands are drawn otherwise, their light is one."""


def arrays_of(groom: Groom) -> dict[str, np.ndarray[Any, Any]]:
    """Return the arrays of a groom's packet, read as `readPacket` of the page does."""
    data = packet_of(groom)
    assert data[:4] == MAGIC
    size = struct.unpack("<I", data[4:8])[0]
    places = json.loads(data[8 : 8 + size])["arrays"]
    arrays = {}
    for name, place in places.items():
        assert (8 + size + place["at"]) % 4 == 0, name  # or the browser refuses the view
        count = int(np.prod(place["shape"]))
        read = np.frombuffer(data, place["type"], count, 8 + size + place["at"])
        arrays[name] = read.reshape(place["shape"])
    return arrays


def test_a_packet_shows_the_head_as_it_is(monkeypatch: Any) -> None:
    """Head with its eyes and its skin, the bust below it, and hair that follows its guides."""
    monkeypatch.setattr(hair_packet, "HAIRS", 200)
    groom = grow("parted", default_head(), 40)
    plain = arrays_of(groom)
    assert plain["head_points"].shape == groom.head.vertices.shape
    assert set(np.flatnonzero(plain["head_eyes"])) == set(groom.head.eye_vertices.ravel())
    assert len(plain["bust_faces"]) > 0
    assert plain["weights"].sum(axis=1).round(5).tolist() == [1.0] * len(plain["hair"])
    assert plain["carriers"].max() < len(plain["guides"])
    red = np.zeros((2048, 2048, 3), np.uint8)
    red[..., 0] = 200
    head = replace(groom.head, maps=SkinMaps(albedo=Texture.encode(red, lossless=False)))
    skin = cv2.imdecode(arrays_of(replace(groom, head=head))["head_skin"], cv2.IMREAD_COLOR)
    assert skin.shape == (SKIN_EDGE, SKIN_EDGE, 3)
    assert abs(skin[..., ::-1].reshape(-1, 3).mean(axis=0) - (200, 0, 0)).max() < 3


def test_hair_has_the_colour_of_the_picture(browser: Any, tmp_path: Path) -> None:
    """Long hair in the page is as bright and brown as `draw_views` draws it in the same light."""
    groom = grow("straight", default_head(), 300)
    write_packet(groom, tmp_path / "packet")
    (tmp_path / "hair.html").write_bytes(result_page(tmp_path / "packet"))
    with browser.new_page(viewport={"width": 480, "height": 480}) as page:
        page.goto((tmp_path / "hair.html").as_uri())
        seen = page.evaluate(
            """async () => {
              const { hairView: view } = document.getElementById("hair");
              view.azimuth = Math.PI;
              for (let k = 0; k < 3; k += 1) await new Promise(requestAnimationFrame);
              const { eye, right, up, back } = view.camera();
              return { eye, right, up, back, size: [view.canvas.width, view.canvas.height] };
            }"""
        )
        shot = page.locator("canvas").screenshot()
    shown = cv2.imdecode(np.frombuffer(shot, np.uint8), cv2.IMREAD_COLOR)[..., ::-1]
    width, height = seen["size"]
    place = np.eye(4)
    place[:3, :3] = [seen["right"], -np.array(seen["up"]), -np.array(seen["back"])]
    place[:3, 3] = -place[:3, :3] @ seen["eye"]
    focal = height / 2 / np.tan(0.25)
    camera = Camera(place, focal, np.array([width, height]) / 2, width, height)
    hair = densify(groom, HAIRS).resampled(POINTS)
    [drawn] = draw_views(hair, groom.head, [camera], material=groom.material, lights=LIGHTS)
    box = np.s_[height // 3 : height // 2, 2 * width // 5 : 3 * width // 5]
    assert abs(shown[box].mean(axis=(0, 1)) - drawn[box].mean(axis=(0, 1))).max() < LEVELS
