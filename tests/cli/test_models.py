"""Laws of `hairkit models`."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from hairkit.cli import main
from hairkit.nets.known_models import KNOWN_MODELS


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """An empty folder of models."""
    monkeypatch.setenv("HAIRKIT_MODELS", str(tmp_path / "models"))
    return tmp_path / "models"


def test_the_list_says_what_is_installed_and_under_which_licence(
    capsys: pytest.CaptureFixture[str], folder: Path
) -> None:
    """Every known network has a line: installed or not, size, licence, package."""
    assert main(["models"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert lines[0] == f"in {folder}"
    for model, line in zip(KNOWN_MODELS, lines[1:], strict=True):
        assert line.split()[:2] == [model.name, "-"]
        assert model.licence in line
        assert model.package.requirement in line
    assert main(["models", "--json"]) == 0
    facts = json.loads(capsys.readouterr().out)
    assert [fact["installed"] for fact in facts] == [False] * len(KNOWN_MODELS)


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["install", "selfie_segmentatoin"], "did you mean 'selfie_segmentation'"),
        (["install", "--from", "nowhere"], "nowhere: no such file or folder"),
        (["list", "face_landmark"], "say install"),
    ],
)
def test_mistakes_are_one_line(
    capsys: pytest.CaptureFixture[str], words: list[str], said: str
) -> None:
    """A wrong name, source or word is answered in one line, with exit code 2."""
    assert main(["models", *words]) == 2
    error = capsys.readouterr().err
    assert said in error
    assert error.count("\n") == 1


def test_an_empty_folder_names_what_it_lacks(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    """--from with a folder that lacks a network says which file with which hash is wanted."""
    (tmp_path / "empty").mkdir()
    assert main(["models", "install", "face_landmark", "--from", str(tmp_path / "empty")]) == 2
    error = capsys.readouterr().err
    assert "face_landmark.tflite with SHA-256" in error


def test_the_doctor_tells(capsys: pytest.CaptureFixture[str]) -> None:
    """Missing networks are a note with the command that installs them."""
    main(["doctor", "--json"])
    findings = {each["topic"]: each for each in json.loads(capsys.readouterr().out)}
    assert findings["networks"]["verdict"] == "note"
    assert "hairkit models install" in findings["networks"]["text"]
