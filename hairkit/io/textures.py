"""Texture maps of mesh files: pictures checked when they are read, MTL materials, side files."""

from __future__ import annotations

import contextlib
import logging
import os
import re
from collections.abc import Mapping
from pathlib import Path, PurePosixPath

import numpy as np

from hairkit.arrays import UInt8Array
from hairkit.errors import FormatError, InputError
from hairkit.io.photos import MAX_BYTES, decode_picture
from hairkit.storage import read_bytes, read_text, replace_file, write_text
from hairkit.types.skin import JPEG, PNG, SkinMaps, Texture

_log = logging.getLogger("hairkit")

_MAX_MTL_BYTES = 2**24
_KINDS = {
    "map_kd": "albedo",
    "map_pr": "roughness",
    "norm": "normal",
    "map_kn": "normal",
    "bump": "bump",
    "map_bump": "bump",
}
"""Maps by the statements of MTL files; `map_Pr` and `norm` are of the PBR extension."""
_STATEMENTS = {"albedo": "map_Kd", "roughness": "map_Pr", "normal": "norm", "bump": "map_Bump"}
_OPTION = re.compile(r"-[a-zA-Z]+(\s+(on|off|[-+0-9.eE]+))*\s+")
"""An option before a picture's name, such as `-bm 1.0` or `-clamp on`."""
_COLOURED = 8
"""Levels of 255 by which the channels of a picture differ that is no grey map."""


def read_texture(path: str | os.PathLike[str]) -> Texture:
    """Return the texture in a picture file; `FormatError` or `InputError` where it is unusable."""
    return texture_of(read_bytes(path, MAX_BYTES), path)


def texture_of(data: bytes, source: str | os.PathLike[str]) -> Texture:
    """Return the texture of a picture file's bytes, decoded once to be sure that it is whole.

    PNG and JPEG files are kept as they are, WebP and TIFF files become PNG.
    """
    pixels = decode_picture(data, source)
    if data.startswith((PNG, JPEG)):
        return Texture(np.frombuffer(data, np.uint8))
    return Texture.encode(pixels)


def read_mtl(path: str | os.PathLike[str]) -> dict[str, dict[str, Path]]:
    """Return the pictures of each material of an MTL file, material and map by name.

    Names of pictures with a folder outside the file's own are looked for beside the file.
    Raises `FormatError` for what is no MTL file.
    """
    file = Path(path)
    materials: dict[str, dict[str, Path]] = {}
    maps: dict[str, Path] | None = None
    text = read_text(file, _MAX_MTL_BYTES)
    if "\0" in text:
        raise FormatError(f"{file}: not an MTL file, it holds binary data")
    for number, line in enumerate(text.splitlines(), 1):
        kind, _, rest = line.strip().partition(" ")
        if kind.lower() == "newmtl":
            maps = materials.setdefault(rest.strip().lower(), {})
        elif kind.lower() in _KINDS:
            if maps is None:
                raise FormatError(f"{file}: line {number} has a map before the first newmtl")
            name = rest.strip()
            while option := _OPTION.match(name):
                name = name[option.end() :]
            maps[_KINDS[kind.lower()]] = _beside(file, name)
    return materials


def read_maps(pictures: Mapping[str, Path]) -> dict[str, Texture]:
    """Return the textures of named picture files; missing ones are left out with a warning.

    A coloured picture that is named as a bump map is a normal map, as many programs write it.
    """
    found: dict[str, Texture] = {}
    for kind, path in pictures.items():
        if not path.exists():
            _log.warning("%s: no such picture; the head has no %s map", path, kind)
            continue
        texture = read_texture(path)
        coloured = np.ptp(texture.pixels[::8, ::8].astype(np.int16), axis=2).max() > _COLOURED
        found["normal" if kind == "bump" and coloured else kind] = texture
    return found


def as_maps(textures: Mapping[str, Texture]) -> SkinMaps | None:
    """Return the maps of named textures, or None where there are none."""
    return SkinMaps(**textures) if textures else None


def write_mtl(path: Path, maps: SkinMaps) -> None:
    """Write the pictures of a head's maps beside `path`, and `path`, an MTL file naming them."""
    write_pictures(path, maps)
    names = picture_names(path, maps).items()
    lines = ["newmtl skin", "Kd 1 1 1", *(f"{_STATEMENTS[kind]} {name}" for kind, name in names)]
    write_text(path, "\n".join(lines) + "\n")


def picture_names(path: Path, maps: SkinMaps) -> dict[str, str]:
    """Return the file names, by kind, of the maps that stand beside `path`: NAME.KIND.png."""
    present = maps.present().items()
    return {kind: f"{path.stem}.{kind}{texture.suffix}" for kind, texture in present}


def write_pictures(path: Path, maps: SkinMaps) -> None:
    """Write the maps beside `path`, all of them or, where that fails, none."""
    with contextlib.ExitStack() as parts:
        for kind, name in picture_names(path, maps).items():
            part = parts.enter_context(replace_file(path.with_name(name)))
            part.write_bytes(maps.present()[kind].data.tobytes())


def grey(texture: Texture, channel: int = 0) -> UInt8Array:
    """Return one channel (H, W) of a texture."""
    return np.ascontiguousarray(texture.pixels[..., channel])


def _beside(file: Path, name: str) -> Path:
    """Return the path of a picture: in the file's folder or below it, never outside."""
    inner = PurePosixPath(name.replace("\\", "/"))
    if not inner.name or "\0" in name:
        raise InputError(f"{file}: names no picture: {name[:80]!r}")
    outside = inner.is_absolute() or ".." in inner.parts or ":" in inner.parts[0]
    return file.parent / (inner.name if outside else inner)
