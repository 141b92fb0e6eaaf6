"""The elements of a PLY file: a header that names them, then their rows, as text or binary."""

from __future__ import annotations

import os
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from hairkit.arrays import Float32Array, Int64Array
from hairkit.errors import FormatError
from hairkit.io.byte_reader import ByteReader
from hairkit.io.number_text import read_numbers
from hairkit.io.polylines import chains

Elements = dict[str, dict[str, npt.NDArray[np.generic]]]
"""Values (N,) by element and property."""

_LONGEST_HEADER = 65_536
_MOST_ELEMENTS, _MOST_PROPERTIES = 32, 128
_KINDS = {
    **{"char": "i1", "uchar": "u1", "short": "i2", "ushort": "u2", "int": "i4", "uint": "u4"},
    **{"float": "f4", "double": "f8", "int8": "i1", "uint8": "u1", "int16": "i2"},
    **{"uint16": "u2", "int32": "i4", "uint32": "u4", "float32": "f4", "float64": "f8"},
}
_ORDERS = {"binary_little_endian": "<", "binary_big_endian": ">", "ascii": ""}
_NAME = re.compile(r"[ -~]{1,64}")


@dataclass(frozen=True)
class _Element:
    """Declaration of one element in the header."""

    name: str
    rows: int
    fields: tuple[tuple[str, str], ...]
    """Names and NumPy types; a list property has the type `list`."""


def read_elements(data: bytes, source: str | os.PathLike[str]) -> Elements:
    """Return the values of all elements before the first with lists (faces).

    Raises
    ------
    FormatError
        It is no PLY file, it is damaged, or rows go beyond its end.
    """
    order, elements, start = _header(data, source)
    plain = []
    for element in elements:
        if element.rows and any(kind == "list" for _, kind in element.fields):
            break
        plain.append(element)
    if order == "":
        return _ascii(data[start:].decode("latin-1"), plain, plain == elements, source)
    reader = ByteReader(data, source, start)
    found: Elements = {}
    for element in plain:
        if not element.fields:
            continue  # rows of nothing, however many the header claims
        kinds = [(name, order + kind) for name, kind in element.fields if kind != "list"]
        rows = reader.array(np.dtype(kinds), element.rows, f"element {element.name}")
        found[element.name] = {
            name: rows[name].astype(rows[name].dtype.newbyteorder("=")) for name, _ in kinds
        }
    return found


def _header(data: bytes, source: str | os.PathLike[str]) -> tuple[str, list[_Element], int]:
    """Return the byte order, what elements there are, and where the rows begin."""
    head = data[:_LONGEST_HEADER]
    end = re.search(rb"end_header\r?\n", head)
    if not re.match(rb"ply\r?\n", head) or end is None:
        raise FormatError(f"{source}: no PLY file: it lacks 'ply' or a near 'end_header'")
    order: str | None = None
    elements: list[_Element] = []
    for line in head[: end.start()].decode("latin-1").splitlines()[1:]:
        words = line.split()
        if not words or words[0] in ("comment", "obj_info"):
            continue
        if words[0] == "format" and len(words) == 3 and words[1] in _ORDERS:
            order = _ORDERS[words[1]]
        elif words[0] == "element" and len(words) == 3 and len(elements) < _MOST_ELEMENTS:
            elements.append(_Element(words[1], _rows(words[2], source), ()))
        elif words[0] == "property" and elements:
            elements[-1] = _with_property(elements[-1], words, source)
        else:
            raise FormatError(f"{source}: cannot understand {line[:60]!r} in the PLY header")
    if order is None:
        raise FormatError(f"{source}: the PLY header names no format that is known")
    if len({element.name for element in elements}) != len(elements):
        raise FormatError(f"{source}: the PLY header names an element twice")
    return order, elements, end.end()


def _rows(text: str, source: str | os.PathLike[str]) -> int:
    if not (text.isascii() and text.isdigit() and len(text) <= 10):
        raise FormatError(f"{source}: an element has {text[:40]!r} rows, expected a whole number")
    return int(text)


