"""A plugin in a process of its own that misbehaves in the way that its first argument names.

What speaks before or beside the protocol is done by hand; the rest goes through `hairkit.worker`.
With `as_told` it goes by the name of the view, so that one process serves many tests.
"""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
import zipfile
from pathlib import Path
from typing import Any

import numpy as np

from hairkit import worker

HOW = sys.argv[1]
SHAPE = (128, 96)
GOOD = {"labels": np.full(SHAPE, 255, np.uint8), "person_known": False}
DESCRIPTION: dict[str, Any] = {
    "protocol": worker.PROTOCOL,
    "hooks": {"segment": ["view"]},
    "options": {},
    "summary": "Bad.",
    "version": "1",
    "digest": "0",
}
OPTION = worker.option(1.0, low=0.0, high=2.0)
DESCRIBED: dict[str, Any] = {
    "old_protocol": {"protocol": 0},
    "no_hooks": {"hooks": {}},
    "unknown_hook": {"hooks": {"segmnt": ["view"]}},
    "live_object": {"hooks": {"make_simulator": ["groom"]}},
    "unknown_argument": {"hooks": {"segment": ["veiw"]}},
    "hooks_of_numbers": {"hooks": 5},
    "unknown_kind": {"options": {"level": OPTION | {"kind": "matrix"}}},
    "default_out_of_bounds": {"options": {"level": OPTION | {"default": 7.0}}},
    "option_without_default": {"options": {"level": {"kind": "int"}}},
}
"""What a wrong description says in the place of the good one."""
SAID: dict[str, bytes] = {
    "garbage": b"Traceback (most recent call last):\n",
    "a_list": b"[1, 2]\n",
    "no_number": b'{"result": {}}\n',
    "deep": b'{"id": 1, "result": ' + 100_000 * b"[" + b"\n",
    "other_number": b'{"id": 77, "result": {}}\n',
    "not_utf8": b"\xff\xfe\x00\n",
    "no_result": b'{"id": 1, "result": 5}\n',
}
"""What is said in the place of an answer to the first question."""


def main() -> None:
    if HOW in SAID:
        os.write(1, SAID[HOW])
        time.sleep(60)
    elif HOW in DESCRIBED:
        os.write(1, json.dumps({"id": 1, "result": DESCRIPTION | DESCRIBED[HOW]}).encode() + b"\n")
        time.sleep(60)
    elif HOW == "silent":
        time.sleep(60)
    elif HOW == "leaves":
        print("no module named torch", file=sys.stderr)
        sys.exit(3)
    elif HOW == "endless_line":
        while True:
            os.write(1, b"x" * 65536)
    elif HOW == "closes_stdout":
        os.close(1)
        time.sleep(60)
    worker.serve(segment)


def segment(view: Any) -> Any:
    """Misbehave as the view's name says, else as the program's argument does."""
    return globals()[view.name if HOW == "as_told" else HOW](view)


def raises(view: Any) -> Any:
    raise RuntimeError("CUDA out of\nmemory")


def raises_a_novel(view: Any) -> Any:
    raise RuntimeError("\x1b[31m" + "word " * 100_000)


def exits(view: Any) -> Any:
    sys.exit(4)


def exits_hard(view: Any) -> Any:
    os._exit(5)


def crashes(view: Any) -> Any:
    os.kill(os.getpid(), signal.SIGSEGV)


def aborts(view: Any) -> Any:
    os.abort()


def is_killed(view: Any) -> Any:
    os.kill(os.getpid(), signal.SIGKILL)


def is_killed_once(view: Any) -> Any:
    """Another process finds the trace and works."""
    trace = Path(sys.argv[2])
    if trace.exists():
        return GOOD
    trace.touch()
    return is_killed(view)


def hangs(view: Any) -> Any:
    signal.signal(signal.SIGTERM, signal.SIG_IGN)
    time.sleep(60)


def stops(view: Any) -> Any:
    os.kill(os.getpid(), signal.SIGSTOP)


def spins(view: Any) -> Any:
    while True:
        pass


