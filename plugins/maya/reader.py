"""Maya ASCII read: every NURBS curve of a scene, where its transforms put it.

Source: Autodesk, Maya ASCII file format, and the matrix of the node `transform`.
"""

from __future__ import annotations

import itertools
import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from hairkit.arrays import Float64Array, Int64Array
from hairkit.errors import FormatError
from hairkit.io.spline_curves import nurbs_map

CENTIMETRE = 0.01
"""Maya's unit where a scene names none, metres."""
_UNITS = {
    "millimeter": 0.001, "mm": 0.001, "centimeter": 0.01, "cm": 0.01, "meter": 1.0, "m": 1.0,
    "kilometer": 1000.0, "km": 1000.0, "inch": 0.0254, "in": 0.0254, "foot": 0.3048, "ft": 0.3048,
    "yard": 0.9144, "yd": 0.9144,
}  # fmt: skip
_MARK = re.compile(r'"(?:\\.|[^"\\])*+(?:"|\Z)|//[^\n]*|;', re.DOTALL)
"""What a semicolon may hide in, and the semicolon that ends a statement."""
_WORD = re.compile(r'"((?:\\.|[^"\\])*+)"?|([^\s"]+)', re.DOTALL)
_CURVE = re.compile(r'setAttr\s[^"]*"\.(?:cc|cached)"\s+-type\s+"nurbsCurve"')
_ORDERS = ("xyz", "yzx", "zxy", "xzy", "yxz", "zyx")
"""Maya's rotate orders, by number; the first axis turns first."""
_VECTORS = {"t": "translate", "r": "rotate", "s": "scale"} | {
    name: name for name in ("rp", "sp", "rpt", "spt")
}
_UNREAD = ("ra", "sh")
"""Rotate axis and shear."""
_HIGHEST_DEGREE = 7
"""Of Maya's curves."""
_MOST_POINTS = 100_000
"""Points of one curve at most, so that few bytes ask for little memory."""


@dataclass
class _Node:
    kind: str
    name: str
    parent: int
    vectors: dict[str, Float64Array] = field(default_factory=dict)
    order: int = 0
    intermediate: bool = False


@dataclass(frozen=True)
class MayaCurves:
    """The curves of a scene, in its axes."""

    points: Float64Array
    """(P, 3) on the curves, in the scene's unit."""
    counts: Int64Array
    """(S,) points of each."""
    names: list[tuple[str, str]]
    """(S,) of the transform of each curve, and of the transform above it."""
    metres: float
    """Of the scene's unit."""


def read_curves(text: str, path: Path) -> MayaCurves:
    """Return the curves of a scene; raises `FormatError` when it has none."""
    nodes: list[_Node] = []
    index: dict[str, int] = {}
    made: list[tuple[int, Float64Array, Int64Array, Float64Array]] = []
    metres = CENTIMETRE
    for statement in _statements(text, path):
        if statement.startswith("createNode"):
            _create(nodes, index, statement)
        elif nodes and nodes[-1].kind == "nurbsCurve" and _CURVE.match(statement):
            made.append((len(nodes) - 1, *_curve(statement, path)))
        elif nodes and statement.startswith("setAttr"):
            _set(nodes[-1], statement, path)
        elif statement.startswith("currentUnit"):
            metres = _unit(statement, path)
    made = [curve for curve in made if not nodes[curve[0]].intermediate]
    if not made:
        raise FormatError(f"{path}: holds no nurbsCurve with points, so no strands")
    return _evaluated(nodes, made, metres, path)


def _statements(text: str, path: Path) -> Iterator[str]:
    """Yield the statements without their semicolons and comments; the last one must be whole."""
    pieces: list[str] = []
    start = 0
    for mark in _MARK.finditer(text):
        if mark[0] == ";":
            pieces.append(text[start : mark.start()])
            yield "".join(pieces).strip()
            pieces, start = [], mark.end()
        elif mark[0].startswith("//"):
            pieces.append(text[start : mark.start()])
            start = mark.end()
    if "".join([*pieces, text[start:]]).strip():
        raise FormatError(f"{path}: ends within a command, as a file that was cut off does")


