"""Cards as Wavefront OBJ: one file a level, one material that names the maps."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from hairkit.storage import write_bytes

from .build import CardSet, Level

MATERIAL = """\
newmtl hair
Kd 1 1 1
Ks 0 0 0
illum 1
map_Kd {stem}.albedo.png
map_d {stem}.alpha.png
norm {stem}.normal.png
"""


def write_objs(path: Path, stem: str, cards: CardSet) -> None:
    """Write the finest level to `path`, the others to STEM_LOD1.cards.obj and so on, in metres."""
    for number, level in enumerate(cards.levels):
        name = path if number == 0 else path.with_name(f"{stem}_LOD{number}.cards.obj")
        write_bytes(name, _encoded(_text(level, number, stem)))
    write_bytes(path.with_name(f"{stem}.mtl"), _encoded(MATERIAL.format(stem=stem)))


def _encoded(text: str) -> bytes:
    """Return UTF-8, and names of files that are not as the system has them."""
    return text.encode(errors="surrogateescape")


def _text(level: Level, number: int, stem: str) -> str:
    lines = ["# metres, +Y up, +Z out of the face", f"mtllib {stem}.mtl", f"o cards_LOD{number}"]
    lines += ["v {:.6g} {:.6g} {:.6g}".format(*row) for row in level.vertices.tolist()]
    # OBJ counts v from the bottom of the picture
    uv = np.stack([level.uv[:, 0], 1 - level.uv[:, 1]], axis=1)
    lines += ["vt {:.6g} {:.6g}".format(*row) for row in uv.tolist()]
    lines += ["vn {:.4g} {:.4g} {:.4g}".format(*row) for row in level.normals.tolist()]
    lines.append("usemtl hair")
    lines += [
        "f {0}/{0}/{0} {1}/{1}/{1} {2}/{2}/{2}".format(*r) for r in (level.faces + 1).tolist()
    ]
    return "\n".join(lines) + "\n"
