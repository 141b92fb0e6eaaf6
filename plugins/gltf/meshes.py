"""Meshes of a groom in a glTF document: head, lines and strips, tied to the head joint."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from hairkit.arrays import Float32Array, Float64Array, UInt8Array
from hairkit.errors import InputError
from hairkit.grooming.guide_weights import guide_mask
from hairkit.head_model.bust import CLOTH, Bust
from hairkit.head_model.skinning import HEAD_JOINT
from hairkit.io.glb_document import INDICES, Document, index_type
from hairkit.io.glb_skin import ROUGHNESS_CHANNEL
from hairkit.io.streamed import Streamed, at_points, repeat_row, segments
from hairkit.io.textures import grey
from hairkit.types.groom import Groom
from hairkit.types.skin import SkinMaps, Texture
from hairkit.types.skin_look import SkinLook
from hairkit.types.strand_blocks import colours, shares
from hairkit.types.strands import Strands

from .strips import HairMesh
from .texture import white_picture

LINES = 1
ROUGHNESS = {"hair": 0.45, "guides": 0.6, "cloth": 0.9}
_SCALP_SHADE = 0.6
"""Brightness of the scalp in shares of the roots' colour: hair shades what lies below it."""
SKIN_COLOUR = np.array([0.58, 0.4, 0.32])
"""Linear RGB of skin without an albedo map."""
LOOK = SkinLook()
"""Roughness of skin without a roughness map, and its refractive index."""
_INDEX = "KHR_materials_ior"
"""Extension of glTF that takes that index."""


