"""What Unreal demands of an .abc beyond its strands: its groom schema, and no mesh."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from hairkit.types.finding import Finding

from .archive import Archive, Object

TARGETS = ("unreal", "metahuman")
_MOST_OBJECTS = 100_000


def check_schema(path: Path) -> list[Finding]:
    """Return findings about groom_version, ids, groups, guides' weights and meshes of a file."""
    nodes = list(_nodes(Archive.open(path)))
    meshes = [node.name for node in nodes if node.is_a("AbcGeom_PolyMesh")]
    said = f"meshes in the file: {', '.join(meshes[:3]) or 'none'}; Unreal refuses grooms with one"
    found = [Finding.of("no-mesh", not meshes, said)]
    versions = [node for node in nodes if "groom_version_major" in _user_properties(node)]
    said = "groom_version_major stands on a transform" if versions else "no groom_version_major"
    found.append(Finding.of("groom-version", bool(versions), said, otherwise="warning"))
    for node in nodes:
        if node.is_a("AbcGeom_Curve"):
            found += _curves(node, _attributes(node))
    return found


def _nodes(archive: Archive) -> Iterator[Object]:
    waiting = [archive.top()]
    for _ in range(_MOST_OBJECTS):
        if not waiting:
            return
        node = waiting.pop()
        yield node
        waiting += node.objects()


def _user_properties(node: Object) -> dict[str, Any]:
    schema = node.properties().get(".xform")
    user = {} if schema is None else schema.properties()
    return user[".userProperties"].properties() if ".userProperties" in user else {}


def _attributes(node: Object) -> dict[str, Any]:
    geometry = node.properties().get(".geom")
    found = geometry.properties() if geometry else {}
    return found[".arbGeomParams"].properties() if ".arbGeomParams" in found else {}


def _curves(node: Object, attributes: dict[str, Any]) -> list[Finding]:
    found = []
    if "groom_id" in attributes:
        ids = _numbers(attributes["groom_id"])
        unique = ids is not None and len(np.unique(ids)) == len(ids)
        said = f"groom_id of {node.name} {'differ' if unique else 'repeat'} from curve to curve"
        found.append(Finding.of("groom-id", unique, said))
    if "groom_group_id" in attributes:
        ids = _numbers(attributes["groom_group_id"])
        several = ids is not None and len(np.unique(ids)) > 1
        named = not several or "groom_group_name" in attributes
        said = "groups have names" if named else "several groups without groom_group_name"
        found.append(Finding.of("group-names", named, said, otherwise="warning"))
    if "groom_guide_weights" in attributes:
        weights = _numbers(attributes["groom_guide_weights"])
        whole = weights is not None and bool(np.allclose(weights.sum(axis=-1), 1, atol=1e-3))
        said = f"groom_guide_weights of {node.name} {'' if whole else 'do not '}sum to 1"
        found.append(Finding.of("guide-weights", whole, said))
    return found


def _numbers(header: Any) -> Any:
    header = header.properties().get(".vals", header)
    whole = header.integers()
    return header.floats() if whole is None else whole
