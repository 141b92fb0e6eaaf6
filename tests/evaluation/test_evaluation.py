"""Laws of a whole evaluation: files in, figures and a report out."""

from __future__ import annotations

import json
import re
import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from fidelity import mean_figures
from scipy.spatial.transform import Rotation

from hairkit import Brush, Edit, Edits
from hairkit.cli import main
from hairkit.errors import FormatError, InputError
from hairkit.evaluation import Evaluation, Truth, read_prediction, read_truth
from hairkit.evaluation import evaluate as evaluate_whole
from hairkit.evaluation.align import Alignment
from hairkit.evaluation.prediction import Prediction
from hairkit.evaluation.report import write_report
from hairkit.evaluation.scorecard import figures
from hairkit.grooming.brushes import edit_groom
from hairkit.testing import VIEW_NAMES


def evaluate(prediction: Prediction, truth: Truth, *, consistency: bool = False) -> Evaluation:
    """Evaluate with few dense strands, which are slow to draw."""
    return evaluate_whole(prediction, truth, consistency=consistency, dense_strands=400)


def test_the_truth_itself_is_perfect(truth_folder: Path, out_folder: Path) -> None:
    """The true strands with the true cameras have no error anywhere."""
    found = evaluate(read_prediction(out_folder), read_truth(truth_folder), consistency=True)
    for scores in (found.scores.all, found.scores.all_signed, found.scores.outer):
        assert scores is not None
        assert [score.f for score in scores] == [1.0, 1.0, 1.0]
    assert found.strands == found.scores.true_strands
    assert found.lengths.mean_ratio == pytest.approx(1.0)
    assert found.own_head.root_distance_max_mm < 0.01
    assert found.own_head.points_inside == found.true_head.samples_inside == 0
    assert found.azimuth_error_deg < 1e-6
    assert found.orientation_deg == pytest.approx(0.0, abs=0.5)
    assert found.mask_iou == 1.0
    assert found.consistency == 1.0


def test_planted_hair_is_not_judged(truth_folder: Path, out_folder: Path) -> None:
    """A groom with a beard has the figures of the same groom without."""
    truth, plain = read_truth(truth_folder), read_prediction(out_folder)
    chin = plain.groom.head.vertices[plain.groom.head.vertices[:, 1].argmin()]
    beard = Edit(np.array([chin]), Brush("add", 0.03, group="beard"))
    groom = edit_groom(plain.groom, Edits((beard,)))
    assert groom.strands.planted.any()
    found, wanted = evaluate(replace(plain, groom=groom), truth), evaluate(plain, truth)
    assert found.strands == wanted.strands
    assert found.scores == wanted.scores
    assert found.lengths == wanted.lengths


def test_the_frame_of_the_prediction_does_not_matter(truth_folder: Path, out_folder: Path) -> None:
    """A prediction turned, moved and scaled as a whole has the same figures."""
    truth, first = read_truth(truth_folder), read_prediction(out_folder)
    turn = Rotation.from_rotvec([0.1, -0.3, 0.2]).as_matrix()
    change = Alignment(1.4, turn, np.array([0.05, 0.1, -0.2]))
    groom = replace(
        first.groom,
        strands=change.moved_strands(first.groom.strands),
        head=replace(first.groom.head, vertices=change.apply(first.groom.head.vertices)),
    )
    cameras = tuple(change.moved_camera(camera) for camera in first.cameras)
    found = evaluate(Prediction(groom, first.names, cameras), truth)
    assert found.similarity.scale == pytest.approx(1 / 1.4, rel=1e-5)
    assert min(score.f for score in found.scores.all_signed) > 0.999
    assert found.azimuth_error_deg < 1e-3
    assert found.orientation_views is found.mask_views is None


def test_views_are_paired_by_name(truth_folder: Path, out_folder: Path) -> None:
    """A prediction whose views come in another order, or with others, is put into the truth's."""
    truth, first = read_truth(truth_folder), read_prediction(out_folder)
    assert first.orientations is not None
    assert first.masks is not None
    back = slice(None, None, -1)
    turned = Prediction(
        first.groom,
        first.names[back],
        first.cameras[back],
        first.orientations[back],
        first.masks[back],
    )
    found = evaluate(turned, truth)
    assert found.azimuth_error_deg < 1e-6
    assert found.mask_iou == 1.0
    above = replace(
        first,
        names=("top", *first.names),
        cameras=(first.cameras[0], *first.cameras),
        orientations=(first.orientations[0], *first.orientations),
        masks=(first.masks[0], *first.masks),
    )
    assert evaluate(above, truth).mask_iou == 1.0
    renamed = replace(first, names=tuple("abcdefgh"))
    assert evaluate(renamed, truth).azimuth_error_deg < 1e-6


