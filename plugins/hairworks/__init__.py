"""HairWorks .apx: guides, growth mesh, skeleton, collision shapes and materials, written and read.

NVIDIA HairWorks 1.1, the text form that FurViewer, the Unity plugin and the Unreal branch load.
HairWorks grows render hair between guides over a growth mesh with exactly one vertex a guide, so
the mesh is made from the roots. Lost on the way: the head's own mesh (the growth mesh is the head
of a groom read back), groups, widths along the strand, and points beyond `points_per_strand`.

* `asset`: the content of an .apx file
* `from_groom`: groom to asset
* `kept`: values of the file that a groom was read from
* `maps`: density and colours over the scalp
* `reader`: strict reader of .apx files
* `schema`: classes, fields and defaults of HairWorks 1.1
* `space`: unit, axes and handedness
* `to_groom`: asset to groom
* `writer`: writer of .apx files
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from hairkit.errors import FormatError, InputError
from hairkit.grooming.adopt_strands import ImportOptions, adopt
from hairkit.grooming.prepare_export import ExportOptions, prepare_export
from hairkit.hookspecs import hookimpl
from hairkit.io.file_format import Feature, FileFormat
from hairkit.options import option
from hairkit.storage import read_bytes, write_bytes, write_text
from hairkit.types.carried import Carried
from hairkit.types.groom import Groom

from .asset import ApxAsset
from .from_groom import Layout, groom_to_asset
from .kept import FORMAT as CARRIED
from .kept import asset_carried_by, with_kept_values
from .maps import scalp_maps, widths
from .reader import MAX_BYTES, read_apx
from .schema import TEXTURES
from .space import CENTIMETRES, RIGHT_HANDED, UP_AXIS
from .to_groom import asset_to_groom
from .writer import asset_text

__all__ = [
    "FORMAT",
    "ApxAsset",
    "Options",
    "asset_text",
    "asset_to_groom",
    "exported_asset",
    "read_apx",
]

FORMAT = FileFormat(
    "HairWorks",
    (".apx",),
    exact={Feature.ROOT_UV, Feature.SKIN, Feature.CAPSULES, Feature.COLOUR, Feature.PHYSICS},
    partial={
        Feature.POINTS: "guides only, resampled to `points_per_strand`",
        Feature.HEAD: "growth mesh of the roots",
        Feature.CURL: "as waves, where points are too far apart to show it",
    },
    written={Feature.DENSITY, Feature.COLOURS},  # with `maps`
)


_POINTS, _HAIRS = 16, 100_000
"""Points of a guide and hairs in all, of grooms that were not read from an .apx; files in use have
5 to 10 points."""


@dataclass(frozen=True)
class Options:
    """Settings of .apx files."""

    strands: str = option(
        "guides", choices=("guides", "all"), doc="Strands of the groom that become guides."
    )

    points_per_strand: int = option(
        0,
        low=0,
        high=64,
        doc="Points of every guide, 2 or more; HairWorks wants one number for all. 0: those of the"
        " .apx that the groom was read from, else 16.",
    )
    unit: str = option(
        "kept",
        choices=("kept", "cm", "m"),
        doc="Unit of length in the file; kept: that of the .apx that was read, else cm.",
    )
    axis: str = option(
        "kept",
        choices=("kept", "y_up", "z_up"),
        doc="Axis that points up in the file; kept: that of the .apx that was read, else y_up.",
    )
    hairs: int = option(
        0,
        low=0,
        high=5_000_000,
        doc="Hairs that HairWorks is to draw in all; 0: by the density of the .apx that was read,"
        " else 100,000.",
    )
    maps: bool = option(
        False,
        doc="Write maps of density, width, root and tip colour beside the file, where they vary.",
    )
    author: str = option("", doc="Author's name in the file.")
    head: Path | None = option(
        None, doc="Head to bind the guides to when a file is read; else its own growth mesh."
    )


@hookimpl
def export_groom(groom: Groom, path: Path, options: Options) -> bool:
    """Write the groom's guides as .apx, and maps beside it where options say so."""
    chosen = _chosen(groom, options)
    maps = scalp_maps(chosen) if options.maps else {}
    if "widthTexture" in maps:  # it makes strands thinner than the widest
        widest = float(widths(chosen).max())
        groom = replace(groom, material=replace(groom.material, width=widest))
    asset = exported_asset(groom, options)
    files = {name: f"{path.stem}_{name.removesuffix('Texture')}.tga" for name in maps}
    names = zip(TEXTURES, asset.textures, strict=True)
    text = asset_text(replace(asset, textures=tuple(files.get(name, kept) for name, kept in names)))
    for name, file in files.items():
        write_bytes(path.with_name(file), maps[name])
    write_text(path, text)
    return True


def exported_asset(groom: Groom, options: Options) -> ApxAsset:
    """Return what is written of a groom; one that was read from an .apx keeps what it can."""
    chosen = _chosen(groom, options)
    kept = asset_carried_by(groom)
    layout = _layout(options, kept)
    asset = groom_to_asset(chosen, layout)
    return asset if kept is None else with_kept_values(asset, chosen, kept, layout)


def _chosen(groom: Groom, options: Options) -> Groom:
    return prepare_export(groom, ExportOptions(strands=options.strands)).groom


def _layout(options: Options, kept: ApxAsset | None) -> Layout:
    if options.points_per_strand == 1:
        raise InputError("points_per_strand is 1, expected 0 or at least 2")
    unit, axis = options.unit, options.axis
    return Layout(
        points=options.points_per_strand or (kept.points_per_guide if kept else _POINTS),
        centimetres=kept.scene_unit if kept and unit == "kept" else CENTIMETRES.get(unit, 1.0),
        up_axis=kept.up_axis if kept and axis == "kept" else UP_AXIS.get(axis, UP_AXIS["y_up"]),
        handedness=kept.handedness if kept else RIGHT_HANDED,
        hairs=options.hairs or (0 if kept else _HAIRS),
        author=options.author or (kept.info[3] if kept else ""),
    )


@hookimpl
def import_groom(path: Path, options: Options) -> Groom:
    """Read an .apx file; the growth mesh becomes the head, if no other is named."""
    asset = read_apx(path)
    content = np.frombuffer(read_bytes(path, MAX_BYTES), np.uint8)
    try:
        groom = replace(asset_to_groom(asset), carried=Carried(CARRIED, content))
    except InputError as error:
        raise FormatError(f"{path}: {error}") from error
    groom.check_reach(path)
    if options.head is None:
        return groom
    bound = adopt(groom.strands, ImportOptions(options.head), path, groom.material)
    return replace(bound, physics=groom.physics, carried=groom.carried)
