"""Stands for `maya.cmds` and `maya.mel`: knows the commands, flags and attributes of the reference.

A command, flag or attribute that is not in the tables fails, as it does in Maya. The scene is a
list of nodes with their types; attributes and connections are noted.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from types import ModuleType
from typing import Any

FLAGS: dict[str, dict[str, type | tuple[type, ...]]] = {
    "AbcImport": {"mode": str, "fitTimeRange": bool},
    "connectAttr": {"force": bool},
    "deleteUI": {"layout": bool},
    "file": {
        "i": bool, "type": str, "ignoreVersion": bool, "mergeNamespacesOnClash": bool,
        "namespace": str,
    },
    "fileDialog2": {"fileMode": int, "dialogStyle": int, "caption": str},
    "getAttr": {},
    "listAttr": {"multi": bool},
    "listHistory": {},
    "listRelatives": {"allDescendents": bool, "type": str, "fullPath": bool},
    "loadPlugin": {"quiet": bool},
    "ls": {"type": str, "long": bool, "selection": bool},
    "mayaUSDImport": {"file": str, "readAnimData": bool},
    "select": {"replace": bool},
    "setAttr": {"type": str},
    "sets": {
        "renderable": bool, "noSurfaceShader": bool, "empty": bool, "name": str, "edit": bool,
        "forceElement": str,
    },
    "shadingNode": {
        "asShader": bool, "asTexture": bool, "asUtility": bool, "isColorManaged": bool, "name": str,
    },
    "shelfButton": {
        "parent": str, "label": str, "annotation": str, "image1": str, "imageOverlayLabel": str,
        "sourceType": str, "command": str,
    },
    "shelfLayout": {"exists": bool, "parent": str},
}  # fmt: skip
"""Long names of the flags that are used, by command (Maya 2025, Python command reference)."""
KINDS = {
    "standardSurface": "asShader",
    "file": "asTexture",
    "bump2d": "asUtility",
    "place2dTexture": "asUtility",
}
"""Types of nodes, and the flag of `shadingNode` under which the Hypershade lists them."""
ATTRIBUTES: dict[str, set[str]] = {
    "standardSurface": {
        "baseColor", "specularRoughness", "normalCamera", "subsurface", "subsurfaceRadius",
        "subsurfaceColor", "outColor",
    },
    "file": {
        "fileTextureName", "colorSpace", "ignoreColorSpaceFileRules", "alphaIsLuminance",
        "outColor", "outAlpha", "uvCoord", "uvFilterSize",
    },
    "bump2d": {"bumpValue", "bumpInterp", "outNormal"},
    "place2dTexture": {"outUV", "outUvFilterSize"},
    "shadingEngine": {"surfaceShader"},
    "blendShape": {"weight"},
}  # fmt: skip
"""Attributes of nodes (Maya 2025, node reference)."""
SIZES = {
    "outColor": 3, "baseColor": 3, "subsurfaceColor": 3, "surfaceShader": 3, "subsurfaceRadius": 3,
    "normalCamera": 3, "outNormal": 3, "outUV": 2, "uvCoord": 2, "outUvFilterSize": 2,
    "uvFilterSize": 2,
}  # fmt: skip
"""Numbers of an attribute that has several; only equal ones can be connected."""


class MayaStand:
    """`maya.cmds` of a scene, into which files bring what `contents` says."""

    def __init__(self, contents: dict[str, dict[str, str]] | None = None) -> None:
        self.contents = contents or {}
        """Nodes (full path, type) that a file of this name brings."""
        self.nodes: dict[str, str] = {}
        self.values: dict[str, Any] = {}
        self.connections: dict[str, str] = {}
        """Source by target."""
        self.members: dict[str, list[str]] = {}
        self.selected: list[str] = []
        self.plugins: list[str] = []
        self.layouts: set[str] = set()
        self.buttons: list[dict[str, Any]] = []
        self.chosen: list[str] | None = None
        """What the user answers to a file dialogue."""
        self.done: list[str] = []

    def __getattr__(self, name: str) -> Callable[..., Any]:
        if name not in FLAGS:
            raise AttributeError(f"module 'maya.cmds' has no attribute {name!r}")

        def command(*values: Any, **flags: Any) -> Any:
            for flag, value in flags.items():
                if flag not in FLAGS[name]:
                    raise TypeError(f"{name}: Invalid flag '{flag}'")
                if not isinstance(value, FLAGS[name][flag]):
                    raise TypeError(f"{name}: Invalid arguments for flag '{flag}': {value!r}")
            self.done.append(name)
            return getattr(self, f"_{name}")(*values, **flags)

        return command

    def _bring(self, path: str) -> None:
        self.nodes.update(self.contents.get(Path(path).name, {}))

    def _loadPlugin(self, name: str, **flags: Any) -> None:  # noqa: N802 - Maya's names, as below
        self.plugins.append(name)

    def _file(self, path: str, **flags: Any) -> None:
        assert flags["i"]
        needed = {"FBX": "fbxmaya", "mayaAscii": None}[flags["type"]]
        assert needed is None or needed in self.plugins
        self._bring(path)

    def _AbcImport(self, path: str, **flags: Any) -> None:  # noqa: N802
        assert "AbcImport" in self.plugins
        self._bring(path)

    def _mayaUSDImport(self, **flags: Any) -> None:  # noqa: N802
        assert "mayaUsdPlugin" in self.plugins
        self._bring(flags["file"])

    def _ls(
        self, pattern: Any = None, type: str | None = None, selection: bool = False, **flags: Any
    ) -> list[str]:
        names = self.selected if selection else list(self.nodes)
        if isinstance(pattern, str):
            start = pattern.rstrip("*")
            names = [n for n in names if n.rpartition("|")[2].startswith(start)]
        elif pattern is not None:
            names = [n for n in names if n in pattern]
        return [n for n in names if type is None or self.nodes[n] == type]

    def _listRelatives(self, groups: list[str], **flags: Any) -> list[str]:  # noqa: N802
        below = [n for n in self.nodes if any(n.startswith(f"{g}|") for g in groups)]
        return [n for n in below if self.nodes[n] == flags["type"]]

    def _listHistory(self, nodes: list[str]) -> list[str]:  # noqa: N802
        return [n for n in self.nodes if self.nodes[n] == "blendShape"] if nodes else []

    def _listAttr(self, place: str, **flags: Any) -> list[str]:  # noqa: N802
        node, _, attribute = place.partition(".")
        assert attribute in ATTRIBUTES[self.nodes[node]]
        return list(self.values.get(place, []))

    def _select(self, nodes: list[str], **flags: Any) -> None:
        assert all(node in self.nodes for node in nodes)
        self.selected = list(nodes)

    def _shadingNode(self, kind: str, **flags: Any) -> str:  # noqa: N802
        assert flags[KINDS[kind]] is True
        name, number = flags["name"], 1
        while name in self.nodes:
            name, number = f"{flags['name']}{number}", number + 1
        self.nodes[name] = kind
        return str(name)

    def _check(self, place: str) -> str:
        node, _, attribute = place.partition(".")
        assert attribute in ATTRIBUTES[self.nodes[node]], place
        return attribute

    def _setAttr(self, place: str, *values: Any, type: str | None = None) -> None:  # noqa: N802
        self._check(place)
        wanted = {None: (bool, int, float), "string": str, "double3": float}[type]
        assert len(values) == (3 if type == "double3" else 1)
        assert all(isinstance(value, wanted) for value in values), place
        self.values[place] = values[0] if len(values) == 1 else values

    def _getAttr(self, place: str) -> Any:  # noqa: N802
        self._check(place)
        return self.values[place]

    def _connectAttr(self, source: str, target: str, **flags: Any) -> None:  # noqa: N802
        ends = [self._check(place) for place in (source, target)]
        assert SIZES.get(ends[0], 1) == SIZES.get(ends[1], 1), (source, target)
        self.connections[target] = source

    def _sets(self, members: list[str] | None = None, **flags: Any) -> str | None:
        if flags.get("edit"):
            assert self.nodes[flags["forceElement"]] == "shadingEngine"
            self.members.setdefault(flags["forceElement"], []).extend(members or [])
            return None
        assert flags["empty"]
        self.nodes[flags["name"]] = "shadingEngine"
        return str(flags["name"])

    def _shelfLayout(self, name: str, exists: bool = False, **flags: Any) -> Any:  # noqa: N802
        if exists:
            return name in self.layouts
        self.layouts.add(name)
        return name

    def _deleteUI(self, name: str, **flags: Any) -> None:  # noqa: N802
        self.layouts.remove(name)
        self.buttons.clear()

    def _shelfButton(self, **flags: Any) -> None:  # noqa: N802
        assert flags["parent"] in self.layouts
        self.buttons.append(flags)

    def _fileDialog2(self, **flags: Any) -> list[str] | None:  # noqa: N802
        return self.chosen


def maya_modules(stand: MayaStand) -> dict[str, ModuleType]:
    """Return the modules `maya`, `maya.cmds` and `maya.mel` by name."""
    maya, mel = ModuleType("maya"), ModuleType("maya.mel")
    mel.eval = {"$hairkit_top = $gShelfTopLevel": "Shelf"}.__getitem__  # type: ignore[attr-defined]
    maya.cmds, maya.mel = stand, mel  # type: ignore[attr-defined]
    return {"maya": maya, "maya.cmds": stand, "maya.mel": mel}  # type: ignore[dict-item]
