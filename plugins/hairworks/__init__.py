"""HairWorks .apx: guides, growth mesh, skeleton, collision shapes and materials, written and read.

NVIDIA HairWorks 1.1, the text form that FurViewer, the Unity plugin and the Unreal branch load.
HairWorks grows render hair between guides over a growth mesh with exactly one vertex a guide, so
the mesh is made from the roots. Lost on the way: the head's own mesh (the growth mesh is the head
of a groom read back), groups, widths along the strand, and points beyond `points_per_strand`.

* `asset`: the content of an .apx file
* `from_groom`: groom to asset
* `reader`: strict reader of .apx files
* `schema`: classes, fields and defaults of HairWorks 1.1
* `to_groom`: asset to groom
* `writer`: writer of .apx files
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from types import MappingProxyType

from hairkit.errors import FormatError, InputError
from hairkit.grooming.adopt_strands import ImportOptions, adopt
from hairkit.grooming.prepare_export import ExportOptions, prepare_export
from hairkit.hookspecs import hookimpl
from hairkit.io.file_format import Feature, FileFormat
from hairkit.options import option
from hairkit.storage import write_text
from hairkit.types.groom import Groom

from .asset import ApxAsset
from .from_groom import groom_to_asset
from .reader import read_apx
from .to_groom import asset_to_groom
from .writer import asset_text

__all__ = [
    "FORMAT",
    "ApxAsset",
    "Options",
    "asset_text",
    "asset_to_groom",
    "groom_to_asset",
    "read_apx",
]

FORMAT = FileFormat(
    "HairWorks",
    (".apx",),
    exact=frozenset(
        {Feature.ROOT_UV, Feature.SKIN, Feature.CAPSULES, Feature.COLOUR, Feature.PHYSICS}
    ),
    partial=MappingProxyType(
        {
            Feature.POINTS: "guides only, resampled to `points_per_strand`",
            Feature.HEAD: "growth mesh of the roots",
            Feature.CURL: "as waves, where points are too far apart to show it",
        }
    ),
)


@dataclass(frozen=True)
class Options:
    """Settings of .apx files."""

    strands: str = option(
        "guides", choices=("guides", "all"), doc="Strands of the groom that become guides."
    )

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
    head: Path | None = option(
        None, doc="Head to bind the guides to when a file is read; else its own growth mesh."
    )


@hookimpl
def export_groom(groom: Groom, path: Path, options: Options) -> bool:
    """Write the groom's guides as .apx."""
    chosen = prepare_export(groom, ExportOptions(strands=options.strands)).groom
    write_text(path, asset_text(groom_to_asset(chosen, options)))
    return True


@hookimpl
def import_groom(path: Path, options: Options) -> Groom:
    """Read an .apx file; the growth mesh becomes the head, if no other is named."""
    asset = read_apx(path)
    try:
        groom = asset_to_groom(asset)
    except InputError as error:
        raise FormatError(f"{path}: {error}") from error
    groom.check_reach(path)
    if options.head is None:
        return groom
    bound = adopt(groom.strands, ImportOptions(options.head), path, groom.material)
    return replace(bound, physics=groom.physics)
