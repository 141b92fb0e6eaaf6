"""Print how far the parting that is found lies from the true one.

python benchmarks/parting.py captures/

The true parting is the x from which most true strands of the crown go to their own side. It is
compared with that of the level views, and, where a capture has a folder `above/` with one more
photo, with that of all. Masks are the capture's own; cameras and head are fitted to them. Captures
whose photos do not tell their views are left out.
"""

from __future__ import annotations

import argparse
import tempfile
from pathlib import Path

import numpy as np
from captures_argument import NO_CAPTURES, add_captures
from hairkit_plugins import mask_files, silhouette, thin_plate

from hairkit import Mask
from hairkit.arrays import Float64Array
from hairkit.evaluation import Truth, read_truth
from hairkit.evaluation.align import align
from hairkit.field.find_parting import parting_from_skin
from hairkit.head_model.template import default_head
from hairkit.io.capture_reader import read_capture
from hairkit.types.parting import Parting

CROWN = 0.045
"""Height of the crown below the top of the head, metres."""
FIRST_WAY = 0.015
"""Metres from the root after which a strand shows to which side it is combed."""
FRONT, BACK = 0.07, -0.03
"""Ends of a parting along z, metres, in which its sides are counted."""
SURE_SIDES = 0.9
"""Share of the crown's strands that must go to their own side where there is a parting."""


def main() -> None:
    """Find the parting of every capture that has truth and masks."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    add_captures(parser)
    arguments = parser.parse_args()
    if arguments.captures is None:
        print(NO_CAPTURES)
        return
    print("| capture | true x, mm | level views | skin's width | with a photo from above | width |")
    print("|---|---|---|---|---|---|")
    for folder in sorted(path.parent for path in arguments.captures.glob("*/truth")):
        if all(view.named for view in read_capture(folder).views):
            print(_row(folder))


def _row(folder: Path) -> str:
    truth = read_truth(folder / "truth")
    wanted = true_parting(truth)
    cells = [folder.name, "none" if wanted is None else f"{1000 * wanted:.0f}"]
    cells += _found(folder, truth)
    if (folder / "above").is_dir():
        with tempfile.TemporaryDirectory() as joined:
            _join(folder, Path(joined))
            cells += _found(Path(joined), truth)
    else:
        cells += ["-", "-"]
    return f"| {' | '.join(cells)} |"


def _join(folder: Path, joined: Path) -> None:
    """Link the photos and masks of a capture and those from above into one folder."""
    for part in ("photos", "masks"):
        (joined / part).mkdir()
        for source in (folder / part, folder / "above" / part):
            for file in source.iterdir():
                (joined / part / file.name).symlink_to(file.resolve())
    if (folder / "landmarks.json").exists():
        (joined / "landmarks.json").symlink_to((folder / "landmarks.json").resolve())


def _found(folder: Path, truth: Truth) -> list[str]:
    """Return the parting found, in the truth's frame, and the width of its skin."""
    capture = read_capture(folder)
    masks = tuple(_mask(mask_files.segment(view)) for view in capture.views)
    head = default_head()
    scene = silhouette.estimate_scene(capture, masks, head, None, silhouette.Options())
    bent = thin_plate.fit_head(capture, masks, scene, thin_plate.Options()).head
    level = [k for k, name in enumerate(scene.names) if name in truth.names]
    cameras = [scene.cameras[k] for k in level]
    similarity = align(cameras, truth.cameras, head.vertices)
    parting = parting_from_skin(masks, scene.cameras, bent)
    if not parting.seen:
        return ["none", "-"]
    return [f"{1000 * _place(parting, similarity.apply):.1f}", f"{1000 * parting.spread:.0f}"]


def _mask(mask: Mask | None) -> Mask:
    if mask is None:
        raise SystemExit("the capture has no masks")
    return mask


def _place(parting: Parting, apply: object) -> float:
    """Return x in the truth's frame of the parting above the head's middle, metres."""
    assert callable(apply)
    return float(apply(np.array([[parting.x, 0.1, 0.0]]))[0, 0])


def true_parting(truth: Truth) -> float | None:
    """Return x of the parting, metres, or None where strands do not part."""
    strands = truth.strands
    roots, ways = strands.roots.astype(np.float64), strands.resampled_by_length(FIRST_WAY)
    moved = ways.points[np.minimum(ways.offsets[:-1] + 1, ways.offsets[1:] - 1)] - roots
    top = truth.head.vertices[:, 1].max()
    chosen = (roots[:, 1] > top - CROWN) & (roots[:, 2] < FRONT) & (roots[:, 2] > BACK)
    if not chosen.any():
        return None
    places: Float64Array = np.linspace(-0.06, 0.06, 121)
    right = np.sign(moved[chosen, :1]) == np.sign(roots[chosen, :1] - places)
    best = int(right.mean(axis=0).argmax())
    return float(places[best]) if right[:, best].mean() > SURE_SIDES else None


if __name__ == "__main__":
    main()
