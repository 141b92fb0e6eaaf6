"""Read an .apx file strictly: what HairWorks would refuse, and what could do harm, is refused."""

from __future__ import annotations

import os
import re
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import Any, NoReturn
from xml.parsers import expat

import numpy as np

from hairkit.arrays import Float64Array, Int64Array
from hairkit.errors import FormatError
from hairkit.io.number_text import read_numbers
from hairkit.storage import read_bytes

from . import schema
from .asset import ApxAsset, Material, MaterialValue

MAX_BYTES = 256 * 2**20
_MAX_DEPTH, _MAX_ELEMENTS, _MAX_ATTRIBUTES = 8, 20_000, 16
_NUMBERS = re.compile(r"[0-9+\-.eE,\s]*")
_CHUNK = 2**20


@dataclass(eq=False)
class _Element:
    """One XML element while the file is read."""

    tag: str
    attributes: dict[str, str]
    texts: list[str] = field(default_factory=list)
    children: list[_Element] = field(default_factory=list)

    @property
    def text(self) -> str:
        return "".join(self.texts)


def read_apx(path: str | os.PathLike[str]) -> ApxAsset:
    """Read a HairWorks .apx file.

    Raises
    ------
    FormatError
        The file cannot be read, is no .apx, declares entities, is nested or large beyond reason,
        lies about sizes, or holds what HairWorks would not load.
    """
    try:
        return parse_apx(read_bytes(path, MAX_BYTES))
    except FormatError as error:
        raise FormatError(f"{path}: {error}") from error


def parse_apx(data: bytes) -> ApxAsset:
    """Return the asset in the bytes of an .apx file; raises `FormatError` as `read_apx` does."""
    classes = _classes(_parse(data))
    texts = _fields(classes["HairSceneDescriptor"])
    info = _fields(classes["HairWorksInfo"])
    fields = _fields(classes["HairAssetDescriptor"])
    materials = _fields(classes["HairInstanceDescriptor"]).get("materials")
    return _asset(fields, materials, _strings(info, schema.INFO_FIELDS), texts)


def _asset(
    fields: dict[str, _Element],
    materials: _Element | None,
    info: tuple[str, ...],
    texts: dict[str, _Element],
) -> ApxAsset:
    guides, points = _whole(fields, "numGuideHairs"), _whole(fields, "numVertices")
    faces, bones = _whole(fields, "numFaces"), _whole(fields, "numBones")
    spheres, capsules = _whole(fields, "numBoneSpheres"), _whole(fields, "numBoneCapsules")
    pins = _whole(fields, "numPinConstraints")
    bound = guides if bones else None
    return ApxAsset(
        vertices=_array(fields, "vertices", "Vec3", points),
        end_indices=_integers(fields, "endIndices", "U32", guides),
        faces=_integers(fields, "faceIndices", "U32", 3 * faces).reshape(-1, 3),
        face_uvs=_array(fields, "faceUVs", "Vec2", 3 * faces).reshape(-1, 3, 2),
        bone_indices=_array(fields, "boneIndices", "Vec4", bound),
        bone_weights=_array(fields, "boneWeights", "Vec4", bound),
        bone_names=_names(fields, bones),
        bind_poses=_array(fields, "bindPoses", "Mat44", bones).reshape(-1, 4, 4),
        bone_parents=_integers(fields, "boneParents", "I32", bones),
        spheres=_array(fields, "boneSpheres", "Struct", spheres),
        capsules=_integers(fields, "boneCapsuleIndices", "U32", 2 * capsules).reshape(-1, 2),
        scene_unit=float(
            _floats(_field(fields, "sceneUnit", "value", "F32").text, "sceneUnit", 1)[0]
        ),
        up_axis=_whole(fields, "upAxis"),
        handedness=_whole(fields, "handedness"),
        materials=_materials(materials),
        info=info,
        textures=_strings(texts, schema.TEXTURES),
        pins=_array(fields, "pinConstraints", "Struct", pins),
    )


def _parse(data: bytes) -> _Element:
    """Return the root element; nothing but elements, attributes and text is let in."""
    parser = expat.ParserCreate("utf-8")  # whatever a prolog says
    parser.buffer_text = True
    root = _Element("", {})
    stack, count = [root], [0]

    def start(tag: str, attributes: dict[str, str]) -> None:
        count[0] += 1
        if len(stack) > _MAX_DEPTH or count[0] > _MAX_ELEMENTS:
            raise FormatError(
                f"line {parser.CurrentLineNumber}: more than {_MAX_DEPTH} levels or "
                f"{_MAX_ELEMENTS} elements, expected a HairWorks asset"
            )
        if len(attributes) > _MAX_ATTRIBUTES:
            raise FormatError(f"line {parser.CurrentLineNumber}: too many attributes on {tag}")
        element = _Element(tag, attributes)
        stack[-1].children.append(element)
        stack.append(element)

    def end(_tag: str) -> None:
        stack.pop()

    def text(data: str) -> None:
        stack[-1].texts.append(data)

    parser.StartElementHandler, parser.EndElementHandler = start, end
    parser.CharacterDataHandler = text
    parser.StartDoctypeDeclHandler = _check_doctype
    parser.EntityDeclHandler = _refuse_entities
    parser.ExternalEntityRefHandler = _refuse_entities
    parser.SkippedEntityHandler = _refuse_entities
    try:
        for start_at in range(0, len(data), _CHUNK):
            parser.Parse(data[start_at : start_at + _CHUNK], False)
        parser.Parse(b"", True)
    except expat.ExpatError as error:
        raise FormatError(f"is no well-formed .apx ({error})") from error
    return root.children[0]


