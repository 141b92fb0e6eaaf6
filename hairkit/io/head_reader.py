"""Heads that users bring: OBJ, PLY and GLB meshes in any unit, with the scalp marked somehow."""

from __future__ import annotations

import json
import os
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import numpy.typing as npt
from scipy.spatial import cKDTree

from hairkit.arrays import Float32Array, Float64Array, Int32Array, Int64Array, check_reach
from hairkit.errors import FormatError, InputError
from hairkit.head_model.carry_scalp import transfer_scalp
from hairkit.head_model.reach import Reach
from hairkit.head_model.template import default_head
from hairkit.io.glb_mesh import read_glb
from hairkit.io.head_landmarks import read_landmarks
from hairkit.io.mesh_text import FileMesh, obj_side_files, read_obj, read_ply
from hairkit.io.photos import read_drawing
from hairkit.io.textures import as_maps, write_mtl
from hairkit.storage import write_text
from hairkit.types.head import Capsules, Head
from hairkit.types.skin import Blendshape, SkinMaps

UNITS = {"m": 1.0, "cm": 0.01, "mm": 0.001, "in": 0.0254}
"""Metres in one unit of a head file."""
_READERS = {".obj": read_obj, ".ply": read_ply, ".glb": read_glb, ".vrm": read_glb}
_DEFAULT_BREADTH, _NARROWEST, _BROADEST = 0.155, 0.05, 0.6
"""Breadths in metres: the default head's, a doll's, a statue's; others are in another unit."""
_OFF_CENTRE = 0.02
"""Metres from the origin to the middle of the cranium; heads farther off are moved."""
_ROOT_GAP = 0.015
"""Metres from a root to the nearest vertex, in the middle of all: half an edge of coarse heads."""
_LANDMARK_GAP = 0.02
"""Metres from a landmark to the nearest vertex; farther off, units or axes differ."""
_LEVEL_BREADTHS = 0.1
"""Half the height, in head breadths, of the slice that gives the cranium's depth."""
_WHITE = 0.75
"""Brightness that painted scalp reaches and bare skin does not, of 1."""
_TOP_OVER_BREADTH = 0.452
"""Height of the crown over the head's centre, in head breadths."""
_HOW_TO_MARK = (
    "mark it by a group, material or vertex property named 'scalp', by vertices painted red (or "
    "white on black), or by a mask picture NAME.scalp.png over its texture coordinates; or "
    "take the default head's scalp, laid on it by shape: --head-scalp transfer"
)
TRANSFER = "transfer"
"""Name of the scalp that is the default head's."""


@dataclass(frozen=True, eq=False)
class BareHead:
    """A head where its file has it, in metres, +Y up, the face along +Z."""

    vertices: Float64Array
    """(V, 3) metres."""
    faces: Int32Array
    """(F, 3) counter-clockwise from outside."""
    uv: Float64Array | None = None
    """(V, 2) texture coordinates in [0, 1]."""
    scalp: Float64Array | None = None
    """(V,) 1 where hair grows; None where nothing marks it."""
    landmark_vertices: Int32Array | None = None
    """(68,) vertices of the iBUG landmarks."""
    maps: SkinMaps | None = None
    blendshapes: tuple[Blendshape, ...] = ()
    grown: bool = False
    """Whether roots of hair, and no mark of the file, show the scalp."""

    @classmethod
    def of(cls, head: Head) -> BareHead:
        """Return a head with a scalp as one that was read."""
        return cls(
            head.vertices.astype(np.float64),
            head.faces,
            head.uv.astype(np.float64),
            head.scalp.astype(np.float64),
            head.landmark_vertices,
            head.maps,
            head.blendshapes,
        )


@dataclass(frozen=True)
class HeadFile:
    """The file of a head and how to read it, see `read_head`."""

    path: str
    units: str = "m"
    scalp: str | None = None
    up: str = "y"

    def read(self) -> Head:
        """Return the head."""
        return read_head(self.path, self.units, self.scalp, self.up)

    def files(self) -> list[Path]:
        """Return the files that the head is read from, those that exist."""
        file = Path(self.path)
        named = [file, _beside(file, "landmarks.json"), _beside(file, "scalp.png")]
        named += [Path(self.scalp or ""), *(obj_side_files(file) if file.is_file() else ())]
        return [path for path in named if path.is_file()]


