"""glTF 2.0 .glb: guides as lines, hair as ribbons or cards, head, skeleton and animation.

Khronos glTF 2.0, written so that the Khronos validator has nothing to say. glTF has no curves:
strands stand in the file twice, as one LINES primitive with custom attributes, which is read back,
and as triangles for viewers, which is not.

* `baking`: a point cache as morph targets
* `extras`: `extras.hairkit`
* `meshes`: head, lines and strips as meshes
* `options`: settings of .glb files
* `reader`: strands from the lines of a file
* `ribbons`: hair as ribbons or cards
* `scene`: the document of a groom
* `strips`: ribbons and cards at several levels of detail
* `texture`: strand and relief pictures for strips
"""

from __future__ import annotations

from pathlib import Path

from hairkit.grooming.prepare_export import prepare_export
from hairkit.hookspecs import hookimpl
from hairkit.io.file_format import Feature, FileFormat
from hairkit.types.groom import Groom

from .options import Options

FORMAT = FileFormat(
    "glTF",
    (".glb", ".gltf"),
    exact=frozenset(Feature)
    - {Feature.GUIDE_WEIGHTS, Feature.DENSITY, Feature.MAPS, Feature.ANIMATION},
    partial={Feature.MAPS: "without the bump map"},
    written={Feature.ANIMATION},
)


@hookimpl
def export_groom(groom: Groom, path: Path, options: Options) -> bool:
    """Write the groom as .glb."""
    from .scene import groom_document

    groom_document(prepare_export(groom, options), options).write(path)
    return True


@hookimpl
def import_groom(path: Path, options: Options) -> Groom:
    """Read the lines of a .glb or .gltf file as strands; files of hairkit give all back."""
    from .reader import read_gltf_groom

    return read_gltf_groom(path, options)
