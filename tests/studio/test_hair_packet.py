"""Laws of the block of bytes that brings a groom into the page."""

from __future__ import annotations

import json
import struct
from dataclasses import replace
from typing import Any

import cv2
import numpy as np

from hairkit.head_model.template import default_head
from hairkit.studio import hair_packet
from hairkit.studio.hair_packet import MAGIC, SKIN_EDGE, packet_of
from hairkit.synth import grow
from hairkit.types.groom import Groom
from hairkit.types.skin import SkinMaps, Texture


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
