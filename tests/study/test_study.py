"""Laws of questionnaires: what is asked, what a program answers, and how answers are counted."""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from hairkit.cli import main
from hairkit.errors import FormatError, InputError
from hairkit.head_model.template import default_head
from hairkit.manager import Manager
from hairkit.study import Study, Subject, make_study, write_results, write_study
from hairkit.study.questionnaire import CHOICES, every_question
from hairkit.study.retrieval import answer, look_distance
from hairkit.study.subject import HEIGHT, WIDTH, Shot, cut_out, distinct_names, frame_camera, settle
from hairkit.synth import STYLES, grow
from hairkit.types.camera import Camera


def camera(azimuth: float) -> Camera:
    return Camera.on_turn(azimuth, distance=0.8, focal=900.0, width=600, height=800)


@pytest.fixture(scope="session")
def study(manager: Manager) -> Iterator[Study]:
    """Four subjects, their pictures taken of other strands than those that are drawn."""
    subjects = []
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("hairkit.study.subject.HAIRS", 1)  # no more than are grown
        patch.setattr("hairkit.study.subject.COARSE_HAIRS", 400)
        for style in list(STYLES)[:4]:
            photographed, drawn = (
                settle(style, grow(style, default_head(), 400, seed), manager, 0.0)
                for seed in (1, 2)
            )
            shots = tuple(
                Shot(
                    name, camera(at), photographed.draw([camera(at)])[0],
                    photographed.look(camera(at)),
                )
                for name, at in (("front", 0.0), ("back-left", 135.0))
            )  # fmt: skip
            subjects.append(replace(drawn, shots=shots))
        stock = [settle("stock parted", grow("parted", default_head(), 400, 3), manager, 0.0)]
        yield make_study(subjects, stock, 4, seed=5)


def test_each_question_has_the_right_answer_once_and_is_drawn_by_its_seed(study: Study) -> None:
    """Four choices, all different, one right; the same seed asks the same, another does not."""
    assert [question.kind for question in study.questions] == ["hair"] * 4 + ["photo"] * 4
    for question in study.questions:
        assert len(set(question.choices)) == CHOICES
        assert question.choices[question.right] == question.subject
    assert {q.subject for q in study.questions[:4]} == {s.name for s in study.subjects}
    again = make_study(study.subjects, study.stock, 4, seed=5)
    assert again.questions == study.questions
    assert make_study(study.subjects, study.stock, 4, seed=6).questions != study.questions


def test_photos_to_choose_from_are_only_those_of_subjects(study: Study) -> None:
    """Stock grooms have no photos; with three subjects no question chooses photos."""
    stock = {each.name for each in study.stock}
    for question in every_question(study):
        assert question.kind == "hair" or not stock & set(question.choices)
    few = make_study(study.subjects[:3], study.stock, 2)
    assert {question.kind for question in few.questions} == {"hair"}
    with pytest.raises(InputError, match="needed"):
        make_study(study.subjects[:2], study.stock, 2)
    with pytest.raises(InputError, match="two subjects"):
        make_study([*study.subjects, study.subjects[0]], study.stock, 2)


def test_the_program_knows_hair_again(study: Study) -> None:
    """Other strands of the same style are found among four; chance would find a quarter."""
    asked = every_question(study)
    right = sum(a == q.right for a, q in zip(answer(study, asked), asked, strict=True))
    assert right >= 0.8 * len(asked)


def test_distance_of_looks(study: Study) -> None:
    """Zero for the same hair, symmetric, and larger for hair that runs across."""
    look = study.subjects[0].shots[0].look
    across = replace(look, direction=-look.direction)
    assert look_distance(look, look) == pytest.approx(0.0, abs=1e-5)
    assert look_distance(look, across) == pytest.approx(1.0, abs=1e-5)
    other = study.subjects[1].shots[0].look
    assert look_distance(look, other) == pytest.approx(look_distance(other, look))