def leaves_a_child(view: Any) -> Any:
    """Die and leave a process that holds the pipes."""
    subprocess.Popen(["sleep", "60"])
    os._exit(6)


def eats_memory(view: Any) -> Any:
    kept = []
    while True:
        kept.append(np.ones(2**23, np.uint8))
        time.sleep(0.001)


def eats_memory_in_a_child(view: Any) -> Any:
    eat = "import time; kept = bytearray(2**29); kept[:] = bytes(2**29); time.sleep(60)"
    subprocess.run([sys.executable, "-c", eat])


def floods_stderr(view: Any) -> Any:
    while True:
        os.write(2, b"warning\n" * 8192)


def floods_stdout(view: Any) -> Any:
    while True:
        print("progress " * 8192)


def text(view: Any) -> Any:
    return "hair"


def number(view: Any) -> Any:
    return 5


def nothing(view: Any) -> Any:
    return None


def an_array(view: Any) -> Any:
    return GOOD["labels"]


def wrong_shape(view: Any) -> Any:
    return GOOD | {"labels": np.full((4, 4), 255, np.uint8)}


def wrong_values(view: Any) -> Any:
    return GOOD | {"labels": np.full(SHAPE, 7, np.uint8)}


def wrong_kind(view: Any) -> Any:
    return GOOD | {"labels": np.full(SHAPE, np.nan)}


def texts_for_numbers(view: Any) -> Any:
    return GOOD | {"labels": np.full(SHAPE, "hair")}


def field_missing(view: Any) -> Any:
    return {"person_known": False}


def field_misspelt(view: Any) -> Any:
    return GOOD | {"lables": 1}


def objects(view: Any) -> Any:
    return GOOD | {"labels": np.array([print])}


def generator(view: Any) -> Any:
    return (x for x in range(3))


def no_file(view: Any) -> Any:
    return _written(lambda folder: (folder / "result.npz").unlink())


def file_cut(view: Any) -> Any:
    return _written(lambda folder: os.truncate(folder / "result.npz", 2000))


def file_is_a_folder(view: Any) -> Any:
    return _written(lambda f: ((f / "result.npz").unlink(), (f / "result.npz").mkdir()))


def file_is_a_pipe(view: Any) -> Any:
    return _written(lambda f: ((f / "result.npz").unlink(), os.mkfifo(f / "result.npz")))


def folder_removed(view: Any) -> Any:
    import shutil

    return _written(shutil.rmtree)


def bomb(view: Any) -> Any:
    """A gigabyte of zeros, packed."""

    def write(folder: Path) -> None:
        with zipfile.ZipFile(folder / "result.npz", "w", zipfile.ZIP_DEFLATED) as archive:
            archive.writestr("result.labels.npy", bytes(2**24))

    return _written(write)


def pickle(view: Any) -> Any:
    return _written(lambda f: np.savez(f / "result.npz", **{"result.labels": np.array([{}])}))


def claims_too_much(view: Any) -> Any:
    """A header that asks for a terabyte."""

    def write(folder: Path) -> None:
        header = {"descr": "|u1", "fortran_order": False, "shape": (2**20, 2**20)}
        made = zipfile.ZipFile(folder / "result.npz", "w")
        with made as archive, archive.open("result.labels.npy", "w") as member:
            np.lib.format.write_array_header_1_0(member, header)

    return _written(write)


def text_is_no_json(view: Any) -> Any:
    return _written(lambda f: (f / "result.json").write_text('{"result": '))


def text_is_deep(view: Any) -> Any:
    return _written(lambda f: (f / "result.json").write_text(100_000 * "["))


def text_names_no_array(view: Any) -> Any:
    return _written(
        lambda f: (f / "result.json").write_text('{"result": {"labels": {"array": 3}}}')
    )


def _written(change: Any) -> Any:
    """Answer well, but change the files before hairkit is told."""
    write = worker.write_tree

    def spoil(tree: Any, text_path: Path, arrays_path: Path) -> None:
        write(tree, text_path, arrays_path)
        worker.write_tree = write  # the next answer is left as it is
        change(text_path.parent)

    worker.write_tree = spoil
    return GOOD


if __name__ == "__main__":
    main()