def read_head(
    path: str | os.PathLike[str],
    units: str = "m",
    scalp: str | None = None,
    up: str = "y",
    roots: npt.ArrayLike | None = None,
) -> Head:
    """Return the head in an OBJ, PLY or GLB file, in metres, +Y up, its middle at the origin.

    The face must look along +Z (along -Y where `up` is z). A head whose origin is more than 2 cm
    from the middle of its cranium is moved there. Winding is turned outward. Joints and capsules
    are those of the default head, scaled and moved.

    Parameters
    ----------
    path
        The 68 landmarks may stand beside it in NAME.landmarks.json: a list of vertex numbers from
        0, or of points [x, y, z] in the file's units and axes.
    units
        `m`, `cm`, `mm` or `in`.
    scalp
        Name of the group, material or vertex property that is the scalp, or the path of a mask
        picture (PNG, white is scalp). `None`: a group named scalp, else NAME.scalp.png, else
        painted colours. `transfer`: where no group has that name, the default head's scalp and,
        where none are given, its landmarks, found by the head's shape.
    up
        `y` or `z`.
    roots
        (S, 3) roots of a head of hair that belongs to it, metres: where the file marks no scalp
        and they lie on the mesh, they show it, and the head stays where it is.

    Raises
    ------
    InputError
        The file is missing, the scalp is not marked, or the size cannot be a head's.
    FormatError
        The file is damaged or of another format.
    """
    file = Path(path)
    bare = _read_bare(file, units, scalp, up, roots)
    if bare.scalp is None and scalp == TRANSFER:
        bare = _with_default_scalp(bare, file)
    if bare.scalp is None:
        raise InputError(f"{file}: the head has no scalp: {_HOW_TO_MARK}")
    return _placed(bare, bare.scalp, file)


def _placed(bare: BareHead, scalp: Float64Array, file: Path) -> Head:
    used = np.unique(bare.faces)
    breadth, middle = _breadth_and_middle(bare.vertices[used], scalp[used], file)
    offset = np.zeros(3) if bare.grown or np.linalg.norm(middle) <= _OFF_CENTRE else middle
    moved, middle = bare.vertices - offset, middle - offset
    uv = _azimuthal_uv(moved - middle) if bare.uv is None else bare.uv
    joints, capsules = _skeleton(breadth / _DEFAULT_BREADTH, middle)
    return Head(
        moved.astype(np.float32),
        bare.faces,
        uv.astype(np.float32),
        scalp.astype(np.float32),
        bare.landmark_vertices,
        joints,
        capsules,
        maps=bare.maps,
        blendshapes=bare.blendshapes,
    )


def _with_default_scalp(bare: BareHead, file: Path) -> BareHead:
    try:
        scalp, marks = transfer_scalp(bare.vertices, bare.faces, bare.landmark_vertices)
    except InputError as error:
        raise InputError(f"{file}: {error}") from error
    return replace(bare, scalp=scalp, landmark_vertices=marks)


def read_bare_head(
    path: str | os.PathLike[str], units: str = "m", scalp: str | None = None, up: str = "y"
) -> BareHead:
    """Return the head in a file where it is, whether or not its scalp is marked.

    Parameters and errors are those of `read_head`.
    """
    return _read_bare(Path(path), units, scalp, up, None)


def _read_bare(
    file: Path, units: str, scalp: str | None, up: str, roots: npt.ArrayLike | None
) -> BareHead:
    mesh = _file_mesh(file, units, up)
    vertices = _in_metres(mesh.vertices, units, up)
    check_reach(vertices, file, "vertices")
    weight = _marked_weight(mesh, file, scalp)
    grown = None
    if weight is None and roots is not None:
        grown = weight = _grown_weight(vertices, mesh.faces, roots)
    return BareHead(
        vertices,
        _orient_outward(vertices, mesh.faces.astype(np.int32)),
        None if mesh.uv is None else _in_unit_square(mesh.uv),
        weight,
        _landmarks(file, vertices, units, up),
        as_maps(mesh.maps),
        tuple(
            Blendshape(name, _in_metres(offsets, units, up).astype(np.float32))
            for name, offsets in mesh.shapes.items()
        ),
        grown=grown is not None,
    )


