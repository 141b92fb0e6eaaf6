"""FBX 7.4 binary .fbx: the head with its skeleton and skin, and strands as curves if asked for.

For engines that take hair from elsewhere and the head from FBX: the mesh with normals and uv,
the root, neck and head joints as limb nodes, smooth skin weights, a bind pose, and the scalp as the
vertex colour, texture maps inside the file, blendshapes. With `curves` every strand is a NURBS
curve of degree 1. Only written, never read.
Coordinates are Y up and centimetres unless `axis` says otherwise. `axis=unreal` is the same file:
Unreal turns it on import into the space that the Alembic groom of `axis=unreal` has, where the face
looks along +Y.
Source: the layout of Blender's documentation of FBX binary files (Campbell Barton, 2013).

* `body`: head mesh, skeleton, skin and bind pose
* `builder`: objects and their connections
* `look`: material, texture maps and blendshapes
* `records`: binary records of FBX 7.4
* `scene`: the document: header, objects, connections
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from hairkit.grooming.prepare_export import ExportOptions, prepare_export
from hairkit.head_model.bust import bust_under
from hairkit.hookspecs import hookimpl
from hairkit.io.coordinate_space import SPACES, FileSpace, SpaceOptions
from hairkit.io.file_format import Feature, FileFormat
from hairkit.options import option
from hairkit.storage import write_pieces
from hairkit.types.groom import Groom

FORMAT = FileFormat(
    title="FBX",
    suffixes=(".fbx",),
    written={
        Feature.HEAD,
        Feature.MAPS,
        Feature.SHAPES,
        Feature.SKIN,
        Feature.POINTS,
        Feature.COUNTS,
    },
)


@dataclass(frozen=True)
class Options(SpaceOptions, ExportOptions):
    """Settings of the FBX exporter; those of strands count only with `curves`."""

    axis: str = option(
        "y_up_centimetres",
        choices=tuple(SPACES),
        doc="Axes and unit of the file; unreal is y_up_centimetres, which Unreal itself turns.",
    )
    curves: bool = option(False, doc="Write the strands too, each as a NURBS curve.")

    bust: bool = option(
        False, doc="Write a clothed bust under a head that ends at the neck, without bones."
    )

    @property
    def written_space(self) -> FileSpace:
        """The axes and unit of the file, which is never left-handed."""
        space = self.space
        return FileSpace("y_up", space.metres) if space.mirrored else space


@hookimpl
def export_groom(groom: Groom, path: Path, options: Options) -> bool:
    """Write the groom's head, and its strands where asked for."""
    from .scene import scene_pieces

    strands = prepare_export(groom, options).groom.strands if options.curves else None
    bust = bust_under(groom.head, groom.strands) if options.bust else None
    write_pieces(path, scene_pieces(groom.head, strands, options.written_space, bust))
    return True
