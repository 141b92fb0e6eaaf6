"""Laws of job files: what runs them does every part once, and then the report."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import pytest

import hairkit.cli.batch
from hairkit.batches.farm_files import FILES, MOST_TASKS, write_job
from hairkit.cli import main
from hairkit.errors import InputError

PROGRAM = (sys.executable, str(Path(__file__).parents[1] / "support" / "part_program.py"))
WORDS = ("--guides", "50", "--set", "gabor.angles=64", "--only", "a name with 'quotes' & spaces")


def run(words: list[str]) -> str:
    """Run a program and return what it prints."""
    done = subprocess.run(words, capture_output=True, text=True, timeout=120)
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


def calls(out: Path) -> dict[str, list[str]]:
    """Return the words of each call by its part."""
    return {p.name[len("called-") :]: p.read_text().split("\n") for p in out.glob("called-*")}


def check(out: Path, captures: Path, parts: int) -> None:
    """Every part was called once with all words, the report once."""
    found = calls(out)
    assert set(found) == {f"{k}of{parts}" for k in range(1, parts + 1)} | {"report"}
    for name, words in found.items():
        assert words[:4] == ["batch", str(captures), "-o", str(out)]
        assert words[-len(WORDS) :] == list(WORDS)
        assert ("--no-report" in words) == (name != "report")
        assert ("--report" in words) == (name == "report")


def test_open_job_description_takes_and_runs_the_template(tmp_path: Path) -> None:
    """`openjd check` accepts it and `openjd run` does every task, the report last."""
    pytest.importorskip("openjd.cli")
    captures, out = tmp_path / "captures", tmp_path / "out"
    captures.mkdir()
    path = write_job("openjd", captures, out, 3, WORDS, PROGRAM)
    openjd = [sys.executable, "-m", "openjd"]
    assert "passes validation" in run([*openjd, "check", str(path)])
    words = [*openjd, "run", str(path), "--step", "Report", "--run-dependencies"]
    assert "success" in run([*words, "-p", f"Captures={captures}", "-p", f"Out={out}"])
    check(out, captures, 3)


@pytest.mark.parametrize("name", ["plain", "it's a 'folder' & more"])
def test_a_shell_runs_the_script(tmp_path: Path, name: str) -> None:
    """The script does every part and the report, whatever is in the names."""
    captures, out = tmp_path / name, tmp_path / f"{name} out"
    captures.mkdir()
    path = write_job("shell", captures, out, 4, WORDS, PROGRAM)
    run(["sh", str(path)])
    check(out, captures, 4)


def test_a_template_of_many_captures_has_as_many_tasks_as_it_may(tmp_path: Path) -> None:
    """Beyond the greatest number of tasks each does several captures."""
    path = write_job("openjd", tmp_path, tmp_path / "out", 5000, ())
    text = path.read_text()
    assert f'"1-{MOST_TASKS}"' in text
    assert f"/{MOST_TASKS}" in text
    with pytest.raises(InputError, match="expected one of openjd, shell"):
        write_job("opencue", tmp_path, tmp_path / "out", 3, ())


def test_the_words_of_a_template_are_understood(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """`hairkit batch` writes a template whose tasks it takes, with the same settings."""
    (tmp_path / "captures" / "anna").mkdir(parents=True)
    out = tmp_path / "out"
    words = ["batch", str(tmp_path / "captures"), "-o", str(out), "--guides", "50", "--sheet"]
    words += ["--set", "orient=gabor", "--set", "gabor.angles=64"]
    assert main([*words, "--write-job", "openjd"]) == 0
    assert str(out / FILES["openjd"]) in capsys.readouterr().out
    assert not (out / "anna").exists()
    template = json.loads((out / FILES["openjd"]).read_text())
    seen = []
    monkeypatch.setattr(hairkit.cli.batch, "run", lambda args: seen.append(args) or 0)
    for step in template["steps"]:
        given = step["script"]["actions"]["onRun"]["args"][2:]
        values = {"{{Task.Param.Part}}": "1", "{{Param.Captures}}": "c", "{{Param.Out}}": "o"}
        for key, value in values.items():
            given = [word.replace(key, value) for word in given]
        assert main(given) == 0
    part, report = seen
    assert (part.captures, part.out, part.part, part.no_report) == ("c", "o", "1/1", True)
    assert report.report
    assert not report.no_report
    for args in seen:
        assert (args.guides, args.sheet, args.set) == (
            50,
            True,
            ["orient=gabor", "gabor.angles=64"],
        )
