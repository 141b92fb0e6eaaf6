"""The program that loads and runs networks; `NetProcess` starts it and speaks to it over pipes.

It uses nothing of hairkit, so that it starts fast, and may die of a bad model file without harm.
A message is the length of its JSON head (4 bytes, little-endian), the head, and the float32 arrays
whose shapes the head lists. Asked `{"model": path, "shapes": [[N, H, W, 3], ...]}` with one array,
it answers `{"shapes": [...]}` with the outputs for that batch, largest first, or `{"error": text}`.
"""

from __future__ import annotations

import json
import os
import signal
import struct
import sys
from typing import IO, Any

MEMORY_BYTES = 4 * 2**30
"""Address space of the process, OpenCV's 1 GiB included: a bad model cannot take the machine's."""


def read_message(stream: IO[bytes]) -> tuple[dict[str, Any], list[Any]] | None:
    """Return head and arrays of the next message, None at the end of the stream."""
    import numpy as np

    length = stream.read(4)
    if len(length) < 4:
        return None
    head = json.loads(_read(stream, struct.unpack("<I", length)[0]))
    arrays = []
    for shape in head.get("shapes", ()):
        data = _read(stream, 4 * int(np.prod(shape)))
        arrays.append(np.frombuffer(data, "<f4").reshape(shape))
    return head, arrays


def write_message(stream: IO[bytes], head: dict[str, Any], arrays: list[Any]) -> None:
    """Write a message; the shapes of its arrays are added to the head."""
    text = json.dumps({**head, "shapes": [array.shape for array in arrays]}).encode()
    stream.write(struct.pack("<I", len(text)) + text)
    for array in arrays:
        stream.write(array.astype("<f4", order="C").tobytes())
    stream.flush()


def _read(stream: IO[bytes], count: int) -> bytes:
    data = stream.read(count)
    if len(data) < count:
        raise EOFError("the pipe was closed within a message")
    return data


def serve(source: IO[bytes], sink: IO[bytes]) -> None:
    """Answer requests until the other side closes its end of the pipe."""
    nets: dict[str, Any] = {}
    while (message := read_message(source)) is not None:
        head, arrays = message
        try:
            outputs = _run(nets, head["model"], arrays[0])
        except Exception as error:  # what OpenCV says of a model is the answer
            write_message(sink, {"error": " ".join(str(error).split())}, [])
        else:
            write_message(sink, {}, outputs)


def _run(nets: dict[str, Any], model: str, batch: Any) -> list[Any]:
    """Return the outputs of a network for each item of a batch (N, H, W, C), stacked, by size."""
    import numpy as np

    if model not in nets:
        nets[model] = _load(model)
    net, results = nets[model], []
    for item in batch:
        net.setInput(np.ascontiguousarray(item.transpose(2, 0, 1)[None]))
        outputs = net.forward(net.getUnconnectedOutLayersNames())
        results.append(sorted((np.array(o) for o in outputs), key=lambda output: -output.size))
    return [np.concatenate(outputs) for outputs in zip(*results, strict=True)]


def _load(model: str) -> Any:
    """Load a file by OpenCV's classic engine: the new one of OpenCV 5 drops all outputs but one."""
    import cv2

    engine = [cv2.dnn.ENGINE_CLASSIC] if hasattr(cv2.dnn, "ENGINE_CLASSIC") else []
    return cv2.dnn.readNetFromTFLite(model, *engine)


def main() -> None:
    """Serve on the standard streams; what OpenCV prints goes nowhere."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is for the other side, which ends this
    if sys.platform != "win32":
        import resource

        resource.setrlimit(resource.RLIMIT_AS, (MEMORY_BYTES, MEMORY_BYTES))
    sink = os.fdopen(os.dup(sys.stdout.fileno()), "wb")
    os.dup2(sys.stderr.fileno(), sys.stdout.fileno())
    serve(sys.stdin.buffer, sink)


if __name__ == "__main__":
    main()
