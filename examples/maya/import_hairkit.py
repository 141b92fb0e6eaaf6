"""Import the files that hairkit wrote into Maya: head, curves for XGen, hair, a whole USD groom.

Not run by hairkit's tests in Maya itself: there is no Maya there; a stand-in notes its commands.
Written from Autodesk's command reference (`file`, `AbcImport`, `mayaUSDImport`).

In the Script Editor, a Python tab:

    import sys; sys.path.append("C:/hairkit/examples/maya")
    import import_hairkit
    import_hairkit.import_files("C:/out/head.fbx", "C:/out/guides.ma")

made by

    hairkit export groom.npz -o head.fbx
    hairkit export groom.npz -o guides.ma --set strands=guides
    hairkit export groom.npz -o hair.abc --set axis=y_up_centimetres --set hairs=20000
    hairkit export groom.npz -o groom.usdc --set axis=y_up_centimetres
"""

from __future__ import annotations

from pathlib import Path

from maya import cmds

GUIDES = "guides*"
PLUGINS = {
    ".fbx": "fbxmaya",
    ".abc": "AbcImport",
    ".usd": "mayaUsdPlugin",
    ".usda": "mayaUsdPlugin",
    ".usdc": "mayaUsdPlugin",
}
"""What Maya must load to read a file."""


def import_files(*paths: str) -> list[str]:
    """Import each file by its ending, select the guides, and return their curves."""
    for path in map(Path, paths):
        suffix = path.suffix.lower()
        if suffix in PLUGINS:
            cmds.loadPlugin(PLUGINS[suffix], quiet=True)
        if suffix == ".abc":
            import_alembic(path)
        elif suffix.startswith(".usd"):
            import_usd(path)
        elif suffix in (".ma", ".fbx"):
            import_scene(path, {".ma": "mayaAscii", ".fbx": "FBX"}[suffix])
        else:
            raise ValueError(f"{path}: expected .ma, .fbx, .abc, .usd, .usda or .usdc")
    return select_guides()


def import_scene(path: Path, kind: str) -> None:
    """Import a Maya scene of curves, or the head of an FBX file, which Maya brings to its unit."""
    cmds.file(
        str(path),
        i=True,
        type=kind,
        ignoreVersion=True,
        mergeNamespacesOnClash=True,
        namespace=":",
    )


def import_alembic(path: Path) -> None:
    """Import hair as NURBS curves of degree 1; the file must be in centimetres."""
    cmds.AbcImport(str(path), mode="import", fitTimeRange=True)


def import_usd(path: Path) -> None:
    """Import head, skeleton and curves of a USD stage, with its frames."""
    cmds.mayaUSDImport(file=str(path), readAnimData=True)


def select_guides() -> list[str]:
    """Select the curves below the groups `guides`, as XGen's *Curves to Guides* wants them."""
    groups = cmds.ls(GUIDES, type="transform", long=True) or []
    shapes = (
        cmds.listRelatives(groups, allDescendents=True, type="nurbsCurve", fullPath=True)
        if groups
        else None
    )
    curves = sorted({shape.rpartition("|")[0] for shape in shapes or []})
    if curves:
        cmds.select(curves, replace=True)
    return curves
