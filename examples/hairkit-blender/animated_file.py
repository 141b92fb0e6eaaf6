"""What Blender's own importers make of an animated file, frame by frame, as a simulation."""

import contextlib
from pathlib import Path

import bpy
import numpy as np

from .playback import Z_UP, Frames, rigid_motion

_IMPORTERS = {
    ".abc": "wm.alembic_import",
    ".usd": "wm.usd_import",
    ".usda": "wm.usd_import",
    ".usdc": "wm.usd_import",
    ".glb": "import_scene.gltf",
    ".gltf": "import_scene.gltf",
}
_KINDS = (
    "objects", "curves", "hair_curves", "meshes", "armatures", "materials", "actions",
    "cache_files", "images", "collections", "cameras", "lights",
)  # fmt: skip
"""What importers add to a file."""
_BARE = {".abc"}
"""Formats that do not say their axes and unit. hairkit reads their first frame as the groom, which
shows both; of the others it reads the rest pose."""
NEAR = 1e-3
"""Metres by which the first frame may lie off the groom that hairkit has read, after a similarity.
"""


class PlaybackError(Exception):
    """The animation cannot be taken over; the text is one line for the user."""


def frames_of(context, path, points, counts):
    """Return the `Frames` of the hair in a file, None where it does not move.

    `points` (P, 3) in Blender's axes and `counts` (S,) are those of the groom that hairkit has
    read from it.
    """
    operator = _IMPORTERS.get(Path(path).suffix.lower())
    if operator is None:
        return None
    with _imported(context, operator, path) as (things, frames):
        if len(frames) < 2:
            return None
        hair = _with_points(context, things, len(points))
        places = np.stack([_positions(context, hair, frame) for frame in frames])
    if np.ptp(places, axis=0).max() == 0:
        return None
    if Path(path).suffix.lower() in _BARE:
        places = _matched(places, points)
    roots = np.cumsum(counts) - counts
    places = places @ Z_UP[:3, :3]  # the inverse of a rotation acts on rows
    times = np.arange(len(frames)) / (context.scene.render.fps / context.scene.render.fps_base)
    return Frames(places.astype(np.float32), times, rigid_motion(places[:, roots].astype(float)))


@contextlib.contextmanager
def _imported(context, operator, path):
    """Yield the objects that an importer makes and their frames; afterwards they are gone."""
    scene, before = context.scene, {kind: set(getattr(bpy.data, kind)) for kind in _KINDS}
    shown = scene.frame_start, scene.frame_end, scene.frame_current
    chosen, active = list(context.selected_objects), context.view_layer.objects.active
    scene.frame_start, scene.frame_end = 0, 0
    room, name = operator.split(".")
    getattr(getattr(bpy.ops, room), name)(filepath=str(path))
    try:
        yield set(bpy.data.objects) - before["objects"], _range(scene, before["actions"])
    finally:
        scene.frame_start, scene.frame_end = shown[:2]
        scene.frame_set(shown[2])
        for kind, known in before.items():
            bpy.data.batch_remove(set(getattr(bpy.data, kind)) - known)
        for thing in chosen:
            thing.select_set(True)
        context.view_layer.objects.active = active


def _range(scene, actions):
    """Return the frames of what was imported: of its actions, or those that it gave the scene."""
    ends = [end for action in set(bpy.data.actions) - actions for end in action.frame_range]
    ends += [scene.frame_start, scene.frame_end] if scene.frame_end > scene.frame_start else []
    return range(int(min(ends)), int(np.ceil(max(ends))) + 1) if ends else range(0)


def _with_points(context, things, count):
    """Return the object whose points are those of the hair, as many as the groom has."""
    fitting = [
        thing
        for thing in things
        if thing.type in ("CURVES", "MESH") and len(_positions(context, thing)) == count
    ]
    if len(fitting) != 1:
        raise PlaybackError(
            f"the animation is not read: {len(fitting)} objects of the file have the {count}"
            " points of its hair"
        )
    return fitting[0]


def _positions(context, thing, frame=None):
    """Return (P, 3) in the world, at a frame."""
    if frame is not None:
        context.scene.frame_set(frame)
    whole = thing.evaluated_get(context.evaluated_depsgraph_get())
    found = whole.data.attributes.get("position")
    if found is None:
        return np.empty((0, 3))
    places = np.empty(3 * len(found.data), np.float32)
    found.data.foreach_get("vector", places)
    matrix = np.array(whole.matrix_world)
    return places.reshape(-1, 3) @ matrix[:3, :3].T + matrix[:3, 3]


def _matched(places, points):
    """Return frames (T, P, 3) moved, turned and scaled so that the first is the groom.

    Source: Umeyama, Least-squares estimation of transformation parameters, 1991.
    """
    first, wanted = places[0].astype(float), points.astype(float)
    if np.abs(first - wanted).max() < NEAR:
        return places
    middle, goal = first.mean(axis=0), wanted.mean(axis=0)
    left, size, right = np.linalg.svd((wanted - goal).T @ (first - middle))
    sign = np.array([1, 1, np.sign(np.linalg.det(left @ right))])
    turn = left @ np.diag(sign) @ right
    scale = (size * sign).sum() / ((first - middle) ** 2).sum()
    moved = scale * (places - middle) @ turn.T + goal
    if np.abs(moved[0] - wanted).max() > NEAR:
        raise PlaybackError(
            "the animation is not read: its first frame is not the groom that hairkit reads"
        )
    return moved
