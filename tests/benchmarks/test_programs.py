"""Laws of all benchmarks and studies: they run on small inputs and print what they announce."""

from __future__ import annotations

import importlib.util
import subprocess
import sys
from pathlib import Path
from types import ModuleType, SimpleNamespace
from typing import Any

import pytest
from foreign_heads import make_coarse_head
from hairkit_plugins import landmarks

from hairkit.cli import main as hairkit

PROJECT = Path(__file__).parents[2]
SHARED = {
    "captures_argument", "card_picture", "example_textures", "foreign_heads", "peer_cases",
    "peer_surfaces", "peer_views", "peer_volumes", "plain_analogies", "random_hair", "spoiled",
}  # fmt: skip
"""Modules that programs import."""
FOLDERS = ("benchmarks", "studies")
PATHS = {path.stem: path for folder in FOLDERS for path in (PROJECT / folder).glob("*.py")}
PROGRAMS = sorted(PATHS.keys() - SHARED)
KNOWN_TURN = SimpleNamespace(
    Options=landmarks.Options,
    estimate_scene=lambda capture, masks, head, _, options: landmarks.estimate_scene(
        capture, masks, head, options
    ),
)
"""In the place of `silhouette`, whose search takes longer than all else."""
SMALL_LENS = SimpleNamespace(size=(180, 320), focal=315.0, distance=0.756, aim=-0.1, tilt=3.0)
SMALL: dict[str, tuple[dict[str, Any], list[str]]] = {
    "analogies": ({"SMALL": 16, "LARGE": 24, "SEEDS": 1, "ROWS": 1}, []),
    "batch": ({"JOBS": 4, "WARM": 2, "WAITING": 2, "WAIT_S": 0.0}, []),
    "cameras": ({}, ["CAPTURES", "--plugin", "landmarks"]),
    "contact": ({}, ["--guides", "20", "--frames", "2", "--hair", "short"]),
    "command_plugins": ({"CALLS": 2, "SIZE": (40, 30)}, []),
    "farm_costs": ({"TASKS": (20, 60)}, ["--seconds", "5"]),
    "farm_scheduler": ({}, ["--counts", "60", "--workers", "4", "--window", "0", "20"]),
    "cards": (
        {"STYLES": ("straight",), "SIZE": (48, 64), "WARM_UP": 20},
        ["--strands", "300", "--points", "8", "--cards", "20", "--atlas", "256"],
    ),
    "few_photos": ({"GUIDES": 60}, ["CAPTURES", "--photos", "1"]),
    "films": (
        {"KINDS": ("short",), "GUIDES": 20, "SHOWN": (0.1,), "SIZE": (40, 40)},
        ["--films", "jump", "--hairs", "40", "-o", "CAPTURES/films"],
    ),
    "growth": ({}, ["CAPTURES/short", "--strands", "50", "--rounds", "1"]),
    "head_fit": ({"MIXINGS": 1, "ROUNDS": 2}, ["CAPTURES"]),
    "health": ({"GUIDES": 30}, ["CAPTURES", "-o", "CAPTURES/health", "--ways", "cut to 0.6"]),
    "held_out": ({"GUIDES": 60, "MEASURED": 5}, ["CAPTURES"]),
    "helices": ({"COUNT": 10}, []),
    "latency": (
        {"GUIDES": 30, "WARM": 0},
        ["--photos", "CAPTURES/short/photos", "--only", "viewer", "--repeats", "1"],
    ),
    "looks": ({"GUIDES": 60}, ["CAPTURES", "-o", "CAPTURES/looks.jpg"]),
    "masks": ({}, ["CAPTURES"]),
    "dyed_hair": ({"GUIDES": 60, "HEIGHT": 160}, ["CAPTURES"]),
    "parting": ({"silhouette": KNOWN_TURN}, ["CAPTURES"]),
    "orientation": ({}, ["CAPTURES", "--only", "structure_tensor"]),
    "orientation_looks": (
        {
            "STRANDS": 2000,
            "SIZE": (240, 320),
            "STYLES": ("straight",),
            "COLOURS": {"red": (0.2, 0, 0)},
            "GLOSS": {"usual": (1.0, 1.0)},
        },
        [],
    ),
    "persons": ({"GUIDES": 60, "STRANDS": 2000, "CROPPED": SMALL_LENS}, ["fringe:28"]),
    "robustness": ({}, ["--grooms", "2"]),
    "render": ({"GUIDES": 40}, ["--strands", "60", "--points", "8", "--size", "60x80"]),
    "scaling": (
        {"PHOTOS": 8, "STEPS": {"file pixels": (240, 300)}},
        ["CAPTURES/short", "--only", "file pixels", "--rounds", "1", "-o", "CAPTURES/growth.png"],
    ),
    "segmentation": ({}, ["CAPTURES", "--plugin", "auto_matte"]),
    "skin": ({"HEIGHT": 120}, ["CAPTURES"]),
    "skin_looks": ({"HEIGHT": 80}, ["-o", "CAPTURES/looks_of_skin.jpg"]),
    "peers": ({}, ["--rounds", "1", "--size", "0.02"]),
    "strokes": ({"STROKES": 1}, ["CAPTURES", "--tool", "brush"]),
    "studio": (
        {"GUIDES": 30},
        ["--photos", "CAPTURES/short/photos", "--strokes", "1", "--until", "preview"],
    ),
    "super_helix": ({"GUIDES": 8, "ELEMENTS": 5, "FRAMES": 2}, []),
    "texture_gallery": ({"SIZE": 64}, ["-o", "CAPTURES/gallery"]),
    "threads": ({"REPETITIONS": 1}, ["--runs", "2"]),
    "turn": ({"SHUFFLES": 1}, ["CAPTURES"]),
    "video": (
        {"GUIDES": 60, "STRANDS": 1200, "FRAMES": 60, "CROPPED": SMALL_LENS},
        ["--styles", "short"],
    ),
    "viewer": (
        {"WARM": 1, "SETTLING": 2, "ROWS": ((False, 0), (True, 3), (None, None))},
        ["--guides", "20", "--hairs", "60", "--size", "64x48", "--pictures", "1"],
    ),
    "wrap": (
        {"STYLES": ("wavy",), "FOREIGN_HEADS": {"coarse": make_coarse_head}},
        ["--strands", "40", "-o", "CAPTURES/wrap.jpg"],
    ),
}
"""Constants and arguments that make a program quick. CAPTURES is a folder with one capture."""
ELSEWHERE = {
    "bench",
    "blender_picture",
    "compare",
    "export",
    "face_landmarks",
    "fidelity",
    "simulation",
    "stages",
}
"""Programs with tests of their own beside this one, or that need Blender."""


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with one small procedural capture and its ground truth."""
    folder = tmp_path_factory.mktemp("captures")
    words = ["synth", "short", "-o", str(folder / "short"), "--strands", "2000"]
    assert hairkit([*words, "--size", "240x320"]) == 0
    return folder


def program(name: str, monkeypatch: pytest.MonkeyPatch) -> ModuleType:
    """Return a program as a module."""
    spec = importlib.util.spec_from_file_location(name, PATHS[name])
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    monkeypatch.setitem(sys.modules, name, module)
    spec.loader.exec_module(module)
    return module


def test_every_program_is_run_by_a_test() -> None:
    """A new program gets a line in `SMALL`, or a test of its own."""
    assert set(PROGRAMS) == set(SMALL) | ELSEWHERE


@pytest.mark.parametrize("name", SMALL)
def test_it_prints_its_table(
    name: str, folder: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """A program prints at least one row of as many cells as its heading has."""
    module = program(name, monkeypatch)
    constants, words = SMALL[name]
    for constant, value in constants.items():
        monkeypatch.setattr(module, constant, value)
    monkeypatch.setattr(
        sys, "argv", [f"{name}.py", *(w.replace("CAPTURES", str(folder)) for w in words)]
    )
    capsys.readouterr()
    assert module.main() in (None, 0)
    rows = [line for line in capsys.readouterr().out.splitlines() if line.startswith("|")]
    assert len(rows) >= 3
    assert rows[0].count("|") == rows[2].count("|")


@pytest.mark.parametrize(
    "name",
    [
        "cameras",
        "face_landmarks",
        "orientation",
        "parting",
        "segmentation",
        "fidelity",
        "health",
        "turn",
    ],
)
def test_captures_are_named_by_the_user(
    name: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Without a folder and without HAIRKIT_CAPTURES a program says what to do, and that is all."""
    monkeypatch.delenv("HAIRKIT_CAPTURES", raising=False)
    monkeypatch.setattr(sys, "argv", [f"{name}.py"])
    assert program(name, monkeypatch).main() in (None, 0)
    assert capsys.readouterr().out.startswith("no captures")


