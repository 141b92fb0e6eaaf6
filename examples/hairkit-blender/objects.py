"""A groom as Blender objects: hair curves that are attached to the mesh of the head."""

import itertools

import bpy
import numpy as np

from . import interpolation
from .attachment import face_cells, places
from .materials import COLOUR, hair_material, head_material

UV, ATTACHMENT = "UVMap", "hairkit attachment"
SCALP = "scalp"
FOLLOW = "Follow the head"
"""Name of the modifier that deforms hair with the surface of the head."""


def add_groom(context, groom, name, fill=0):
    """Add a groom to the scene and return the objects (head, hair), the hair selected.

    Guides get Blender's nodes that draw about `fill` hairs between them.
    """
    head = add_head(context, groom, f"{name} head")
    hair = add_hair(context, groom, name, head)
    if interpolation.wanted(groom, fill):
        interpolation.interpolate(hair, head, groom, fill, SCALP, ATTACHMENT)
    for thing in context.selected_objects:
        thing.select_set(False)
    hair.select_set(True)
    context.view_layer.objects.active = hair
    return head, hair


def add_head(context, groom, name):
    """Add the head mesh, smooth, with its uv, one for the hair's attachment, and the scalp."""
    mesh = bpy.data.meshes.new(name)
    mesh.vertices.add(len(groom.vertices))
    mesh.vertices.foreach_set("co", groom.vertices.ravel())
    mesh.loops.add(groom.faces.size)
    mesh.loops.foreach_set("vertex_index", groom.faces.ravel())
    mesh.polygons.add(len(groom.faces))
    mesh.polygons.foreach_set("loop_start", np.arange(0, groom.faces.size, 3, dtype=np.int32))
    mesh.update(calc_edges=True)
    mesh.shade_smooth()
    for layer, uv in ((UV, groom.uv[groom.faces]), (ATTACHMENT, face_cells(len(groom.faces)))):
        values = np.ascontiguousarray(uv, np.float32).ravel()
        mesh.uv_layers.new(name=layer).uv.foreach_set("vector", values)
    mesh.uv_layers.active = mesh.uv_layers[UV]
    mesh.materials.append(head_material())
    head = bpy.data.objects.new(name, mesh)
    head.add_rest_position_attribute = True  # what the deformation is measured from
    _weigh(head, groom.scalp)
    context.collection.objects.link(head)
    return head


def add_hair(context, groom, name, head):
    """Add the strands as hair curves, which follow the head when it moves or changes shape."""
    curves = bpy.data.hair_curves.new(name)
    curves.add_curves(np.diff(groom.offsets).tolist())
    curves.position_data.foreach_set("vector", groom.points.ravel())
    _set(curves, "radius", "FLOAT", "POINT", groom.radius)
    roots = places(face_cells(len(groom.faces)), groom.root_triangle, groom.root_barycentric)
    _set(curves, "surface_uv_coordinate", "FLOAT2", "CURVE", roots)
    _set(curves, "root_uv", "FLOAT2", "CURVE", groom.root_uv)
    for key, kind in (("group", "INT"), ("guide", "BOOLEAN")):
        if key in groom.strand:
            _set(curves, key, kind, "CURVE", groom.strand[key])
    if groom.colours is not None:
        opaque = np.pad(groom.colours, ((0, 0), (0, 1)), constant_values=1)
        _set(curves, COLOUR, "FLOAT_COLOR", "POINT", opaque)
    curves.materials.append(hair_material(groom.root_colour, groom.tip_colour))
    curves.surface = head
    curves.surface_uv_map = ATTACHMENT
    hair = bpy.data.objects.new(name, curves)
    hair.parent = head
    hair.modifiers.new(FOLLOW, "NODES").node_group = _follow_nodes()
    context.collection.objects.link(hair)
    return hair


def _set(curves, name, kind, domain, values):
    attribute = curves.attributes.get(name) or curves.attributes.new(name, kind, domain)
    key = {"FLOAT2": "vector", "FLOAT_COLOR": "color"}.get(kind, "value")
    attribute.data.foreach_set(key, np.ascontiguousarray(values).ravel())


def _weigh(head, scalp):
    """Mark the scalp as a vertex group; vertices of equal weight go in at once."""
    group = head.vertex_groups.new(name=SCALP)
    for weight in np.unique(scalp[scalp > 0]):
        group.add(np.flatnonzero(scalp == weight).tolist(), float(weight), "REPLACE")


def _follow_nodes():
    """Return the geometry nodes that Blender itself gives new hair: deform on the surface."""
    name = "hairkit follow the head"
    tree = bpy.data.node_groups.get(name)
    if tree is not None:
        return tree
    tree = bpy.data.node_groups.new(name, "GeometryNodeTree")
    tree.is_modifier = True
    for way in ("INPUT", "OUTPUT"):
        tree.interface.new_socket("Geometry", in_out=way, socket_type="NodeSocketGeometry")
    nodes = [
        tree.nodes.new(kind)
        for kind in ("NodeGroupInput", "GeometryNodeDeformCurvesOnSurface", "NodeGroupOutput")
    ]
    for index, (first, second) in enumerate(itertools.pairwise(nodes)):
        second.location.x = 200 * (index + 1)
        tree.links.new(first.outputs[0], second.inputs[0])
    return tree
