"""A study as local files: `index.html` to answer it, `results.html` with what was answered.

The pages need no server. Answers leave the page as a file, `answers.json`, that the reader saves.
"""

from __future__ import annotations

import dataclasses
import html
import json
import os
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from hairkit.arrays import Int64Array, UInt8Array
from hairkit.errors import FormatError, InputError
from hairkit.html_page import page
from hairkit.imaging.picture_file import write_picture
from hairkit.storage import read_text, write_text
from hairkit.study.questionnaire import CHOICES, Question, Study, nearest_view
from hairkit.study.subject import Shot, Subject

STUDY, PAGE, RESULTS, GALLERY = "study.json", "index.html", "results.html", "gallery.jpg"
"""Names in the folder of a study."""
VERSION = 1
"""Of `study.json` and of answers."""
GALLERY_VIEWS = 2
"""Photos of each subject in the gallery, each with the hair beside it."""
_From = tuple[str, str]
"""A subject, and the name of a photo of it, by whose camera something is seen."""
_Drawn = dict[tuple[str, str, str], UInt8Array]
"""Pictures of grooms by their names, each with from where it is seen."""
_MOST_BYTES = 2**22
_JPEG_QUALITY = 88
_ASK = {"hair": "Which hair is that of the photo?", "photo": "Which photo is that of the hair?"}
_COLOURS = ("#3b6ea5", "#c98a2b", "#5d9b63", "#a3557a")
_STYLE = """
body { font: 16px/1.45 system-ui, sans-serif; margin: 2em auto; max-width: 1100px; padding: 0 1em;
  background: #f7f6f4; color: #222 }
fieldset { border: 0; border-top: 1px solid #ccc; margin: 0; padding: 1.5em 0 }
legend { font-size: 1.2em; padding-right: .6em }
.question { display: grid; grid-template-columns: repeat(auto-fit, minmax(160px, 1fr)); gap: 12px }
img { width: 100%; display: block; border-radius: 4px }
label { border: 3px solid transparent; border-radius: 8px; padding: 4px; cursor: pointer }
label:has(:checked) { border-color: #3b6ea5 } label:has(:focus-visible) { outline: 3px solid #222 }
.bar { display: flex; height: 2em; border-radius: 4px; overflow: hidden; color: #fff }
.bar span { display: flex; align-items: center; justify-content: center; min-width: 0 }
.right { outline: 3px solid #222; outline-offset: -3px; font-weight: 700 }
button { font: inherit; padding: .6em 1.4em; border: 0; border-radius: 6px; background: #3b6ea5;
  color: #fff; cursor: pointer } button:disabled { background: #9aa7b5 }
"""
_SCRIPT = """
const form = document.querySelector("form"), button = form.querySelector("button");
const choices = () => [...form.querySelectorAll("fieldset")].map(
  (field) => Number(field.querySelector(":checked")?.value ?? -1));
const changed = () => { button.disabled = choices().includes(-1); };
form.addEventListener("change", changed);
form.addEventListener("submit", (event) => {
  event.preventDefault();
  const answers = { answers: VERSION, identity: form.dataset.identity, choices: choices() };
  const link = document.createElement("a");
  link.href = URL.createObjectURL(new Blob([JSON.stringify(answers)]));
  link.download = "answers.json";
  link.click();
});
changed();
"""


def write_study(
    folder: str | os.PathLike[str], study: Study, program: Sequence[int], identity: str
) -> Path:
    """Write pictures, gallery, page and `study.json`, in this order; return the page.

    Parameters
    ----------
    folder
        Made if need be.
    study
        The questions and what they show.
    program
        The choice of the stand-in for each question, for the results.
    identity
        Tells answers of this study from those of others.

    The page does not hold which choices are right; `study.json` does.
    """
    base = Path(folder)
    base.mkdir(parents=True, exist_ok=True)
    drawn = _draw(study)
    for number, question in enumerate(study.questions):
        for name, picture in zip(_names(number), _pictures(study, question, drawn), strict=True):
            write_picture(base / name, picture, _JPEG_QUALITY)
    write_picture(base / GALLERY, _gallery(study, drawn), _JPEG_QUALITY)
    write_text(base / PAGE, _page([question.kind for question in study.questions], identity))
    asked = [
        dataclasses.asdict(question) | {"program": int(choice)}
        for question, choice in zip(study.questions, program, strict=True)
    ]
    document = {"study": VERSION, "identity": identity, "questions": asked}
    write_text(base / STUDY, json.dumps(document, indent=1) + "\n")
    return base / PAGE


