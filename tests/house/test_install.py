"""A plain `pip install` works wherever Python is started, in the clone too."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
import sysconfig
import venv
from pathlib import Path

import pytest

from hairkit.testing import bristle_groom

SHIPPED = ("hairkit", "plugins", "shaders", "__init__.py", "pyproject.toml", "README.md", "LICENSE")
"""What a wheel is made of."""


@pytest.fixture(scope="module")
def clone(tmp_path_factory: pytest.TempPathFactory, project: Path) -> Path:
    """A copy of the clone that is called `hairkit`."""
    copy = tmp_path_factory.mktemp("above") / "hairkit"
    copy.mkdir()
    unwanted = shutil.ignore_patterns("__pycache__", "shipped_kernels")
    for name in SHIPPED:
        if (project / name).is_dir():
            shutil.copytree(project / name, copy / name, ignore=unwanted)
        else:
            shutil.copy(project / name, copy)
    return copy


@pytest.fixture(scope="module")
def python(clone: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Python of an environment with a plain install of the clone.

    Its dependencies are those of the environment of the tests. That environment's own `.pth` files
    are not read, so its editable install of hairkit is not there.
    """
    folder = tmp_path_factory.mktemp("environment")
    venv.create(folder, symlinks=True)
    names = {"base": str(folder), "platbase": str(folder)}
    site = Path(sysconfig.get_path("purelib", "venv", names))
    options = "--quiet --no-deps --no-build-isolation --disable-pip-version-check --no-index"
    pip = [sys.executable, "-m", "pip", "install", *options.split()]
    subprocess.run([*pip, "--target", str(site), str(clone)], check=True, capture_output=True)
    shared = {sysconfig.get_path("purelib"), sysconfig.get_path("platlib")}
    (site / "dependencies.pth").write_text("\n".join(sorted(shared)))
    return Path(sysconfig.get_path("scripts", "venv", names)) / "python"


@pytest.mark.parametrize("place", [".", "..", "../.."], ids=["inside", "above", "elsewhere"])
def test_the_command_line_draws(clone: Path, python: Path, tmp_path: Path, place: str) -> None:
    """A picture needs shaders and a reader needs plugins: both are found inside the clone, in the
    folder above it, where `hairkit` is the clone, and elsewhere."""
    groom, picture = tmp_path / "groom.npz", tmp_path / "hair.png"
    bristle_groom().save(groom)
    command = ["render", str(groom), "-o", str(picture), "--size", "40x40", "--hairs", "1"]
    environment = {name: value for name, value in os.environ.items() if name != "PYTHONPATH"}
    done = subprocess.run(
        [str(python), "-m", "hairkit", *command],
        cwd=clone / place,
        env=environment,
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stderr
    assert picture.is_file()


def test_the_workflow_tests_every_python(project: Path) -> None:
    """The versions of Python that pyproject.toml names are those that the workflow tests."""
    named = re.findall(r"Python :: (3\.\d+)", (project / "pyproject.toml").read_text())
    workflow = (project / ".github" / "workflows" / "checks.yml").read_text()
    [tested] = re.findall(r"python: \[(.*)\]", workflow)
    assert re.findall(r"\d+\.\d+", tested) == named