def _words(statement: str) -> list[str]:
    return [plain or quoted for quoted, plain in _WORD.findall(statement)]


def _create(nodes: list[_Node], index: dict[str, int], statement: str) -> None:
    """Add a node; `index` finds it by its full path and by its name."""
    words = _words(statement)
    flags = dict(itertools.pairwise(words))
    kind, name = words[1] if len(words) > 1 else "", flags.get("-n", f"{len(nodes)}")
    above = flags.get("-p", "")
    parent = index.get(above, index.get(above.rpartition("|")[2], -1)) if above else -1
    number = len(nodes)
    nodes.append(_Node(kind, name, parent))
    index[name] = number
    if above.startswith("|"):
        index[f"{above}|{name}"] = number
    elif not above:
        index[f"|{name}"] = number


def _set(node: _Node, statement: str, path: Path) -> None:
    """Keep what a node's attribute says about its place."""
    words = _words(statement)
    at = next((i for i, word in enumerate(words) if word.startswith(".")), len(words))
    name, values = words[at][1:] if at < len(words) else "", words[at + 1 :]
    if name == "io":
        node.intermediate = values[:1] in (["yes"], ["on"], ["true"], ["1"])
    if node.kind != "transform":
        return
    if name in _VECTORS or (name in _UNREAD):
        node.vectors[name] = _numbers(values[2:] if values[:1] == ["-type"] else values, 3, path)
    elif name[:-1] in _VECTORS and name[-1:] in ("x", "y", "z"):
        vector = node.vectors.setdefault(name[:-1], _default(name[:-1]))
        vector["xyz".index(name[-1])] = _numbers(values, 1, path)[0]
    elif name == "ro":
        order = float(_numbers(values, 1, path)[0])
        if order not in range(len(_ORDERS)):
            raise FormatError(f"{path}: {node.name} has the rotate order {order:g}")
        node.order = int(order)
    if name in _UNREAD and node.vectors[name].any():
        raise FormatError(
            f"{path}: {node.name} is sheared or has a rotate axis; freeze its transforms in Maya"
        )


def _numbers(words: list[str], count: int, path: Path) -> Float64Array:
    try:
        values = np.array(words[:count], np.float64)
    except ValueError:
        values = np.zeros(0)
    if len(values) != count or not np.isfinite(values).all():
        raise FormatError(f"{path}: an attribute of a transform has no {count} numbers")
    return values


def _unit(statement: str, path: Path) -> float:
    words = _words(statement)
    flags = dict(itertools.pairwise(words))
    name = flags.get("-l", flags.get("-linear", "cm"))
    if name not in _UNITS:
        raise FormatError(f"{path}: unknown unit {name[:40]!r}; expected one of Maya's")
    return _UNITS[name]


