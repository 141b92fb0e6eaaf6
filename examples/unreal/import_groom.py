"""Import a groom that hairkit wrote into Unreal, and bind it to its head.

Not run by hairkit's tests: there is no Unreal there. It follows Epic's Python API of 5.1 to 5.7.

In the editor (plugins Alembic Groom Importer, Groom, Python Editor Script Plugin enabled):

    py import_groom.py C:/out/hair.abc /Game/Hair
    py import_groom.py C:/out/hair.abc /Game/Hair C:/out/head.fbx
    py import_groom.py C:/out/sway.abc /Game/Hair --cache /Game/Hair/hair

made by `hairkit export groom.npz -o hair.abc --set axis=unreal --set hairs=50000`.
"""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

import unreal

INTERPOLATION_POINTS = 100


def import_groom(path: Path, folder: str) -> Any:
    """Return the groom asset of an .abc in Unreal's axes: no rotation, one unit is one cm."""
    options = unreal.GroomImportOptions()
    options.set_editor_property("conversion_settings", _as_it_is())
    return _imported(path, folder, options, unreal.GroomAsset)


def import_cache(path: Path, folder: str, groom: Any) -> Any:
    """Return the groom cache of an animated .abc that belongs to a groom asset."""
    settings = unreal.GroomCacheImportSettings()
    settings.set_editor_property("import_groom_cache", True)
    settings.set_editor_property("import_groom_asset", False)
    settings.set_editor_property("groom_asset", unreal.SoftObjectPath(groom.get_path_name()))
    settings.set_editor_property("override_conversion_settings", True)
    settings.set_editor_property("conversion_settings", _as_it_is())
    options = unreal.GroomCacheImportOptions()
    options.set_editor_property("import_settings", settings)
    return _imported(path, folder, options, unreal.GroomCache)


def import_head(path: Path, folder: str) -> Any:
    """Return the skeletal mesh of the head's .fbx."""
    options = unreal.FbxImportUI()
    options.set_editor_property("import_mesh", True)
    options.set_editor_property("import_as_skeletal", True)
    options.set_editor_property("import_animations", False)
    options.set_editor_property("mesh_type_to_import", unreal.FBXImportType.FBXIT_SKELETAL_MESH)
    return _imported(path, folder, options, unreal.SkeletalMesh, unreal.FbxFactory())


def bind(groom: Any, head: Any, folder: str) -> Any:
    """Return the binding asset that ties the groom's roots to the head's skin."""
    package = f"{folder}/{groom.get_name()}_binding"
    return unreal.GroomLibrary.create_new_groom_binding_asset_with_path(
        package, groom, head, INTERPOLATION_POINTS
    )


def _as_it_is() -> Any:
    still = unreal.GroomConversionSettings()
    still.set_editor_property("rotation", unreal.Vector(0.0, 0.0, 0.0))
    still.set_editor_property("scale", unreal.Vector(1.0, 1.0, 1.0))
    return still


def _imported(path: Path, folder: str, options: Any, kind: Any, factory: Any = None) -> Any:
    """Return the first asset of a kind that importing a file makes."""
    task = unreal.AssetImportTask()
    task.set_editor_property("filename", str(path))
    task.set_editor_property("destination_path", folder)
    task.set_editor_property("automated", True)
    task.set_editor_property("replace_existing", True)
    task.set_editor_property("save", True)
    task.set_editor_property("options", options)
    # without a factory of its own a groom would be taken for a mesh in an Alembic file
    task.set_editor_property("factory", factory or unreal.HairStrandsFactory())
    unreal.AssetToolsHelpers.get_asset_tools().import_asset_tasks([task])
    assets = map(unreal.load_asset, task.get_editor_property("imported_object_paths"))
    made = next((asset for asset in assets if isinstance(asset, kind)), None)
    if made is None:
        raise RuntimeError(f"{path}: Unreal made no {kind.__name__} of it; see the Output Log")
    return made


def main() -> None:
    """Import what the command line names."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("groom", type=Path, help=".abc in Unreal's axes")
    parser.add_argument("folder", help="content folder: /Game/Hair")
    parser.add_argument("head", type=Path, nargs="?", help=".fbx of the head")
    parser.add_argument("--cache", metavar="ASSET", help="import as cache of this groom asset")
    given = parser.parse_args()
    if given.cache:
        import_cache(given.groom, given.folder, unreal.load_asset(given.cache))
        return
    groom = import_groom(given.groom, given.folder)
    if given.head:
        bind(groom, import_head(given.head, given.folder), given.folder)


if __name__ == "__main__":
    main()
