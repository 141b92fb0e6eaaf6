"""`hairkit study OUT ... -o study/`: ask people whether grooms look like their photos."""

from __future__ import annotations

import argparse
import hashlib
import sys
from pathlib import Path

from hairkit.cli.arguments import LARGEST_SEED, Add, add_shared, check_range
from hairkit.cli.written import print_written
from hairkit.errors import InputError

DESCRIPTION = """\
Example: hairkit study anna/ ben/ carla/ deniz/ -o study/
         hairkit study study/ --answers answers-*.json

Make a questionnaire of reconstructions: a photo and four grooms, a groom and four photos. The
grooms hang as a simulation leaves them and are seen from where the photo was taken; wrong choices
are the other grooms and stock ones. study/index.html needs no server; each person opens it and
saves answers.json. --answers counts them: study/results.html. A program answers, too."""
QUESTIONS = 4
"""Of each kind, as in the thesis' questionnaire."""
MOST_QUESTIONS = 100
_IDENTITY_BYTES = 8
"""Of the name by which answers belong to a study."""


def add_arguments(add: Add) -> None:
    """Add the arguments."""
    add("folders", nargs="+", type=Path, metavar="OUT", help="folders of reconstruct; or a study")
    add("-o", "--output", type=Path, metavar="DIR", help="folder for the questionnaire")
    add("--questions", type=int, default=QUESTIONS, metavar="N", help=f"each way ({QUESTIONS})")
    add("--seed", type=int, default=0, help="of choices and views (0)")
    add("--answers", nargs="+", type=Path, metavar="FILE", help="answers to count")
    add_shared(add, "--json")


def run(args: argparse.Namespace) -> int:
    """Write the questionnaire, or count its answers."""
    if args.answers is not None:
        return _count(args)
    if args.output is None:
        raise InputError("where to? give -o FOLDER for the questionnaire")
    check_range("--questions", args.questions, 1, MOST_QUESTIONS)
    check_range("--seed", args.seed, 0, LARGEST_SEED)
    return _make(args)


def _make(args: argparse.Namespace) -> int:
    from hairkit.manager import Manager
    from hairkit.study import distinct_names, make_stock, make_study, read_subject, write_study
    from hairkit.study.questionnaire import CHOICES, every_question
    from hairkit.study.retrieval import answer

    manager = Manager.loaded()
    subjects, names = [], distinct_names(args.folders)
    for folder, name in zip(args.folders, names, strict=True):
        subjects.append(read_subject(folder, manager, name=name))
        print(f"{folder}: {len(subjects[-1].shots)} photos", file=sys.stderr)
    study = make_study(subjects, make_stock(manager, seed=args.seed), args.questions, args.seed)
    if len(subjects) < CHOICES:
        print(f"no questions with photos to choose from: they take {CHOICES} OUT", file=sys.stderr)
    every = every_question(study)
    chosen = answer(study, [*study.questions, *every])  # what one sees, others need not look for
    count = len(study.questions)
    page = write_study(args.output, study, chosen[:count], _identity(args, names))
    for kind, what in (("hair", "hair of a photo"), ("photo", "photo of a hair")):
        pairs = zip(chosen[count:], every, strict=True)
        right = [choice == question.right for choice, question in pairs if question.kind == kind]
        if right:
            print(f"the program finds the {what}: {sum(right)} of {len(right)}", file=sys.stderr)
    print_written(args, page)
    return 0


def _count(args: argparse.Namespace) -> int:
    from hairkit.study import write_results

    if len(args.folders) != 1 or args.output is not None:
        raise InputError("--answers belong to one study: hairkit study study/ --answers FILE ...")
    page, counts = write_results(args.folders[0], args.answers)
    for number, row in enumerate(counts.tolist()):
        print(f"question {number + 1}: {' '.join(str(count) for count in row)}", file=sys.stderr)
    print_written(args, page)
    return 0


def _identity(args: argparse.Namespace, names: tuple[str, ...]) -> str:
    """Return a name for the study, the same when it is made again."""
    parts = [str(args.questions), str(args.seed), *names]
    return hashlib.blake2b("\0".join(parts).encode(), digest_size=_IDENTITY_BYTES).hexdigest()