def write_head_obj(path: str | os.PathLike[str], head: Head) -> None:
    """Write the head as OBJ in metres, its faces in the groups `scalp` and `head`.

    Landmarks go to NAME.landmarks.json beside it, maps to NAME.mtl and pictures. `read_head` gives
    the same mesh and maps back; blendshapes have no place in an OBJ file.
    """
    chosen = head.scalp[head.faces].mean(axis=1) > 0.5
    lines = ["# metres, +Y up, +Z out of the face"]
    if head.maps is not None:
        material = Path(path).with_suffix(".mtl")
        write_mtl(material, head.maps)
        lines += [f"mtllib {material.name}", "usemtl skin"]
    lines += ["v {:.9g} {:.9g} {:.9g}".format(*row) for row in head.vertices.tolist()]
    lines += ["vt {:.9g} {:.9g}".format(*row) for row in head.uv.tolist()]
    for name, faces in (("scalp", head.faces[chosen]), ("head", head.faces[~chosen])):
        lines.append(f"g {name}")
        lines += ["f {0}/{0} {1}/{1} {2}/{2}".format(*row) for row in (faces + 1).tolist()]
    write_text(path, "\n".join(lines) + "\n")
    if head.landmark_vertices is not None:
        marks = json.dumps(head.landmark_vertices.tolist())
        write_text(_beside(Path(path), "landmarks.json"), marks)


def _file_mesh(file: Path, units: str, up: str) -> FileMesh:
    if units not in UNITS:
        raise InputError(f"head units are {units!r}, expected one of {', '.join(UNITS)}")
    if up not in ("y", "z"):
        raise InputError(f"the head's up axis is {up!r}, expected y or z")
    if file.suffix.lower() not in _READERS:
        raise FormatError(f"{file}: a head must be an .obj, .ply, .glb or .vrm file")
    return _READERS[file.suffix.lower()](file)


def _beside(file: Path, ending: str) -> Path:
    return file.with_name(f"{file.stem}.{ending}")


def _grown_weight(
    vertices: Float64Array, faces: Int64Array, roots: npt.ArrayLike
) -> Float64Array | None:
    """(V,) 1 where roots of hair stand near each other; None where they are not on the mesh."""
    places = np.asarray(roots, np.float64).reshape(-1, 3)
    if np.median(cKDTree(vertices).query(places)[0]) > _ROOT_GAP:
        return None
    grown = Reach.of(places).covers(vertices).astype(np.float64)
    return grown if grown[faces].all(axis=1).any() else None


def _marked_weight(mesh: FileMesh, file: Path, scalp: str | None) -> Float64Array | None:
    """(V,) from the first mark that the file or the user gives; None where there is none."""
    if scalp is not None and scalp.lower() in mesh.groups:
        weight = mesh.groups[scalp.lower()]
    elif scalp is not None and os.path.lexists(scalp):
        weight = _picture_weight(mesh, file, Path(scalp))
    elif scalp == TRANSFER:
        return None
    elif scalp is not None:
        known = ", ".join(sorted(mesh.groups)) or "none"
        raise InputError(f"{file}: no group or picture {scalp!r} for the scalp; groups: {known}")
    elif "scalp" in mesh.groups:
        weight = mesh.groups["scalp"]
    elif os.path.lexists(_beside(file, "scalp.png")):
        weight = _picture_weight(mesh, file, _beside(file, "scalp.png"))
    elif mesh.colours is not None and (painted := _painted_weight(mesh.colours)) is not None:
        weight = painted
    else:
        return None
    in_use = np.bincount(mesh.faces.ravel(), minlength=len(weight)) > 0
    weight = np.clip(weight, 0, 1) * in_use
    if not (weight[mesh.faces].mean(axis=1) > 0.5).any():
        raise InputError(f"{file}: no face of the head is marked as scalp: {_HOW_TO_MARK}")
    return weight


def _picture_weight(mesh: FileMesh, file: Path, picture: Path) -> Float64Array:
    """Brightness of the mask picture at each vertex's texture coordinates, v from the bottom."""
    if mesh.uv is None:
        raise InputError(f"{file}: has no texture coordinates, which the mask {picture} needs")
    mask = read_drawing(picture)
    height, width = mask.shape
    place = _in_unit_square(mesh.uv)
    column = np.minimum((place[:, 0] * width).astype(int), width - 1)
    row = np.minimum(((1 - place[:, 1]) * height).astype(int), height - 1)
    brightest = max(int(mask.max()), 1)
    return np.asarray(mask[row, column] / brightest, np.float64)


