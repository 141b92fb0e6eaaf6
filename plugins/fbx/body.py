"""The head's mesh, skeleton, skin and bind pose."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from hairkit.arrays import Float32Array, Float64Array, Int32Array
from hairkit.head_model.bust import CLOTH, Bust
from hairkit.head_model.skinning import JOINT_NAMES, head_weights
from hairkit.types.head import Head

from .builder import SCENE, Scene, one
from .look import add_material, add_shapes, add_skin_material
from .records import Record, array, number, record, text

DEFORM_ACCURACY = 50.0
"""`Link_DeformAcuracy` (so spelled in the format), per cent, as other exporters write it."""


def add_body(scene: Scene, head: Head) -> None:
    """Add the head mesh, bound to the root, neck and head joints."""
    joints = scene.space.points_to_file(head.joints).astype(np.float64)
    geometry = _add_geometry(scene, head)
    mesh = scene.add_model("head_mesh", "Mesh", SCENE)
    scene.connect(geometry, mesh)
    scene.connect(add_skin_material(scene, head.maps), mesh)
    add_shapes(scene, geometry, head)
    bones = _add_bones(scene, joints)
    _add_bind_pose(scene, mesh, bones, joints)
    _add_skin(scene, geometry, bones, joints, head_weights(head))


def _add_geometry(scene: Scene, head: Head) -> int:
    faces = scene.space.faces_to_file(head.faces)
    scalp = np.repeat(head.scalp[:, None], 4, axis=1)
    scalp[:, 3] = 1.0
    layers = {
        "Color": _indexed_layer("Color", "scalp", "Colors", "ColorIndex", scalp, faces),
        "UV": _indexed_layer("UV", "map1", "UV", "UVIndex", head.uv, faces),
    }
    return _add_mesh(scene, "head_mesh", head.vertices, head.faces, head.normals(), layers)


def add_bust(scene: Scene, bust: Bust) -> None:
    """Add the bust as a mesh of its own, without bones."""
    mesh = scene.add_model("torso", "Mesh", SCENE)
    scene.connect(_add_mesh(scene, "torso", *bust, {}), mesh)
    scene.connect(add_material(scene, "cloth", CLOTH), mesh)


def _add_mesh(
    scene: Scene,
    name: str,
    vertices: Float32Array,
    faces: Int32Array,
    normals: Float32Array | Float64Array,
    layers: Mapping[str, Record],
) -> int:
    """Add a mesh of triangles with normals, one material and more layers; return its id."""
    space = scene.space
    polygons = space.faces_to_file(faces).copy()
    polygons[:, 2] = -polygons[:, 2] - 1  # the last corner of each polygon is marked so
    upright = record("Normals", array("d", space.directions_to_file(normals)))
    alike = record("Materials", array("i", [0]))
    layers = {
        "Normal": _layer("Normal", "", "ByVertice", "Direct", upright),
        **layers,
        "Material": _layer("Material", "", "AllSame", "IndexToDirect", alike),
    }
    return scene.add(
        "Geometry",
        name,
        "Mesh",
        record("GeometryVersion", number("I", 124)),
        record("Vertices", array("d", space.points_to_file(vertices))),
        record("PolygonVertexIndex", array("i", polygons)),
        *layers.values(),
        _layer_list(list(layers)),
    )


def _indexed_layer(
    kind: str, name: str, values: str, index: str, rows: Float32Array, faces: Int32Array
) -> Record:
    """Return a layer with a value a vertex, named again at every corner of every face."""
    content = record(values, array("d", rows)), record(index, array("i", faces))
    return _layer(kind, name, "ByPolygonVertex", "IndexToDirect", *content)


def _layer(kind: str, name: str, mapping: str, reference: str, *content: Record) -> Record:
    return record(
        f"LayerElement{kind}",
        number("I", 0),
        children=[
            record("Version", number("I", 101)),
            record("Name", text(name)),
            record("MappingInformationType", text(mapping)),
            record("ReferenceInformationType", text(reference)),
            *content,
        ],
    )


def _layer_list(kinds: list[str]) -> Record:
    entries = [
        record(
            "LayerElement",
            children=[
                record("Type", text(f"LayerElement{kind}")),
                record("TypedIndex", number("I", 0)),
            ],
        )
        for kind in kinds
    ]
    version = record("Version", number("I", 100))
    return record("Layer", number("I", 0), children=[version, *entries])


def _add_bones(scene: Scene, joints: Float64Array) -> list[int]:
    """Add the joints as limb nodes, each the parent of the next."""
    bones: list[int] = []
    for name, offset in zip(JOINT_NAMES, np.diff(joints, axis=0, prepend=0.0), strict=True):
        attribute = scene.add(
            "NodeAttribute", name, "LimbNode", record("TypeFlags", text("Skeleton"))
        )
        move = one("Lcl Translation", "Lcl Translation", "", "A", *offset.tolist())
        bones.append(scene.add_model(name, "LimbNode", bones[-1] if bones else SCENE, move))
        scene.connect(attribute, bones[-1])
    return bones


def _translation(offset: Float64Array) -> Float64Array:
    """Return the translation by `offset`, acting on row vectors."""
    matrix = np.eye(4)
    matrix[3, :3] = offset
    return matrix


def _add_bind_pose(scene: Scene, mesh: int, bones: list[int], joints: Float64Array) -> None:
    places = [(mesh, np.eye(4))]
    places += [(bone, _translation(joint)) for bone, joint in zip(bones, joints, strict=True)]
    scene.add(
        "Pose",
        "bind",
        "BindPose",
        record("Type", text("BindPose")),
        record("Version", number("I", 100)),
        record("NbPoseNodes", number("I", len(places))),
        *[
            record(
                "PoseNode",
                children=[record("Node", number("L", node)), record("Matrix", array("d", matrix))],
            )
            for node, matrix in places
        ],
    )


def _add_skin(
    scene: Scene, geometry: int, bones: list[int], joints: Float64Array, weights: Float32Array
) -> None:
    """Add the skin with one cluster a joint: which vertices follow it, and how much."""
    skin = scene.add(
        "Deformer",
        "head_skin",
        "Skin",
        record("Version", number("I", 101)),
        record("Link_DeformAcuracy", number("D", DEFORM_ACCURACY)),
    )
    scene.connect(skin, geometry)
    for name, bone, joint, share in zip(JOINT_NAMES, bones, joints, weights.T, strict=True):
        rows = np.flatnonzero(share)
        listed = [record("Indexes", array("i", rows)), record("Weights", array("d", share[rows]))]
        cluster = scene.add(
            "Deformer",
            name,
            "Cluster",
            record("Version", number("I", 100)),
            record("UserData", text(""), text("")),
            *(listed if len(rows) else ()),
            record("Transform", array("d", _translation(-joint))),
            record("TransformLink", array("d", _translation(joint))),
            label="SubDeformer",
        )
        scene.connect(cluster, skin)
        scene.connect(bone, cluster)
