"""Damaged USD files, read one in a process each: `python tests/plugins/usd/fuzzing.py 3000`.

Prints one line of JSON for each kind of file: how many gave a groom (`read`), one clear error
(`refused`), a crash or stand-still of the USD library, which the plugin's own process keeps away
from hairkit (`crashed`, `stuck`), or any other exception (`broken`, which should be 0).
"""

from __future__ import annotations

import collections
import json
import logging
import os
import resource
import signal
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np
from hairkit_plugins import usd
from hairkit_plugins.usd import guarded, reading_child

from hairkit.errors import HairkitError
from hairkit.storage import read_npz
from hairkit.testing import bristle_groom

PATIENCE = 30.0
"""Seconds for one file."""
_ENDINGS = {0: "read", 3: "refused", 4: "broken"}
_WORDS = (0, 2**64 - 1, 2**31, 2**63, 2**62, 2**32 - 1, 2**16)


def main() -> None:
    """Fuzz .usdc and .usda with as many damaged files each as the command line says."""
    count = int(sys.argv[1])
    logging.disable(logging.WARNING)
    for suffix in (".usdc", ".usda"):
        with tempfile.TemporaryDirectory() as folder:
            whole = Path(folder) / f"whole{suffix}"
            usd.export_groom(bristle_groom(), whole, usd.Options())
            usd.import_groom(whole, usd.Options())
            data = whole.read_bytes()
            found: collections.Counter[str] = collections.Counter()
            for seed in range(count):
                found[_outcome(damaged(data, seed), Path(folder) / f"damaged{suffix}")] += 1
        print(json.dumps({"suffix": suffix, "files": count} | dict(sorted(found.items()))))


def damaged(data: bytes, seed: int) -> bytes:
    """Return the bytes cut short, overwritten, with a piece missing or added, or a lying count."""
    generator = np.random.default_rng(seed)
    result = bytearray(data)
    at, size = int(generator.integers(len(data) - 8)), int(generator.integers(1, 64))
    kind = seed % 6
    if kind == 0:
        return data[:at]
    if kind == 1:
        for place in generator.integers(len(data), size=min(size, 8)):
            result[place] = generator.integers(256)
    elif kind == 2:
        result[at : at + 8] = _WORDS[size % len(_WORDS)].to_bytes(8, "little")
    elif kind == 3:
        del result[at : at + size]
    elif kind == 4:
        result[at:at] = generator.bytes(size)
    else:  # the start, and the tables at the end, where a crate file has its structure
        table = int(generator.integers(96))
        last = len(data) - 1 - int(generator.integers(min(4096, len(data))))
        result[table if seed % 4 else last] = generator.integers(256)
    return bytes(result)


def _outcome(data: bytes, path: Path) -> str:
    path.write_bytes(data)
    start = time.monotonic()
    child = os.fork()
    if not child:
        _read(path)
    while True:
        ended, status = os.waitpid(child, os.WNOHANG)
        if ended:
            break
        if time.monotonic() - start > PATIENCE:
            os.kill(child, signal.SIGKILL)
            os.waitpid(child, 0)
            return "stuck"
        time.sleep(0.001)
    return "crashed" if os.WIFSIGNALED(status) else _ENDINGS.get(os.WEXITSTATUS(status), "broken")


def _read(path: Path) -> None:
    """Read the file in this process and end it with what came of that."""
    silent = os.open(os.devnull, os.O_WRONLY)
    os.dup2(silent, 2)
    resource.setrlimit(resource.RLIMIT_AS, (guarded.MEMORY, guarded.MEMORY))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    code = 4
    try:
        guarded.ask_for_arrays = _read_here
        usd.import_groom(path, usd.Options())
        code = 0
    except HairkitError as error:
        code = 3 if "\n" not in str(error) else 4
    finally:
        os._exit(code)


def _read_here(program: Path, question: dict[str, str], *limits: object) -> tuple[Any, Any]:
    target = Path(question["source"]).with_suffix(".npz")
    answer = reading_child.read(question["source"], str(target))
    return answer, {} if answer else read_npz(target)


if __name__ == "__main__":
    main()
