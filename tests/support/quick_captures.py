"""A stand-in for the process that reconstructs captures: quick, and bad where a name says so."""

from __future__ import annotations

import json
import os
import signal
import sys
import time
from pathlib import Path
from typing import Any

from hairkit import worker

MOST_BYTES = 2**31


def capture(question: dict[str, Any], tell: Any) -> dict[str, Any]:
    """Write a groom that depends on the photos alone, unless the capture's name says otherwise."""
    job = question["job"]
    out, photos = Path(job["out"]), Path(job["photos"])
    out.mkdir(parents=True, exist_ok=True)
    with (out / "starts").open("a") as file:
        file.write("x")
    tell("segment")
    kind = job["name"].partition("-")[0]
    if kind == "crash":
        os.kill(os.getpid(), signal.SIGSEGV)
    if kind == "killed" and (out / "starts").read_text() == "x":
        os.kill(os.getpid(), signal.SIGKILL)
    if kind == "hang":
        time.sleep(600)
    if kind == "eat":
        kept = []
        while len(kept) < MOST_BYTES // 2**24:
            kept.append(bytes(range(256)) * 2**16)
    if kind == "flood":
        while True:
            os.write(2, bytes(2**16))
    if kind == "fails" and not (photos / "mended").exists():
        return result(question, "failed") | {"error": "no photos in it"}
    if kind == "raises":
        raise RuntimeError("a bug")
    time.sleep(float(question["settings"]["seed"]) / 1000)
    data = b"".join(path.read_bytes() for path in sorted(photos.iterdir()))
    (out / "groom.npz").write_bytes(data)
    made = result(question, "done")
    (out / "batch.json").write_text(json.dumps(made))
    return made


def result(question: dict[str, Any], state: str) -> dict[str, Any]:
    """The result as the real process gives it."""
    figure = {"stage": "strands", "name": "roots grown", "value": 0.5, "unit": "", "light": "amber"}
    return {
        "name": question["job"]["name"],
        "state": state,
        "out": question["job"]["out"],
        "seconds": 0.01,
        "peak_bytes": 2**27,
        "digest": question["digest"],
        "health": [figure],
    }


def write_captures(folder: Path, *names: str) -> Path:
    """Write a folder of captures, each with one file; return it."""
    for name in names:
        (folder / name).mkdir(parents=True)
        (folder / name / "photo").write_text(name)
    return folder


COMMAND = (sys.executable, __file__)

if __name__ == "__main__":
    worker.answer_questions({"capture": capture})