def test_the_frame_shows_the_same_metres_of_every_photo() -> None:
    """A point lies at the same place in a photo's cut-out and in the framed camera's picture."""
    near = camera(30.0)
    point = np.array([0.04, 0.06, 0.05])
    photo = np.zeros((near.height, near.width), np.uint8)
    x, y = near.project(point).astype(int)
    photo[y - 3 : y + 4, x - 3 : x + 4] = 255
    framed = cut_out(photo, near)
    assert framed.shape == (HEIGHT, WIDTH)
    at = np.argwhere(framed > 60).mean(axis=0)[::-1] + 0.5
    np.testing.assert_allclose(at, frame_camera(near).project(point), atol=1.5)


def test_answers_are_counted(study: Study, tmp_path: Path) -> None:
    """Counts are those of the files; the page does not tell what is right; others are refused."""
    program = answer(study, study.questions)
    page = write_study(tmp_path, study, program, "abc")
    text = page.read_text()
    assert all(subject.name not in text for subject in study.subjects)
    assert text.count("<img") == len(study.questions) * (1 + CHOICES)
    right = [question.right for question in study.questions]
    files = []
    for number, choices in enumerate((right, [0] * len(right), right)):
        path = tmp_path / f"answers{number}.json"
        path.write_text(json.dumps({"answers": 1, "identity": "abc", "choices": choices}))
        files.append(path)
    results, counts = write_results(tmp_path, files)
    assert counts.sum(axis=1).tolist() == [3] * len(right)
    assert all(counts[i, r] == 2 + (r == 0) for i, r in enumerate(right))
    assert "3 people" in results.read_text()
    files[0].write_text(json.dumps({"answers": 1, "identity": "abd", "choices": right}))
    with pytest.raises(InputError, match="another study"):
        write_results(tmp_path, files)


@pytest.mark.parametrize(
    "text",
    ["", "[]", "{}", '{"answers": 1, "identity": "abc", "choices": [0, 4]}', "[" * 50_000,
     '{"answers": 1, "identity": "abc", "choices": [true, 0]}'],
)  # fmt: skip
def test_damaged_answers_are_one_line(tmp_path: Path, text: str) -> None:
    """A file that holds no answers is refused by name."""
    asked = [
        {"kind": "hair", "subject": "a", "view": "front", "choices": list("abcd"), "program": 0}
    ] * 2
    document = {"study": 1, "identity": "abc", "questions": asked}
    (tmp_path / "study.json").write_text(json.dumps(document))
    path = tmp_path / "answers.json"
    path.write_text(text)
    with pytest.raises(FormatError, match=r"answers\.json"):
        write_results(tmp_path, [path])


def test_the_command_refuses_what_it_cannot_ask(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """One line each, exit code 2."""
    for words in (
        ["study", str(tmp_path)],
        ["study", str(tmp_path), "-o", str(tmp_path / "s")],
        ["study", str(tmp_path), "-o", str(tmp_path / "s"), "--questions", "0"],
        ["study", str(tmp_path), "--answers", str(tmp_path / "none.json")],
    ):
        assert main(words) == 2
        assert len(capsys.readouterr().err.strip().splitlines()) == 1
    assert not (tmp_path / "s").exists()


def test_folders_of_one_name_are_told_apart_by_those_above() -> None:
    """Studio projects all keep their hair in a folder of one name."""
    folders = [Path("/heads/anna/result"), Path("/heads/ben/result"), Path("/heads/carl")]
    assert distinct_names(folders) == ("anna/result", "ben/result", "heads/carl")
    assert distinct_names(folders[:1]) == ("result",)
    assert distinct_names([folders[0]] * 2) == ("/".join(folders[0].parts),) * 2


def test_read_subject_shows_the_photos_of_a_run(captures: Path, tmp_path: Path) -> None:
    """What reconstruct wrote is enough: photos, masks and cameras come from its record."""
    from hairkit.study import read_subject

    out = tmp_path / "out"
    words = ["reconstruct", str(captures / "short"), "-o", str(out), "--guides", "60", "--no-sheet"]
    assert main([*words, "--quiet"]) == 0
    subject: Subject = read_subject(out, Manager.loaded(autoload=False), settling=0.0)
    assert len(subject.shots) == 8
    front = next(shot for shot in subject.shots if shot.name == "front")
    assert look_distance(front.look, subject.look(front.camera)) < 1.0
