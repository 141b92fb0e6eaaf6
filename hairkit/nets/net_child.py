"""The program that loads and runs networks, asked by `NetProcess`.

It may die of a bad model file without harm. Asked `{"do": "run", "model": PATH, "folder": FOLDER}`
it takes the pictures (N, H, W, C) of `batch.npz` in that folder, and writes `outputs.npz` there:
the outputs for that batch, "0" the largest.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from hairkit import worker


def run(question: dict[str, Any], _tell: Callable[[Any], None]) -> dict[str, Any]:
    """Write the outputs of a network for each item of a batch, stacked, by size."""
    folder, net, results = Path(question["folder"]), _load(question["model"]), []
    for item in worker.map_arrays(folder / "batch.npz")["batch"]:
        net.setInput(np.ascontiguousarray(item.transpose(2, 0, 1)[None]))
        outputs = net.forward(net.getUnconnectedOutLayersNames())
        results.append(sorted((np.array(o) for o in outputs), key=lambda output: -output.size))
    stacked = [np.concatenate(outputs) for outputs in zip(*results, strict=True)]
    worker.write_arrays(folder / "outputs.npz", {str(i): o for i, o in enumerate(stacked)})
    return {}


@cache
def _load(model: str) -> Any:
    """Load a file by OpenCV's classic engine: the new one of OpenCV 5 drops all outputs but one."""
    import cv2

    engine = [cv2.dnn.ENGINE_CLASSIC] if hasattr(cv2.dnn, "ENGINE_CLASSIC") else []
    return cv2.dnn.readNetFromTFLite(model, *engine)


if __name__ == "__main__":
    worker.answer_questions({"run": run})
