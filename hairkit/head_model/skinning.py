"""Skin weights of a head: the shares of its three joints in each vertex's motion.

The skull moves with the head joint, the lowest part of the neck stays with the root, and the neck
between is blended by height. The height is measured along an axis that leans forward, because the
base of the skull falls from the nape to the chin. The scalp is rigid, so that hair bound to the
head joint alone stays on the skin.
"""

from __future__ import annotations

import numpy as np

from hairkit.arrays import Float32Array, Float64Array
from hairkit.types.head import Head

JOINT_NAMES = ("root", "neck", "head")
"""Names of the joints in their order; each is the parent of the next."""
JOINT_PARENTS = (-1, 0, 1)
HEAD_JOINT = 2
"""The joint that hair is bound to."""
_LEAN = np.radians(20.0)
"""Forward lean of the axis along which the neck is blended."""
_SKULL = 0.5
"""Share of the height from the neck joint to the head joint above which all is skull."""


def head_weights(head: Head) -> Float32Array:
    """Return (V, 3) the weights of root, neck and head joint: at least 0, each row with sum 1.

    A vertex with scalp of 0.5 or more follows the head joint alone.

    >>> from hairkit.head_model.template import default_head
    >>> top = default_head().vertices[:, 1].argmax()
    >>> head_weights(default_head())[top].tolist()
    [0.0, 0.0, 1.0]
    """
    root, neck, skull = head.joints.astype(np.float64)
    offset = head.vertices.astype(np.float64) - neck
    height = offset @ _upward(skull - root)
    upper = np.linalg.norm(skull - neck)
    lower = np.linalg.norm(neck - root)
    raised = _smooth_step(height / max(_SKULL * upper, 1e-6))
    raised = np.maximum(raised, _smooth_step(2.0 * head.scalp.astype(np.float64)))
    sunk = _smooth_step(-height / max(lower, 1e-6)) * (1.0 - raised)
    weights = np.stack([sunk, 1.0 - raised - sunk, raised], axis=1)
    return np.asarray(weights.clip(0.0, 1.0), np.float32)


def _upward(spine: Float64Array) -> Float64Array:
    """Return the unit direction of the spine, inclined towards the face."""
    length = np.linalg.norm(spine)
    up = spine / length if length > 1e-6 else np.array([0.0, 1.0, 0.0])
    ahead = np.array([0.0, 0.0, 1.0]) - up[2] * up
    ahead /= max(float(np.linalg.norm(ahead)), 1e-6)
    return np.asarray(np.cos(_LEAN) * up + np.sin(_LEAN) * ahead)


def _smooth_step(share: Float64Array) -> Float64Array:
    inside = share.clip(0.0, 1.0)
    return np.asarray(inside * inside * (3.0 - 2.0 * inside))