class Meshes:
    """Adds meshes to a document; triangles are skinned, lines hang on the head joint."""

    def __init__(self, document: Document, groom: Groom) -> None:
        self.document, self.groom = document, groom

    def head(self) -> int:
        """Add the head and return its mesh; the scalp is tinted like the hair's roots."""
        head, add = self.groom.head, self.document.accessor
        attributes = {
            "POSITION": add(head.vertices, bounds=True),
            "NORMAL": add(_unit_normals(head.normals())),
            "TEXCOORD_0": add(_upside_down(head.uv)),
            "COLOR_0": add(_bytes(self._scalp_tint()), normalised=True),
            "_SCALP": add(head.scalp),
            **self._skin(len(head.vertices)),
        }
        primitive = {
            "attributes": attributes,
            "indices": self.document.indices(head.faces, len(head.vertices)),
            "material": skin_material(self.document, head.maps or SkinMaps()),
        }
        names = [shape.name for shape in head.blendshapes]
        shapes = [shape.offsets for shape in head.blendshapes]
        return self._with_shapes("head_mesh", primitive, shapes, names)

    def torso(self, bust: Bust) -> int:
        """Add the bust, which stays with the root joint, and return its mesh."""
        add, count = self.document.accessor, len(bust.vertices)
        attributes = {
            "POSITION": add(bust.vertices, bounds=True),
            "NORMAL": add(bust.normals),
            **self._skin(count, joint=0),
        }
        primitive = {
            "attributes": attributes,
            "indices": self.document.indices(bust.faces, count),
            "material": _plain(self.document, "cloth", np.array(CLOTH)),
        }
        return self._with_shapes("torso", primitive, ())

    def _scalp_tint(self) -> Float64Array:
        """Return colours (V, 3) by which the skin is multiplied: the roots' on the scalp."""
        scalp = self.groom.head.scalp[:, None]
        tint = scalp * (_SCALP_SHADE * self.groom.material.root_colour / SKIN_COLOUR)
        return np.asarray(np.clip(tint + 1 - scalp, 0, 1))

    def hair(self, mesh: HairMesh, material: int, level: int) -> int:
        """Add strips and return their mesh."""
        add, ribbons = self.document.accessor, mesh.ribbons
        attributes = {
            "POSITION": add(ribbons.vertices, bounds=True),
            "NORMAL": add(ribbons.normals),
            "TANGENT": add(ribbons.tangents),
            "TEXCOORD_0": add(ribbons.uv),
            "TEXCOORD_1": add(_upside_down(mesh.root_uv)),
            "COLOR_0": add(
                _bytes(mesh.colour / np.maximum(brightest(self.groom), 1e-6)), normalised=True
            ),
            **self._skin(len(ribbons.vertices)),
        }
        primitive = {
            "attributes": attributes,
            "indices": self.document.indices(ribbons.faces, len(ribbons.vertices)),
            "material": material,
        }
        return self._with_shapes(f"hair_LOD{level}", primitive, mesh.shapes)

    def lines(self, groom: Groom, shapes: Float32Array, which: str) -> int:
        """Add one indexed LINES primitive of strands, without skin, and return its mesh."""
        if which == "guides":
            keep = guide_mask(groom.strands)
            if not keep.any():
                raise InputError("the groom has no guides; choose lines=all or lines=none")
            shapes = shapes[:, keep[groom.strands.strand_of_point]]
            groom = groom.select(keep)
        strands, own = groom.strands, groom.strands.colours
        attributes, described = self._line_attributes(strands)
        colour = brightest(groom) if own is None else np.ones(3)
        index = segments(strands, index_type(len(strands.points)))
        primitive = {
            "attributes": attributes,
            "indices": self.document.accessor(index, INDICES),
            "material": _plain(self.document, "guides", colour),
            "mode": LINES,
            "extras": {"hairkit": described},
        }
        return self._with_shapes("guides", primitive, shapes)

    def _line_attributes(self, strands: Strands) -> tuple[dict[str, int], dict[str, Any]]:
        """Return what stands at every point, and what is the same for all strands."""
        add, counts, widths, own = (
            self.document.accessor, strands.counts, strands.widths, strands.colours,
        )  # fmt: skip
        attributes = {
            "POSITION": add(strands.points, bounds=True),
            "_STRAND_ID": add(_at_points(strands, np.arange(len(strands)))),
            "_STRAND_T": add(_shares(strands)),
        }
        described: dict[str, Any] = {"strands": len(strands)}
        if (counts == counts[0]).all():
            described["points_per_strand"] = int(counts[0])
        else:
            described["offsets"] = strands.offsets.tolist()
        if widths is not None:
            radius = at_points(strands, np.float32, lambda block: widths[block.points] / 2)
            attributes["_RADIUS"] = add(radius)
        if own is not None:
            attributes["COLOR_0"] = add(at_points(strands, np.float32, lambda b: own[b.points], 3))
        if strands.root_uv is not None:
            # a scalar each: Blender 4.5 mixes up custom attributes of different widths
            for name, column in zip("UV", _upside_down(strands.root_uv).T, strict=True):
                attributes[f"_ROOT_{name}"] = add(_at_points(strands, column))
        for name, values in (("group", strands.group), ("guide", strands.guide)):
            if values is not None and (values == values[0]).all():
                described[name] = values[0].item()
            elif values is not None:
                attributes[f"_{name.upper()}"] = add(_at_points(strands, values))
        return attributes, described

    def _with_shapes(
        self,
        name: str,
        primitive: dict[str, Any],
        shapes: Sequence[Float32Array] | Float32Array,
        names: Sequence[str] | None = None,
    ) -> int:
        extras = weights = None
        if len(shapes):
            primitive["targets"] = [
                {"POSITION": self.document.accessor(shape, bounds=True)} for shape in shapes
            ]
            weights = [0.0] * len(shapes)
            extras = {"targetNames": names or [f"motion_{each}" for each in range(len(shapes))]}
        return self.document.add(
            "meshes", name=name, primitives=[primitive], weights=weights, extras=extras
        )

    def _skin(self, count: int, joint: int = HEAD_JOINT) -> dict[str, int]:
        """Return the attributes that tie vertices to one joint alone."""
        joints, weights = np.zeros((2, 4), np.uint8)
        joints[0], weights[0] = joint, 255
        add = self.document.accessor
        bound, whole = repeat_row(joints, count), repeat_row(weights, count)
        return {"JOINTS_0": add(bound), "WEIGHTS_0": add(whole, normalised=True)}


