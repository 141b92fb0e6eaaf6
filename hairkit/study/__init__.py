"""Questionnaires that ask people whether a reconstruction looks like its photos.

The form is that of the thesis behind the default method: a photo and four grooms, or a groom and
four photos; which belong together? A program answers the same questions as a stand-in.

* `subject`: a reconstruction with its photos, or a stock groom, ready to be shown
* `questionnaire`: which question shows what
* `retrieval`: the stand-in: the choice whose hair looks most like the question's
* `pages`: the questionnaire and its results as local pages
"""

from __future__ import annotations

from hairkit.study.pages import write_results, write_study
from hairkit.study.questionnaire import Question, Study, make_study
from hairkit.study.subject import Subject, distinct_names, make_stock, read_subject

__all__ = [
    "Question",
    "Study",
    "Subject",
    "distinct_names",
    "make_stock",
    "make_study",
    "read_subject",
    "write_results",
    "write_study",
]
