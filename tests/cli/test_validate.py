"""Laws of `hairkit validate`: what hairkit writes passes, and each fault is told by its rule."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from hairkit import hookimpl
from hairkit.cli import main
from hairkit.cli.validate import BROKEN
from hairkit.errors import PluginError
from hairkit.grooming.engine_files import ENGINES
from hairkit.grooming.target_rules import TARGETS, check_groom
from hairkit.head_model.scalp import sample_roots
from hairkit.head_model.template import default_head
from hairkit.manager import Manager
from hairkit.testing import bristle_groom
from hairkit.types.finding import Finding
from hairkit.types.groom import Groom
from hairkit.types.strands import Strands

WRITTEN = {
    "unreal": ("hair.abc", ["--set", "axis=unreal"]),
    "metahuman": ("hair.abc", ["--set", "axis=unreal"]),
    "unity": ("hair.abc", []),
    "hairworks": ("hair.apx", []),
    "tressfx": ("hair.tfx", []),
    "web": ("hair.glb", ["--set", "strips=20"]),
    "usd": ("hair.usda", []),
    "blender": ("hair.abc", []),
    "maya": ("hair.abc", ["--set", "axis=y_up_centimetres"]),
    "houdini": ("hair.abc", []),
}
"""The file of each target, and how it is exported."""


def short_hair() -> Groom:
    """Return 120 strands of 3 cm on the default head, of eight points."""
    head = default_head()
    roots = sample_roots(head, 120)
    along = np.linspace(0, 0.03, 8)[None, :, None] * roots.normals[:, None]
    points = (roots.positions[:, None] + along).reshape(-1, 3)
    strands = Strands(points, np.arange(121) * 8, root_uv=roots.uv)
    return Groom(strands, head, roots.triangle, roots.barycentric)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a folder with groom.npz."""
    folder = tmp_path_factory.mktemp("validate")
    short_hair().save(folder / "groom.npz")
    return folder


def answers(words: list[str], capsys: pytest.CaptureFixture[str]) -> tuple[int, dict[str, str]]:
    """Return the exit code and the level of every rule."""
    capsys.readouterr()
    code = main(["validate", *words, "--json"])
    return code, {each["rule"]: each["level"] for each in json.loads(capsys.readouterr().out)}


