"""`hairkit masks PHOTOS -o DIR`: the hair in single photos, as mask files to be painted over."""

from __future__ import annotations

import argparse
import sys
import tempfile
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from hairkit.cli.arguments import Add, add_shared, add_stage_settings
from hairkit.cli.written import print_written
from hairkit.errors import InputError

if TYPE_CHECKING:
    from hairkit.arrays import UInt8Array
    from hairkit.pipeline.single_photo import SeenPhoto

DESCRIPTION = """\
Example: hairkit masks photos/ -o masks/ --preview masks.jpg

Find the hair in photos, each by itself: one or many, of one head or of several. DIR gets a
NAME.png for each photo, of its size: 255 hair, 128 the rest of the person, 0 background. Paint over
them in any program, and put them beside the photos as masks/ of a capture."""
PREVIEW_HEIGHT = 400
"""Height of the photos in the preview, pixels."""


def add_arguments(add: Add) -> None:
    """Add the arguments."""
    add("photos", nargs="+", type=Path, metavar="PHOTOS", help="photos, or folders of photos")
    add("-o", "--output", type=Path, required=True, metavar="DIR", help="folder for the masks")
    add("--preview", type=Path, metavar="FILE", help="picture of photos and masks (.jpg, .png)")
    add_stage_settings(add)
    add_shared(add, "--plugin", "--quiet", "--json")


def run(args: argparse.Namespace) -> int:
    """Find the masks, write them, and print the files' names."""
    from hairkit.imaging.picture_file import write_picture
    from hairkit.io.capture_reader import read_view
    from hairkit.manager import Manager
    from hairkit.pipeline.recipe import load_recipe
    from hairkit.pipeline.single_photo import see_photo
    from hairkit.progress import progress_for
    from hairkit.stages import FACES, LABELS, PERSONS
    from hairkit.types.mask import HAIR

    photos, manager = _photos(args.photos), Manager.loaded(args.plugin)
    recipe = load_recipe(args.recipe).with_set(args.set).only(FACES, PERSONS, LABELS)
    recipe.check(manager)
    args.output.mkdir(parents=True, exist_ok=True)
    files, shown = [args.output / f"{photo.stem}.png" for photo in photos], []
    with (
        tempfile.TemporaryDirectory(prefix="hairkit-masks-") as work,
        progress_for(sys.stderr, quiet=args.quiet or args.json) as progress,
    ):
        for photo, file in zip(photos, files, strict=True):
            folder = Path(work) / photo.stem
            seen = see_photo(read_view(photo), folder, recipe, manager, strands=False)
            mask = _as_large_as_the_photo(seen)
            write_picture(file, mask)
            progress.message(f"{file}: {(mask == HAIR).mean():.1%} of the photo is hair")
            shown += [] if args.preview is None else [_beside(seen)]
    if args.preview is not None:
        write_picture(args.preview, np.concatenate(shown, axis=1))
        files.append(args.preview)
    print_written(args, *files)
    return 0


def _as_large_as_the_photo(seen: SeenPhoto) -> UInt8Array:
    from hairkit.io.framed_photos import on_photo

    view = seen.view
    mask = on_photo(seen.mask.labels, view.frame, view.photo_size)
    return np.rot90(mask, view.quarter_turns)


def _photos(given: list[Path]) -> list[Path]:
    """Return the photos that are named and those in folders that are; no two with one name."""
    from hairkit.io.capture_reader import photo_files

    photos = [photo for path in given for photo in (photo_files(path) if path.is_dir() else [path])]
    if not photos:
        raise InputError(f"{given[0]}: no photos in this folder")
    names = [photo.stem for photo in photos]
    for photo in photos:
        if not photo.is_file():
            raise InputError(f"{photo}: no such photo")
        if names.count(photo.stem) > 1:
            raise InputError(f"{photo}: two photos are called {photo.stem!r}; rename one")
    return photos


def _beside(seen: SeenPhoto) -> UInt8Array:
    """Return a photo above the same with its mask, (H, W, 3) RGB."""
    import cv2

    from hairkit.pipeline.contact_sheet import mask_picture

    view = seen.view
    size = (max(1, round(PREVIEW_HEIGHT * view.width / view.height)), PREVIEW_HEIGHT)
    small = np.asarray(cv2.resize(view.image, size, interpolation=cv2.INTER_AREA), np.uint8)
    return np.concatenate([small, mask_picture(small, seen.mask)])
