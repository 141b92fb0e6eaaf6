"""A shelf for Maya: a whole groom in one go, and `hairkit texture` on the selected map.

Not run by hairkit's tests in Maya itself: there is no Maya there; a stand-in checks every command's
name, flags and attributes against Autodesk's reference.

In the Script Editor, a Python tab:

    import sys; sys.path.append("C:/hairkit/examples/maya")
    import hairkit_shelf
    hairkit_shelf.make_shelf()

The folder to import is made by

    hairkit export out/groom.npz -o out/head.fbx
    hairkit export out/groom.npz -o out/guides.ma --set strands=guides
    hairkit head photos/ -o out/head.obj

of which the last writes the maps beside the head: head.albedo.png, head.normal.png and so on.
`COMMAND` starts hairkit outside of Maya, whose Python does not have it.
"""

from __future__ import annotations

import subprocess
from pathlib import Path

import import_hairkit
from maya import cmds, mel

SHELF = "hairkit"
COMMAND = ["hairkit"]
"""How hairkit is started; a list such as `["C:/hairkit/.venv/Scripts/hairkit.exe"]`."""
HEAD, HAIR = ("head.fbx", "groom.fbx"), ("guides.ma", "groom.ma", "hair.abc", "groom.abc")
"""Files that a folder may have, the first that is there counts."""
MAPS = {
    "albedo": ("outColor", "baseColor"),
    "roughness": ("outAlpha", "specularRoughness"),
    "normal": ("outAlpha", "normalCamera"),
    "bump": ("outAlpha", "normalCamera"),
}
"""Maps, what their file nodes give, and where it goes in a standardSurface."""
TANGENT_SPACE_NORMALS = 1
"""Value of `bumpInterp` of a bump2d node whose map holds normals."""
SUBSURFACE, RADIUS = 0.4, (0.367, 0.137, 0.068)
"""Weight of subsurface scattering, and its radius by channel in centimetres: the diffuse mean free
path of the sample skin1 of Jensen et al. 2001."""
WORKS = ("sharpen", "bump", "normal")
"""Works of `hairkit texture` with a button of their own."""


def make_shelf() -> None:
    """Make the shelf anew, with a button for the import and one for each work on a texture."""
    if cmds.shelfLayout(SHELF, exists=True):
        cmds.deleteUI(SHELF, layout=True)
    top = mel.eval("$hairkit_top = $gShelfTopLevel")
    cmds.shelfLayout(SHELF, parent=top)
    _button("import", "Import head, maps, shapes and hair of a folder", "import_groom()")
    for work in WORKS:
        _button(work, f"hairkit texture {work} on the selected map", f"work_on_texture('{work}')")


def _button(label: str, annotation: str, call: str) -> None:
    cmds.shelfButton(
        parent=SHELF, label=label, annotation=annotation, image1="commandButton.png",
        imageOverlayLabel=label[:5], sourceType="python",
        command=f"import hairkit_shelf; hairkit_shelf.{call}",
    )  # fmt: skip


def import_groom(folder: str | None = None) -> list[str]:
    """Import head, maps, blendshapes and hair of a folder; return the curves of the guides.

    The user is asked for the folder where none is given.
    """
    if folder is None:
        chosen = cmds.fileDialog2(fileMode=3, dialogStyle=2, caption="Folder of a hairkit groom")
        if not chosen:
            return []
        folder = chosen[0]
    head, hair = _first(folder, HEAD), _first(folder, HAIR)
    before = set(cmds.ls(type="mesh", long=True) or [])
    import_hairkit.import_files(str(head))
    meshes = sorted(set(cmds.ls(type="mesh", long=True) or []) - before)
    maps = find_maps(head)
    if maps:
        assign_skin(make_skin(maps), meshes)
    shapes = list_shapes(meshes)
    curves = import_hairkit.import_files(str(hair))
    print(f"hairkit: {len(maps)} maps, {len(shapes)} blendshapes, {len(curves)} guides")
    return curves


def _first(folder: str, names: tuple[str, ...]) -> Path:
    for name in names:
        if (Path(folder) / name).is_file():
            return Path(folder) / name
    raise FileNotFoundError(f"{folder}: expected one of {', '.join(names)}")


def find_maps(head: Path) -> dict[str, Path]:
    """Return the pictures beside a head, by kind: head.albedo.png."""
    found = {
        kind: path
        for kind in MAPS
        for path in sorted(head.parent.glob(f"{head.stem}.{kind}.*"))
        if path.suffix.lower() in (".png", ".jpg")
    }
    if "normal" in found:
        found.pop("bump", None)  # a surface takes one of them
    return found