@pytest.mark.parametrize("target", TARGETS)
def test_what_hairkit_writes_for_a_target_passes(
    target: str, folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """No rule fails, and no warning is given."""
    name, options = WRITTEN[target]
    path = folder / target / name
    path.parent.mkdir()
    assert main(["export", str(folder / "groom.npz"), "-o", str(path), *options]) == 0
    code, found = answers([str(path), "--for", target], capsys)
    assert (code, set(found.values())) == (0, {"passed"}), found


@pytest.mark.parametrize("engine", ENGINES)
def test_an_export_for_an_engine_passes_its_rules(
    engine: str, folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Its files lie in the folder, the hair passes every rule, and nothing else has to be said."""
    out = folder / f"for-{engine}"
    assert main(["export", str(folder / "groom.npz"), "--for", engine, "-o", f"{out}/"]) == 0
    files = capsys.readouterr().out.split()
    assert files == [str(out / file.name) for file in ENGINES[engine]]
    assert sorted(files) == sorted(map(str, out.iterdir()))
    code, found = answers([files[0], "--for", engine], capsys)
    assert (code, set(found.values())) == (0, {"passed"}), found


def test_one_line_a_rule(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Without --json each rule is a line that begins with its level."""
    assert main(["convert", str(folder / "groom.npz"), str(folder / "a.data")]) == 0
    capsys.readouterr()
    assert main(["validate", str(folder / "a.data"), "--for", "tressfx"]) == BROKEN
    lines = capsys.readouterr().out.splitlines()
    assert all(line.split()[0] in ("passed", "warning", "failed") for line in lines)
    assert any(line.split()[:2] == ["failed", "format"] for line in lines)


def test_another_unit_fails(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """An .abc in metres is refused for Unreal, which takes centimetres, and the way out is told."""
    path = folder / "metres.abc"
    assert main(["export", str(folder / "groom.npz"), "-o", str(path)]) == 0
    assert main(["validate", str(path), "--for", "unreal"]) == BROKEN
    assert "--set axis=unreal" in capsys.readouterr().out


def _with(groom: Groom, **changes: object) -> Groom:
    return replace(groom, strands=replace(groom.strands, **changes))


def _lying(groom: Groom) -> Groom:
    points = groom.strands.points
    return _with(groom, points=np.stack([points[:, 0], -points[:, 2], points[:, 1]], axis=1))


FAULTS: dict[str, tuple[str, str, Callable[[Groom], Groom]]] = {
    "axes": ("unreal", "hair.abc", _lying),
    "unit": ("usd", "hair.usda", lambda g: _with(g, points=100 * g.strands.points)),
    "widths": ("unity", "hair.abc", lambda g: _with(g, widths=np.full(960, 0.05))),
    "root-widths": ("unity", "hair.abc", lambda g: _with(g, widths=np.zeros(960))),
    "root-uv": ("unreal", "hair.abc", lambda g: _with(g, root_uv=g.strands.root_uv + 1)),
    "guides": ("unreal", "hair.abc", lambda g: _with(g, guide=np.ones(120, bool))),
    "group-ids": ("unreal", "hair.abc", lambda g: _with(g, group=np.arange(120) % 2 * 5)),
    "lengths": ("usd", "a.usda", lambda g: _with(g, points=np.repeat(g.strands.roots, 8, axis=0))),
    "strands": ("unity", "hair.abc", lambda g: bristle_groom()),
    "bones": ("tressfx", "hair.tfx", lambda g: g),
    "equal-points": (
        "hairworks",
        "hair.apx",
        lambda g: replace(
            g, strands=Strands(g.strands.points, np.append(np.arange(120) * 8, 960) + _SHIFTED)
        ),
    ),
    "roots-on-mesh": ("hairworks", "hair.apx", lambda g: _with(g, points=g.strands.points + 0.01)),
}
"""What breaks each rule: target, file and change."""
_SHIFTED = np.where(np.arange(121) == 60, 2, 0)


@pytest.mark.parametrize("rule", FAULTS)
def test_each_fault_is_told_by_its_rule(rule: str, tmp_path: Path) -> None:
    """The rule passes for good hair where it can, and does not for the fault."""
    target, name, change = FAULTS[rule]
    groom = change(short_hair())
    if rule == "strands":
        groom = replace(groom, strands=groom.strands.select(range(10)),
                        root_triangle=groom.root_triangle[:10],
                        root_barycentric=groom.root_barycentric[:10])  # fmt: skip
    found = {each.rule: each.level for each in check_groom(groom, tmp_path / name, target)}
    assert found[rule] in ("warning", "failed"), found


class _House:
    """A studio's rule."""

    @hookimpl
    def validate_groom(self, groom: Groom, target: str) -> list[Finding]:
        fits = len(groom.strands) <= 100
        return [Finding.of("house", fits, f"{len(groom.strands)} strands for {target}")]


class _Wrong:
    @hookimpl
    def validate_groom(self) -> list[str]:
        return ["all is well"]


def test_plugins_add_rules(tmp_path: Path) -> None:
    """Findings of every plugin are told; what is no finding is an error that names the plugin."""
    manager = Manager()
    manager.register(_House(), "house")
    [finding] = manager.findings(short_hair(), tmp_path / "a.abc", "unreal")
    assert (finding.rule, finding.level) == ("house", "failed")
    manager.register(_Wrong(), "wrong")
    with pytest.raises(PluginError, match="wrong"):
        manager.findings(short_hair(), tmp_path / "a.abc", "unreal")
