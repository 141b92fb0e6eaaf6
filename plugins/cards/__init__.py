"""Hair cards: strips of triangles with strands on an atlas, four levels of detail, bones, VRM 1.0.

Strands are sorted into locks (k-means), each lock gets a strip along its middle, and its strands
are drawn onto it. `.cards.glb` has a scene a level, `.cards.obj` a file a level; all maps lie
beside them as PNG. `bones` adds chains of joints, with which cards are skinned. `.vrm` is a VRM 1.0
avatar of the head and its hair, whose chains swing (`VRMC_springBone`) around the head's capsules.

* `bones`: chains of bones and weights
* `build`: levels and atlas of a groom
* `locks`: strands sorted into locks
* `maps`: the atlas as PNG files
* `obj`: Wavefront OBJ files
* `options`: settings of cards
* `packing`: places in the atlas
* `painting`: strands drawn onto cards
* `scene`: glTF documents
* `strips`: the cards' geometry
* `vrm`: the skeleton and extensions of VRM 1.0
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from hairkit.grooming.prepare_export import prepare_export
from hairkit.hookspecs import hookimpl
from hairkit.io.file_format import Feature, FileFormat
from hairkit.storage import write_bytes
from hairkit.types.groom import Groom

from .options import Options

if TYPE_CHECKING:
    from .build import CardSet

FORMAT = FileFormat(
    "Hair cards",
    (".cards.glb", ".cards.obj", ".vrm"),
    written={
        Feature.HEAD, Feature.MAPS, Feature.SKIN, Feature.CAPSULES, Feature.COLOUR,
        Feature.COLOURS,
        Feature.PHYSICS,
    },
)  # fmt: skip
DEFAULT_CHAINS = 40
"""Chains of a .vrm file where the option leaves it open."""


@hookimpl
def export_groom(groom: Groom, path: Path, options: Options) -> bool:
    """Write the groom's cards as .cards.glb, .cards.obj or .vrm, with the maps beside them."""
    from .build import build_cards

    ready = prepare_export(groom, options).groom
    vrm = path.suffix.lower() == ".vrm"
    if vrm:
        from .vrm import raise_groom, stand_up

        ready = raise_groom(ready, stand_up(ready))
    cards = build_cards(ready, options)
    stem = path.name.split(".")[0]
    if path.suffix.lower() == ".obj":
        from .obj import write_objs

        write_objs(path, stem, cards)
    else:
        _write_gltf(path, ready, cards, options, vrm)
    for name, picture in cards.maps.items():
        write_bytes(path.with_name(f"{stem}.{name}.png"), picture)
    return True


def _write_gltf(path: Path, groom: Groom, cards: CardSet, options: Options, vrm: bool) -> None:
    from .bones import find_chains
    from .scene import Scenes, plain_skeleton
    from .vrm import extensions, human_skeleton

    count = options.bones or (DEFAULT_CHAINS if vrm else 0)
    chains = find_chains(groom, cards, count) if count else None
    scenes = Scenes(groom, cards, chains, options.alpha)
    document = scenes.document
    if vrm and chains is not None:
        skeleton = human_skeleton(groom, chains)
        nodes = scenes.level(0, skeleton, head=options.head_mesh)
        found = extensions(groom, chains, skeleton, nodes, path.stem, options.author)
        document.json["extensions"] = found
        document.json["extensionsUsed"] = sorted(found)
    else:
        for number in range(len(cards.levels)):
            scenes.level(number, plain_skeleton(groom, chains), head=options.head_mesh)
    document.write(path)
