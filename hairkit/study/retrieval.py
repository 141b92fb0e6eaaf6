"""A stand-in for people: which choice has the hair that looks most like the question's?

It compares where the hair is, how it runs and what colour it has, in pictures of one frame. It
knows no faces and no clothes, by which people could tell photos apart.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cache

import numpy as np

from hairkit.study.questionnaire import Question, Study, nearest_view
from hairkit.study.subject import Look

COLOUR_RANGE = 255.0
"""Distance of sRGB colours that counts as much as hair at another place altogether."""


def answer(study: Study, questions: Sequence[Question]) -> list[int]:
    """Return for each question the index of the choice with the least distance to it."""
    looks = _looks(study)
    return [int(np.argmin(_distances(study, question, looks))) for question in questions]


def look_distance(first: Look, second: Look) -> float:
    """Return 0 for the same hair, up to about 3: one each for place, direction and colour.

    Place: 1 - intersection over union of the coverages. Direction: half of 1 - mean cosine of
    twice the angle between both, where both have hair. Colour: distance of the means in sRGB.
    """
    common = np.minimum(first.hair, second.hair)
    union = float(np.maximum(first.hair, second.hair).sum())
    place = 1.0 - float(common.sum()) / union if union > 0 else 0.0
    cosine = (first.direction * second.direction).sum(axis=-1)
    sure = np.linalg.norm(first.direction, axis=-1) * np.linalg.norm(second.direction, axis=-1)
    weight = float((common * sure).sum())
    course = (1.0 - float((common * cosine).sum()) / weight) / 2 if weight > 0 else 0.5
    colour = float(np.linalg.norm(first.colour - second.colour)) / COLOUR_RANGE
    return place + course + colour


_Looks = Callable[[str, str, str], Look]


def _looks(study: Study) -> _Looks:
    """Return a function of groom, subject and view: the groom as seen by that subject's camera."""

    @cache
    def look(groom: str, subject: str, view: str) -> Look:
        return study.named(groom).look(study.named(subject).shot(view).camera)

    return look


def _distances(study: Study, question: Question, looks: _Looks) -> list[float]:
    subject = study.named(question.subject)
    if question.kind == "hair":
        shown = subject.shot(question.view).look
        drawn = (looks(name, subject.name, question.view) for name in question.choices)
        return [look_distance(shown, each) for each in drawn]
    hair = looks(subject.name, subject.name, question.view)
    others = (study.named(name) for name in question.choices)
    photos = (each.shots[nearest_view(each, subject, question.view)].look for each in others)
    return [look_distance(hair, photo) for photo in photos]
