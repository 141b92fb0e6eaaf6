"""Maya ASCII .ma: every strand as a NURBS curve of degree 1, which XGen takes as guides.

The scene needs no plugin: transforms `guides` and `hair` (one for each group of the groom, where it
has several) below `groom`, with one curve a strand. Widths, root uv, colour and the
head go by Alembic, USD or FBX. Read are the open NURBS curves of any scene, where transforms put
them, as points on the curves.
Source: Autodesk's description of Maya ASCII files and of `setAttr -type nurbsCurve`.

* `reader`: the curves of a scene
"""

from __future__ import annotations

import itertools
import re
from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path

import numpy as np

from hairkit.arrays import Int64Array
from hairkit.errors import InputError
from hairkit.grooming.adopt_strands import ImportOptions, adopt, pack_strands
from hairkit.grooming.prepare_export import ExportOptions, prepare_export
from hairkit.hookspecs import hookimpl
from hairkit.io.coordinate_space import SPACES, FileSpace, SpaceOptions
from hairkit.io.file_format import Feature, FileFormat
from hairkit.io.number_text import format_rows
from hairkit.options import option
from hairkit.storage import read_text, write_pieces
from hairkit.types.groom import Groom
from hairkit.types.strand_blocks import blocks
from hairkit.types.strands import Strands

FORMAT = FileFormat(
    title="Maya ASCII",
    suffixes=(".ma",),
    exact={Feature.POINTS, Feature.COUNTS, Feature.GUIDE, Feature.GROUP},
)

UNITS = {0.001: "millimeter", 0.01: "centimeter", 1.0: "meter", 0.0254: "inch", 0.3048: "foot"}
"""Maya's names of units, by their metres."""
_TOP = "groom"
_NAME = re.compile(r"(guide|hair)_(\d{1,18})")
_GROUP = re.compile(r"(?:guides|hair)(?:_(minus)?(\d{1,9}))?")
"""Names of hairkit's own scenes."""
_HEADER = """//Maya ASCII 2018 scene
//hairkit: strands as curves of degree 1
requires maya "2018";
currentUnit -l {unit} -a degree -t film;
createNode transform -n "{top}";
"""


@dataclass(frozen=True)
class Options(SpaceOptions, ExportOptions, ImportOptions):
    """Settings of .ma files. Scenes say their unit; reading takes `scale` only to overrule it."""

    axis: str = option(
        "y_up_centimetres",
        choices=tuple(name for name in SPACES if name != "unreal"),
        doc="Axes and unit of the scene; Z up is for a Maya whose up axis is set to Z.",
    )


@hookimpl
def export_groom(groom: Groom, path: Path, options: Options) -> bool:
    """Write the strands as a Maya scene of curves."""
    space = options.space
    unit = _unit(space)
    strands = prepare_export(groom, options).groom.strands
    header = _HEADER.format(unit=unit, top=_TOP)
    write_pieces(path, itertools.chain([header.encode("ascii")], _scene(strands, space)))
    return True


@hookimpl
def import_groom(path: Path, options: Options) -> Groom:
    """Read all NURBS curves as strands; a head is put under them."""
    from .reader import read_curves

    curves = read_curves(read_text(path), path)
    space = options.space if options.scale else replace(options.space, metres=curves.metres)
    points = space.points_to_head(curves.points)
    strands, _ = pack_strands(points, curves.counts, path)
    return adopt(_as_named(strands, curves.names), options, path)


def _as_named(strands: Strands, names: list[tuple[str, str]]) -> Strands:
    """Return strands in the order, groups and kinds that the names of hairkit's scenes tell.

    Strands of other scenes stay as they are.
    """
    found = [(_NAME.fullmatch(name), _GROUP.fullmatch(group)) for name, group in names]
    numbers = [int(name[2]) for name, _ in found if name]
    if not all(name and group for name, group in found) or len({*numbers}) < len(names):
        return strands
    groups = [-int(g[2]) if g[1] else int(g[2] or 0) for _, g in found if g]
    guide = np.array([name[1] == "guide" for name, _ in found if name])
    named = replace(strands, group=np.array(groups), guide=guide)
    return named.select(np.argsort(numbers))


def _unit(space: FileSpace) -> str:
    """Return Maya's name of the file's unit."""
    for metres, name in UNITS.items():
        if abs(space.metres - metres) < 1e-6 * metres:
            return name
    raise InputError(
        f"a unit of {space.metres:g} m has no name in Maya; scale must be one of"
        f" {', '.join(f'{metres:g} ({name})' for metres, name in UNITS.items())}"
    )


def _scene(strands: Strands, space: FileSpace) -> Iterator[bytes]:
    """Yield the groups, each with its curves."""
    assert strands.guide is not None
    assert strands.group is not None
    for kind, top, chosen in (("guide", "guides", strands.guide), ("hair", "hair", ~strands.guide)):
        groups = np.unique(strands.group[chosen])
        for group in groups.tolist():
            # letters, digits and underscores, as Maya's names are
            number = f"_{group}" if group >= 0 else f"_minus{-group}"
            name = top if groups.tolist() == [0] else top + number
            yield f'createNode transform -n "{name}" -p "|{_TOP}";\n'.encode("ascii")
            index = np.flatnonzero(chosen & (strands.group == group))
            yield from _curves(strands, space, index, name.encode(), kind.encode())


def _curves(
    strands: Strands, space: FileSpace, index: Int64Array, group: bytes, kind: bytes
) -> Iterator[bytes]:
    """Yield the text of the curves; strand numbers are in the names, all with as many digits."""
    digits = len(str(len(strands) - 1))
    for block in blocks(strands):
        chosen = index[(index >= block.strands.start) & (index < block.strands.stop)]
        if not len(chosen):
            continue
        part = strands.select(chosen)
        points, ends = space.points_to_file(part.points), part.offsets.tolist()
        pieces = []
        for strand, start, stop in zip(chosen.tolist(), ends, ends[1:], strict=False):
            name = b"%s_%0*d" % (kind, digits, strand)
            pieces.append(_template(stop - start) % (name, group, name, group, name))
            pieces += (format_rows(b"\t\t%.9g %.9g %.9g\n", points[start:stop]), b"\t\t;\n")
        yield b"".join(pieces)


@cache
def _template(count: int) -> bytes:
    """Return how a curve of `count` points begins, with places for names.

    Degree, spans, form (0 open), rational, dimensions; as many knots as points, 0, 1, 2 ...
    """
    text = (
        f'createNode transform -n "%s" -p "|{_TOP}|%s";\n'
        f'createNode nurbsCurve -n "%sShape" -p "|{_TOP}|%s|%s";\n'
        '\tsetAttr -k off ".v";\n'
        '\tsetAttr ".cc" -type "nurbsCurve"\n'
        f"\t\t1 {count - 1} 0 no 3\n"
        f"\t\t{count} {' '.join(map(str, range(count)))}\n"
        f"\t\t{count}\n"
    )
    return text.encode("ascii")
