"""Laws of the house: floors, packaging, sizes, light start."""

from __future__ import annotations

import ast
import graphlib
import re
import subprocess
import sys
import tomllib
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import pytest

PROJECT = Path(__file__).parents[2]
SOURCES = sorted((PROJECT / "hairkit").rglob("*.py"))
PACKAGES = sorted(path.parent for path in (PROJECT / "hairkit").rglob("__init__.py"))
PACKAGES += sorted(path.parent for path in (PROJECT / "plugins").glob("*/__init__.py"))
PACKAGES += sorted(path.parent for path in (PROJECT / "training").rglob("__init__.py"))
TRAINING = sorted((PROJECT / "training").rglob("*.py"))
FOLDERS = ("hairkit", "plugins", "training", "benchmarks", "studies", "tests", "examples")
ALL = sorted(path for folder in FOLDERS for path in (PROJECT / folder).rglob("*.py"))
PLUGINS = sorted(set((PROJECT / "plugins").rglob("*.py")) - {PROJECT / "plugins" / "__init__.py"})

FLOORS = (
    (
        "version",
        "errors",
        "system",
        "arrays",
        "colour",
        "options",
        "storage",
        "progress",
        "remote",
        "parallel",
        "kernel_cache",
        "memory",
        "html_page",
        "compilation",
        "child_process",
        "worker",
    ),
    ("types",),
    ("cameras", "imaging", "helices", "head_model", "rendering"),
    ("field", "io", "nets"),
    ("simulation", "grooming", "synth", "hookspecs", "stages"),
    ("manager", "testing"),
    ("pipeline", "evaluation"),
    ("viewer", "studio", "study", "batches", "api"),
    ("cli", "__main__"),
)
"""Rooms of hairkit, lowest floor first. A room may use its own floor and those below."""

LONGEST_BODY = 40
"""Lines of a function without its docstring and its parameters."""

FLOOR_OF = {room: floor for floor, rooms in enumerate(FLOORS) for room in rooms}


def module_name(path: Path) -> str:
    """Return the module in a file: `hairkit_plugins.rods` for plugins/rods/__init__.py."""
    top, *inner = path.relative_to(PROJECT).with_suffix("").parts
    name = ".".join([{"plugins": "hairkit_plugins"}.get(top, top), *inner])
    return name.removesuffix(".__init__")