def write_results(
    folder: str | os.PathLike[str], answers: Sequence[str | os.PathLike[str]]
) -> tuple[Path, Int64Array]:
    """Write `results.html`: for every question a stacked bar of what people chose.

    Parameters
    ----------
    folder
        What `write_study` wrote.
    answers
        Files that the page saved, one a person.

    Returns
    -------
    tuple
        The page, and how often each choice was taken, (questions, `CHOICES`).

    Raises
    ------
    InputError
        No answers, or those to another study.
    FormatError
        A file is damaged.
    """
    identity, questions, program = _read_study(Path(folder) / STUDY)
    if not answers:
        raise InputError("no answers; give the files that the page saved")
    counts = np.zeros((len(questions), CHOICES), np.int64)
    for path in answers:
        counts[np.arange(len(questions)), _read_answers(Path(path), identity, len(questions))] += 1
    right = int(counts[np.arange(len(questions)), [q.right for q in questions]].sum())
    guessed = sum(q.right == choice for q, choice in zip(questions, program, strict=True))
    title = f"{len(answers)} people: {right} of {counts.sum()} answers right"
    rows = [
        _result(number, question, counts[number], choice)
        for number, (question, choice) in enumerate(zip(questions, program, strict=True))
    ]
    lead = f"<h1>{title}</h1><p>The program: {guessed} of {len(questions)}.</p>"
    write_text(Path(folder) / RESULTS, page(title, _STYLE, lead, *rows))
    return Path(folder) / RESULTS, counts


def _read_study(path: Path) -> tuple[str, tuple[Question, ...], tuple[int, ...]]:
    """Return identity, questions, and what the program chose."""
    document = _read(path, "study")
    try:
        asked = document["questions"]
        questions = tuple(
            Question(q["kind"], q["subject"], q["view"], tuple(q["choices"])) for q in asked
        )
        if any(len(q.choices) != CHOICES or q.right < 0 or q.kind not in _ASK for q in questions):
            raise ValueError(f"a question has not {CHOICES} choices")
        return str(document["identity"]), questions, tuple(int(q["program"]) for q in asked)
    except (KeyError, TypeError, ValueError) as error:
        raise FormatError(f"{path}: not a study ({error})") from error


def _read_answers(path: Path, identity: str, count: int) -> list[int]:
    """Return the choice for each question."""
    document = _read(path, "answers")
    if document.get("identity") != identity:
        raise InputError(f"{path}: answers to another study")
    choices = document.get("choices")
    if (
        not isinstance(choices, list)
        or len(choices) != count
        or not all(type(choice) is int and 0 <= choice < CHOICES for choice in choices)
    ):
        raise FormatError(f"{path}: expected {count} choices of 0 to {CHOICES - 1}")
    return choices


def _read(path: Path, kind: str) -> dict[str, Any]:
    """Return a JSON object that calls itself `kind`."""
    try:
        document = json.loads(read_text(path, _MOST_BYTES))
        if not isinstance(document, dict) or document.get(kind) != VERSION:
            raise ValueError(f"no {kind} of version {VERSION}")
    except (ValueError, RecursionError) as error:
        raise FormatError(f"{path}: cannot be read ({error})") from error
    return document


def _wanted(study: Study) -> dict[str, list[_From]]:
    """Return for each groom from where it is shown, each place once."""
    found: dict[str, dict[_From, None]] = {}
    for question in study.questions:
        shown = question.choices if question.kind == "hair" else (question.subject,)
        for name in shown:
            found.setdefault(name, {})[question.subject, question.view] = None
    for subject in study.subjects:
        for shot in _gallery_shots(study, subject):
            found.setdefault(subject.name, {})[subject.name, shot.name] = None
    return {name: list(places) for name, places in found.items()}


