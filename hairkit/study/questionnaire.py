"""Which question shows what: drawn by lot, the same for the same subjects and seed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from hairkit.errors import InputError
from hairkit.study.subject import Subject, check_names

Kind = Literal["hair", "photo"]
"""What is chosen: the hair of a photo, or the photo of a hair."""

CHOICES = 4
"""Pictures to choose from, as in the thesis' questionnaire."""


@dataclass(frozen=True)
class Question:
    """One question: `subject` from `view`, and the names of the subjects to choose from."""

    kind: Kind
    subject: str
    view: str
    choices: tuple[str, ...]

    @property
    def right(self) -> int:
        """Index of the right choice."""
        return self.choices.index(self.subject)


@dataclass(frozen=True, eq=False)
class Study:
    """Questions about subjects, and the stock grooms among their choices."""

    subjects: tuple[Subject, ...]
    stock: tuple[Subject, ...]
    questions: tuple[Question, ...]

    def named(self, name: str) -> Subject:
        """Return a subject or a stock groom."""
        return next(each for each in (*self.subjects, *self.stock) if each.name == name)


def make_study(
    subjects: Sequence[Subject], stock: Sequence[Subject], questions: int, seed: int = 0
) -> Study:
    """Return a study of `questions` questions that choose hair, and as many that choose photos.

    Each subject is asked about equally often, from views drawn by lot. Photos are chosen among
    those of the subjects alone, since stock grooms have none: below `CHOICES` subjects there are
    no such questions.

    Raises `InputError` for no subject, two of one name, or too few pictures to choose from.
    """
    check_names([*subjects, *stock])
    if not subjects or questions < 1:
        raise InputError(f"{questions} questions about {len(subjects)} grooms; both must be 1 up")
    if len(subjects) + len(stock) < CHOICES:
        raise InputError(f"{len(subjects) + len(stock)} grooms to choose from, {CHOICES} needed")
    lots = np.random.default_rng(seed)
    kinds: list[Kind] = ["hair"] * questions
    if len(subjects) >= CHOICES:
        kinds += ["photo"] * questions
    asked = [
        _ask(kind, subjects[number % len(subjects)], subjects, stock, lots)
        for number, kind in enumerate(kinds)
    ]
    return Study(tuple(subjects), tuple(stock), tuple(asked))


def every_question(study: Study) -> tuple[Question, ...]:
    """Return a question of each kind about each photo: what a program has the patience for."""
    lots = np.random.default_rng(0)
    kinds: list[Kind] = ["hair", "photo"] if len(study.subjects) >= CHOICES else ["hair"]
    return tuple(
        _ask(kind, subject, study.subjects, study.stock, lots, view)
        for kind in kinds
        for subject in study.subjects
        for view in range(len(subject.shots))
    )


def nearest_view(subject: Subject, like: Subject, view: str) -> int:
    """Return the index of the subject's photo that was taken from most nearly the same side."""
    wanted = like.shot(view).camera.rotation[2]
    return int(np.argmax([shot.camera.rotation[2] @ wanted for shot in subject.shots]))


def _ask(
    kind: Kind,
    subject: Subject,
    subjects: Sequence[Subject],
    stock: Sequence[Subject],
    lots: np.random.Generator,
    view: int | None = None,
) -> Question:
    others = [each.name for each in subjects if each is not subject]
    others += [each.name for each in stock] if kind == "hair" else []
    wrong = lots.choice(others, CHOICES - 1, replace=False).tolist()
    shown = int(lots.integers(len(subject.shots))) if view is None else view
    choices = tuple(str(name) for name in lots.permutation([subject.name, *wrong]))
    return Question(kind, subject.name, subject.shots[shown].name, choices)
