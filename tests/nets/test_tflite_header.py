"""Laws of the header of a network: its input's shape, or one line of error."""

from __future__ import annotations

import contextlib
import struct
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from hairkit.errors import FormatError
from hairkit.nets.known_models import KNOWN_MODELS
from hairkit.nets.model_folder import find_model
from hairkit.nets.tflite_header import IDENTIFIER, read_input_shape

EDGES = {"face_detection_short_range": 128, "selfie_segmentation": 256}


def header(shape: tuple[int, ...]) -> bytes:
    """Return the least file whose network has an input of a shape."""
    return b"".join(
        [
            struct.pack("<I4s", 20, IDENTIFIER),
            struct.pack("<6H", 10, 8, 0, 0, 4, 0),  # 8: the model's field 2 lies 4 bytes in
            struct.pack("<iI", 12, 4),  # 20: the model; its subgraphs are 4 bytes on
            struct.pack("<II", 1, 16),  # 28: one subgraph, 16 bytes on
            struct.pack("<6H", 8, 12, 4, 8, 0, 0),  # 36: fields 0 and 1 of the subgraph
            struct.pack("<iII", 12, 8, 12),  # 48: the subgraph; its tensors and inputs
            struct.pack("<II", 1, 20),  # 60: one tensor, 20 bytes on
            struct.pack("<Ii", 1, 0),  # 68: one input, tensor 0
            struct.pack("<4H", 6, 8, 4, 0),  # 76: field 0 of the tensor
            struct.pack("<iI", 8, 4),  # 84: the tensor; its shape is 4 bytes on
            struct.pack(f"<I{len(shape)}i", len(shape), *shape),
        ]
    )


def test_the_shape_of_the_first_input_is_read(tmp_path: Path) -> None:
    """What the header says is what comes back."""
    path = tmp_path / "net.tflite"
    path.write_bytes(header((1, 192, 256, 3)))
    assert read_input_shape(path) == (1, 192, 256, 3)


@given(place=st.integers(0, 200), value=st.integers(0, 255), length=st.integers(0, 120))
def test_damage_is_a_shape_or_one_line(
    tmp_path_factory: pytest.TempPathFactory, place: int, value: int, length: int
) -> None:
    """A damaged byte or a file cut short never leads outside of the file."""
    data = bytearray(header((1, 192, 192, 3)))
    if place < len(data):
        data[place] = value
    path = tmp_path_factory.getbasetemp() / "damaged.tflite"
    path.write_bytes(data[: length or None])
    with contextlib.suppress(FormatError):
        assert 0 < len(read_input_shape(path)) <= 8


@pytest.mark.parametrize("content", [b"", b"PK\x03\x04", b"not a network at all"])
def test_other_files_are_refused(tmp_path: Path, content: bytes) -> None:
    """A file without the format's identifier is refused by name."""
    path = tmp_path / "hair.tflite"
    path.write_bytes(content)
    with pytest.raises(FormatError, match=r"hair\.tflite: no TensorFlow Lite file"):
        read_input_shape(path)


@pytest.mark.parametrize("name", EDGES)
def test_known_networks_want_squares(name: str) -> None:
    """Real files of the format are read."""
    path = find_model(name)
    if path is None:
        pytest.skip(f"the network {name} is not installed: hairkit models install")
    assert read_input_shape(path) == (1, EDGES[name], EDGES[name], 3)
    assert name in {model.name for model in KNOWN_MODELS}