def test_two_reports_are_identical(truth_folder: Path, out_folder: Path, tmp_path: Path) -> None:
    """Figures and pictures are byte for byte the same twice, and the report needs no other file."""
    for name in ("one", "two"):
        prediction, truth = read_prediction(out_folder), read_truth(truth_folder)
        write_report(tmp_path / name, evaluate(prediction, truth), prediction, truth)
    for name in ("evaluation.json", "report.html"):
        assert (tmp_path / "one" / name).read_bytes() == (tmp_path / "two" / name).read_bytes()
    page = (tmp_path / "one" / "report.html").read_text()
    assert page.count("data:image/jpeg;base64,") == 5 * len(VIEW_NAMES) == page.count("src=")
    assert json.loads((tmp_path / "one" / "evaluation.json").read_text())["strands"] > 0


@pytest.mark.parametrize("name", ["truth.json", "strands.npz", "head.obj"])
def test_a_missing_truth_file_is_named(truth_folder: Path, name: str) -> None:
    """One line names the file that is not there."""
    (truth_folder / name).unlink()
    with pytest.raises(InputError, match=f"no {name}"):
        read_truth(truth_folder)


@pytest.mark.parametrize(
    ("name", "content"),
    [
        ("truth.json", b"{}"),
        ("strands.npz", b"no archive"),
        ("head.obj", b"v 1 2\nf 1 2 9\n"),
        ("head.obj", b"v a b c\n"),
        ("orientation/0_front.png", b"no picture"),
    ],
)
def test_a_damaged_truth_file_is_named(
    truth_folder: Path, out_folder: Path, name: str, content: bytes
) -> None:
    """One line names the file that cannot be read."""
    (truth_folder / name).write_bytes(content)
    with pytest.raises(FormatError, match=name.rpartition("/")[2]):
        evaluate(read_prediction(out_folder), read_truth(truth_folder))


def test_the_command_prints_and_writes(
    truth_folder: Path, out_folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The table says how many strands, the JSON is on stdout alone, the report lies in OUT."""
    assert main(["evaluate", str(out_folder), "--truth", str(truth_folder.parent)]) == 0
    printed = capsys.readouterr()
    assert "264 strands, 264 true" in printed.out
    assert "100.0 / 100.0 / 100.0" in printed.out
    assert (out_folder / "evaluation" / "report.html").is_file()
    report = ["-o", str(out_folder / "elsewhere"), "--json"]
    assert (
        main(["evaluate", str(out_folder / "groom.npz"), "--truth", str(truth_folder), *report])
        == 0
    )
    assert json.loads(capsys.readouterr().out)["scores"]["all"][0]["f"] == 1.0
    assert (out_folder / "elsewhere" / "evaluation.json").is_file()


def test_a_groom_without_its_cameras_is_one_line(
    truth_folder: Path, out_folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Without scene.json the line says so, exit code 2; --scene names another."""
    scene = out_folder / "scene.json"
    moved = shutil.move(scene, out_folder / "cameras.json")
    command = ["evaluate", str(out_folder), "--truth", str(truth_folder)]
    assert main(command) == 2
    said = capsys.readouterr().err
    assert "scene.json: no such file" in said
    assert said.count("\n") == 1
    assert not (out_folder / "evaluation").exists()
    assert main([*command, "--scene", str(moved)]) == 0
    assert main(["evaluate", str(out_folder / "work"), "--truth", str(truth_folder)]) == 2
    assert "no such groom" in capsys.readouterr().err


def test_another_captures_truth_is_one_line(truth_folder: Path, out_folder: Path) -> None:
    """Seven predicted views cannot be compared with eight of other names."""
    first = read_prediction(out_folder)
    seven = replace(first, names=first.names[:7], cameras=first.cameras[:7])
    with pytest.raises(InputError, match="7 views, the truth 8"):
        evaluate(seven, read_truth(truth_folder))


def test_every_figure_says_what_is_good(truth_folder: Path, out_folder: Path) -> None:
    """Names are unique, and each figure has a text that says which values are better."""
    found = figures(evaluate(read_prediction(out_folder), read_truth(truth_folder)))
    assert len({figure.name for figure in found}) == len(found)
    assert all(re.search("better|best|compare", figure.meaning) for figure in found)
    by_name = {figure.name: figure.text() for figure in found}
    assert by_name["F 4 mm/40, all"] == "100.0"
    assert by_name["mean length / true"] == "1.00"


def test_means_leave_out_what_is_unknown(truth_folder: Path, out_folder: Path) -> None:
    """The mean of figures is taken over those that were measured."""
    found = figures(evaluate(read_prediction(out_folder), read_truth(truth_folder)))
    without = [replace(figure, value=None) for figure in found]
    assert mean_figures([found, without]) == mean_figures([found])
    assert all(figure.value is None for figure in mean_figures([without]))
