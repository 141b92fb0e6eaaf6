"""VRM 1.0: the head and its cards on a humanoid skeleton, with hair that swings.

`VRMC_vrm` and `VRMC_springBone` 1.0 (vrm-c/vrm-specification). A VRM file must be of a whole human:
the bones below the neck, which a groom does not have, stand where an average adult's do.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from hairkit.arrays import Float64Array
from hairkit.types.groom import Groom, HairPhysics

from .bones import Chains
from .scene import Skeleton, with_chains

GROUND = 1.55
"""Metres from the ground to the head's joint, where a groom lies about the origin."""
STANDING = 0.8
"""Height of the head's joint, metres, from which a groom stands on the ground already."""
BODY: tuple[tuple[str, str, tuple[float, float, float]], ...] = (
    ("hips", "", (0, 0.6, 0)),
    ("spine", "hips", (0, 0.67, 0)),
    ("neck", "spine", (0, 0, 0)),
    ("head", "neck", (0, 0, 0)),
    ("leftUpperLeg", "hips", (0.055, 0.57, 0)),
    ("leftLowerLeg", "leftUpperLeg", (0.055, 0.31, 0)),
    ("leftFoot", "leftLowerLeg", (0.055, 0.05, 0)),
    ("rightUpperLeg", "hips", (-0.055, 0.57, 0)),
    ("rightLowerLeg", "rightUpperLeg", (-0.055, 0.31, 0)),
    ("rightFoot", "rightLowerLeg", (-0.055, 0.05, 0)),
    ("leftUpperArm", "spine", (0.11, 0.86, 0)),
    ("leftLowerArm", "leftUpperArm", (0.28, 0.86, 0)),
    ("leftHand", "leftLowerArm", (0.44, 0.86, 0)),
    ("rightUpperArm", "spine", (-0.11, 0.86, 0)),
    ("rightLowerArm", "rightUpperArm", (-0.28, 0.86, 0)),
    ("rightHand", "rightLowerArm", (-0.44, 0.86, 0)),
)
"""Bones, the bone above, and places in shares of the head joint's height (T pose; estimates from
the proportions of Drillis and Contini 1966). Neck and head are the groom's own."""
STIFFEST = 2.0
"""Stiffness force of the stiffest hair; the specification's usual range is 0 to 4."""
LEAST_DRAG = 0.3
"""Drag of hair without damping, of 1; below, chains swing for seconds."""
HIT_RADIUS = 0.012
"""Metres of hair around a joint that colliders push."""
LICENCE = "https://vrm.dev/licenses/1.0/"
"""The licence that VRM 1.0 files name; its terms are the fields of `meta`."""


def stand_up(groom: Groom) -> Float64Array:
    """Return the move (3,) that takes a groom about the origin to its height above the ground."""
    height = float(groom.head.joints[2, 1])
    return np.array([0.0, 0.0 if height > STANDING else GROUND - height, 0.0])


def raise_groom(groom: Groom, move: Float64Array) -> Groom:
    """Return the groom moved by `move` (3,), metres."""
    offset = move.astype(np.float32)
    strands = replace(groom.strands, points=groom.strands.points + offset)
    return replace(groom, strands=strands, head=groom.head.carried(lambda p: p + offset))


def human_skeleton(groom: Groom, chains: Chains) -> Skeleton:
    """Return the bones of a human around the groom's head, and the chains on it."""
    _, neck, head = groom.head.joints.astype(np.float64)
    own = {"neck": neck, "head": head}
    number = {name: n for n, (name, _, _) in enumerate(BODY)}
    places = np.array(
        [
            own.get(name, head[1] * np.array(share) + (neck[0], 0.0, neck[2]))
            for name, _, share in BODY
        ]
    )
    parents = [number.get(above, -1) for _, above, _ in BODY]
    joints = number["spine"], number["neck"], number["head"]
    return with_chains([name for name, _, _ in BODY], places, parents, joints, chains)


def extensions(
    groom: Groom, chains: Chains, skeleton: Skeleton, nodes: list[int], title: str, author: str
) -> dict[str, Any]:
    """Return the two extensions of a document whose skeleton has these nodes."""
    bones = {name: {"node": nodes[n]} for n, (name, _, _) in enumerate(BODY)}
    meta = {"name": title, "version": "1", "authors": [author], "licenseUrl": LICENCE}
    return {
        "VRMC_vrm": {"specVersion": "1.0", "meta": meta, "humanoid": {"humanBones": bones}},
        "VRMC_springBone": _springs(groom, chains, skeleton, nodes),
    }


def _springs(groom: Groom, chains: Chains, skeleton: Skeleton, nodes: list[int]) -> dict[str, Any]:
    colliders = _colliders(groom, skeleton, nodes)
    joint = _joint_settings(groom.physics)
    springs = []
    for number, (first, last) in enumerate(zip(chains.first[:-1], chains.first[1:], strict=True)):
        members = [nodes[skeleton.chains + j] for j in range(first, last)]
        springs.append(
            {
                "name": f"hair_{number}",
                "joints": [{"node": node, **joint} for node in members],
                "colliderGroups": [0],
            }
        )
    return {
        "specVersion": "1.0",
        "colliders": colliders,
        "colliderGroups": [{"name": "head", "colliders": list(range(len(colliders)))}],
        "springs": springs,
    }


def _joint_settings(physics: HairPhysics) -> dict[str, Any]:
    """Return the settings of every joint; the hair at rest hangs already, so nothing pulls it."""
    return {
        "hitRadius": HIT_RADIUS,
        "stiffness": STIFFEST * float(np.clip(physics.stiffness, 0, 1)),
        "gravityPower": 0.0,
        "gravityDir": [0.0, -1.0, 0.0],
        "dragForce": float(np.clip(LEAST_DRAG + physics.damping, 0, 1)),
    }


def _colliders(groom: Groom, skeleton: Skeleton, nodes: list[int]) -> list[dict[str, Any]]:
    """Return the head's capsules on the nearest of its joints, with the mean of their radii."""
    capsules = groom.head.capsules
    joints = groom.head.joints.astype(np.float64)
    colliders = []
    for first, second, radius in zip(capsules.first, capsules.second, capsules.radius, strict=True):
        middle = 0.5 * (first + second)
        nearest = int(np.linalg.norm(joints - middle, axis=1).argmin())
        bone = skeleton.head[nearest]
        place = skeleton.places[bone]
        shape = {
            "offset": (first - place).tolist(),
            "radius": float(radius.mean()),
            "tail": (second - place).tolist(),
        }
        colliders.append({"node": nodes[bone], "shape": {"capsule": shape}})
    return colliders
