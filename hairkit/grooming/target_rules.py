"""What engines and programs demand of a hair file, as rules that are checked on it.

Sources: Epic's "Alembic for Grooms Specification" 1.5; Unity's `com.unity.demoteam.hair`; NVIDIA's
HairWorks documentation; AMD's `TressFXFileFormat.h`; Khronos' glTF 2.0 and WebGL 2; OpenUSD's
`UsdGeomBasisCurves`. The pages on the engines in the documentation name what each reads.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from hairkit.arrays import Float64Array
from hairkit.grooming.guide_weights import guide_mask
from hairkit.head_model.bvh import build_tree, nearest_on_surface
from hairkit.head_model.placement import find_place
from hairkit.head_model.template import default_head
from hairkit.io.glb_file import GlbFile, readable
from hairkit.types.finding import Finding, Level
from hairkit.types.groom import Groom

_SPREAD = (0.015, 0.6)
"""Metres over which roots of a head of hair spread, least and most, as importers take it."""
_ANIMAL = 3.0
"""Metres: up to here the roots may be an animal's; beyond, the unit is wrong."""
_SHORTEST = 1e-4
"""Metres: shorter strands have no direction in single precision about a body."""
_WIDTHS = (1e-5, 1e-3)
"""Metres: hair is 0.02 to 0.2 mm thick (Robbins, Chemical and Physical Behavior of Human Hair)."""
_ON_MESH = 1e-3
"""Metres from the head within which a root is on it."""
_FITS_BETTER = (0.5, 0.005)
"""Share, and metres, by which other axes must fit the roots better to be the likely ones."""
_UNREAL_POINTS, _UNREAL_CURVES, _UNREAL_GROUP_POINTS = 255, 4_194_303, 16_777_215
"""Most points of a curve, curves of a group and points of a group that Unreal reads."""
_UNITY_STRANDS, _UNITY_POINTS = (64, 64_000), (3, 128)
"""Strands of a group and points of a strand, least and most, of Unity's hair."""
_TRIANGLES = 4
"""glTF's number of the mode."""
_HAIRWORKS_POINTS = 64
_TRESSFX_POINTS = (4, 8, 16, 32, 64)
_WEB_TARGETS, _WEB_BYTES = 256, 50 * 2**20
"""Layers of a texture array that WebGL 2 promises, and bytes that a page loads in seconds."""


@dataclass(frozen=True)
class Target:
    """A program, the files that it reads, and how to read them as it does."""

    suffixes: tuple[str, ...]
    rules: tuple[Callable[[Groom, Path], Iterator[Finding]], ...]
    reading: tuple[tuple[str, str], ...] = ()
    """Options with which an .abc is read, which does not state its axes and unit."""


def check_groom(groom: Groom, path: Path, target: str) -> list[Finding]:
    """Return what the rules of a target find in a groom that was read from a file."""
    known = TARGETS[target]
    right = path.suffix.lower() in known.suffixes
    said = f"{path.suffix}; {target} reads {', '.join(known.suffixes)}"
    found = [Finding.of("format", right, said)]
    for rule in (*_EVERYWHERE, *(known.rules if right else ())):
        found.extend(rule(groom, path))
    return found


def _unit(groom: Groom, path: Path) -> Iterator[Finding]:
    roots = groom.strands.roots
    spread = float(np.ptp(roots, axis=0).max())
    if len(roots) > 1:
        said = f"roots spread over {spread:.3g} m, those of a head {_SPREAD[0]} to {_SPREAD[1]}"
        level: Level = "warning" if spread <= _ANIMAL and spread >= _SPREAD[0] else "failed"
        holds = _SPREAD[0] <= spread <= _SPREAD[1]
        yield Finding.of("unit", holds, said, otherwise=level)


def _axes(groom: Groom, path: Path) -> Iterator[Finding]:
    """Compare the fit of a head under the roots with that for other axes."""
    size = float(np.ptp(groom.strands.roots, axis=0).max())
    if not _SPREAD[0] <= size <= _SPREAD[1]:
        return
    turns = {"as it is": np.eye(3), "Z up instead of Y": _ROLLED, "Y up instead of Z": _ROLLED.T}
    off = {name: _misfit(groom, turn) for name, turn in turns.items()}
    best = min(off, key=lambda name: off[name])
    own = off["as it is"]
    wrong = off[best] < min(_FITS_BETTER[0] * own, own - _FITS_BETTER[1])
    said = f"a head fits under the roots {1000 * own:.1f} mm off"
    if wrong:
        said += f", with {best} {1000 * off[best]:.1f} mm"
    yield Finding.of("axes", not wrong, said)


