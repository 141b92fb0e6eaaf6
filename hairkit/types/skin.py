"""What a head wears: texture maps of its skin, and shapes that blend into it."""

from __future__ import annotations

from dataclasses import dataclass, fields
from functools import cached_property

import numpy as np
import numpy.typing as npt

from hairkit.arrays import Float32Array, UInt8Array, freeze
from hairkit.errors import DataError
from hairkit.storage import Stored

PNG, JPEG = b"\x89PNG\r\n\x1a\n", b"\xff\xd8\xff"
"""First bytes of the two kinds of picture files that all mesh formats take."""
PNG_SIZE = slice(16, 20), slice(20, 24)
"""Bytes of a PNG file that hold its width and height."""
LARGEST_TEXTURE = 64_000_000
"""Pixels of a texture at most: 8,000 x 8,000."""
JPEG_QUALITY = 92
"""Of 100, for textures that come from photos."""


@dataclass(frozen=True, eq=False)
class Texture(Stored):
    """A picture over the texture coordinates, kept as the PNG or JPEG file that it is.

    v of the texture coordinates runs from the picture's lower edge to its upper one.
    """

    data: UInt8Array
    """(N,) the bytes of the file."""

    def __post_init__(self) -> None:
        data = freeze(self, "data", np.uint8, (None,), "texture data")
        if not data[:8].tobytes().startswith((PNG, JPEG)):
            raise DataError("a texture is neither a PNG nor a JPEG file")

    def __repr__(self) -> str:
        return f"Texture({self.media_type}, {len(self.data)} bytes)"

    @classmethod
    def encode(cls, pixels: npt.NDArray[np.uint8], *, lossless: bool = True) -> Texture:
        """Return a texture of pixels (H, W) grey or (H, W, 3) RGB, as PNG or else as JPEG."""
        import cv2

        ordered = pixels if pixels.ndim == 2 else np.ascontiguousarray(pixels[..., ::-1])
        if lossless:
            encoded = cv2.imencode(".png", ordered, [cv2.IMWRITE_PNG_COMPRESSION, 4])[1]
        else:
            encoded = cv2.imencode(".jpg", ordered, [cv2.IMWRITE_JPEG_QUALITY, JPEG_QUALITY])[1]
        return cls(np.asarray(encoded, np.uint8).ravel())

    @property
    def media_type(self) -> str:
        """`image/png` or `image/jpeg`."""
        return "image/png" if self.data[:8].tobytes() == PNG else "image/jpeg"

    @property
    def suffix(self) -> str:
        """Ending of the picture's file, dot first."""
        return ".png" if self.media_type == "image/png" else ".jpg"

    @cached_property
    def pixels(self) -> UInt8Array:
        """(H, W, 3) uint8 RGB, the upper row first; grey maps have equal channels.

        Raises `DataError` for a damaged picture, or one of more than `LARGEST_TEXTURE` pixels.
        """
        import cv2

        if self.media_type == "image/png":
            width, height = (int.from_bytes(self.data[at].tobytes(), "big") for at in PNG_SIZE)
            if width * height > LARGEST_TEXTURE:
                raise DataError(f"a texture of {width} x {height}: {LARGEST_TEXTURE} at most")
        try:
            found = cv2.imdecode(self.data, cv2.IMREAD_COLOR | cv2.IMREAD_IGNORE_ORIENTATION)
        except cv2.error:
            found = None
        if found is None:
            raise DataError("a texture's picture is damaged and cannot be decoded")
        result = np.ascontiguousarray(found[..., ::-1], np.uint8)
        result.setflags(write=False)
        return result

    def at_eighth(self) -> Texture:
        """Return the picture an eighth as wide and high, for heads that are drawn small."""
        import cv2

        found = cv2.imdecode(self.data, cv2.IMREAD_REDUCED_COLOR_2 | cv2.IMREAD_IGNORE_ORIENTATION)
        if found is None:
            raise DataError("a texture's picture is damaged and cannot be decoded")
        size = max(found.shape[1] // 4, 1), max(found.shape[0] // 4, 1)
        small = cv2.resize(found, size, interpolation=cv2.INTER_AREA)
        return Texture.encode(np.asarray(small[..., ::-1], np.uint8))

    def sample(self, uv: npt.ArrayLike) -> Float32Array:
        """Return (N, 3) the values at texture coordinates (N, 2), of 1, between pixels linear."""
        import cv2

        pixels = self.pixels
        places = np.asarray(uv, np.float64)
        column = places[:, 0] * pixels.shape[1] - 0.5
        row = (1 - places[:, 1]) * pixels.shape[0] - 0.5
        count, line = len(column), 16_384  # OpenCV's pictures are at most 32,767 pixels wide
        column, row = (
            np.pad(each, (0, -count % line)).reshape(-1, line).astype(np.float32)
            for each in (column, row)
        )
        found = cv2.remap(
            pixels, column, row, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE
        ).reshape(-1, 3)
        return np.asarray(found[:count], np.float32) / np.float32(255)


@dataclass(frozen=True, eq=False)
class SkinMaps(Stored):
    """The texture maps of a head's one material; None where there is none."""

    albedo: Texture | None = None
    """Colour without light, sRGB."""
    roughness: Texture | None = None
    """Grey: 0 is a mirror, 255 matt; the square root of the microfacets' alpha, as in glTF."""
    normal: Texture | None = None
    """Normals in the tangent frame, +X along u, +Y along v, 128 is 0 (OpenGL's order)."""
    bump: Texture | None = None
    """Grey: heights, brighter is higher."""

    def present(self) -> dict[str, Texture]:
        """Return the maps that there are, by name."""
        found = {each.name: getattr(self, each.name) for each in fields(self)}
        return {name: texture for name, texture in found.items() if texture is not None}


@dataclass(frozen=True, eq=False)
class Blendshape(Stored):
    """A named shape that is added to the head, by a weight from 0 to 1."""

    name: str
    """Such as `jaw_open`; unique on its head."""
    offsets: Float32Array
    """(V, 3) moves of the vertices at weight 1, metres."""

    def __post_init__(self) -> None:
        freeze(self, "offsets", np.float32, (None, 3), "blendshape offsets")
