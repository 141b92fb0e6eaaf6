"""Answers calls: a line of JSON in, a line of JSON out, arrays beside it in an npz file.

Runs in the Python that has Blender; hairkit is not installed there.
"""

import importlib
import json
import os
import sys
import tempfile
import traceback


def main() -> None:
    """Answer until standard input ends."""
    folder = sys.argv[1]
    answers = os.fdopen(os.dup(1), "w")
    os.dup2(2, 1)  # Blender prints what it likes; the answers keep a stream of their own
    for line in sys.stdin:
        request = json.loads(line)
        try:
            answer = _answer(request, folder)
        except Exception:
            answer = {"error": traceback.format_exc()}
        print(json.dumps(answer), file=answers, flush=True)


def _answer(request: dict, folder: str) -> dict:
    import numpy as np

    module, name = request["function"].split(".")
    result = getattr(importlib.import_module(module), name)(**request["arguments"])
    arrays: dict = {}
    plain = _taken_apart(result, arrays)
    handle, path = tempfile.mkstemp(suffix=".npz", dir=folder)
    with os.fdopen(handle, "wb") as file:
        np.savez(file, **arrays)
    return {"result": plain, "arrays": path}


def _taken_apart(value: object, arrays: dict) -> object:
    """Return the value with `{"array": name}` where arrays were, and put these into `arrays`."""
    import numpy as np

    if isinstance(value, np.ndarray):
        arrays[name := f"a{len(arrays)}"] = value
        return {"array": name}
    if isinstance(value, dict):
        return {str(key): _taken_apart(item, arrays) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [_taken_apart(item, arrays) for item in value]
    return value


if __name__ == "__main__":
    main()