def _with_property(element: _Element, words: list[str], source: str | os.PathLike[str]) -> _Element:
    """Return the element with the property of a header line: `property float x`."""
    listed = len(words) == 5 and words[1] == "list"
    kind = "list" if listed else _KINDS.get(words[1]) if len(words) == 3 else None
    name = words[-1]
    known = {other for other, _ in element.fields}
    if kind is None or name in known or not _NAME.fullmatch(name):
        raise FormatError(f"{source}: cannot understand {' '.join(words)[:60]!r}")
    if len(known) >= _MOST_PROPERTIES:
        raise FormatError(f"{source}: element {element.name[:40]!r} has too many properties")
    return _Element(element.name, element.rows, (*element.fields, (name, kind)))


def _ascii(
    text: str, elements: list[_Element], whole: bool, source: str | os.PathLike[str]
) -> Elements:
    """Return the values of elements whose rows are lines of numbers."""
    lines = text.split("\n")
    wanted = sum(element.rows for element in elements if element.fields)
    if wanted > len(lines):
        raise FormatError(f"{source}: has {len(lines)} lines for {wanted} rows of its elements")
    numbers = read_numbers("\n".join(lines[:wanted]), source, "elements")
    size = sum(element.rows * len(element.fields) for element in elements)
    if len(numbers) != size or (whole and "".join(lines[wanted:]).strip()):
        raise FormatError(f"{source}: holds {len(numbers)} numbers, its elements are {size}")
    found: Elements = {}
    at = 0
    for element in elements:
        width = len(element.fields)
        rows = numbers[at : at + element.rows * width].reshape(-1, width) if width else None
        at += element.rows * width
        found[element.name] = {
            name: _convert(rows[:, column], kind, source)
            for column, (name, kind) in enumerate(element.fields)
            if rows is not None and kind != "list"
        }
    return found


def _convert(
    values: npt.NDArray[np.float64], kind: str, source: str | os.PathLike[str]
) -> npt.NDArray[np.generic]:
    """Return the numbers in the property's type, which must hold them."""
    if kind[0] == "f":
        return values
    limits = np.iinfo(kind)
    if (values < limits.min).any() or (values > limits.max).any() or (values % 1).any():
        raise FormatError(f"{source}: holds numbers beyond the type of their property")
    return values.astype(kind)


def vertex_points(elements: Elements, path: str | os.PathLike[str]) -> Float32Array:
    """Return the vertices (P, 3), which may be infinite; raises `FormatError` without places."""
    points = columns(elements.get("vertex", {}), ("x", "y", "z"))
    if points is None:
        raise FormatError(f"{path}: has no element vertex with x, y and z")
    return points


def columns(
    values: Mapping[str, npt.NDArray[np.generic]], names: Sequence[str]
) -> Float32Array | None:
    """Return properties of an element (N, names) side by side; None where one is missing."""
    if not set(names) <= set(values):
        return None
    with np.errstate(over="ignore"):  # the caller refuses what is not finite
        return np.stack([values[name] for name in names], axis=1).astype(np.float32)


def strand_order(
    elements: Elements, vertices: int, path: str | os.PathLike[str]
) -> tuple[Int64Array, Int64Array]:
    """Return the vertices (P,) strand after strand, and the points (S,) of each.

    From an element `strand` with `nsegs`, else from the edges. Raises `FormatError` without either.
    """
    segments = elements.get("strand", {}).get("nsegs")
    if segments is not None:
        counts = segments.astype(np.int64) + 1
        if (counts < 1).any() or counts.sum() != vertices:
            raise FormatError(f"{path}: nsegs part {counts.sum()} points, {vertices} vertices")
        return np.arange(vertices), counts
    edge = elements.get("edge", {})
    if not {"vertex1", "vertex2"} <= set(edge) or not len(edge["vertex1"]):
        raise FormatError(f"{path}: has no strands: neither an element strand nor edges")
    try:
        pairs = np.stack([edge["vertex1"], edge["vertex2"]], axis=1).astype(np.int64)
        return chains(pairs, vertices)
    except FormatError as error:
        raise FormatError(f"{path}: {error}") from error
