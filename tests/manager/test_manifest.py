"""Laws of plugins on a shared drive: described without running them, loaded when first used."""

from __future__ import annotations

import json
import sys
from pathlib import Path

import pytest

from hairkit.cli import main
from hairkit.errors import PluginError
from hairkit.hookspecs import HOOKSPEC_VERSION
from hairkit.manager import Manager
from hairkit.manager.manifest import PLUGIN_PATH
from hairkit.stages import OF_HOOK
from hairkit.testing import stage_arguments

OWN = ".".join(map(str, HOOKSPEC_VERSION))
MANIFEST = f"""
name = "upright"
version = "2.1"
summary = "All strands stand."
hookspec = "{OWN}"
hooks = ["orient"]
module = "code.py"
[options.angle]
default = 1.5
low = 0.0
high = 3.0
unit = "rad"
doc = "Angle of all strands."
"""
CODE = '''"""All strands stand."""
from dataclasses import dataclass
from pathlib import Path
import numpy as np
from hairkit import OrientationMap, hookimpl
from hairkit.options import option

Path(__file__).with_name("loaded").touch()

@dataclass(frozen=True)
class Options:
    angle: float = option(1.5, low=0.0, high=3.0, unit="rad", doc="Angle of all strands.")

@hookimpl
def orient(mask, options):
    angle = np.full(mask.labels.shape, options.angle, np.float32)
    return OrientationMap(angle, mask.hair.astype(np.float32))
'''


@pytest.fixture
def drive(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A shared folder with one plugin; the folder of the plugin is returned."""
    folder = tmp_path / "drive" / "upright"
    folder.mkdir(parents=True)
    (folder / "hairkit.toml").write_text(MANIFEST)
    (folder / "code.py").write_text(CODE)
    monkeypatch.setenv(PLUGIN_PATH, str(tmp_path / "drive"))
    monkeypatch.delenv("HAIRKIT_DISABLE_PLUGIN_AUTOLOAD", raising=False)
    return folder


def test_it_is_listed_without_being_loaded(drive: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Name, version, stages and options come from the manifest; no code of the plugin runs."""
    assert main(["plugins", "upright", "--json"]) == 0
    (entry,) = json.loads(capsys.readouterr().out)
    assert (entry["version"], entry["stages"]) == ("2.1", ["orient"])
    assert entry["options"][0]["wanted"] == "a number from 0.0 to 3.0 (rad)"
    assert main(["plugins", "orient"]) == 0
    assert "All strands stand." in capsys.readouterr().out
    assert not (drive / "loaded").exists()


def test_it_is_loaded_when_it_is_used(drive: Path) -> None:
    """The first call imports it, and it works with its options."""
    manager = Manager.loaded()
    assert not (drive / "loaded").exists()
    found = manager.call("orient", "upright", {"angle": 1.0}, **stage_arguments("orient"))
    assert (found.angle == 1.0).all()
    assert (drive / "loaded").exists()
    assert manager.info("upright").version == "2.1"


def test_a_command_may_be_described_too(drive: Path) -> None:
    """A manifest with a command starts it when it is used, in the manifest's folder."""
    (drive / "hairkit.toml").write_text(
        MANIFEST.replace('module = "code.py"', f'command = ["{sys.executable}", "worker.py"]')
    )
    (drive / "worker.py").write_text(
        "import numpy as np\nfrom pathlib import Path\nfrom hairkit.worker import option, serve\n"
        "Path('loaded').touch()\n"
        "def orient(mask, options):\n    angle = np.full(mask.labels.shape, options.angle, 'f4')\n"
        "    return {'angle': angle, 'confidence': (mask.labels == 255).astype('f4')}\n"
        "serve(orient, options={'angle': option(1.5, doc='Angle.')})\n"
    )
    manager = Manager.loaded()
    assert manager.info("upright").stages == ("orient",)
    assert not (drive / "loaded").exists()
    found = manager.call("orient", "upright", {"angle": 1.0}, **stage_arguments("orient"))
    assert (found.angle == 1.0).all()
    manager._pluggy.get_plugin("upright").close()


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ('name = "upright"', 'nmae = "upright"', "did you mean 'name'"),
        ('name = "upright"', "", "has no name"),
        ('hooks = ["orient"]', 'hooks = ["oreint"]', "did you mean 'orient'"),
        ('hooks = ["orient"]', "hooks = 3", "no hook '3'"),
        (f'"{OWN}"', '"0.9"', "update the plugin"),
        (f'"{OWN}"', '"2.0"', "update hairkit"),
        (f'"{OWN}"', '"1.99"', "needs hooks of version 1.99"),
        (f'"{OWN}"', '"new"', "its hookspec is 'new'"),
        ('module = "code.py"', "", "has a module or a command, expected one"),
        ('module = "code.py"', 'module = "gone.py"', "gone.py, which is not there"),
        ('module = "code.py"', 'command = "python"', "expected a list of words"),
        ("default = 1.5", "default = [1]", "of kind list"),
        ("default = 1.5", "", "default"),
        ('name = "upright"', 'name = "upright', "hairkit.toml"),
    ],
)
def test_a_wrong_manifest_is_listed_as_broken(
    drive: Path, old: str, new: str, said: str, capsys: pytest.CaptureFixture[str]
) -> None:
    """What is wrong stands in the list; everything else works, and no code runs."""
    assert old in MANIFEST
    (drive / "hairkit.toml").write_text(MANIFEST.replace(old, new))
    assert main(["plugins", "upright"]) == 2
    assert said in capsys.readouterr().out
    assert not (drive / "loaded").exists()
    assert Manager.loaded().info("gabor").broken is None


