"""Laws of `hairkit batch` as a whole, on captures of the made-up head."""

from __future__ import annotations

import errno
import io
import json
from dataclasses import asdict
from pathlib import Path
from typing import Any

import pytest
from ball import PLUGIN_FILE, RECIPE, write_capture

import hairkit
from hairkit.batches import capture_child
from hairkit.batches.jobs import DONE, FAILED, KEPT, Job, Result, Settings, finished, read_result
from hairkit.batches.report import DATA, PAGE, write_report
from hairkit.cli import main
from hairkit.cli.batch_table import BatchTable, LiveTable, ResultLines, table_for
from hairkit.errors import HairkitError, InputError, MissingExtraError, OptionError
from hairkit.pipeline.reconstruct import reconstruct

FIGURE = {"stage": "masks", "name": "<hair>", "value": 0.5, "unit": "", "light": "red"}
RESULTS = (
    Result("anna", DONE, "out/anna", 12.5, strands=600, peak_bytes=2**30, health=(FIGURE,),
           thumbnail="thumbnail.jpg", scores={"F 4 mm/40 deg": 0.81}),
    Result("b & <b>", FAILED, "out/b", 3.0, tries=3, error="its process crashed (SIGSEGV)"),
    Result("carl", KEPT, "out/carl", 11.0, strands=590),
)  # fmt: skip