def make_skin(maps: dict[str, Path]) -> str:
    """Return a standardSurface that wears the maps, with the scattering of skin."""
    skin = cmds.shadingNode("standardSurface", asShader=True, name="hairkit_skin")
    cmds.setAttr(f"{skin}.subsurface", SUBSURFACE)
    cmds.setAttr(f"{skin}.subsurfaceRadius", *RADIUS, type="double3")
    for kind, path in maps.items():
        texture = make_file(path, f"hairkit_{kind}", colour=kind == "albedo")
        source, target = MAPS[kind]
        if target == "normalCamera":
            bump = cmds.shadingNode("bump2d", asUtility=True, name=f"hairkit_{kind}_bump")
            cmds.setAttr(f"{bump}.bumpInterp", TANGENT_SPACE_NORMALS if kind == "normal" else 0)
            cmds.connectAttr(f"{texture}.{source}", f"{bump}.bumpValue", force=True)
            texture, source = bump, "outNormal"
        cmds.connectAttr(f"{texture}.{source}", f"{skin}.{target}", force=True)
        if kind == "albedo":
            cmds.connectAttr(f"{texture}.outColor", f"{skin}.subsurfaceColor", force=True)
    return skin


def make_file(path: Path, name: str, *, colour: bool) -> str:
    """Return a file node of a picture, with its place; maps that are no colours are not managed."""
    node = cmds.shadingNode("file", asTexture=True, isColorManaged=True, name=name)
    place = cmds.shadingNode("place2dTexture", asUtility=True, name=f"{name}_place")
    cmds.connectAttr(f"{place}.outUV", f"{node}.uvCoord", force=True)
    cmds.connectAttr(f"{place}.outUvFilterSize", f"{node}.uvFilterSize", force=True)
    cmds.setAttr(f"{node}.fileTextureName", path.as_posix(), type="string")
    cmds.setAttr(f"{node}.colorSpace", "sRGB" if colour else "Raw", type="string")
    cmds.setAttr(f"{node}.ignoreColorSpaceFileRules", True)
    cmds.setAttr(f"{node}.alphaIsLuminance", not colour)
    return node


def assign_skin(skin: str, meshes: list[str]) -> None:
    """Give meshes a shader."""
    group = cmds.sets(renderable=True, noSurfaceShader=True, empty=True, name=f"{skin}SG")
    cmds.connectAttr(f"{skin}.outColor", f"{group}.surfaceShader", force=True)
    if meshes:
        cmds.sets(meshes, edit=True, forceElement=group)


def list_shapes(meshes: list[str]) -> list[str]:
    """Return the names of the blendshapes of meshes."""
    history = cmds.listHistory(meshes) if meshes else []
    blends = cmds.ls(history, type="blendShape") if history else []
    return [name for blend in blends for name in cmds.listAttr(f"{blend}.weight", multi=True) or []]


def work_on_texture(work: str, example: str | None = None) -> list[str]:
    """Run `hairkit texture` on the selected file nodes; return the pictures that were written.

    `sharpen` puts its result in the place of the map; other works make a new file node, which is
    selected. The user is asked for the close-up that `sharpen` follows.
    """
    nodes = cmds.ls(selection=True, type="file") or []
    if not nodes:
        raise RuntimeError("select the file node of a map first")
    if work == "sharpen" and example is None:
        chosen = cmds.fileDialog2(fileMode=1, dialogStyle=2, caption="Close-up of sharp skin")
        if not chosen:
            return []
        example = chosen[0]
    written, made = [], []
    for node in nodes:
        path = Path(cmds.getAttr(f"{node}.fileTextureName"))
        out = path.with_name(f"{path.stem}_{work}.png")
        run_texture(work, path, out, example)
        written.append(str(out))
        if work == "sharpen":
            cmds.setAttr(f"{node}.fileTextureName", out.as_posix(), type="string")
        else:
            made.append(make_file(out, f"hairkit_{work}", colour=False))
    cmds.select(made or nodes, replace=True)
    return written


def run_texture(work: str, path: Path, out: Path, example: str | None) -> None:
    """Run hairkit outside of Maya; its one line of an error becomes the error here."""
    words = [*COMMAND, "texture", work, str(path), "-o", str(out)]
    words += ["--example", example] if example else []
    done = subprocess.run(words, capture_output=True, text=True)
    if done.returncode:
        raise RuntimeError(done.stderr.strip().rpartition("\n")[2])
