"""Laws of `hairkit doctor`."""

from __future__ import annotations

import importlib.metadata
import json
import os
from pathlib import Path

import cv2
import pytest

import hairkit
from hairkit.cli import doctor, main
from hairkit.cli.doctor import Finding


def test_it_looks_at_everything_and_its_code_says_whether_the_core_works(
    capsys: pytest.CaptureFixture[str],
) -> None:
    """Every requirement, both OpenGL backends, extras, cache and plugins are there; 2 on FAIL."""
    code = main(["doctor", "--json"])
    findings = {each["topic"]: each for each in json.loads(capsys.readouterr().out)}
    topics = {"python", "hairkit", "numpy", "opencv wheels", "OpenGL by egl", "OpenGL by osmesa"}
    assert topics | {"extra studio", "compiled kernels", "plugins"} <= set(findings)
    assert not {"extra all", "extra test", "extra docs", "extra dev"} & set(findings)
    assert findings["numpy"]["verdict"] == "ok"
    failed = [each for each in findings.values() if each["verdict"] == "FAIL"]
    assert code == (2 if failed else 0)


@pytest.mark.parametrize(("verdict", "code"), [("ok", 0), ("note", 0), ("FAIL", 2)])
def test_only_a_failure_fails(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], verdict: str, code: int
) -> None:
    """What is optional is noted and does not change the exit code."""
    finding = Finding("x", verdict, "a text")  # type: ignore[arg-type]  # a parameter of the test
    monkeypatch.setattr(doctor, "examine", lambda: [finding])
    assert main(["doctor"]) == code
    assert capsys.readouterr().out.split() == [verdict, "x", "a", "text"]


def test_two_opencv_wheels_are_a_failure_with_its_cure() -> None:
    """Two wheels that share the folder cv2 are found, and the cure names them."""
    found = doctor._opencv_wheels(["numpy", "opencv-python", "opencv-contrib-python-headless"])
    assert found.verdict == "FAIL"
    assert "pip uninstall -y opencv-contrib-python-headless opencv-python" in found.text
    assert doctor._opencv_wheels(["opencv-python-headless"]).verdict == "ok"


def test_opencv_of_another_distribution_will_do(monkeypatch: pytest.MonkeyPatch) -> None:
    """Where another wheel brings cv2, its version is told and nothing fails."""

    def absent(name: str) -> str:
        raise importlib.metadata.PackageNotFoundError(name)

    monkeypatch.setattr(importlib.metadata, "version", absent)
    found = doctor._package("opencv-python-headless")
    assert (found.verdict, found.text) == ("ok", f"{cv2.__version__}, of another distribution")


def test_a_missing_package_is_named_with_pip() -> None:
    """The cure is a command that can be copied."""
    found = doctor._package("no-such-distribution")
    assert found.verdict == "FAIL"
    assert "pip install --force-reinstall no-such-distribution" in found.text
    assert 'pip install "hairkit[x]"' in doctor._extra("x", ["no-such-distribution"]).text


def test_a_backend_that_does_not_exist_is_reported() -> None:
    """The reason is the last line of what the driver said."""
    success, text = doctor._try_backend("no-such-backend")
    assert not success
    assert "no-such-backend" in text


@pytest.mark.parametrize("open_to_others", [False, True])
def test_kernels_are_kept_in_the_temporary_folder_if_nowhere_else(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, open_to_others: bool
) -> None:
    """With a read-only installation and home, Numba gets a folder that nobody else can write to."""
    monkeypatch.delenv("NUMBA_CACHE_DIR", raising=False)
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    hairkit._choose_kernel_cache()
    assert "NUMBA_CACHE_DIR" not in os.environ
    monkeypatch.setattr(os, "access", lambda *_: False)
    folder = tmp_path / f"hairkit-kernels-{os.getuid()}"
    if open_to_others:
        folder.mkdir()
        folder.chmod(0o777)
    hairkit._choose_kernel_cache()
    assert os.environ.pop("NUMBA_CACHE_DIR", None) == (None if open_to_others else str(folder))
