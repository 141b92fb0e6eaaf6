"""Laws of batches whose captures and results lie at URLs, or are named in a file."""

from __future__ import annotations

import json
import os
import shutil
import uuid
from collections.abc import Iterator
from dataclasses import asdict
from pathlib import Path
from typing import Any

import fsspec
import pytest
from ball import PLUGIN_FILE, RECIPE, write_capture

import hairkit
from hairkit import remote
from hairkit.batches import capture_child
from hairkit.batches.jobs import DONE, KEPT, Job, Settings, find_jobs, finished, job_digest
from hairkit.batches.report import DATA, PAGE
from hairkit.cli import main
from hairkit.errors import InputError

KEYS = {"AWS_ACCESS_KEY_ID": "nobody", "AWS_SECRET_ACCESS_KEY": "nothing"}


@pytest.fixture
def captures(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder of two captures, the recipe of the test plugin, copies in a folder of the test."""
    for name in ("anna", "bert"):
        write_capture(tmp_path / "captures" / name)
    text = RECIPE.replace('[capture]\nplugin = "ball_plugin"', '[capture]\nplugin = "url_folder"')
    (tmp_path / "ball.toml").write_text(text)
    (tmp_path / "copies").mkdir()
    monkeypatch.setenv("TMPDIR", str(tmp_path / "copies"))
    monkeypatch.setattr(remote.tempfile, "tempdir", None)
    return tmp_path / "captures"


@pytest.fixture(scope="module")
def s3() -> Iterator[str]:
    """The URL of an empty bucket of a server in this process."""
    moto = pytest.importorskip("moto.server", reason="moto is not installed: no server for s3")
    pytest.importorskip("s3fs")
    server = moto.ThreadedMotoServer(port=0, verbose=False)
    server.start()
    host, port = server.get_host_and_port()
    with pytest.MonkeyPatch.context() as patch:
        for key, value in {**KEYS, "AWS_ENDPOINT_URL": f"http://{host}:{port}"}.items():
            patch.setenv(key, value)
        fsspec.filesystem("s3").mkdir("hair")
        yield "s3://hair"
    server.stop()


def words(captures: str, out: str, folder: Path) -> list[str]:
    """The command of a small batch."""
    recipe = remote.join(captures.rpartition("/")[0], "ball.toml")
    return [
        "batch", captures, "-o", out, "--recipe", recipe, "--plugin", str(PLUGIN_FILE),
        "--guides", "10", "--workers", "1", "--quiet", "--json",
    ]  # fmt: skip


def near(captures: Path) -> dict[str, bytes]:
    """What `reconstruct` makes of a capture's folder, but for what holds times and places."""
    recipe, out = captures.with_name("ball.toml"), captures.with_name("near")
    text = recipe.read_text().replace("url_folder", "photo_folder")
    recipe.with_name("near.toml").write_text(text)
    manager = hairkit.Manager.loaded([PLUGIN_FILE])
    hairkit.reconstruct(
        captures / "anna", out, recipe.with_name("near.toml"), manager, guides=10, sheet=False
    )
    return {name: (out / name).read_bytes() for name in ("scene.json", "groom.ball")}


def test_a_batch_at_s3_is_that_of_folders(
    captures: Path, s3: str, capsys: pytest.CaptureFixture[str]
) -> None:
    """Captures, recipe and results at URLs: equal bytes, no `work`, kept the second time."""
    files = fsspec.filesystem("s3")
    files.put(str(captures), "hair/captures", recursive=True)
    files.put(str(captures.with_name("ball.toml")), "hair/ball.toml")
    command = words(f"{s3}/captures", f"{s3}/out", captures.parent)
    assert main(command) == 0
    results = json.loads(capsys.readouterr().out)
    assert [(r["name"], r["state"]) for r in results] == [("anna", DONE), ("bert", DONE)]
    for name, data in near(captures).items():
        assert remote.read_bytes(f"{s3}/out/anna/{name}") == data
    inside = {name for name, _ in remote.children(f"{s3}/out/anna")}
    assert {"groom.npz", "run.json", "batch.json", "thumbnail.jpg"} <= inside
    assert "work" not in inside
    assert {PAGE, DATA} <= {name for name, _ in remote.children(f"{s3}/out")}
    assert not list(remote.copies().iterdir())  # nothing is left on this machine
    assert main(command) == 0
    assert {r["state"] for r in json.loads(capsys.readouterr().out)} == {KEPT}


def test_what_was_made_of_a_url_is_made_again(
    captures: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The record names URLs; `rerun` fetches them, and refuses photos that have changed."""
    url, out = (captures / "anna").as_uri(), captures.with_name("out")
    command = ["reconstruct", url, "-o", str(out), "--recipe", str(captures.with_name("ball.toml"))]
    command += ["--plugin", str(PLUGIN_FILE), "--guides", "10", "--no-sheet", "--quiet"]
    assert main([*command, "--drop-work"]) == 0
    assert [path.name for path in (out / "work").iterdir()] == [".lock"]
    record = json.loads((out / "run.json").read_text())
    assert record["photos"] == url
    assert f"{url}/photos/0_front.png" in [each["path"] for each in record["inputs"]]
    shutil.rmtree(remote.copies())
    again = ["rerun", str(out / "run.json"), "-o", str(out.with_name("again")), "--json"]
    capsys.readouterr()
    assert main(again) == 0
    assert json.loads(capsys.readouterr().out)["different"] == []
    photo = captures / "anna" / "photos" / "0_front.png"
    photo.write_bytes(photo.read_bytes() + b" ")
    assert main(again) == 2
    assert f"{url}/photos/0_front.png: changed since" in capsys.readouterr().err


def test_a_batch_in_memory_is_that_of_folders(captures: Path) -> None:
    """One capture in this process, all of it at URLs of `memory://`."""
    memory = f"memory://{uuid.uuid4().hex}"
    fsspec.filesystem("memory").put(str(captures), f"{memory}/captures", recursive=True)
    jobs = find_jobs(f"{memory}/captures", f"{memory}/out")
    assert [job.photos for job in jobs] == [f"{memory}/captures/{n}" for n in ("anna", "bert")]
    recipe = str(captures.with_name("ball.toml"))
    settings = Settings(recipe, plugin_files=(str(PLUGIN_FILE),), guides=10)
    question = {"job": asdict(jobs[0]), "settings": asdict(settings), "digest": "x"}
    found = capture_child.capture(question, lambda _: None)
    assert (found["state"], found["error"]) == (DONE, "")
    assert finished(jobs[0], "x") is not None
    for name, data in near(captures).items():
        assert remote.read_bytes(f"{memory}/out/anna/{name}") == data
    assert not list(remote.copies().iterdir())


def test_a_file_names_captures(captures: Path) -> None:
    """One a line, paths and other names; equal folders for two are refused."""
    listed = captures.with_name("night.txt")
    listed.write_text(f"# the night\nasset:hero/042\n\n{captures / 'anna'}\n")
    jobs = find_jobs(listed, captures.with_name("out"))
    assert {Path(job.out).name: job.photos for job in jobs} == {
        "asset_hero_042": "asset:hero/042",
        str(captures / "anna").replace("/", "_").strip("_"): str(captures / "anna"),
    }
    assert len({job_digest(job, "x") for job in jobs}) == 2
    listed.write_text("asset:a/b\nasset:a:b\n")
    with pytest.raises(InputError, match="would have one folder asset_a_b"):
        find_jobs(listed, captures.with_name("out"))


@pytest.mark.parametrize(
    ("given", "out", "said"),
    [
        ("memory://nobody/captures", "out", "no such folder"),
        ("memory://here/captures", "memory://here/captures/out", "lies in the folder"),
    ],
)
def test_what_is_wrong_with_a_place_is_said_at_once(given: str, out: str, said: str) -> None:
    """Missing captures, and results among them, are one line as they are of folders."""
    fsspec.filesystem("memory").makedirs("here/captures/anna", exist_ok=True)
    with pytest.raises(InputError, match=said):
        find_jobs(given, out)


def test_a_capture_that_changed_at_its_url_is_done_again(captures: Path) -> None:
    """The digest of a job holds size and time of every file."""
    job = Job("anna", (captures / "anna").as_uri(), "out")
    before: Any = job_digest(job, "x")
    assert job_digest(job, "x") == before
    os.utime(captures / "anna" / "photos" / "0_front.png", (1, 1))
    assert job_digest(job, "x") != before