def _draw(study: Study) -> _Drawn:
    """Return all pictures of grooms; each groom is uploaded once for all of its own."""
    drawn: _Drawn = {}
    for name, places in _wanted(study).items():
        cameras = [study.named(subject).shot(view).camera for subject, view in places]
        for place, picture in zip(places, study.named(name).draw(cameras), strict=True):
            drawn[(name, *place)] = picture
    return drawn


def _pictures(study: Study, question: Question, drawn: _Drawn) -> Iterator[UInt8Array]:
    """Yield what is asked about, then the choices."""
    subject, view = study.named(question.subject), question.view
    if question.kind == "hair":
        yield subject.shot(view).picture
        yield from (drawn[name, subject.name, view] for name in question.choices)
        return
    yield drawn[subject.name, subject.name, view]
    for each in (study.named(name) for name in question.choices):
        yield each.shots[nearest_view(each, subject, view)].picture


def _gallery(study: Study, drawn: _Drawn) -> UInt8Array:
    """Return photos and hair side by side, one row a subject."""
    rows = [
        np.hstack(
            [
                picture
                for shot in _gallery_shots(study, subject)
                for picture in (shot.picture, drawn[subject.name, subject.name, shot.name])
            ]
        )
        for subject in study.subjects
    ]
    return np.vstack(rows)


def _gallery_shots(study: Study, subject: Subject) -> list[Shot]:
    count = min(GALLERY_VIEWS, *(len(each.shots) for each in study.subjects))
    return [subject.shots[i * len(subject.shots) // count] for i in range(count)]


def _names(number: int) -> list[str]:
    """Return the files of a question: what is asked about, then the choices."""
    return [f"{number + 1}.jpg", *(f"{number + 1}-{choice + 1}.jpg" for choice in range(CHOICES))]


def _page(kinds: Sequence[str], identity: str) -> str:
    fields = [_field(number, kind) for number, kind in enumerate(kinds)]
    form = [f'<form data-identity="{html.escape(identity)}">', *fields]
    end = "<button disabled>Save the answers</button></form>"
    script = f"<script>{_SCRIPT.replace('VERSION', str(VERSION))}</script>"
    lead = "<h1>Hair and photos</h1><p>Every question has one right answer. Keys: Tab, arrows.</p>"
    return page("Hair and photos", _STYLE, lead, *form, end, script)


def _field(number: int, kind: str) -> str:
    asked, *choices = _names(number)
    other = "Hair" if kind == "hair" else "Photo"
    options = [
        f'<label><img src="{name}" alt="{other} {choice + 1}">'
        f'<input type="radio" name="q{number}" value="{choice}" required> {choice + 1}</label>'
        for choice, name in enumerate(choices)
    ]
    shown = "Photo" if kind == "hair" else "Hair"
    question = f'<div><img src="{asked}" alt="{shown} of question {number + 1}">{shown}</div>'
    legend = f"<legend>{number + 1}. {_ASK[kind]}</legend>"
    return f'<fieldset>{legend}<div class="question">{question}{"".join(options)}</div></fieldset>'


def _result(number: int, question: Question, counts: Int64Array, program: int) -> str:
    """Return a question, its pictures, and the bar of its answers."""
    total = max(1, int(counts.sum()))
    bars = [
        f'<span class="{"right" if choice == question.right else ""}"'
        f' style="width: {100 * count / total:.1f}%; background: {_COLOURS[choice]}">'
        f"{f'{choice + 1}: {count}' if count else ''}</span>"
        for choice, count in enumerate(counts.tolist())
    ]
    pictures = "".join(
        f'<div><img src="{name}" alt="">{html.escape(text)}</div>'
        for name, text in zip(
            _names(number),
            (question.view, *(f"{i + 1}: {name}" for i, name in enumerate(question.choices))),
            strict=True,
        )
    )
    said = f"right: {question.right + 1}; the program chose {program + 1}"
    return (
        f"<fieldset><legend>{number + 1}. {_ASK[question.kind]}</legend>"
        f'<div class="question">{pictures}</div><p>{said}</p>'
        f'<div class="bar">{"".join(bars)}</div></fieldset>'
    )