def _curve(statement: str, path: Path) -> tuple[Float64Array, Int64Array, Float64Array]:
    """Return control points (n, 3), (order,) and knots of a curve.

    In the file: degree, spans, form, whether rational, dimensions; knots, without the first and the
    last; points.
    """
    words = statement.partition('"nurbsCurve"')[2].split()
    try:
        degree, form, dimensions, knots = (int(words[i]) for i in (0, 2, 4, 5))
        rational = words[3] != "no"
        inner = np.array(words[6 : 6 + knots], np.float64)
        count = int(words[6 + knots])
        numbers = np.array(words[7 + knots :], np.float64)
    except (ValueError, IndexError, OverflowError) as error:
        raise FormatError(f"{path}: a nurbsCurve is cut off or damaged") from error
    if (
        dimensions not in (2, 3)
        or not 1 <= degree <= _HIGHEST_DEGREE
        or not degree < count <= _MOST_POINTS
        or (len(inner), len(numbers)) != (count + degree - 1, (dimensions + int(rational)) * count)
    ):
        raise FormatError(
            f"{path}: a nurbsCurve of degree {degree} has {len(inner)} knots and {len(numbers)}"
            f" numbers for {count} points"
        )
    if form:
        raise FormatError(f"{path}: a nurbsCurve is closed; strands are open")
    if rational:
        raise FormatError(f"{path}: a nurbsCurve is rational; rebuild it without weights in Maya")
    rows = numbers.reshape(count, dimensions)
    if not (np.isfinite(rows).all() and np.isfinite(inner).all()):
        raise FormatError(f"{path}: points or knots of a nurbsCurve are not finite numbers")
    points = np.zeros((count, 3))
    points[:, :dimensions] = rows
    if degree == 1:  # its points are on it, wherever the knots are
        inner = np.arange(count, dtype=np.float64)
    return points, np.array([degree + 1]), np.concatenate([inner[:1], inner, inner[-1:]])


def _evaluated(
    nodes: list[_Node],
    made: list[tuple[int, Float64Array, Int64Array, Float64Array]],
    metres: float,
    path: Path,
) -> MayaCurves:
    """Return points on all curves, in the world."""
    world = _world_matrices(nodes)
    counts = np.array([len(points) for _, points, _, _ in made], np.int64)
    controls = np.concatenate([points for _, points, _, _ in made])
    orders = np.concatenate([order for _, _, order, _ in made])
    knots = np.concatenate([knots for _, _, _, knots in made])
    points = np.asarray(nurbs_map(counts, orders, knots, None, path) @ controls)
    owners = np.array([nodes[node].parent for node, _, _, _ in made])
    matrices = np.repeat(world[owners], counts, axis=0)
    with np.errstate(over="ignore", invalid="ignore"):  # refused below
        placed = np.einsum("pi,pij->pj", points, matrices[:, :3, :3]) + matrices[:, 3, :3]
    if not np.isfinite(placed).all():
        raise FormatError(f"{path}: transforms put a curve beyond all numbers")
    parents = [nodes[owner].parent if owner >= 0 else -1 for owner in owners]
    names = [(_name(nodes, o), _name(nodes, p)) for o, p in zip(owners, parents, strict=True)]
    return MayaCurves(placed, counts, names, metres)


def _name(nodes: list[_Node], node: int) -> str:
    return nodes[node].name if node >= 0 else ""


def _world_matrices(nodes: list[_Node]) -> Float64Array:
    """Return (N + 1, 4, 4) of row vectors; the last, which -1 finds, is the world itself.

    Parents are created before their children.
    """
    world = np.tile(np.eye(4), (len(nodes) + 1, 1, 1))
    with np.errstate(over="ignore", invalid="ignore"):
        for number, node in enumerate(nodes):
            own = _matrix(node) if node.vectors else np.eye(4)
            world[number] = own @ world[node.parent]
    return world


def _matrix(node: _Node) -> Float64Array:
    """Return a transform of row vectors: scale about its pivot, rotation about its own, place."""
    from scipy.spatial.transform import Rotation  # it loads much of SciPy

    def vector(name: str) -> Float64Array:
        return node.vectors.get(name, _default(name))

    order = _ORDERS[node.order]
    angles = vector("r")[["xyz".index(axis) for axis in order]]
    turn = Rotation.from_euler(order, angles, degrees=True).as_matrix().T
    matrix = np.eye(4)
    matrix[:3, :3] = np.diag(vector("s")) @ turn
    after = vector("sp") + vector("spt") - vector("rp")
    matrix[3, :3] = (-vector("sp") * vector("s") + after) @ turn
    matrix[3, :3] += vector("rp") + vector("rpt") + vector("t")
    return matrix


def _default(name: str) -> Float64Array:
    return np.ones(3) if name == "s" else np.zeros(3)