@pytest.mark.parametrize("name", PROGRAMS)
def test_help_tells_what_it_measures(
    name: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """`--help` works for every program and begins with its purpose."""
    monkeypatch.setattr(sys, "argv", [f"{name}.py", "--help"])
    with pytest.raises(SystemExit) as leaving:
        program(name, monkeypatch).main()
    assert leaving.value.code == 0
    assert f"usage: {name}.py" in capsys.readouterr().out


def test_programs_run_as_scripts() -> None:
    """A program finds the modules beside it, and `main` is called."""
    for name in ("cameras", "looks"):
        words = [sys.executable, PATHS[name], "--help"]
        done = subprocess.run(words, capture_output=True, text=True)
        assert done.returncode == 0, done.stderr
        assert f"usage: {name}.py" in done.stdout
    for name in PROGRAMS:
        assert '\nif __name__ == "__main__":\n' in PATHS[name].read_text()


def test_runs_are_timed_on_some_of_the_photos(
    folder: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """After a first run that is not printed there is a row for each number of photos at hand."""
    turn, seen = program("turn", monkeypatch), []

    def run(given: Path, _out: Path, *, sheet: bool) -> None:
        seen.append((len(list(given.iterdir())), sheet))

    monkeypatch.setattr(turn, "reconstruct", run)
    turn.print_seconds(folder / "short")
    assert [count for count, _ in seen[1:]] == [3, 8]
    rows = capsys.readouterr().out.splitlines()[2:]
    assert [row.split("|")[1].strip() for row in rows] == ["3", "8"]