def _check_doctype(name: str, system: str | None, public: str | None, subset: int) -> None:
    if name != schema.DOCTYPE or system or public or subset:
        raise FormatError(f"has the DOCTYPE {name!r}, expected a bare {schema.DOCTYPE}")


def _refuse_entities(*_arguments: Any) -> NoReturn:
    raise FormatError("declares or uses XML entities, which no .apx does")


def _classes(root: _Element) -> dict[str, _Element]:
    """Return the struct of each of the four classes."""
    if root.tag != schema.DOCTYPE:
        raise FormatError(f"starts with <{root.tag[:40]}>, expected <{schema.DOCTYPE}>")
    found: dict[str, _Element] = {}
    for value in root.children:
        name = value.attributes.get("className", "")
        if name not in schema.CHECKSUMS or name in found:
            raise FormatError(f"holds the class {name[:40]!r} twice or unasked for")
        version = value.attributes.get("version", "")
        if version not in schema.READABLE_VERSIONS:
            readable = " or ".join(schema.READABLE_VERSIONS)
            raise FormatError(f"holds {name} of version {version[:20]!r}, expected {readable}")
        if len(value.children) != 1 or value.children[0].tag != "struct":
            raise FormatError(f"{name} holds no single struct")
        found[name] = value.children[0]
    missing = [name for name in schema.CHECKSUMS if name not in found]
    if missing:
        raise FormatError(f"lacks the class {missing[0]}")
    return found


def _fields(struct: _Element) -> dict[str, _Element]:
    fields: dict[str, _Element] = {}
    for child in struct.children:
        name = child.attributes.get("name", "")
        if name in fields:
            raise FormatError(f"holds the field {name[:40]!r} twice")
        fields[name] = child
    return fields


def _field(fields: dict[str, _Element], name: str, tag: str, kind: str) -> _Element:
    element = fields.get(name)
    if element is None:
        raise FormatError(f"lacks the field {name}")
    found = element.attributes.get("type", "")
    if element.tag != tag or found != kind:
        raise FormatError(f"{name} is a {element.tag[:20]} of {found[:20]!r}, expected {kind}")
    return element


def _strings(fields: dict[str, _Element], names: tuple[str, ...]) -> tuple[str, ...]:
    return tuple(_field(fields, name, "value", "String").text for name in names)


def _whole(fields: dict[str, _Element], name: str) -> int:
    value = _value(_field(fields, name, "value", "U32"), name, "U32")
    if not isinstance(value, int):
        raise FormatError(f"{name} is no whole number")
    return value


def _array(fields: dict[str, _Element], name: str, kind: str, size: int | None) -> Float64Array:
    """Return a numeric array (size, components), checked against its own and the wanted size."""
    element = _field(fields, name, "array", kind)
    claimed = element.attributes.get("size", "")
    if not (claimed.isascii() and claimed.isdigit() and len(claimed) < 10):
        raise FormatError(f"{name} has the size {claimed[:20]!r}, expected a whole number")
    if size is not None and int(claimed) != size:
        raise FormatError(f"{name} has size {claimed}, expected {size}")
    components = schema.SPHERE_NUMBERS if kind == "Struct" else schema.COMPONENTS[kind]
    return _floats(element.text, name, int(claimed) * components).reshape(-1, components)


def _integers(fields: dict[str, _Element], name: str, kind: str, size: int) -> Int64Array:
    values = _array(fields, name, kind, size).reshape(-1)
    if (values != np.round(values)).any() or (np.abs(values) > 2**53).any():
        raise FormatError(f"{name} holds numbers that are not whole")
    return values.astype(np.int64)


def _floats(text: str, name: str, count: int) -> Float64Array:
    if not _NUMBERS.fullmatch(text):
        raise FormatError(f"{name} holds something that is no number")
    values = read_numbers(text.replace(",", " "), schema.DOCTYPE, name)
    if len(values) != count:
        raise FormatError(f"{name} holds {len(values)} numbers, expected {count}")
    if (np.abs(values) > np.finfo(np.float32).max).any():
        raise FormatError(f"{name} holds numbers beyond what a float can hold")
    return values


def _names(fields: dict[str, _Element], count: int) -> tuple[str, ...]:
    element = _field(fields, "boneNameList", "array", "String")
    names = tuple(child.text for child in element.children)
    if len(names) != count or element.attributes.get("size") != str(count):
        raise FormatError(f"boneNameList holds {len(names)} names, expected {count}")
    return names


def _materials(element: _Element | None) -> tuple[Material, ...]:
    if element is None or element.attributes.get("size") != str(len(element.children)):
        raise FormatError("materials are missing or their size is wrong")
    if len(element.children) > schema.MATERIALS:
        raise FormatError(f"{len(element.children)} materials, expected {schema.MATERIALS}")
    materials = []
    for struct in element.children:
        fields = _fields(struct)
        values = {
            wanted.name: _value(
                _field(fields, wanted.name, "value", wanted.type), wanted.name, wanted.type
            )
            for wanted in schema.MATERIAL_FIELDS
        }
        materials.append(MappingProxyType(values))
    return tuple(materials)


def _value(element: _Element, name: str, kind: str) -> MaterialValue:
    text = element.text.strip()
    if kind == "String":
        return element.text
    if kind == "Bool":
        if text not in ("true", "false"):
            raise FormatError(f"{name} is {text[:20]!r}, expected true or false")
        return text == "true"
    if kind == "U32":
        if text == schema.NO_BONE_TEXT:
            return schema.NO_BONE
        if not (text.isascii() and text.isdigit() and len(text) <= 10 and int(text) < 2**32):
            raise FormatError(f"{name} is {text[:20]!r}, expected a whole number")
        return int(text)
    numbers = _floats(text, name, schema.COMPONENTS[kind]).tolist()
    return float(numbers[0]) if kind == "F32" else tuple(numbers)