def imported(path: Path, source: str | None = None) -> list[str]:
    """Return the full names of everything a file imports, inside functions too.

    Names of the front door stand for the modules that define them, and the bare front door for the
    highest of these. `source` is looked at in the place of the file's own.
    """
    module = module_name(path).split(".")
    package = module if path.name == "__init__.py" else module[:-1]
    names = []
    for node in ast.walk(ast.parse(path.read_text() if source is None else source)):
        if isinstance(node, ast.Import):
            names += [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            around = package[: len(package) + 1 - node.level] if node.level else []
            base = ".".join([*around, *([node.module] if node.module else [])])
            names += [f"{base}.{alias.name}" for alias in node.names]
    return [_behind_the_front_door(name) for name in names]


def _behind_the_front_door(name: str) -> str:
    """Return `hairkit.types.mask.Mask` for `hairkit.Mask`, and `hairkit.api` for `hairkit`."""
    import hairkit

    first, _, rest = name.partition(".")
    if first != "hairkit" or rest in FLOOR_OF:
        return name
    return (
        f"{hairkit._HOME_OF[rest]}.{rest}"
        if rest in hairkit._HOME_OF
        else name
        if rest
        else "hairkit.api"
    )


def pyproject() -> dict[str, Any]:
    """Return the project's pyproject.toml."""
    return tomllib.loads((PROJECT / "pyproject.toml").read_text())


def room(name: str) -> str:
    """Return the room of a module: `rendering` for hairkit.rendering.hair, "" outside hairkit."""
    first, *rest = name.split(".")
    return rest[0] if first == "hairkit" and rest else ""


def test_every_room_has_its_floor() -> None:
    """A module or package at the top of hairkit stands in `FLOORS`, and nothing else does."""
    found = {path.stem for path in (PROJECT / "hairkit").glob("*.py")}
    found |= {path.parent.name for path in (PROJECT / "hairkit").glob("*/__init__.py")}
    assert found - {"__init__"} == set(FLOOR_OF)


@pytest.mark.parametrize("path", SOURCES, ids=lambda p: str(p.relative_to(PROJECT)))
def test_no_room_uses_a_floor_above(path: Path) -> None:
    """A room imports from its own floor and the floors below."""
    module = module_name(path)
    if module == "hairkit":
        return  # the front door shows names of several floors
    own = FLOOR_OF[room(module)]
    used = {name for name in imported(path) if room(name) in FLOOR_OF}
    above = sorted(name for name in used if FLOOR_OF[room(name)] > own)
    assert not above, f"{module} on floor {own} uses {above}"


def circles(uses: Mapping[str, Iterable[str]]) -> list[str]:
    """Return the modules that import each other, directly or not, one of each circle's names."""
    try:
        graphlib.TopologicalSorter(uses).prepare()
    except graphlib.CycleError as error:
        return list(error.args[1])
    return []


def module_uses(paths: Iterable[Path]) -> dict[str, set[str]]:
    """Return the modules that each module imports; the front door imports none."""
    modules = {module_name(path): path for path in paths}
    uses = {}
    for module, path in modules.items():
        names = imported(path) if module != "hairkit" else []
        homes = {name if name in modules else name.rpartition(".")[0] for name in names}
        uses[module] = homes & modules.keys() - {module}
    return uses


def test_no_two_modules_import_each_other() -> None:
    """Imports form no circle, those inside functions and for type checkers counted."""
    assert circles(module_uses(SOURCES + PLUGINS)) == []


def test_faults_of_imports_are_found() -> None:
    """Circles of two and of three; names that come through the front door."""
    assert circles({"a": ["b"], "b": ["c"], "c": ["a"]})
    assert circles({"a": ["b"], "b": ["a"]})
    assert not circles({"a": ["b", "c"], "b": ["c"]})
    plugin = PROJECT / "plugins" / "rods" / "rods.py"
    source = "from hairkit import Manager, storage\nimport hairkit\nfrom . import Options\n"
    source += "from .block import f"
    found = imported(plugin, source)
    assert found == [
        "hairkit.manager.Manager",
        "hairkit.storage",
        "hairkit.api",
        "hairkit_plugins.rods.Options",
        "hairkit_plugins.rods.block.f",
    ]
    assert FLOOR_OF[room(found[0])] == FLOOR_OF["manager"]


@pytest.mark.parametrize("path", SOURCES, ids=lambda p: str(p.relative_to(PROJECT)))
def test_hairkit_names_no_plugin_module(path: Path) -> None:
    """Plugins are found by entry point; the SDK does not know them."""
    assert "hairkit_plugins" not in path.read_text()


@pytest.mark.parametrize("path", PLUGINS, ids=lambda p: str(p.relative_to(PROJECT)))
def test_a_plugin_stands_alone_on_public_names(path: Path) -> None:
    """A plugin uses no other plugin, nothing private, and nothing of the floors that run it."""
    folder = path.relative_to(PROJECT / "plugins").parts[0]
    for name in imported(path):
        own = name.startswith(f"hairkit_plugins.{Path(folder).stem}.")
        assert own or not name.startswith("hairkit_plugins"), f"{path.name} uses {name}"
        if name.startswith("hairkit."):
            assert not re.search(r"\._(?!_)", name), name
            assert FLOOR_OF.get(room(name), 0) < FLOOR_OF["manager"], name


@pytest.mark.parametrize(
    "path", SOURCES + PLUGINS + TRAINING, ids=lambda p: str(p.relative_to(PROJECT))
)
def test_a_file_tells_one_story(path: Path) -> None:
    """Files stay under 400 lines, begin with a docstring and have no name that says nothing."""
    text = path.read_text()
    assert len(text.splitlines()) < 400
    assert path.stem not in ("utils", "helpers", "common", "misc")
    assert not text.strip() or ast.get_docstring(ast.parse(text))


def long_functions(source: str) -> list[tuple[str, int]]:
    """Return the functions whose bodies have over 40 lines, docstrings not counted."""
    found = []
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
            body = node.body[1:] if ast.get_docstring(node) is not None else node.body
            lines = (node.end_lineno or 0) + 1 - body[0].lineno if body else 0
            found += [(node.name, lines)] if lines > LONGEST_BODY else []
    return found


@pytest.mark.parametrize("path", ALL, ids=lambda p: str(p.relative_to(PROJECT)))
def test_a_function_does_one_step(path: Path) -> None:
    """The body of a function has at most 40 lines, in tests and benchmarks, too."""
    assert long_functions(path.read_text()) == []


def test_long_functions_are_found() -> None:
    """Lines of a body count, those of its docstring and its parameters do not."""
    head = 'def f(\n    a,\n    b,\n):\n    """One.\n\n    Two.\n    """\n'
    assert long_functions(head + LONGEST_BODY * "    a = b\n") == []
    assert long_functions(head + 41 * "    a = b\n") == [("f", 41)]
    assert long_functions("async def g():\n" + 50 * "    pass\n") == [("g", 50)]


def test_every_package_is_in_the_wheel() -> None:
    """The list of packages in pyproject.toml is the list of packages there are."""
    found = {
        ".".join(path.parent.relative_to(PROJECT).parts)
        for path in (PROJECT / "hairkit").rglob("__init__.py")
    }
    found |= {"hairkit_shaders", "hairkit_plugins"}
    found |= {f"hairkit_plugins.{p.parent.name}" for p in PROJECT.glob("plugins/*/__init__.py")}
    assert set(pyproject()["tool"]["setuptools"]["packages"]) == found


def test_every_plugin_has_its_entry_point() -> None:
    """A file in plugins/ is registered under its own name, and nothing else is."""
    found = {path.stem for path in PROJECT.glob("plugins/*.py")} - {"__init__"}
    found |= {path.parent.name for path in PROJECT.glob("plugins/*/__init__.py")}
    entries = pyproject()["project"]["entry-points"]["hairkit"]
    assert entries == {name: f"hairkit_plugins.{name}" for name in found}


def test_data_files_are_in_the_wheel() -> None:
    """Every file beside the sources that is not Python is covered by a package-data pattern."""
    patterns = pyproject()["tool"]["setuptools"]["package-data"]
    for package, folder in (("hairkit", "hairkit"), ("hairkit_shaders", "shaders")):
        base = PROJECT / folder
        covered = {path for pattern in patterns[package] for path in base.glob(pattern)}
        for path in base.rglob("*"):
            inside = path.is_file() and "__pycache__" not in path.parts and path.suffix != ".py"
            assert not inside or path in covered, f"{path} would not be installed"


def test_every_dependency_is_used() -> None:
    """What hairkit depends on is imported by a file of hairkit or of its plugins."""
    modules = {"opencv-python-headless": "cv2", "ai-edge-litert": "ai_edge_litert", "pillow": "PIL"}
    used = {name.partition(".")[0] for path in SOURCES + PLUGINS for name in imported(path)}
    names = [re.split(r"[^\w-]", line)[0] for line in pyproject()["project"]["dependencies"]]
    assert [name for name in names if modules.get(name, name) not in used] == []


def test_versions_agree() -> None:
    """The package's version is that of its metadata, its Blender add-on and its last release."""
    import hairkit

    assert pyproject()["project"]["version"] == hairkit.__version__
    for file, line in (
        ("CITATION.cff", r"version: (.+)"),
        ("examples/hairkit-blender/blender_manifest.toml", r'version = "(.+)"'),
        ("CHANGELOG.md", r"## (\d\S+)"),
    ):
        written = re.search(f"^{line}", (PROJECT / file).read_text(), re.MULTILINE)
        assert written is not None, file
        assert written[1] == hairkit.__version__, file


def test_importing_hairkit_is_light() -> None:
    """OpenGL, OpenCV, Numba and other heavy libraries load where they are used."""
    heavy = ["cv2", "numba", "moderngl", "glfw", "trimesh", "rich", "scipy", "rtree"]
    code = f"import hairkit, sys; print([m for m in {heavy} if m in sys.modules])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


def test_every_public_name_is_there() -> None:
    """`__all__` of the front door names what exists."""
    import hairkit

    assert all(hasattr(hairkit, name) for name in hairkit.__all__)


@pytest.mark.parametrize("package", PACKAGES, ids=lambda p: str(p.relative_to(PROJECT)))
def test_a_package_lists_its_modules(package: Path) -> None:
    """The docstring of a package says what belongs there and names each module, once."""
    docstring = ast.get_docstring(ast.parse((package / "__init__.py").read_text())) or ""
    listed = re.findall(r"^\* `(\w+)`: \S", docstring, re.MULTILINE)
    found = {path.stem for path in package.glob("*.py")}
    found |= {path.parent.name for path in package.glob("*/__init__.py")}
    assert sorted(listed) == sorted(found - {"__init__", "__main__"})
    assert docstring.partition("\n")[0].endswith((".", ")"))


@pytest.mark.parametrize(
    "words",
    [
        ["-c", "import hairkit; print(hairkit.load_recipe('default').name)"],
        ["-c", "import hairkit.simulation; print(hairkit.load_recipe('default').name)"],
        ["-m", "hairkit", "reconstruct", "--help"],
    ],
)
def test_python_runs_in_the_folder_above_the_clone(words: list[str], tmp_path: Path) -> None:
    """A clone named `hairkit` does not hide the package inside it from `python` started above."""
    (tmp_path / "hairkit").symlink_to(PROJECT)
    done = subprocess.run(
        [sys.executable, *words], cwd=tmp_path, capture_output=True, text=True, check=True
    )
    assert "default" in done.stdout
