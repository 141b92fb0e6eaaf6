"""A groom read from hairkit's native file with NumPy alone, turned to Blender's axes."""

import zipfile
from contextlib import contextmanager
from dataclasses import dataclass

import numpy as np

NEWEST = 1
"""The version of the file that this add-on reads."""


class GroomError(Exception):
    """The file is no groom; the text is one line for the user."""


@dataclass(frozen=True)
class GroomArrays:
    """What Blender needs of a groom: metres, Z up, the face along -Y."""

    points: np.ndarray
    """(P, 3) strand after strand, root first."""
    offsets: np.ndarray
    """(S + 1,) strand s is `points[offsets[s]:offsets[s + 1]]`."""
    radius: np.ndarray
    """(P,) metres."""
    strand: dict
    """Per strand (S,): `group` and `guide`, where the groom has them."""
    root_triangle: np.ndarray
    """(S,) face of the head that carries the root."""
    root_barycentric: np.ndarray
    """(S, 3) weights of that face's corners."""
    root_uv: np.ndarray
    """(S, 2) texture coordinates of the root, as the groom states them."""
    vertices: np.ndarray
    """(V, 3) of the head."""
    faces: np.ndarray
    """(F, 3), counter-clockwise seen from outside."""
    uv: np.ndarray
    """(V, 2) of the head."""
    scalp: np.ndarray
    """(V,) 1 where hair grows."""
    root_colour: np.ndarray
    """(3,) linear RGB."""
    tip_colour: np.ndarray
    """(3,) linear RGB."""
    colours: np.ndarray | None
    """(P, 3) linear RGB, where points have colours of their own."""


def read_groom(path):
    """Return the groom in an .npz file; `GroomError` when it is anything else."""
    with stored_arrays(path, "a groom") as stored:
        version = int(stored["hairkit_groom"])
        if version != NEWEST:
            raise GroomError(f"{path}: a groom of version {version}, this reads {NEWEST}")
        return _arranged({name: stored[name] for name in stored.files})


@contextmanager
def stored_arrays(path, kind):
    """Give the arrays of an .npz file by name; `GroomError` when they are not of this kind."""
    try:
        with np.load(path, allow_pickle=False) as stored:
            yield stored
    except (OSError, KeyError, TypeError, ValueError, zipfile.BadZipFile) as error:
        raise GroomError(f"{path}: not {kind} of hairkit ({error})") from error


def z_up(points):
    """Return points (N, 3) of the head frame (Y up, face along +Z) in Blender's axes."""
    return np.stack([points[:, 0], -points[:, 2], points[:, 1]], axis=1).astype(np.float32)


def y_up(points):
    """Return points (N, 3) of Blender's axes in the head frame."""
    return np.stack([points[:, 0], points[:, 2], -points[:, 1]], axis=1).astype(np.float32)


def _arranged(stored):
    points, faces, uv = stored["points"], stored["head.faces"], stored["head.uv"]
    widths = stored.get("widths")
    if widths is None:
        widths = np.full(len(points), stored["material.width"], np.float32)
    triangle, barycentric = stored["root_triangle"], stored["root_barycentric"]
    root_uv = stored.get("root_uv")
    if root_uv is None:
        root_uv = np.einsum("sk,skc->sc", barycentric, uv[faces[triangle]])
    return GroomArrays(
        points=z_up(points),
        offsets=stored["offsets"].astype(np.int32),
        radius=np.asarray(widths / 2, np.float32),
        strand={name: stored[name] for name in ("group", "guide") if name in stored},
        root_triangle=triangle,
        root_barycentric=barycentric,
        root_uv=np.asarray(root_uv, np.float32),
        vertices=z_up(stored["head.vertices"]),
        faces=faces,
        uv=uv,
        scalp=stored["head.scalp"],
        root_colour=stored["material.root_colour"],
        tip_colour=stored["material.tip_colour"],
        colours=stored.get("colours"),
    )
