"""A program of its own: takes the objects of an Alembic file and the values of its curves.

Asked to `read` the file `source`, it writes the first sample of every array to `target`, and a
description of the objects as JSON text. It runs apart because the Alembic library ends the process
at some damaged files.
"""

from __future__ import annotations

import json
from typing import Any

import numpy as np
import numpy.typing as npt
from alembic3d import Abc, AbcGeom

from hairkit import worker

MOST_LEVELS, MOST_OBJECTS = 100, 100_000
"""Objects in each other, and of a file, at most."""


def read(source: str, target: str) -> dict[str, str]:
    """Write the objects, parents first, in the file's order."""
    arrays: dict[str, npt.NDArray[Any]] = {}
    objects: list[dict[str, Any]] = []
    waiting = [*_children(Abc.IArchive(source).getTop(), np.eye(4), 1)]
    while waiting:
        node, world, level = waiting.pop()
        if level > MOST_LEVELS or len(objects) >= MOST_OBJECTS:
            raise ValueError(f"more than {MOST_LEVELS} levels or {MOST_OBJECTS} objects")
        objects.append(_description(node, world, f"{len(objects)}/", arrays))
        waiting += _children(node, world, level + 1)
    arrays["objects"] = np.frombuffer(json.dumps(objects).encode(), np.uint8)
    save: Any = np.savez  # whose stubs take names of arrays for options
    save(target, **arrays)
    return {}


def _children(
    node: Any, world: npt.NDArray[np.float64], level: int
) -> list[tuple[Any, npt.NDArray[np.float64], int]]:
    """Return the objects under one, the last first, each with its transform to the world."""
    found = []
    for number in reversed(range(node.getNumChildren())):
        child, own = node.getChild(number), world
        if AbcGeom.IXform.matches(child.getHeader()):
            sample = AbcGeom.IXform(node, child.getName()).getSchema().getValue()
            own = np.array([list(row) for row in sample.getMatrix()])
            with np.errstate(over="ignore", invalid="ignore"):
                own = own @ world if sample.getInheritsXforms() else own
        found.append((child, own, level))
    return found


def _description(
    node: Any, world: npt.NDArray[np.float64], prefix: str, arrays: dict[str, npt.NDArray[Any]]
) -> dict[str, Any]:
    """Return what is said of an object; the arrays of curves are put aside under the prefix."""
    found = _properties(node.getProperties())
    values: dict[str, Any] = {}
    if ".geom" in found and AbcGeom.ICurves.matches(node.getHeader()):
        own = _properties(found[".geom"])
        given = _properties(own[".arbGeomParams"]) if ".arbGeomParams" in own else {}
        for name, each in (own | given).items():
            array, samples = _values(name, each)
            scope = each.getHeader().getMetaData().get("geoScope")
            values[name] = {"scope": scope, "samples": samples}
            if array is not None:
                arrays[prefix + name] = array
    user = _properties(found[".xform"]).get(".userProperties") if ".xform" in found else None
    return {
        "name": node.getName(),
        "schema": node.getHeader().getMetaData().get("schema"),
        "user": [] if user is None else [*_properties(user)],
        "world": world.tolist(),
        "values": values,
    }


def _properties(compound: Any) -> dict[str, Any]:
    """Return the properties in a compound by name."""
    found = (compound.getProperty(number) for number in range(compound.getNumProperties()))
    return {each.getName(): each for each in found}


def _values(name: str, given: Any) -> tuple[npt.NDArray[Any] | None, int]:
    """Return (N, C) the first sample, None where it holds no numbers, and how many there are.

    Of an indexed parameter they are the values that the indices name.
    """
    if given.isCompound():
        parts = _properties(given)
        if not {".vals", ".indices"} <= {*parts}:
            return None, 0
        (array, samples), (index, _) = (_values(name, parts[k]) for k in (".vals", ".indices"))
        if array is None or index is None:
            return array, samples
        if index.max() >= len(array):
            raise ValueError(f"{name} has bad indices")
        return array[index[:, 0]], samples
    samples = given.getNumSamples()
    value: Any = given.getValue() if samples else ()
    if given.isScalar() and samples:
        array = np.array([[*value]]) if name == "curveBasisAndType" else None
        return array, samples
    if not len(value):
        return None, samples
    try:
        array = np.array(memoryview(value))
    except TypeError:  # of unsigned numbers and texts, for example
        array = np.array([*value])
    return array.reshape(len(array), -1) if array.dtype.kind in "iufb" else None, samples


if __name__ == "__main__":
    worker.answer_questions({"read": lambda asked, _: read(asked["source"], asked["target"])})
