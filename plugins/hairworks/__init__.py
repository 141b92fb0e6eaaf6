"""HairWorks .apx: guides, growth mesh, skeleton, collision shapes and materials, written and read.

NVIDIA HairWorks 1.1, the text form that FurViewer, the Unity plugin and the Unreal branch load.
HairWorks grows render hair between guides over a growth mesh with exactly one vertex a guide, so
the mesh is made from the roots. Lost on the way: the head's own mesh (the growth mesh is the head
of a groom read back), groups, widths along the strand, and points beyond `points_per_strand`.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from hairkit.errors import FormatError, InputError
from hairkit.groom import Groom
from hairkit.hookspecs import hookimpl
from hairkit.options import option
from hairkit.stored import write_text

from .asset import ApxAsset
from .from_groom import groom_to_asset
from .reader import read_apx
from .to_groom import asset_to_groom
from .writer import asset_text

__all__ = ["ApxAsset", "Options", "asset_text", "asset_to_groom", "groom_to_asset", "read_apx"]

SUFFIXES = (".apx",)


@dataclass(frozen=True)
class Options:
    """Settings of the .apx exporter."""

    points_per_strand: int = option(
        16, low=2, high=64, doc="Points of every guide; HairWorks wants one number for all."
    )
    unit: str = option("cm", choices=("cm", "m"), doc="Unit of length in the file.")
    axis: str = option("y_up", choices=("y_up", "z_up"), doc="Axis that points up in the file.")
    hairs: int = option(
        100_000, low=100, high=5_000_000, doc="Hairs that HairWorks is to draw in all."
    )
    author: str = option("", doc="Author's name in the file.")
    last_modified: str = option(
        "2000-01-01 00:00:00 UTC",
        doc="Date in the file; fixed, so that equal grooms are equal files.",
    )


@hookimpl
def export_groom(groom: Groom, path: Path, options: Options) -> bool:
    """Write the groom's guides as .apx."""
    write_text(path, asset_text(groom_to_asset(groom, options)))
    return True


@hookimpl
def import_groom(path: Path) -> Groom:
    """Read an .apx file; the growth mesh becomes the head."""
    asset = read_apx(path)
    try:
        return asset_to_groom(asset)
    except InputError as error:
        raise FormatError(f"{path}: {error}") from error