_ROLLED = np.array([[1.0, 0, 0], [0, 0, 1], [0, -1, 0]])
"""Takes Z up to Y up."""


def _misfit(groom: Groom, turn: Float64Array) -> float:
    strands = groom.strands
    turned = replace(strands, points=(strands.points @ turn.T).astype(np.float32))
    return find_place(default_head(), turned).distance


def _lengths(groom: Groom, path: Path) -> Iterator[Finding]:
    short = int(np.count_nonzero(groom.strands.lengths() < _SHORTEST))
    said = f"{short} of {len(groom.strands)} strands are shorter than {1000 * _SHORTEST:g} mm"
    yield Finding.of("lengths", short == 0, said, otherwise="warning")


def _widths(groom: Groom, path: Path) -> Iterator[Finding]:
    widths = groom.strands.widths
    if widths is None and groom.carried is not None:  # an .apx has one width, in its material
        widths = np.full(1, groom.material.width, np.float32)
    if widths is None:
        yield Finding("widths", "warning", "the file gives no widths")
        return
    middle = float(np.median(widths))
    fine = _WIDTHS[0] <= middle <= _WIDTHS[1]
    said = f"hair is {1000 * middle:.3g} mm wide in the middle, expected 0.01 to 1: check the unit"
    yield Finding.of("widths", fine, said, otherwise="warning")


def _root_uv(groom: Groom, path: Path) -> Iterator[Finding]:
    uv = groom.strands.root_uv
    inside = uv is not None and bool(((uv >= 0) & (uv <= 1)).all())
    said = f"root uv {'lie in 0 to 1' if inside else 'are missing or lie outside 0 to 1'}"
    yield Finding.of("root-uv", inside, said, otherwise="warning")


def _roots_on_mesh(groom: Groom, path: Path) -> Iterator[Finding]:
    tree = build_tree(groom.head.vertices, groom.head.faces)
    worst = float(nearest_on_surface(tree, groom.strands.roots)[2].max())
    said = f"roots lie up to {1000 * worst:.2g} mm off the mesh, expected {1000 * _ON_MESH:g}"
    yield Finding.of("roots-on-mesh", worst <= _ON_MESH, said, otherwise="warning")


_EVERYWHERE = (_unit, _axes, _lengths, _widths, _root_uv)


def _unreal(groom: Groom, path: Path) -> Iterator[Finding]:
    strands = groom.strands
    most = int(strands.counts.max())
    said = f"strands have up to {most} points, Unreal reads {_UNREAL_POINTS}"
    yield Finding.of("points-per-strand", most <= _UNREAL_POINTS, said)
    group = np.zeros(len(strands), np.int32) if strands.group is None else strands.group
    numbers, place = np.unique(group, return_inverse=True)
    curves, points = np.bincount(place), np.bincount(place, strands.counts)
    said = f"{len(numbers)} groups of up to {curves.max()} curves and {int(points.max())} points"
    fits = curves.max() <= _UNREAL_CURVES and points.max() <= _UNREAL_GROUP_POINTS
    yield Finding.of("group-size", bool(fits), said)
    dense = np.array_equal(numbers, np.arange(len(numbers)))
    said = f"groom_group_id {numbers.min()} to {numbers.max()}, expected 0, 1, 2 ..."
    yield Finding.of("group-ids", dense, said, otherwise="warning")
    marked = strands.guide is not None and bool(guide_mask(strands).all())
    said = "every strand is marked as a guide: Unreal draws none" if marked else "hair is drawn"
    yield Finding.of("guides", not marked, said)


def _unity(groom: Groom, path: Path) -> Iterator[Finding]:
    strands = groom.strands
    few, many = _UNITY_STRANDS
    said = f"{len(strands)} strands, Unity takes {few} to {many}; it draws no others than these"
    yield Finding.of("strands", few <= len(strands) <= many, said)
    least, most = int(strands.counts.min()), int(strands.counts.max())
    said = f"strands of {least} to {most} points; Unity resamples to {_UNITY_POINTS[0]} to"
    fits = _UNITY_POINTS[0] <= least and most <= _UNITY_POINTS[1]
    yield Finding.of("points-per-strand", fits, f"{said} {_UNITY_POINTS[1]}", otherwise="warning")
    if strands.widths is not None:
        bare = int(np.count_nonzero(strands.widths[strands.offsets[:-1]] <= 0))
        said = f"{bare} strands are 0 wide at the root; one makes Unity discard all widths"
        yield Finding.of("root-widths", bare == 0, said)


