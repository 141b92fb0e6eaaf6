"""The .tfxbone beside a .tfx: the names of the joints, and which of them carry each strand."""

from __future__ import annotations

import struct

import numpy as np

from hairkit.io.byte_writer import join_bytes

JOINTS = ("root", "neck", "head")
"""Names of the joints of a groom's head, in its order."""

INFLUENCES = 4
STRAND = np.dtype([("strand", "<i4"), ("pairs", [("bone", "<i4"), ("weight", "<f4")], INFLUENCES)])


def bone_bytes(strands: int) -> memoryview:
    """Return the whole file: every strand is carried by the head alone."""
    names = struct.pack("<i", len(JOINTS))
    for index, name in enumerate(JOINTS):
        text = name.encode("ascii") + b"\0"
        names += struct.pack("<ii", index, len(text)) + text
    rows = np.zeros(strands, STRAND)
    rows["strand"] = np.arange(strands)
    rows["pairs"]["bone"][:, 0] = JOINTS.index("head")
    rows["pairs"]["weight"][:, 0] = 1.0
    head = names + struct.pack("<i", strands)
    return join_bytes([("u1", np.frombuffer(head, np.uint8)), (STRAND, rows)])
