"""Moving hair: frames of a simulation become a file that Blender plays on the hair curves.

Points are kept as they lie on the head, so that hair goes where the head goes, whatever moves it.
The file is Alembic, which Blender reads frame by frame (modifier Mesh Sequence Cache): scenes play
and render where the add-on is not installed.
"""

from dataclasses import dataclass
from pathlib import Path

import bpy
import numpy as np
from mathutils import Matrix

from . import child, interpolation
from .groom_file import GroomError
from .objects import FOLLOW

MODIFIER = "hairkit simulation"
GROOM = "hairkit_groom"
"""Property of a hair object: the file of its groom."""
Z_UP = np.array([[1.0, 0, 0, 0], [0, 0, -1, 0], [0, 1, 0, 0], [0, 0, 0, 1]])
"""Head frame to Blender's axes."""
STILL = 1e-6
"""Metres and shares: a motion of the head below it is none."""
_CURVES = "/groom/strands"
"""Where hairkit's Alembic files have the hair."""


@dataclass(frozen=True)
class Frames:
    """A simulation in the head frame of its first frame, metres, as hairkit stores it."""

    points: np.ndarray
    """(T, P, 3)."""
    times: np.ndarray
    """(T,) seconds."""
    head_from_rest: np.ndarray
    """(T, 4, 4)."""


def read_frames(path):
    """Return the `Frames` of a cache that `hairkit simulate` wrote; `GroomError` else."""
    try:
        with np.load(path, allow_pickle=False) as stored:
            return Frames(*(stored[name] for name in ("points", "times", "head_from_rest")))
    except (OSError, KeyError, ValueError) as error:
        raise GroomError(f"{path}: not a simulation of hairkit ({error})") from error


def folder(name):
    """Return the folder of files that belong to the scene: beside it, else Blender's own."""
    base = Path(bpy.path.abspath("//")) if bpy.data.filepath else Path(bpy.app.tempdir)
    made = base / f"{bpy.path.clean_name(name)}-hairkit"
    made.mkdir(parents=True, exist_ok=True)
    return made


def free_name(place, stem, ending):
    """Return a file in a folder that is not there yet: what Blender has open is not replaced."""
    number = 1
    while (place / f"{stem}-{number}{ending}").exists():
        number += 1
    return place / f"{stem}-{number}{ending}"


def on_the_head(frames):
    """Return the same frames seen from the moving head, which then rests."""
    back = np.linalg.inv(frames.head_from_rest)
    points = np.einsum("tij,tpj->tpi", back[:, :3, :3], frames.points) + back[:, None, :3, 3]
    still = np.tile(np.eye(4), (len(points), 1, 1))
    return Frames(points.astype(np.float32), frames.times, still)


def write_playable(words, groom, frames, place):
    """Return the Alembic file that hairkit (`words` run it) makes of a groom's frames.

    Frames of all strands move all of them, frames of the guides the others with them.
    """
    with np.load(groom, allow_pickle=False) as stored:
        arrays = dict(stored)
    if frames.points.shape[1] == len(arrays["points"]):
        arrays.pop("guide", None)
    source, cache = place / "playing.npz", place / "frames.npz"
    np.savez(source, **arrays)
    np.savez(cache, **vars(on_the_head(frames)))
    target = free_name(place, "simulation", ".abc")
    try:
        child.run([*words, "export", str(source), "-o", str(target), "--set", f"cache={cache}"])
    finally:
        source.unlink()
        cache.unlink()
    return target


def play(hair, path, start):
    """Let hair curves play a file that `write_playable` made, from frame `start` of the scene."""
    known = set(bpy.data.cache_files)
    bpy.ops.cachefile.open(filepath=str(path))
    file = next(file for file in bpy.data.cache_files if file not in known)
    file.frame_offset = start
    modifier = hair.modifiers.get(MODIFIER) or hair.modifiers.new(MODIFIER, "MESH_SEQUENCE_CACHE")
    modifier.cache_file, modifier.object_path = file, _CURVES
    hair.modifiers.move(hair.modifiers.find(MODIFIER), 0)
    follow = hair.modifiers.get(FOLLOW)
    if follow is not None:  # the frames say where the roots are
        hair.modifiers.remove(follow)
    interpolation.follow_frames(hair)


def head_motion(context, head):
    """Return (T, 4, 4) how the scene moves the head since its first frame, in the head frame."""
    scene, now = context.scene, context.scene.frame_current
    places = []
    for frame in range(scene.frame_start, scene.frame_end + 1):
        scene.frame_set(frame)
        places.append(np.array(head.evaluated_get(context.evaluated_depsgraph_get()).matrix_world))
    scene.frame_set(now)
    since = np.linalg.inv(places[0]) @ np.stack(places)
    return np.linalg.inv(Z_UP) @ since @ Z_UP


def moves(motion):
    """Return whether a motion (T, 4, 4) leaves rest."""
    return bool(np.abs(motion - np.eye(4)).max() > STILL)


def set_keys(head, motion, start):
    """Let an object carry out a motion (T, 4, 4) of the head frame, by keys from a frame on."""
    rest = head.matrix_basis.copy()
    head.rotation_mode = "QUATERNION"
    last = None
    for index, each in enumerate(Z_UP @ motion @ np.linalg.inv(Z_UP)):
        head.matrix_basis = rest @ Matrix(each.tolist())
        if last is not None:
            head.rotation_quaternion.make_compatible(last)
        last = head.rotation_quaternion.copy()
        for name in ("location", "rotation_quaternion"):
            head.keyframe_insert(name, frame=start + index)


def rigid_motion(roots):
    """Return (T, 4, 4) the rigid motion of roots (T, S, 3) since the first frame.

    Source: Kabsch, A solution for the best rotation to relate two sets of vectors, 1976.
    """
    centres = roots.mean(axis=1)
    around = roots - centres[:, None]
    left, _, right = np.linalg.svd(np.einsum("sc,tsd->tcd", around[0], around))
    right[:, 2] *= np.sign(np.linalg.det(left @ right))[:, None]  # no mirroring
    motion = np.tile(np.eye(4), (len(roots), 1, 1))
    motion[:, :3, :3] = np.swapaxes(left @ right, 1, 2)
    motion[:, :3, 3] = centres - motion[:, :3, :3] @ centres[0]
    return motion