def _hairworks(groom: Groom, path: Path) -> Iterator[Finding]:
    counts = groom.strands.counts
    said = f"guides of {counts.min()} to {counts.max()} points, expected one number for all"
    yield Finding.of("equal-points", bool((counts == counts[0]).all()), said)
    said = f"guides have up to {counts.max()} points, HairWorks takes {_HAIRWORKS_POINTS}"
    yield Finding.of("points-per-strand", bool(counts.max() <= _HAIRWORKS_POINTS), said)
    yield from _roots_on_mesh(groom, path)


def _tressfx(groom: Groom, path: Path) -> Iterator[Finding]:
    found = sorted({int(count) for count in np.unique(groom.strands.counts)})
    said = f"strands of {', '.join(map(str, found[:4]))} points, expected one of 4, 8, 16, 32, 64"
    yield Finding.of("points-per-strand", len(found) == 1 and found[0] in _TRESSFX_POINTS, said)
    bones = path.with_suffix(".tfxbone")
    beside = bones.is_file()
    said = f"{bones.name} {'lies' if beside else 'does not lie'} beside the file, to bind the hair"
    yield Finding.of("bones", beside, said, otherwise="warning")


def _web(groom: Groom, path: Path) -> Iterator[Finding]:
    size = path.stat().st_size
    said = f"{size / 1e6:.1f} MB, pages load up to {_WEB_BYTES / 2**20:.0f} MB in seconds"
    yield Finding.of("size", size <= _WEB_BYTES, said, otherwise="warning")
    with readable(path, "glTF groom"):
        file = GlbFile(path)
        yield from _web_meshes(file)
        yield from _web_weights(file)
    yield from _roots_on_mesh(groom, path)


def _web_meshes(file: GlbFile) -> Iterator[Finding]:
    document = file.document
    primitives = [part for mesh in document["meshes"] for part in mesh["primitives"]]
    solid = any(
        part.get("mode", _TRIANGLES) == _TRIANGLES and "COLOR_0" in part["attributes"]
        for part in primitives
    )
    said = "hair has triangles" if solid else "hair is lines only, one pixel wide in every viewer"
    yield Finding.of("triangles", solid, said, otherwise="warning")
    skinned = [
        str(node.get("name", "unnamed"))[:40]
        for node in document.get("nodes", [])
        if "skin" in node and _has_lines(document["meshes"][node["mesh"]])
    ]
    said = f"lines with a skin: {', '.join(skinned) or 'none'}; three.js does not skin lines"
    yield Finding.of("skinned-lines", not skinned, said)


def _has_lines(mesh: dict[str, Any]) -> bool:
    return any(part.get("mode", _TRIANGLES) < _TRIANGLES for part in mesh["primitives"])


def _web_weights(file: GlbFile) -> Iterator[Finding]:
    document = file.document
    targets = max(
        (len(p.get("targets", ())) for mesh in document["meshes"] for p in mesh["primitives"]),
        default=0,
    )
    said = f"{targets} morph targets, WebGL 2 promises {_WEB_TARGETS}"
    yield Finding.of("morph-targets", targets <= _WEB_TARGETS, said)
    lowest, highest = 0.0, 1.0
    for animation in document.get("animations", []):
        for channel in animation["channels"]:
            if channel["target"]["path"] == "weights":
                values = file.numbers(animation["samplers"][channel["sampler"]]["output"])
                lowest, highest = min(lowest, values.min()), max(highest, values.max())
    said = f"weights of morph targets from {lowest:.3g} to {highest:.3g}; programs clamp to 0 to 1"
    yield Finding.of("morph-weights", lowest >= -1e-6 and highest <= 1 + 1e-6, said)


def _usd(groom: Groom, path: Path) -> Iterator[Finding]:
    yield from _roots_on_mesh(groom, path)


_ALEMBIC, _USD = (".abc",), (".usdc", ".usda", ".usd")
TARGETS = {
    "unreal": Target((*_ALEMBIC, *_USD), (_unreal,), (("axis", "unreal"),)),
    "metahuman": Target(_ALEMBIC, (_unreal,), (("axis", "unreal"),)),
    "unity": Target(_ALEMBIC, (_unity,)),
    "hairworks": Target((".apx",), (_hairworks,)),
    "tressfx": Target((".tfx",), (_tressfx,)),
    "web": Target((".glb", ".gltf"), (_web,)),
    "usd": Target(_USD, (_usd,)),
    "blender": Target((*_ALEMBIC, *_USD, ".glb", ".ply", ".obj"), ()),
    "maya": Target((*_ALEMBIC, *_USD, ".ma"), (), (("axis", "y_up_centimetres"),)),
    "houdini": Target((*_ALEMBIC, *_USD), ()),
}
"""Targets of `hairkit validate --for`."""
