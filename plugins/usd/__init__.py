"""USD .usda, .usdc, .usd: curves on a skinned head, still or animated, written and read.

Written is one component: a SkelRoot with the skeleton (root, neck, head), the head mesh, all
strands as one BasisCurves and their materials. The strands carry Unreal's `groom_*` primvars, and
what only hairkit knows (binding, scalp, capsules, curl, physics) is in primvars and custom data
named `hairkit`, so that the file gives the whole groom back. Texture maps of the
head stand beside the file, which names them; its blendshapes are UsdSkel's. Neither is read back.
Animated strands are baked: their points are where they are in the world, and they are not bound to
the skeleton, which would move them twice; the head mesh is skinned to the moving skeleton.
Read are the BasisCurves of any program, cubic ones as the polylines of their control points. The
USD library (usd-core) reads in a process of its own, because damaged crate files crash it; files
that refer to other files are refused.
Source: OpenUSD, UsdGeomBasisCurves and UsdSkel schemas; Epic's groom attributes.

* `body`: skeleton, motion and skinned head
* `body_reading`: the head of a file by hairkit
* `curves`: strands as BasisCurves
* `guarded`: the reading process, guarded against crashes
* `look`: materials
* `options`: settings of USD files
* `reading_child`: the program that reads in a process of its own
* `settings`: groom settings as custom data
* `stage`: metadata and parts of the stage
* `to_groom`: a groom from what was read
"""

from __future__ import annotations

from pathlib import Path

from hairkit.grooming.prepare_export import prepare_export
from hairkit.hookspecs import hookimpl
from hairkit.io.file_format import Feature, FileFormat
from hairkit.types.groom import Groom

from .options import Options

_WRITTEN = frozenset({Feature.GUIDE_WEIGHTS, Feature.DENSITY, Feature.MAPS, Feature.SHAPES})
FORMAT = FileFormat(
    title="USD",
    suffixes=(".usdc", ".usda", ".usd"),
    exact=frozenset(Feature) - _WRITTEN - {Feature.ANIMATION},
    partial={Feature.ANIMATION: "written; the rest pose is read"},
    written=_WRITTEN,
    needs="pxr",
)


@hookimpl
def export_groom(groom: Groom, path: Path, options: Options) -> bool:
    """Write the groom as .usda (text), .usdc or .usd (crate), animated where options say so."""
    from .stage import write_stage

    write_stage(prepare_export(groom, options), path, options)
    return True


@hookimpl
def import_groom(path: Path, options: Options) -> Groom:
    """Read all curves of a USD file, and the head and settings where hairkit wrote them."""
    from .to_groom import read_groom

    return read_groom(path, options)
