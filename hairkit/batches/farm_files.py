"""Job files for what runs elsewhere: a template of Open Job Description, or a shell script.

A batch is cut into parts, each a task that runs `hairkit batch --part K/N`; a last one writes the
report. Tasks that ran already find their captures done, so a farm may repeat any of them.
"""

from __future__ import annotations

import json
import os
import shlex
from collections.abc import Sequence
from pathlib import Path

from hairkit.errors import InputError
from hairkit.storage import write_text

OPENJD, SHELL = "openjd", "shell"
FILES = {OPENJD: "job.template.json", SHELL: "job.sh"}
"""Kind of job file -> its name in the output folder."""
MOST_TASKS = 1024
"""Values that a list in a template may have: Open Job Description 2023-09, section 3.4.1."""
LONGEST_NAME = 64
"""Characters of a job's name: section 1.1."""


def write_job(
    kind: str,
    captures: str | os.PathLike[str],
    out: str | os.PathLike[str],
    count: int,
    words: Sequence[str],
    program: Sequence[str] = ("hairkit",),
) -> Path:
    """Write a job file into the output folder and return its path.

    Parameters
    ----------
    kind
        `openjd` or `shell`.
    captures, out
        Of the batch; a template takes others when it is submitted.
    count
        Number of captures: each is a task of its own, as far as there may be so many.
    words
        Further arguments of `hairkit batch`, equal for all parts.
    program
        How hairkit is started where the tasks run.
    """
    if kind not in FILES:
        raise InputError(f"job file {kind!r}, expected one of {', '.join(FILES)}")
    path = Path(out).absolute() / FILES[kind]
    path.parent.mkdir(parents=True, exist_ok=True)
    parts = min(count, MOST_TASKS)
    source, target = str(Path(captures).absolute()), str(path.parent)
    if kind == OPENJD:
        template = _template(Path(source).name, parts, words, program)
        write_text(path, json.dumps(template, indent=1) + "\n")
    else:
        write_text(path, _script(source, target, parts, words, program))
    return path


def _template(
    name: str, parts: int, words: Sequence[str], program: Sequence[str]
) -> dict[str, object]:
    """Return a template; its folders have no defaults, which would have to lie beside it."""
    batch = [*program[1:], "batch", "{{Param.Captures}}", "-o", "{{Param.Out}}", "--quiet"]
    part = [*batch, "--part", f"{{{{Task.Param.Part}}}}/{parts}", "--no-report", *words]

    def script(arguments: Sequence[str]) -> dict[str, object]:
        return {"actions": {"onRun": {"command": program[0], "args": list(arguments)}}}

    return {
        "specificationVersion": "jobtemplate-2023-09",
        "name": f"hairkit batch of {name}"[:LONGEST_NAME],
        "parameterDefinitions": [
            _folder("Captures", "IN", "A folder for each capture"),
            _folder("Out", "OUT", "Folder for the results"),
        ],
        "steps": [
            {
                "name": "Reconstruct",
                "parameterSpace": {
                    "taskParameterDefinitions": [
                        {"name": "Part", "type": "INT", "range": f"1-{parts}"}
                    ]
                },
                "script": script(part),
            },
            {
                "name": "Report",
                "dependencies": [{"dependsOn": "Reconstruct"}],
                "script": script([*batch, "--report", *words]),
            },
        ],
    }


def _folder(name: str, flow: str, description: str) -> dict[str, str]:
    return {
        "name": name,
        "type": "PATH",
        "objectType": "DIRECTORY",
        "dataFlow": flow,
        "description": description,
    }


def _script(
    captures: str, out: str, parts: int, words: Sequence[str], program: Sequence[str]
) -> str:
    batch = shlex.join([*program, "batch", captures, "-o", out, "--quiet"])
    rest = shlex.join(words)
    return f"""#!/bin/sh
# {parts} tasks and a report. On one machine: sh job.sh. As a Slurm array, then the report:
#   sbatch --array=1-{parts} job.sh && sbatch --dependency=singleton job.sh report
set -u
part() {{ {batch} --part "$1/{parts}" --no-report {rest}; }}
report() {{ {batch} --report {rest}; }}
if [ "${{1:-}}" = report ]; then report; exit; fi
if [ -n "${{SLURM_ARRAY_TASK_ID:-}}" ]; then part "$SLURM_ARRAY_TASK_ID"; exit; fi
k=1
while [ "$k" -le {parts} ]; do part "$k"; k=$((k + 1)); done
report
"""
