"""The head bent onto a scan of the person: non-rigid iterative closest points, by trimesh.

The scan, a mesh or a point cloud, is first moved and scaled onto the head: by its landmarks where
it has some, then by trimmed iterative closest points (Chetverikov et al. 2002). Then the head's
vertices are drawn to their nearest points of the scan, with a stiffness that falls step by step:
`amberg` gives each vertex an affine map that differs little from its neighbours' (Amberg et al.
2007, "Optimal step nonrigid ICP algorithms for surface registration"), `sumner` each triangle one
(Sumner and Popovic 2004). Vertices without scan near them, over holes and under hair, follow their
neighbours. Faces, texture coordinates and the scalp stay those of the head.

The photos' cameras are those of the head that is bent, so the scan is scaled to that head. Without
a scan the points that the plugin `sfm` found on the person's skin take its place.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from scipy.spatial import cKDTree

from hairkit import Capture, Head, Mask, Scene, hookimpl
from hairkit.arrays import BoolArray, Float32Array, Float64Array, Int32Array, Int64Array
from hairkit.cameras.similarity import Similarity, fit_similarity
from hairkit.errors import FormatError, InputError
from hairkit.head_model.thin_plate_spline import ThinPlateSpline
from hairkit.io.glb_mesh import read_glb
from hairkit.io.head_landmarks import read_landmarks
from hairkit.io.head_reader import UNITS
from hairkit.io.mesh_text import read_obj, read_ply
from hairkit.io.ply_elements import read_elements
from hairkit.options import option
from hairkit.storage import read_bytes
from hairkit.types.head import JAW_LANDMARKS

STIFFNESS = (0.2, 0.05, 0.02, 0.01)
"""Falling weights of the difference between neighbouring maps (Amberg's alpha). The head is scaled
to a size of 1 for them; trimesh's own steps end at 0.01 too."""
MARKED = (5.0, 2.0, 0.5, 0.0)
"""Weights of landmarks in the same steps (Amberg's beta): the surface knows better at the end."""
NORMALS = 0.5
"""Power of the cosine between normals by which a match counts."""
ITERATIONS = 4
"""Iterations of each step at most."""
SMOOTHNESS = 8.0
"""Weights of Sumner's smoothness are the stiffness times this, those of the match 1."""
IDENTITY = 0.001
"""Weight of staying as it is, of Sumner's method; trimesh recommends it."""
NEAR = 0.015
"""Metres from the scan beyond which a vertex has no match."""
SMALLEST, LARGEST = 0.08, 2.5
"""Metres across: scans from a face's to a person's; others are in another unit."""
FEWEST_POINTS = 500
"""Points of a scan at least."""
FEWEST_SPARSE = 100
"""Points of a scene on the head at least, where there is no scan."""
ROUNDS, KEPT = 40, 0.7
"""Rounds of the rigid alignment, and the share of the nearest points that it uses."""
SAMPLE = 4000
"""Points of the scan that the rigid alignment uses at most."""
OVERLAP = 0.25
"""Share of the head above the neck that lies near the scan at least."""
SPREAD_POINTS = 100_000
"""Points spread over the faces of a scanned mesh: 2 mm apart on a head and neck."""
CONTROLS = 300
"""Vertices by which joints, capsules and shapes are carried along."""
_FACES = re.compile(rb"^element face 0*[1-9]", re.MULTILINE)
"""In the header of a PLY file with faces."""


@dataclass(frozen=True)
class Options:
    """Settings of the registration."""

    scan: Path | None = option(
        None, doc="The scan: .ply (mesh or points), .obj or .glb; none: the points of sfm."
    )
    units: str = option("m", choices=tuple(UNITS), doc="Unit of the scan.")
    method: str = option("amberg", choices=("amberg", "sumner"), doc="What is kept smooth.")
    stiffness: float = option(
        1.0, low=0.05, high=50, doc="Factor of the stiffness: more follows the scan less."
    )


class Scan(NamedTuple):
    """What was scanned."""

    points: Float64Array
    """(P, 3) metres."""
    faces: Int64Array
    """(F, 3), none for a point cloud."""
    landmarks: Float64Array | None
    """(68, 3) metres, in iBUG order."""


@hookimpl
def fit_head(capture: Capture, masks: tuple[Mask, ...], scene: Scene, options: Options) -> Scene:
    """Return the scene with its head bent onto the scan."""
    if options.scan is None:
        return replace(scene, head=bend(scene.head, _sparse(scene), options))
    scan = read_scan(options.scan, options.units)
    return replace(scene, head=bend(scene.head, place(scan, scene.head, options.scan), options))


def _sparse(scene: Scene) -> Scan:
    """Return the points that the scene's cameras found on the head, which lie on it already."""
    points = np.zeros((0, 3)) if scene.points is None else scene.points.astype(np.float64)
    near = points[cKDTree(scene.head.vertices).query(points)[0] < NEAR]
    if len(near) < FEWEST_SPARSE:
        raise InputError(
            "nonrigid_icp needs a scan, --set nonrigid_icp.scan=FILE, or the points of a scene by"
            f" sfm, {FEWEST_SPARSE} or more on the head; there are {len(near)}"
        )
    return Scan(near, np.empty((0, 3), np.int64), None)


def read_scan(path: Path, units: str = "m") -> Scan:
    """Return the scan in a file, with the landmarks of NAME.landmarks.json beside it.

    Raises
    ------
    InputError
        Its size cannot be a head's, or it has too few points.
    FormatError
        The file is damaged or of another format.
    """
    suffix = path.suffix.lower()
    faces = np.empty((0, 3), np.int64)
    if suffix == ".ply" and (cloud := _point_cloud(path)) is not None:
        points = cloud
    elif suffix in (".ply", ".obj", ".glb"):
        mesh = {".ply": read_ply, ".obj": read_obj, ".glb": read_glb}[suffix](path)
        points, faces = mesh.vertices, mesh.faces.astype(np.int64)
    else:
        raise FormatError(f"{path}: a scan must be a .ply, .obj or .glb file")
    if len(points) < FEWEST_POINTS:
        raise InputError(f"{path}: {len(points)} points, expected {FEWEST_POINTS} or more")
    marks = read_landmarks(path, len(points))
    if marks is not None:
        marks = UNITS[units] * (points[marks.astype(np.int64)] if marks.ndim == 1 else marks)
    points = UNITS[units] * points
    across = float(np.linalg.norm(np.ptp(points, axis=0)))
    if not SMALLEST <= across <= LARGEST:
        raise InputError(
            f"{path}: the scan is {across:.3g} m across in the unit {units!r}, expected"
            f" {SMALLEST:g} to {LARGEST:g}; set nonrigid_icp.units to one of {', '.join(UNITS)}"
        )
    return Scan(points, faces, marks)


def place(scan: Scan, head: Head, source: object = "scan") -> Scan:
    """Return the scan moved, turned and scaled onto the head.

    Without landmarks the scan must face +Z with +Y up. Raises `InputError` where both do not
    overlap.
    """
    vertices = head.vertices.astype(np.float64)
    if scan.landmarks is not None and head.landmark_vertices is not None:
        pairs = scan.landmarks, vertices[head.landmark_vertices]
        start = fit_similarity(*pairs)
    else:
        pairs = np.empty((0, 3)), np.empty((0, 3))
        middles = [(np.min(p, axis=0) + np.max(p, axis=0)) / 2 for p in (scan.points, vertices)]
        start = Similarity(1.0, np.eye(3), middles[1] - middles[0])
    found = _align(scan.points, vertices, pairs, start)
    placed = found.apply(scan.points)
    above = vertices[vertices[:, 1] > head.joints[1, 1]]
    covered = float((cKDTree(placed).query(above)[0] < NEAR).mean())
    if covered < OVERLAP:
        raise InputError(
            f"{source}: the scan covers {covered:.0%} of the head, expected {OVERLAP:.0%} or more;"
            " turn it to face +Z with +Y up, or put 68 points in NAME.landmarks.json beside it"
        )
    marks = None if scan.landmarks is None else found.apply(scan.landmarks)
    return Scan(placed, scan.faces, marks)


def bend(head: Head, scan: Scan, options: Options) -> Head:
    """Return the head with its vertices on a scan that lies on it, all else carried along."""
    import trimesh
    from trimesh import registration

    used, faces = np.unique(head.skin_faces(), return_inverse=True)
    source = trimesh.Trimesh(head.vertices[used], faces.reshape(-1, 3), process=False)
    marked: dict[str, Any] = {}
    if scan.landmarks is not None and head.landmark_vertices is not None:
        index = np.searchsorted(used, head.landmark_vertices)
        marked = {"source_landmarks": index, "target_positions": scan.landmarks}
    register: Any = registration  # it has no types
    target = _spread_points(scan)
    common = {"distance_threshold": NEAR / source.scale, "use_faces": False, **marked}
    stiffness = options.stiffness * np.array(STIFFNESS)
    if options.method == "amberg":
        steps = [[s, w, NORMALS, ITERATIONS] for s, w in zip(stiffness, MARKED, strict=True)]
        moved = register.nricp_amberg(source, target, steps=steps, **common)
    else:
        steps = [
            [1.0, IDENTITY, SMOOTHNESS * s, w, NORMALS]
            for s, w in zip(stiffness, MARKED, strict=True)
        ]
        moved = register.nricp_sumner(source, target, steps=steps, **common)
    if not np.isfinite(moved).all():
        raise InputError("nonrigid_icp: the registration failed; raise nonrigid_icp.stiffness")
    skin = ~_behind_eyes(head)[used]
    carried = _carried(head, used[skin], moved[skin])
    vertices = carried.vertices.copy()
    vertices[used[skin]] = moved[skin]
    return replace(carried, vertices=vertices)


def _behind_eyes(head: Head) -> BoolArray:
    """Return (V,) what lies within the eyeballs, and would be drawn before them: the skin that is
    pushed back between the lids."""
    within = np.zeros(len(head.vertices), np.bool_)
    centres = head.eye_centres()
    if head.eye_vertices is not None and centres is not None:
        for ball, centre in zip(head.eye_vertices, centres, strict=True):
            radius = np.linalg.norm(head.vertices[ball] - centre, axis=1).max()
            within |= np.linalg.norm(head.vertices - centre, axis=1) < radius
    return within


def _spread_points(scan: Scan) -> Float64Array:
    """Return points (P, 3) all over the scan: those of a cloud, or evenly spread on its faces."""
    if not len(scan.faces):
        return scan.points
    corners = scan.points[scan.faces]
    area = np.linalg.norm(
        np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1
    )
    generator = np.random.default_rng(0)
    face = generator.choice(len(area), SPREAD_POINTS, p=area / area.sum())
    weights = generator.dirichlet(np.ones(3), SPREAD_POINTS)
    spread: Float64Array = np.einsum("nc,ncx->nx", weights, corners[face])
    return np.concatenate([scan.points[np.unique(scan.faces)], spread])


def _carried(head: Head, used: Int32Array, moved: Float64Array) -> Head:
    """Return the head with everything carried as its vertices `used` are moved."""
    chosen = np.linspace(0, len(used) - 1, CONTROLS).astype(np.int64)
    if head.landmark_vertices is not None:
        marks = np.isin(used, head.landmark_vertices[JAW_LANDMARKS:])
        chosen = np.concatenate([chosen, np.flatnonzero(marks)])
    chosen = np.unique(chosen)
    places = head.vertices[used[chosen]].astype(np.float64)
    spline = ThinPlateSpline(places, moved[chosen] - places, np.zeros(len(chosen)))

    def carry(points: Float32Array) -> Float32Array:
        return (points + spline(points.astype(np.float64))).astype(np.float32)

    return head.carried(carry)


def _align(
    points: Float64Array,
    vertices: Float64Array,
    pairs: tuple[Float64Array, Float64Array],
    start: Similarity,
) -> Similarity:
    """Return the similarity that brings a scan's points nearest to the head's, trimmed.

    `pairs` are landmarks of the scan and of the head, which count as much as all other points.
    """
    sample = points[np.linspace(0, len(points) - 1, min(SAMPLE, len(points))).astype(np.int64)]
    tree, found = cKDTree(vertices), start
    for _ in range(ROUNDS):
        distance, near = tree.query(found.apply(sample))
        kept = distance <= np.quantile(distance, KEPT)
        weights = np.ones(kept.sum() + len(pairs[0]))
        weights[kept.sum() :] = kept.sum() / max(len(pairs[0]), 1)
        found = fit_similarity(
            np.concatenate([sample[kept], pairs[0]]),
            np.concatenate([vertices[near[kept]], pairs[1]]),
            weights,
        )
    return found


def _point_cloud(path: Path) -> Float64Array | None:
    """Return the points (P, 3) of a PLY file without faces, None where it has some."""
    data = read_bytes(path)
    if _FACES.search(data[: data.find(b"end_header")]):
        return None
    vertex = read_elements(data, path).get("vertex", {})
    if not all(axis in vertex for axis in "xyz"):
        raise FormatError(f"{path}: its vertices have no x, y and z")
    with np.errstate(invalid="ignore"):  # signalling NaNs
        points: Float64Array = np.stack([vertex[a].astype(np.float64) for a in "xyz"], axis=1)
    if not np.isfinite(points).all():
        raise FormatError(f"{path}: holds coordinates that are not finite numbers")
    return points
