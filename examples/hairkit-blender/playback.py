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
from .groom_file import stored_arrays
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
    with stored_arrays(path, "a simulation") as stored:
        return Frames(*(stored[name] for name in ("points", "times", "head_from_rest")))


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


def on_the_head(frames, carried):
    """Return the same frames seen from an object that moves as `carried` (T, 4, 4) says."""
    back = np.linalg.inv(carried)
    points = np.einsum("tij,tpj->tpi", back[:, :3, :3], frames.points) + back[:, None, :3, 3]
    still = np.tile(np.eye(4), (len(points), 1, 1))
    return Frames(points.astype(np.float32), frames.times, still)


def write_playable(words, groom, frames, carried, place):
    """Return the Alembic file that hairkit (`words` run it) makes of a groom's frames.

    `carried` (T, 4, 4) is the motion of the object that the hair hangs on. Frames of all strands
    move all of them, frames of the guides the others with them.
    """
    with np.load(groom, allow_pickle=False) as stored:
        arrays = dict(stored)
    if frames.points.shape[1] == len(arrays["points"]):
        arrays.pop("guide", None)
    source, cache = place / "playing.npz", place / "frames.npz"
    np.savez(source, **arrays)
    np.savez(cache, **vars(on_the_head(frames, carried)))
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


def head_motion(context, head, scalp):
    """Return how the scene moves a head's object and its scalp, both (T, 4, 4), in the head frame.

    Both are motions since the object's place at the first frame, with the mesh at rest. They differ
    where bones move the scalp; of a scalp that is bent the rigid part counts.
    """
    scene, now = context.scene, context.scene.frame_current
    rest = _vertices(head.data)
    chosen = _members(head, scalp)
    places, shapes = [], [rest[chosen]]
    for frame in range(scene.frame_start, scene.frame_end + 1):
        scene.frame_set(frame)
        whole = head.evaluated_get(context.evaluated_depsgraph_get())
        places.append(np.array(whole.matrix_world))
        shape = _vertices(whole.data)  # modifiers that add vertices tell no motion of one
        shapes.append((shape if len(shape) == len(rest) else rest)[chosen])
    scene.frame_set(now)
    carried = np.linalg.inv(places[0]) @ np.stack(places)
    shapes = np.stack(shapes)
    bent = rigid_motion(shapes)[1:]
    bent[np.abs(shapes[1:] - shapes[0]).max(axis=(1, 2)) < STILL] = np.eye(4)
    back = np.linalg.inv(Z_UP)
    return back @ carried @ Z_UP, back @ carried @ bent @ Z_UP


def _vertices(mesh):
    """Return (V, 3) in the object."""
    places = np.empty(3 * len(mesh.vertices), np.float32)
    mesh.vertices.foreach_get("co", places)
    return places.reshape(-1, 3).astype(float)


def _members(thing, name):
    """Return the vertices that belong to a group by more than a half; all where none do."""
    group = thing.vertex_groups.get(name)
    number = -1 if group is None else group.index
    found = [
        vertex.index
        for vertex in thing.data.vertices
        if any(each.group == number and each.weight > 0.5 for each in vertex.groups)
    ]
    return found or list(range(len(thing.data.vertices)))


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
