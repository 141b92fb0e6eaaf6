"""What Unreal demands of an .abc beyond its strands: its groom schema, and no mesh."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from hairkit.types.finding import Finding

from .contents import Object, Values, read_objects

TARGETS = ("unreal", "metahuman")


def check_schema(path: Path) -> list[Finding]:
    """Return findings about groom_version, ids, groups, guides' weights and meshes of a file."""
    nodes = read_objects(path)
    meshes = [node.name for node in nodes if node.is_a("AbcGeom_PolyMesh")]
    said = f"meshes in the file: {', '.join(meshes[:3]) or 'none'}; Unreal refuses grooms with one"
    found = [Finding.of("no-mesh", not meshes, said)]
    versions = [node for node in nodes if "groom_version_major" in node.user]
    said = "groom_version_major stands on a transform" if versions else "no groom_version_major"
    found.append(Finding.of("groom-version", bool(versions), said, otherwise="warning"))
    for node in nodes:
        if node.is_a("AbcGeom_Curve"):
            found += _curves(node, node.values)
    return found


def _curves(node: Object, attributes: Mapping[str, Values]) -> list[Finding]:
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


def _numbers(values: Values) -> Any:
    whole = values.integers()
    return values.floats() if whole is None else whole
