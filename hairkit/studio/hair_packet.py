"""A groom for the page: head, bust, hair and the guides that move it, as one block of bytes.

Four bytes `HKS3`, the length of a JSON header (uint32, little-endian), the header padded to a
multiple of four, then the arrays that it names with type, shape and place.
"""

from __future__ import annotations

import json
import struct
from dataclasses import replace
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import numpy.typing as npt

from hairkit.arrays import UInt8Array
from hairkit.grooming.densify import densify
from hairkit.grooming.guide_weights import closest_guides
from hairkit.grooming.locks import TAPER
from hairkit.grooming.prepare_export import point_colours
from hairkit.imaging.picture_file import encode_picture
from hairkit.rendering.context import shader_source
from hairkit.rendering.hair import packed_colours
from hairkit.rendering.head import Solid, bust_solid, head_solid
from hairkit.rendering.light import EXPOSURE, Lights, hair_density, light_volume
from hairkit.rendering.picture import display_width
from hairkit.storage import write_bytes
from hairkit.studio.project import PACKET
from hairkit.types.groom import Groom, HairMaterial
from hairkit.types.head import Head, Roots
from hairkit.types.strands import Strands

MAGIC = PACKET.encode()
HAIRS, POINTS = 9000, 16
"""Strands drawn and points of each: what a phone draws sixty times a second."""
MOST_GUIDES = 700
"""Guides of the head's hair that are simulated in the page."""
SKIN_EDGE, SKIN_QUALITY = 1024, 85
"""Longest edge in pixels, and JPEG quality, of the picture of the skin: about 100 kB."""
LIGHT_CELL = 0.006
"""Edge of a cell of the light through the hair, metres: about 1 MB."""
LIGHTS = Lights.studio((0.5, 0.6, 0.75), (-0.55, 0.6, -0.55), EXPOSURE)
"""Key light in front on the subject's left, rim light behind: they stay when the view turns."""


def write_packet(groom: Groom, path: Path, roots: Roots | None = None) -> None:
    """Write the packet of a groom."""
    write_bytes(path, packet_of(groom, roots))


def packet_of(groom: Groom, roots: Roots | None = None) -> bytes:
    """Return the packet of a groom; `roots` are those of the hair between its guides, if known."""
    strands, moved = groom.strands, page_guides(groom)
    guides = moved.strands
    hair = densify(groom, HAIRS, roots=roots).resampled(POINTS)
    shape = (-1, POINTS, 3)
    joined = Strands.from_list([*guides.points.reshape(shape), *hair.points.reshape(shape)])
    marked = np.arange(len(joined)) < len(guides)
    followed = closest_guides(replace(joined, guide=marked))
    head = groom.head
    own, bust = head_solid(head, groom.material), bust_solid(head, strands)
    solids = [own, *([] if bust is None else [bust])]
    light = light_volume(hair_density(hair, solids, LIGHT_CELL), LIGHTS)
    arrays: dict[str, npt.NDArray[Any]] = {
        **_mesh("head", own),
        "head_scalp": head.scalp.astype(np.float32),
        "head_eyes": _on_eyes(head),
        **({} if bust is None else _mesh("bust", bust)),
        "guides": guides.points.astype(np.float32).reshape(shape),
        "tint": packed_colours(point_colours(moved)).reshape(-1, POINTS),
        "stiff": guides.planted.astype(np.uint8),
        "hair": hair.points.astype(np.float32).reshape(shape),
        "carriers": followed.guides[len(guides) :].astype(np.float32),
        "weights": followed.weights[len(guides) :],
        "capsules": np.hstack(
            [head.capsules.first, head.capsules.second, head.capsules.radius]
        ).astype(np.float32),
        **_skin(head),
        "light": np.rint(255 * light.transmittance.transpose(2, 1, 0, 3)).astype(np.uint8),
    }
    facts = {
        "shading": shader_source("light_volume.glsl") + shader_source("hair_colour.glsl"),
        "look": LIGHTS.uniforms() | light.uniforms() | _look(hair, groom.material),
        "stiffness": groom.physics.stiffness,
        "strands": len(strands),
    }
    return pack(arrays, facts)


def page_guides(groom: Groom) -> Groom:
    """Return the guides of a groom that move in the page, of `POINTS` points."""
    strands = groom.strands
    step = max(1, -(-int((~strands.planted).sum()) // MOST_GUIDES))
    some = groom.select(strands.planted | (np.arange(len(strands)) % step == 0))
    return replace(some, strands=some.strands.resampled(POINTS))


def pack(arrays: dict[str, npt.NDArray[Any]], facts: dict[str, Any]) -> bytes:
    """Return arrays and facts as the page reads them."""
    places, blocks, at = {}, [], 0
    for name, array in arrays.items():
        data = np.ascontiguousarray(array).tobytes()
        data += bytes(-len(data) % 4)
        places[name] = {"type": array.dtype.name, "shape": array.shape, "at": at}
        blocks.append(data)
        at += len(data)
    header = json.dumps({"arrays": places, "facts": facts}).encode()
    header += b" " * (-len(header) % 4)
    return b"".join([MAGIC, struct.pack("<I", len(header)), header, *blocks])


def _mesh(name: str, solid: Solid) -> dict[str, npt.NDArray[Any]]:
    """Return points, normals, colours (V, 3), faces (F, 3) and texture coordinates (V, 2)."""
    uv = np.zeros((len(solid.vertices), 2)) if solid.uv is None else solid.uv
    return {
        f"{name}_points": solid.vertices.astype(np.float32),
        f"{name}_normals": solid.normals.astype(np.float32),
        f"{name}_colours": solid.colours.astype(np.float32),
        f"{name}_uv": uv.astype(np.float32),
        f"{name}_faces": solid.faces.astype(np.uint32),
    }


def _look(hair: Strands, material: HairMaterial) -> dict[str, Any]:
    """Return width in metres and taper of the hair as uniforms of its shader."""
    return {"u_width": float(display_width(replace(hair, widths=None), material)), "u_taper": TAPER}


def _on_eyes(head: Head) -> npt.NDArray[np.float32]:
    """Return (V,) 1 on the eyeballs, 0 elsewhere."""
    found = np.zeros(len(head.vertices), np.float32)
    if head.eye_vertices is not None:
        found[head.eye_vertices.ravel()] = 1
    return found


def _skin(head: Head) -> dict[str, UInt8Array]:
    """Return the picture (N,) of the skin as a JPEG file, where the head has one."""
    if head.maps is None or head.maps.albedo is None:
        return {}
    pixels = head.maps.albedo.pixels
    scale = min(1.0, SKIN_EDGE / max(pixels.shape[:2]))
    small = cv2.resize(pixels, None, fx=scale, fy=scale, interpolation=cv2.INTER_AREA)
    data = encode_picture(np.asarray(small, np.uint8), ".jpg", SKIN_QUALITY)
    return {"head_skin": np.frombuffer(data, np.uint8)}
