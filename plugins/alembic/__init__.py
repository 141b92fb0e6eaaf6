"""Alembic .abc (Ogawa): curves with Unreal's groom schema 1.5, still or animated, written and read.

All strands are one curves object, in the groom's order, and say strand by strand whether they are
guides: Blender then makes one hair object, Unity merges nothing, and Unreal reads `groom_guide` of
every curve. There is no mesh in the file, because Unreal refuses grooms with one; the head goes
into an FBX file.
Written and read through the Alembic library (alembic3d), whose arrays share NumPy's memory; read in
a process of its own, because the library ends the process at some damaged files.
Sources: Alembic 1.8 AbcGeom and Ogawa; Epic's "Alembic for Grooms Specification", version 1.5.

* `contents`: the objects of a file
* `curve_sets`: curves objects of a file: world points, widths, attributes
* `curves`: a groom's curves in the file's space, within Unreal's limits
* `options`: settings
* `reading_child`: the program that reads files
* `to_groom`: a groom from curves of a file
* `validation`: rules of Unreal's groom schema
* `writer`: writing through the Alembic library
"""

from __future__ import annotations

from pathlib import Path

from hairkit.grooming.prepare_export import prepare_export
from hairkit.hookspecs import hookimpl
from hairkit.io.file_format import Feature, FileFormat
from hairkit.types.finding import Finding
from hairkit.types.groom import Groom

from .options import Options

__all__ = ["FORMAT", "Options", "export_groom", "import_groom"]

FORMAT = FileFormat(
    title="Alembic",
    suffixes=(".abc",),
    exact={
        Feature.POINTS,
        Feature.COUNTS,
        Feature.WIDTHS,
        Feature.ROOT_UV,
        Feature.GROUP,
        Feature.GUIDE,
        Feature.COLOUR,
        Feature.COLOURS,
    },
    partial={Feature.ANIMATION: "written; the first frame is read"},
    written={Feature.GUIDE_WEIGHTS, Feature.DENSITY},
)


@hookimpl
def export_groom(groom: Groom, path: Path, options: Options) -> bool:
    """Write the groom as .abc, animated where options name a cache."""
    from .curves import groom_curves
    from .writer import write_curves

    write_curves(groom_curves(prepare_export(groom, options), options), path)
    return True


@hookimpl
def import_groom(path: Path, options: Options) -> Groom:
    """Read the curves of an .abc file, of any program, at the first frame."""
    from .to_groom import read_groom

    return read_groom(path, options)


@hookimpl
def validate_groom(path: Path, target: str) -> list[Finding] | None:
    """Check Unreal's groom schema in an .abc."""
    from .validation import TARGETS, check_schema

    if target not in TARGETS or path.suffix.lower() not in FORMAT.suffixes:
        return None
    return check_schema(path)
