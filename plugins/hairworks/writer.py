"""Write an `ApxAsset` as HairWorks' tools do: same order, same types, same white space."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from html import escape

import numpy as np
import numpy.typing as npt

from hairkit.errors import InputError

from . import schema
from .asset import ApxAsset, Material, MaterialValue

_ELEMENTS_PER_LINE = 16
_SCALARS_PER_LINE = 32
_INDENT = "      "


def asset_text(asset: ApxAsset) -> str:
    """Return the whole file as ASCII text with line feeds."""
    bodies = {
        "HairWorksInfo": _strings(schema.INFO_FIELDS, asset.info),
        "HairSceneDescriptor": _strings(schema.TEXTURES, asset.textures),
        "HairAssetDescriptor": _asset_body(asset),
        "HairInstanceDescriptor": _materials(asset.materials),
    }
    lines = [
        f"<!DOCTYPE {schema.DOCTYPE}>",
        f'<NvParameters numObjects="{len(bodies)}" version="1.0" >',
    ]
    for name, body in bodies.items():
        checksum = schema.CHECKSUMS[name]
        lines += [
            f'<value name="" type="Ref" className="{name}" version="{schema.VERSION}" '
            f'checksum="{checksum}">',
            '  <struct name="">',
            *body,
            "  </struct>",
            "</value>",
        ]
    return "\n".join([*lines, "</NvParameters>", ""])


def _asset_body(asset: ApxAsset) -> Iterable[str]:
    names = b"".join(name.encode("ascii") + b"\0" for name in asset.bone_names)
    spheres = f' structElements="{schema.SPHERE_ELEMENTS}"'
    yield _value("numGuideHairs", "U32", asset.guides)
    yield _value("numVertices", "U32", len(asset.vertices))
    yield _array("vertices", "Vec3", asset.vertices)
    yield _array("endIndices", "U32", asset.end_indices)
    yield _value("numFaces", "U32", len(asset.faces))
    yield _array("faceIndices", "U32", asset.faces.reshape(-1))
    yield _array("faceUVs", "Vec2", asset.face_uvs.reshape(-1, 2))
    yield _value("numBones", "U32", len(asset.bone_names))
    yield _array("boneIndices", "Vec4", asset.bone_indices)
    yield _array("boneWeights", "Vec4", asset.bone_weights)
    yield _array("boneNames", "U8", np.frombuffer(names, np.uint8))
    yield _string_array("boneNameList", asset.bone_names)
    yield _array("bindPoses", "Mat44", asset.bind_poses.reshape(-1, 16))
    yield _array("boneParents", "I32", asset.bone_parents)
    yield _value("numBoneSpheres", "U32", len(asset.spheres))
    yield _array("boneSpheres", "Struct", asset.spheres, spheres)
    yield _value("numBoneCapsules", "U32", len(asset.capsules))
    yield _array("boneCapsuleIndices", "U32", asset.capsules.reshape(-1))
    yield _value("numPinConstraints", "U32", len(asset.pins))
    yield _array("pinConstraints", "Struct", asset.pins, spheres)
    yield _value("sceneUnit", "F32", asset.scene_unit)
    yield _value("upAxis", "U32", asset.up_axis)
    yield _value("handedness", "U32", asset.handedness)


def _array(name: str, kind: str, values: npt.NDArray[np.generic], more: str = "") -> str:
    """Return an array element; vectors are parted by commas, scalars by spaces.

    The numbers end with white space, for FurViewer crashes on those that do not.
    """
    head = f'    <array name="{name}" size="{len(values)}" type="{kind}"{more}>'
    if not len(values):
        return head + "</array>"
    number = "%d" if values.dtype.kind in "iu" else "%.9g"
    if values.ndim == 1:
        text = _wrap_pattern([number], len(values), " ", _SCALARS_PER_LINE)
    else:
        per_line = max(_ELEMENTS_PER_LINE // max(values.shape[1] // 4, 1), 1)
        text = _wrap_pattern([number] * values.shape[1], len(values), ", ", per_line)
    return f"{head}\n{_INDENT}{text % tuple(values.reshape(-1).tolist())}\n    </array>"


def _wrap_pattern(element: Sequence[str], count: int, separator: str, per_line: int) -> str:
    """Return a pattern for `count` elements, broken into indented lines."""
    pattern = " ".join(element)
    full = separator.join([pattern] * per_line)
    lines = [full] * (count // per_line)
    if count % per_line:
        lines.append(separator.join([pattern] * (count % per_line)))
    return f"{separator}\n{_INDENT}".join(lines)


def _string_array(name: str, texts: Sequence[str]) -> str:
    head = f'    <array name="{name}" size="{len(texts)}" type="String">'
    rows = [f'{_INDENT}<value type="String">{_escape(name, text)}</value>' for text in texts]
    return "\n".join([head, *rows, "    </array>"]) if rows else head + "</array>"


def _strings(names: Sequence[str], texts: Sequence[str]) -> list[str]:
    lines = []
    for name, text in zip(names, texts, strict=True):
        unset = name in schema.UNSET_TEXTURES and not text
        lines.append(_value(name, "String", text, ' null="1"' if unset else ""))
    return lines


def _materials(materials: Sequence[Material]) -> Iterable[str]:
    yield f'    <array name="materials" size="{len(materials)}" type="Struct">'
    for material in materials:
        yield "      <struct>"
        for field in schema.MATERIAL_FIELDS:
            value = material[field.name]
            unset = ' null="1"' if field.type == "String" and not value else ""
            yield "    " + _value(field.name, field.type, value, unset)
        yield "      </struct>"
    yield "    </array>"


def _value(name: str, kind: str, value: MaterialValue, more: str = "") -> str:
    return f'    <value name="{name}"{more} type="{kind}">{_number(name, value)}</value>'


def _number(name: str, value: MaterialValue) -> str:
    if isinstance(value, str):
        return _escape(name, value)
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, tuple):
        return " ".join(f"{item:.9g}" for item in value)
    if isinstance(value, int):
        return schema.NO_BONE_TEXT if value == schema.NO_BONE else str(value)
    return f"{value:.9g}"


def _escape(name: str, text: str) -> str:
    if len(text) > schema.MAX_STRING or not (text.isascii() and text.isprintable()):
        raise InputError(
            f"{name} is {text[:40]!r}, expected at most {schema.MAX_STRING} printable ASCII letters"
        )
    return escape(text, quote=False)