def _painted_weight(colours: Float64Array) -> Float64Array | None:
    """Red paint if there is any, else white on black; skin colours are neither, so None."""
    redness = colours[:, 0] - colours[:, 1:].max(axis=1)
    if redness.max() > 0.5:
        return np.asarray(redness / redness.max(), np.float64)
    brightness: Float64Array = colours.mean(axis=1)
    if brightness.min() > 0.25 or brightness.max() < _WHITE or np.ptp(colours, axis=1).max() > 0.25:
        return None
    return brightness


def _in_metres(points: Float64Array, units: str, up: str) -> Float64Array:
    turned = points if up == "y" else np.stack([points[:, 0], points[:, 2], -points[:, 1]], axis=1)
    return np.asarray(turned * UNITS[units], np.float64)


def _orient_outward(vertices: Float64Array, faces: Int32Array) -> Int32Array:
    corners = vertices[faces] - vertices.mean(axis=0)
    volume = (np.cross(corners[:, 0], corners[:, 1]) * corners[:, 2]).sum()
    return np.ascontiguousarray(faces[:, ::-1]) if volume < 0 else faces


def _breadth_and_middle(
    vertices: Float64Array, weight: Float64Array, file: Path
) -> tuple[float, Float64Array]:
    """Breadth of the scalp and the middle of the cranium, metres, by the default head's shape."""
    scalp = vertices[weight > 0.5]
    breadth = float(np.ptp(scalp[:, 0])) if len(scalp) else 0.0
    if not _NARROWEST <= breadth <= _BROADEST:
        raise InputError(
            f"{file}: the scalp is {breadth:.4g} m broad, a head's is about {_DEFAULT_BREADTH} m: "
            "give the file's units (m, cm, mm, in)"
        )
    height = scalp[:, 1].max() - _TOP_OVER_BREADTH * breadth
    level = vertices[np.abs(vertices[:, 1] - height) < _LEVEL_BREADTHS * breadth]
    depth = level if len(level) else scalp
    middle = [
        0.5 * (scalp[:, 0].min() + scalp[:, 0].max()),
        height,
        0.5 * (depth[:, 2].min() + depth[:, 2].max()),
    ]
    return breadth, np.array(middle, np.float64)


def _landmarks(file: Path, vertices: Float64Array, units: str, up: str) -> Int32Array | None:
    """(68,) vertices named by, or nearest to the points in, NAME.landmarks.json."""
    values = read_landmarks(file, len(vertices))
    if values is None or values.ndim == 1:
        return None if values is None else values.astype(np.int32)
    points = _in_metres(values, units, up)
    apart, nearest = cKDTree(vertices).query(points)
    if apart.max() > _LANDMARK_GAP:
        raise InputError(
            f"{_beside(file, 'landmarks.json')}: a landmark is {1e3 * apart.max():.0f} mm from the"
            " head; same units and axes?"
        )
    return np.asarray(nearest, np.int32)


def _in_unit_square(uv: Float64Array) -> Float64Array:
    """Texture coordinates of further tiles brought back into the first."""
    outside = (uv < 0) | (uv > 1)
    return np.where(outside, uv - np.floor(uv), uv)


def _azimuthal_uv(vertices: Float64Array) -> Float64Array:
    """(V, 2) projection from the crown about the head's middle, as the default head has it."""
    length = np.maximum(np.linalg.norm(vertices, axis=1), 1e-9)
    radius = 0.5 * np.arccos((vertices[:, 1] / length).clip(-1, 1)) / np.pi
    azimuth = np.arctan2(vertices[:, 0], vertices[:, 2])
    return np.stack([0.5 + radius * np.sin(azimuth), 0.5 - radius * np.cos(azimuth)], axis=1)


def _skeleton(scale: float, middle: Float64Array) -> tuple[Float32Array, Capsules]:
    """The default head's joints and capsules, scaled about its middle and moved."""
    model = default_head()
    first = model.capsules.first * scale + middle
    second = model.capsules.second * scale + middle
    radius = model.capsules.radius * scale
    capsules = Capsules(
        first.astype(np.float32), second.astype(np.float32), radius.astype(np.float32)
    )
    return (model.joints * scale + middle).astype(np.float32), capsules
