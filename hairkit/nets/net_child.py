"""The program that loads and runs networks, asked by `NetProcess`.

It may die of a bad model file without harm. Asked `{"do": "shape", "model": PATH}` it answers the
shape of the network's input. Asked `{"do": "run", "model": PATH, "folder": FOLDER}` it takes the
pictures (N, H, W, C) of `batch.npz` in that folder, and writes `outputs.npz` there: the outputs for
that batch, "0" the largest.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from hairkit import worker


def shape(question: dict[str, Any], _tell: Callable[[Any], None]) -> list[int]:
    """Return the shape of a network's first input, usually (1, height, width, channels)."""
    sizes: list[int] = _load(question["model"]).get_input_details()[0]["shape"].tolist()
    return sizes


def run(question: dict[str, Any], _tell: Callable[[Any], None]) -> dict[str, Any]:
    """Write the outputs of a network for each item of a batch, stacked, by size."""
    folder, net, results = Path(question["folder"]), _load(question["model"]), []
    for item in worker.map_arrays(folder / "batch.npz")["batch"]:
        net.set_tensor(net.get_input_details()[0]["index"], item[None])
        net.invoke()
        outputs = [net.get_tensor(output["index"]) for output in net.get_output_details()]
        results.append(sorted(outputs, key=lambda output: -output.size))
    stacked = [np.concatenate(outputs) for outputs in zip(*results, strict=True)]
    worker.write_arrays(folder / "outputs.npz", {str(i): o for i, o in enumerate(stacked)})
    return {}


@cache
def _load(model: str) -> Any:
    from ai_edge_litert.interpreter import Interpreter

    net = Interpreter(model)
    net.allocate_tensors()
    return net


if __name__ == "__main__":
    worker.answer_questions({"shape": shape, "run": run})
