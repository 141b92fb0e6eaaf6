"""Make a glTF document of a groom: skeleton, head, lines, strips, materials and animation."""

from __future__ import annotations

import functools

import numpy as np

from hairkit.arrays import Float32Array, Float64Array
from hairkit.errors import InputError
from hairkit.grooming.prepare_export import PreparedGroom
from hairkit.head_model.bust import bust_under
from hairkit.head_model.skinning import HEAD_JOINT, JOINT_NAMES, JOINT_PARENTS
from hairkit.io.glb_document import Document
from hairkit.simulation.rigid_motion import follow_head, inverse_motion
from hairkit.types.groom import Groom

from .baking import Baked, bake
from .extras import groom_extras
from .meshes import ROUGHNESS, Meshes, brightest
from .options import Options
from .strips import hair_meshes
from .texture import strand_pictures, white_picture

BODY = ("head_mesh", "torso")
"""Meshes without the hair's shapes."""
LINES = "guides"
"""The mesh that no client skins: three.js skins triangles alone."""
_CUTOFF = 0.4
_STRANDS_ON = {"ribbons": 6, "cards": 22}
"""Strands in the picture of each strip."""


def groom_document(ready: PreparedGroom, options: Options) -> Document:
    """Return the document of a groom; each level of detail is a scene, the first holds the lines.

    Raises
    ------
    InputError
        The options leave nothing to write.
    """
    document = Document()
    groom = ready.groom
    document.json["extras"] = {"hairkit": groom_extras(groom)}
    baked = _bake(ready, options)
    shapes = (
        np.zeros((0, len(groom.strands.points), 3), np.float32) if baked is None else baked.shapes
    )
    meshes = Meshes(document, groom)
    shared = [("head_mesh", meshes.head())] if options.head_mesh else []
    bust = bust_under(groom.head, groom.strands) if options.head_mesh and options.bust else None
    if bust is not None:
        shared.append(("torso", meshes.torso(bust)))
    levels = []
    if options.hair != "none":
        material = _hair_material(document, groom, options)
        for level, mesh in enumerate(hair_meshes(groom, shapes, options)):
            levels.append([(f"hair_LOD{level}", meshes.hair(mesh, material, level))])
    first = levels[0] if levels else []
    if options.lines != "none":
        first = [(LINES, meshes.lines(groom, shapes, options.lines)), *first]
    if not (first or shared):
        raise InputError("lines=none, hair=none and head_mesh=false leave nothing to write")
    scenes = [[*shared, *first], *([*shared, *level] for level in levels[1:])]
    animated = [
        _scene(document, groom, parts, level, len(shapes)) for level, parts in enumerate(scenes)
    ]
    document.json["scene"] = 0
    if baked is not None:
        _animate(document, groom, baked, animated)
    return document


def _bake(ready: PreparedGroom, options: Options) -> Baked | None:
    if ready.cache is None or options.animation == "none":
        return None
    rest = ready.groom.strands.points
    deform = options.animation == "morph"
    return bake(ready.cache, rest, options.frame_step, options.morphs, deform)


def _scene(
    document: Document, groom: Groom, parts: list[tuple[str, int]], level: int, morphs: int
) -> tuple[int, list[int]]:
    """Add a scene with a skeleton of its own; return its root joint and the nodes that morph.

    Scenes share no node: a node has one place in three.js, and skins must lie in their scene.
    """
    joints = groom.head.joints.astype(np.float64)
    offsets = np.diff(joints, axis=0, prepend=np.zeros((1, 3)))
    numbers = document.joints(JOINT_NAMES, joints, JOINT_PARENTS)
    nodes, at_top = [], []
    skin = document.skin(numbers, joints) if any(name != LINES for name, _ in parts) else None
    for name, mesh in parts:
        if name == LINES:
            node = document.add("nodes", name=name, mesh=mesh, translation=_back(offsets))
            document.json["nodes"][numbers[HEAD_JOINT]]["children"] = [node]
        else:
            node = document.add("nodes", name=name, mesh=mesh, skin=skin)
            at_top.append(node)
        nodes.append(node)
    document.add("scenes", name=f"LOD{level}", nodes=[numbers[0], *at_top])
    moving = [node for node, (name, _) in zip(nodes, parts, strict=True) if name not in BODY]
    return numbers[0], moving if morphs else []


def _back(offsets: Float64Array) -> list[float]:
    """Return the translation that leads from the head joint to the origin, without a remainder."""
    # summed in the order in which readers multiply the nodes' transforms
    place = functools.reduce(np.add, offsets)
    back: list[float] = (-place).tolist()
    return back


def _animate(
    document: Document, groom: Groom, baked: Baked, animated: list[tuple[int, list[int]]]
) -> None:
    """Add one animation that moves all scenes alike."""
    times = document.accessor(baked.times, None, bounds=True)
    tracks = _joint_tracks(groom, baked.head_from_rest)
    if len(baked.shapes):
        tracks.append((0, "weights", baked.weights.reshape(-1)))
    samplers = [
        {"input": times, "interpolation": "LINEAR", "output": document.accessor(values, None)}
        for _, _, values in tracks
    ]
    channels = [
        {"sampler": sampler, "target": {"node": node, "path": path}}
        for root, moving in animated
        for sampler, (joint, path, _) in enumerate(tracks)
        for node in (moving if path == "weights" else [root + joint])
    ]
    document.add("animations", name="simulation", samplers=samplers, channels=channels)


def _joint_tracks(groom: Groom, motion: Float64Array) -> list[tuple[int, str, Float32Array]]:
    """Return translations (T, 3) and rotations (T, 4) of torso, the root joint, and head on it."""
    from scipy.spatial.transform import Rotation

    root, neck, head = groom.head.joints.astype(np.float64)
    torso = np.stack([follow_head(np.eye(4), moved, neck) for moved in motion])
    against = inverse_motion(torso) @ motion
    tracks: list[tuple[int, str, Float32Array]] = []
    for joint, moved, rest in ((0, torso, root), (HEAD_JOINT, against, head)):
        place = moved[:, :3, :3] @ rest + moved[:, :3, 3] - (neck if joint else 0.0)
        turn = Rotation.from_matrix(moved[:, :3, :3]).as_quat()
        # the shorter way from key to key: q and -q are the same rotation
        jump = (turn[1:] * turn[:-1]).sum(axis=1) < 0
        turn[1:] *= np.where(np.cumsum(jump) % 2, -1.0, 1.0)[:, None]
        tracks.append((joint, "translation", place.astype(np.float32)))
        tracks.append((joint, "rotation", turn.astype(np.float32)))
    return tracks


def _hair_material(document: Document, groom: Groom, options: Options) -> int:
    colour, normal = strand_pictures(_STRANDS_ON[options.hair], options.alpha == "OPAQUE")
    return document.add(
        "materials",
        name="hair",
        pbrMetallicRoughness={
            "baseColorFactor": [*brightest(groom).tolist(), 1.0],
            "baseColorTexture": {"index": document.image(colour, "strands")},
            "metallicFactor": 0.0,
            "roughnessFactor": ROUGHNESS["hair"],
        },
        normalTexture={"index": document.image(normal, "relief")},
        # white: it gives the roots' texture coordinates a use, and a studio's scalp map a place
        occlusionTexture={"index": document.image(white_picture(), "white"), "texCoord": 1},
        alphaMode=options.alpha,
        alphaCutoff=_CUTOFF if options.alpha == "MASK" else None,
        doubleSided=True,
    )
