"""hairkit's own groom file, `.npz`: lossless, and readable by anything that has NumPy."""

from __future__ import annotations

from pathlib import Path

from hairkit.grooming.prepare_export import ExportOptions, prepare_export
from hairkit.hookspecs import hookimpl
from hairkit.io.file_format import Feature, FileFormat
from hairkit.types.groom import Groom

FORMAT = FileFormat(
    "hairkit",
    (".npz",),
    exact=frozenset(Feature) - {Feature.GUIDE_WEIGHTS, Feature.ANIMATION},
    partial={Feature.GUIDE_WEIGHTS: "made again from the guides"},
)

Options = ExportOptions


@hookimpl
def export_groom(groom: Groom, path: Path, options: ExportOptions) -> bool:
    """Write everything that is on the groom, or the strands that the options choose."""
    whole = options == ExportOptions()
    (groom if whole else prepare_export(groom, options).groom).save(path)
    return True


@hookimpl
def import_groom(path: Path) -> Groom:
    """Read the groom exactly as it was written."""
    return Groom.load(path)
