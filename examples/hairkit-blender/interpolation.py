"""Hair between guides, by the nodes that come with Blender: interpolate, then a profile.

The nodes are those of Blender's own assets (Interpolate Hair Curves, Set Hair Curve Profile), so
that everything about them can be changed in the modifier's settings, and the file needs no add-on.
"""

from pathlib import Path

import bpy
import numpy as np

ASSETS = "procedural_hair_node_assets.blend"
INTERPOLATE, PROFILE = "Interpolate Hair Curves", "Set Hair Curve Profile"
FULL = 100_000
"""Hairs of a head, on the average; fewer are drawn wider, so that they cover as much."""
WIDEST = 4.0
"""Factor by which hairs are drawn wider at most."""
NEIGHBOUR, REACH = 3, 1.5
"""Hair grows up to 1.5 times the distance from a guide to its third neighbour, as in hairkit."""
MIXED = 2
"""Guides mixed for a hair. Blender's 4 leave a bald band at a parting, whose two sides they mix;
1 leaves clumps (both by eye, 400 guides)."""
SAMPLE = 2000
"""Guides among which that distance is measured."""


def wanted(groom, hairs):
    """Return whether a groom consists of guides, with fewer than `hairs` strands."""
    strands = len(groom.offsets) - 1
    guide = groom.strand.get("guide")
    return 1 < strands < hairs and (guide is None or bool(np.all(guide)))


def interpolate(hair, head, groom, hairs, scalp, uv):
    """Give the guides of an object the nodes that fill them up to about `hairs` on the head.

    `scalp` and `uv` name the vertex group where hair may grow and the map that attaches it. The
    nodes stand before those that follow the head, so that what they grow follows it too.
    """
    nodes = _modifier(hair, INTERPOLATE)
    _set(nodes, "Surface", head, kind="NodeSocketObject")
    _set_field(nodes, "Surface UV Map", uv)
    _set(nodes, "Surface Rest Position", True)
    _set(nodes, "Part by Mesh Islands", False)
    _set(nodes, "Interpolation Guides", MIXED)
    _set(nodes, "Distance to Guides", _reach(groom))
    _set(nodes, "Density", hairs / _scalp_area(groom))
    _set_field(nodes, "Density Mask", scalp)
    if "Distribution Method" not in _sockets(nodes):  # up to Blender 4.5
        _set(nodes, "Poisson Disk Distribution", False)
    profile = _modifier(hair, PROFILE)
    wider = float(np.clip(np.sqrt(FULL / hairs), 1, WIDEST))
    _set(profile, "Radius", float(np.mean(groom.radius)) * wider)
    hair.modifiers.move(hair.modifiers.find(INTERPOLATE), 0)
    return nodes


def follow_frames(hair):
    """Let the nodes take guides and head as they are at each frame, not as they were at rest."""
    nodes = hair.modifiers.get(INTERPOLATE)
    if nodes is not None:
        _set(nodes, "Surface Rest Position", False)


def _modifier(hair, name):
    modifier = hair.modifiers.new(name, "NODES")
    modifier.node_group = _asset(name)
    return modifier


def _asset(name):
    """Return a node group of Blender's hair assets, loaded once a file."""
    found = bpy.data.node_groups.get(name)
    if found is not None and found.library is None:
        return found
    folder = Path(bpy.utils.resource_path("LOCAL")) / "datafiles" / "assets"
    path = next(folder.rglob(ASSETS))
    with bpy.data.libraries.load(str(path)) as (there, here):
        here.node_groups = [group for group in there.node_groups if group == name]
    return here.node_groups[0]


def _sockets(modifier):
    """Return the identifiers of a modifier's inputs by name."""
    items = modifier.node_group.interface.items_tree
    return {
        item.name: item.identifier
        for item in items
        if item.item_type == "SOCKET" and item.in_out == "INPUT"
    }


def _set(modifier, name, value, kind=None):
    items = modifier.node_group.interface.items_tree
    key = next(
        item.identifier
        for item in items
        if item.item_type == "SOCKET"
        and item.in_out == "INPUT"
        and item.name == name
        and kind in (None, item.socket_type)
    )
    modifier[key] = value


def _set_field(modifier, name, attribute):
    key = _sockets(modifier)[name]
    modifier[f"{key}_use_attribute"] = True
    modifier[f"{key}_attribute_name"] = attribute


def _reach(groom):
    """Return the distance in metres within which a guide has hair around it."""
    roots = groom.points[groom.offsets[:-1]]
    some = roots[:: max(1, len(roots) // SAMPLE)]
    apart = np.linalg.norm(some[:, None] - some[None], axis=2)
    rank = min(NEIGHBOUR, len(some) - 1)
    return REACH * float(np.median(np.partition(apart, rank, axis=1)[:, rank]))


def _scalp_area(groom):
    """Return the area in m2 where hair may grow."""
    corners = groom.vertices[groom.faces]
    across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    share = groom.scalp[groom.faces].mean(axis=1)
    return max(float(0.5 * np.linalg.norm(across, axis=1) @ share), 1e-6)