def test_a_batch_is_what_reconstruct_makes_of_each(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Good ones have the bytes of `reconstruct`, a bad one fails alone, a second batch keeps."""
    captures, out = tmp_path / "captures", tmp_path / "out"
    for name in ("anna", "bert"):
        write_capture(captures / name)
    (captures / "empty").mkdir()
    (tmp_path / "ball.toml").write_text(RECIPE)
    words = ["batch", str(captures), "-o", str(out), "--recipe", str(tmp_path / "ball.toml")]
    words += ["--plugin", str(PLUGIN_FILE), "--guides", "10", "--workers", "2", "--quiet"]
    assert main(words) == 2
    said = capsys.readouterr()
    assert "2 done, 0 kept, 1 failed" in said.out
    assert "failed empty: " in said.out
    manager = hairkit.Manager.loaded([PLUGIN_FILE])
    alone = tmp_path / "alone"
    reconstruct(captures / "bert", alone, tmp_path / "ball.toml", manager, guides=10, sheet=False)
    for name in ("scene.json", "groom.ball"):  # tests' own processes paint a smaller skin
        assert (out / "bert" / name).read_bytes() == (alone / name).read_bytes(), name
    assert (out / "anna" / "thumbnail.jpg").read_bytes()[:2] == b"\xff\xd8"
    settings = {"plugin_files": (str(PLUGIN_FILE),), "guides": 10}
    found = hairkit.batch(captures, out, tmp_path / "ball.toml", settings=settings, workers=1)
    assert {r.name: r.state for r in found} == {"anna": KEPT, "bert": KEPT, "empty": FAILED}
    (out / PAGE).unlink()
    assert main([*words, "--report", "--json"]) == 2
    assert [entry["name"] for entry in json.loads(capsys.readouterr().out)] == [
        "anna", "bert", "empty",
    ]  # fmt: skip
    assert "run the batch again" in (out / PAGE).read_text()


def test_the_report_names_every_capture_and_is_safe_to_open(tmp_path: Path) -> None:
    """Failures come first, names and reasons are escaped, figures that are not green are shown."""
    write_report(tmp_path, RESULTS, 100.0)
    page = (tmp_path / PAGE).read_text()
    assert "<b>" not in page
    assert page.index("b &amp; &lt;b&gt;") < page.index("anna") < page.index("carl")
    assert "crashed (SIGSEGV)" in page
    assert "red    masks: &lt;hair&gt; 0.50" in page
    assert 'src="anna/thumbnail.jpg"' in page
    assert "http" not in page
    document = json.loads((tmp_path / DATA).read_text())
    assert document["counts"] == {"done": 1, "kept": 1, "failed": 1}
    assert [entry["error"] for entry in document["captures"]][1:] == ["", ""]


def test_a_result_is_read_as_it_was_written(tmp_path: Path) -> None:
    """What stands beside a groom is the result; anything else is refused in one line."""
    result = Result("anna", DONE, str(tmp_path), health=(FIGURE,), digest="x")
    result.write()
    assert read_result(tmp_path / "batch.json") == result
    for text in ("", "[]", "{}", '{"health": 3}', '{"name": 3, "health": [], "x": 1}'):
        (tmp_path / "batch.json").write_text(text)
        with pytest.raises(InputError, match="no result of a batch"):
            read_result(tmp_path / "batch.json")


class Terminal(io.StringIO):
    """A stream that says it is a terminal."""

    def isatty(self) -> bool:
        return True


def test_the_table_shows_who_is_at_work(monkeypatch: pytest.MonkeyPatch) -> None:
    """On a terminal rows come and go and failures stay; pipes get a line each, quiet nothing."""
    monkeypatch.setenv("TERM", "xterm")
    stream = Terminal()
    with table_for(stream, 3, quiet=False) as table:
        assert isinstance(table, LiveTable)
        table.started("anna")
        table.stage("anna", "orient")
        table.started("b & <b>")
        drawn = table._drawn()
        assert [list(column.cells) for column in drawn.columns][:2] == [
            ["anna", "b & <b>"], ["orient", ""],
        ]  # fmt: skip
        for result in RESULTS[:2]:
            table.ended(result)
        assert not table._drawn().row_count
        assert "2 of 3 captures" in str(table._drawn().title)
    assert "failed b & <b> 3.0 s: its process crashed (SIGSEGV)" in stream.getvalue()
    lines = io.StringIO()
    with table_for(lines, 3, quiet=False) as table:
        assert isinstance(table, ResultLines)
        table.ended(RESULTS[2])
    assert lines.getvalue() == "kept   carl 11.0 s\n"
    assert type(table_for(lines, 3, quiet=True)) is BatchTable


@pytest.mark.parametrize(
    ("more", "said"),
    [
        ({"recipe": "none.toml"}, "none.toml"),
        ({"settings": {"settings": ["orient=gabr"]}}, "gabr"),
        ({"settings": {"settings": ["gabor.angles=64"]}}, "recipe default uses"),
        ({"workers": -1}, "workers is -1"),
        ({"memory_gib": 0}, "0 GiB of memory"),
        ({"part": "3/2"}, "expected K/N"),
    ],
)
def test_what_concerns_all_captures_is_said_before_the_first(
    tmp_path: Path, more: dict[str, Any], said: str
) -> None:
    """A wrong recipe, option or number is one line, and nothing is written."""
    write_capture(tmp_path / "captures" / "anna")
    with pytest.raises(HairkitError, match=said):
        hairkit.batch(tmp_path / "captures", tmp_path / "out", **more)
    assert not (tmp_path / "out").exists()


def test_other_settings_are_another_batch(manager: hairkit.Manager) -> None:
    """The digest knows every setting that changes a result."""
    every = [Settings(), Settings(guides=5), Settings(seed=1), Settings(max_edge=300)]
    every += [Settings(sheet=True), Settings(scores=True), Settings("thesis")]
    every += [Settings(settings=("visual_hull.voxel_size=0.004",))]
    assert len({settings.digest(manager) for settings in every}) == len(every)
    with pytest.raises(OptionError):
        Settings(settings=("visual_hull.voxel_size=x",)).digest(manager)


def test_dask_that_is_not_installed_is_named(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Without the extra the one line says what to install."""
    from hairkit.batches import dask_pool

    def absent(name: str) -> Any:
        raise ImportError(name)

    monkeypatch.setattr(dask_pool.importlib, "import_module", absent)
    with pytest.raises(MissingExtraError, match=r"pip install 'hairkit\[batch\]'"):
        dask_pool.connect("tcp://127.0.0.1:1")


@pytest.mark.parametrize("where", ["run", "result"])
def test_a_full_disk_is_said_and_the_capture_is_done_later(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, where: str
) -> None:
    """Without room a capture fails with what to do, and leaves nothing that says it is done."""
    full = OSError(errno.ENOSPC, "No space left on device", str(tmp_path / "groom.npz"))

    def fail(*_: Any, **__: Any) -> Any:
        raise full

    job = Job("anna", str(tmp_path), str(tmp_path / "out"))
    made = {"state": DONE, "out": job.out}
    run = fail if where == "run" else lambda *_: made
    monkeypatch.setattr(capture_child, "_reconstruct", run)
    if where == "result":
        monkeypatch.setattr(Result, "write", fail)
    question = {"job": asdict(job), "settings": asdict(Settings()), "digest": "x"}
    found = capture_child.capture(question, lambda _: None)
    assert found["state"] == FAILED
    assert found["error"].endswith("on device; free some space and run the batch again")
    assert finished(job, "x") is None