@pytest.mark.parametrize(
    ("code", "said"),
    [
        ("raise RuntimeError('no licence')", "RuntimeError: no licence"),
        (CODE.replace("def orient(mask", "def segment(view"), "its code has no orient"),
        ("HOOKSPEC = (2, 0)\n" + CODE, "it is for hooks of version 2.0"),
        ("HOOKSPEC = 'x'\n" + CODE, "its hookspec is 'x'"),
    ],
)
def test_code_that_is_not_as_described_is_one_line(drive: Path, code: str, said: str) -> None:
    """A plugin that lies or fails is broken from then on, with its manifest named."""
    (drive / "code.py").write_text(code)
    manager = Manager.loaded()
    for _ in range(2):
        with pytest.raises(PluginError, match=r"hairkit\.toml 2\.1 is broken: .*" + said):
            manager.call("orient", "upright", **stage_arguments("orient"))


def test_older_plugins_go_on_working(drive: Path) -> None:
    """A plugin for an older minor version of the hooks is taken."""
    (drive / "hairkit.toml").write_text(MANIFEST.replace(f'"{OWN}"', '"1.0"'))
    (drive / "code.py").write_text("HOOKSPEC = (1, 0)\n" + CODE)
    assert Manager.loaded().implementer("orient", "upright").broken is None


def test_names_are_taken_once(drive: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A shared plugin cannot replace an installed one; a missing folder is named."""
    (drive / "hairkit.toml").write_text(MANIFEST.replace('"upright"', '"gabor"'))
    monkeypatch.setenv(PLUGIN_PATH, f"{drive.parent}:/no/such/folder")
    infos = Manager.loaded().plugins()
    broken = {info.name: info.broken for info in infos if info.broken}
    assert "already loaded from hairkit" in broken["gabor"]
    assert "which is no folder" in broken["/no/such/folder"]
    monkeypatch.setenv("HAIRKIT_DISABLE_PLUGIN_AUTOLOAD", "1")
    assert not any(info.broken for info in Manager.loaded().plugins())


def test_check_finds_what_is_wrong(drive: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """`--check` passes a good plugin, and fails one that is random, unexplained or wrong."""
    assert main(["plugins", "upright", "--check"]) == 0
    rows = capsys.readouterr().out.splitlines()
    assert [row.split()[1] for row in rows] == ["loads", "summary", "options", "orient", "orient"]
    for old, new, name in (
        ('"""All strands stand."""', "", "summary"),
        ('doc="Angle of all strands."', 'doc=""', "options"),
        ("options.angle,", "np.random.default_rng().random(),", "orient twice"),
        ("mask.hair.astype(np.float32)", "mask.hair.astype(np.float32)[:9]", "orient"),
        ("import numpy as np", "import nmupy as np", "loads"),
    ):
        assert old in CODE
        (drive / "code.py").write_text(CODE.replace(old, new))
        assert main(["plugins", "upright", "--check", "--json"]) == 2
        failed = [c["name"] for c in json.loads(capsys.readouterr().out) if not c["passed"]]
        assert failed == [name]
    assert main(["plugins", "--check"]) == 2


@pytest.mark.parametrize("name", ["gabor", "mask_files", "native"])
def test_shipped_plugins_pass(name: str, capsys: pytest.CaptureFixture[str]) -> None:
    """Plugins of a stage, of one that has no answer, and of files keep the contract."""
    assert main(["plugins", name, "--check"]) == 0, capsys.readouterr().out
    assert set(OF_HOOK)