def _at_points(strands: Strands, values: npt.NDArray[Any]) -> Streamed:
    """Return (P,) float32 of which every point has its strand's value (S,)."""
    single, counts = values.astype(np.float32), strands.counts
    return at_points(strands, np.float32, lambda b: np.repeat(single[b.strands], counts[b.strands]))


def _shares(strands: Strands) -> Streamed:
    """Return (P,) 0 at the root of each strand to 1 at its tip."""
    profile = shares(strands.counts).mapped(lambda share: share.astype(np.float32))
    return at_points(strands, np.float32, lambda block: profile.at(block.strands))


def _upside_down(uv: Float32Array) -> Float32Array:
    """Return texture coordinates with v from the picture's top, as glTF has it, or back."""
    turned = uv.astype(np.float32, copy=True)
    turned[:, 1] = 1 - turned[:, 1]
    return turned


def _unit_normals(normals: Float64Array) -> Float32Array:
    """Return normals that are unit also at vertices without faces."""
    lost = np.linalg.norm(normals, axis=1) < 0.5
    return np.where(lost[:, None], [0.0, 1.0, 0.0], normals).astype(np.float32)


def _bytes(colour: npt.NDArray[Any]) -> UInt8Array:
    """Return RGBA bytes of linear colours (V, 3) in [0, 1]."""
    bytes_ = np.full((len(colour), 4), 255, np.uint8)
    bytes_[:, :3] = np.rint(255 * np.clip(colour, 0, 1))
    return bytes_


def brightest(groom: Groom) -> Float64Array:
    """Return (3,) the brightest colour of the hair in each channel, which vertex colours darken."""
    rows = colours(groom.material, groom.strands).rows
    return np.asarray(np.clip(rows.max(axis=0, initial=0), 0, 1), np.float64)


def _plain(document: Document, name: str, colour: Float64Array) -> int:
    look: dict[str, Any] = {
        "baseColorFactor": [*np.clip(colour, 0, 1).tolist(), 1.0],
        "metallicFactor": 0.0,
        "roughnessFactor": ROUGHNESS[name],
    }
    return document.add("materials", name=name, pbrMetallicRoughness=look)


def skin_material(document: Document, maps: SkinMaps) -> int:
    """Add the material and return it. glTF has no bump maps: that one is left out."""
    colour = [1.0, 1.0, 1.0] if maps.albedo is not None else SKIN_COLOUR.tolist()
    # without a picture of the skin, validators call the uv unused
    albedo = white_picture() if maps.albedo is None else maps.albedo.data.tobytes()
    look: dict[str, Any] = {
        "baseColorFactor": [*colour, 1.0],
        "baseColorTexture": {"index": document.image(albedo, "albedo")},
        "metallicFactor": 0.0,
        "roughnessFactor": LOOK.roughness,
    }
    if maps.roughness is not None:
        packed = _pack_roughness(maps.roughness)
        look["metallicRoughnessTexture"] = {"index": document.image(packed, "roughness")}
        look["roughnessFactor"] = 1.0
    normal = None
    if maps.normal is not None:
        normal = {"index": document.image(maps.normal.data.tobytes(), "normal")}
    index = {_INDEX: {"ior": LOOK.ior}}
    document.json.setdefault("extensionsUsed", []).append(_INDEX)
    return document.add(
        "materials", name="head", pbrMetallicRoughness=look, normalTexture=normal, extensions=index
    )


def _pack_roughness(roughness: Texture) -> bytes:
    """Return a PNG with the roughness in the channel where glTF reads it."""
    values = grey(roughness)
    packed = np.zeros((*values.shape, 3), np.uint8)
    packed[..., ROUGHNESS_CHANNEL] = values
    return Texture.encode(packed).data.tobytes()
