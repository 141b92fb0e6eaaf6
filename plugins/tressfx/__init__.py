"""TressFX .tfx: strands of 4 to 64 points for AMD's simulation, with a .tfxbone beside it.

Version 4 (TressFXFileFormat.h): a header of 160 bytes, then a position and inverse mass (4 f32) for
every point, a texture coordinate and a thickness for every strand and a colour (4 f32) for every
point. The first two points of a strand are fixed to the head. The .tfxbone binds each strand to
the joints. Binary files of version 3 and the text files of version 1 and 2 are read.

* `binary`: .tfx of versions 4 and 3
* `text`: .tfx of versions 1 and 2
* `writer`: blocks of a .tfx in order, and .tfxbone files
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from hairkit.arrays import Float32Array
from hairkit.grooming.adopt_strands import ImportOptions, adopt, plain_widths
from hairkit.grooming.curve_sets import CurveSet, strands_of
from hairkit.grooming.prepare_export import ExportOptions, prepare_export
from hairkit.hookspecs import hookimpl
from hairkit.io.byte_reader import ByteReader
from hairkit.io.coordinate_space import SpaceOptions
from hairkit.io.file_format import Feature, FileFormat
from hairkit.options import option
from hairkit.storage import read_bytes, write_bytes, write_pieces
from hairkit.types.groom import Groom

from .binary import TfxHair, read_binary
from .text import is_text, read_text
from .writer import bone_bytes, tfx_pieces

__all__ = ["FORMAT", "Options", "TfxHair", "bone_bytes", "read_binary", "read_text", "tfx_pieces"]

POINTS = (4, 8, 16, 32, 64)
"""Points of every strand that TressFX's threads can share out."""
FORMAT = FileFormat(
    "TressFX",
    (".tfx",),
    exact={Feature.ROOT_UV, Feature.COLOUR},
    partial={
        Feature.POINTS: "resampled to `points_per_strand`, ends kept",
        Feature.WIDTHS: "mean of each strand",
        Feature.COLOURS: "resampled to `points_per_strand`",
    },
    written={Feature.SKIN},
)


@dataclass(frozen=True)
class Options(ExportOptions, ImportOptions, SpaceOptions):
    """Settings of .tfx files."""

    points_per_strand: int = option(
        32, choices=POINTS, doc="Points of every strand; strands of another number are resampled."
    )
    colours: bool = option(True, doc="Write a colour at every point.")
    flip_v: bool = option(True, doc="Texture coordinates run down in the file, as in DirectX.")
    bones: bool = option(True, doc="Write the .tfxbone that binds the strands to the head's joint.")


@hookimpl
def export_groom(groom: Groom, path: Path, options: Options) -> bool:
    """Write the strands, and the .tfxbone beside the file."""
    ready = _resample(prepare_export(groom, options).groom, options.points_per_strand)
    uv = _flip_v(np.asarray(ready.strands.root_uv), options)
    count, coloured = options.points_per_strand, options.colours
    write_pieces(path, tfx_pieces(ready, count, options.space, uv, coloured=coloured))
    if options.bones:
        write_bytes(path.with_suffix(".tfxbone"), bone_bytes(len(ready.strands)))
    return True


@hookimpl
def import_groom(path: Path, options: Options) -> Groom:
    """Read a .tfx of versions 1 to 4; a head is put under it."""
    data = read_bytes(path)
    hair, counts = read_text(data, path) if is_text(data) else read_binary(ByteReader(data, path))
    points = options.space.points_to_head(hair.points.reshape(-1, 3))
    widths, uv, colours = None, None, None
    if hair.thickness is not None:
        widths = np.repeat(plain_widths(hair.thickness, options.space.metres, path), counts)
    if hair.uv is not None:
        uv = _flip_v(hair.uv, options)
    if hair.colours is not None:
        colours = hair.colours.reshape(-1, 3)
    strands, _ = strands_of(CurveSet(points, counts, widths, uv, colours), path)
    return adopt(strands, options, path)


def _resample(groom: Groom, count: int) -> Groom:
    if (groom.strands.counts == count).all():
        return groom
    return replace(groom, strands=groom.strands.resampled(count))


def _flip_v(uv: Float32Array, options: Options) -> Float32Array:
    turned = uv.copy()
    if options.flip_v:
        turned[:, 1] = 1 - turned[:, 1]
    return turned
