"""Masks and scene: masks show where the cameras are, and these where hair can be.

Masks of single views give a first scene; the head that it places in every view mends the masks, and
the scene is found again from them.
"""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import Future

from hairkit.pipeline.single_photo import given_photo
from hairkit.pipeline.stage_runner import Given, StageRunner, completed
from hairkit.pipeline.work_folder import digest_of
from hairkit.types.capture import Capture
from hairkit.types.head import Head
from hairkit.types.mask import Mask, Masks
from hairkit.types.scene import Scene


def label_views(
    run: StageRunner, photos: Given[Capture], head: Head
) -> tuple[list[Future[Given[Mask]]], Given[Scene] | None]:
    """Return the masks of all views, mended by the head where they were not given.

    Then the scene by which they were mended, if they were.
    """
    views = photos.value.views
    masks = run.every_view("segment", Mask, [given_photo(view) for view in views])
    if run.has("refine") and not all(view.mask_path for view in views):
        return _refine(run, photos, masks, Given.of(head))
    return masks, None


def fit_scene(
    run: StageRunner,
    photos: Given[Capture],
    masks: Sequence[Future[Given[Mask]]],
    head: Head,
    start: Given[Scene] | None,
) -> Given[Scene]:
    """Return the cameras, found from those of `start`, and the head fitted to the photos."""
    scene = run.once(
        "scene", Scene, capture=photos, masks=masks, head=Given.of(head),
        start=start or Given.of(None),
    )  # fmt: skip
    if run.has("head"):
        return run.once("head", Scene, capture=photos, masks=masks, scene=scene)
    return scene


def _refine(
    run: StageRunner,
    photos: Given[Capture],
    masks: Sequence[Future[Given[Mask]]],
    head: Given[Head],
) -> tuple[list[Future[Given[Mask]]], Given[Scene]]:
    """Return the masks after a first scene has shown where the head is in every view, and it.

    Views that came with a mask keep it.
    """
    nothing = Given.of(None)
    scene = run.once(
        "scene", Scene, "first_scene", capture=photos, masks=masks, head=head, start=nothing
    )
    refined = run.once("refine", Masks, capture=photos, masks=masks, scene=scene)
    mended = [
        mask if view.mask_path else _mended(mask, new)
        for view, mask, new in zip(photos.value.views, masks, refined.value.views, strict=True)
    ]
    return mended, scene


def _mended(mask: Future[Given[Mask]], new: Mask) -> Future[Given[Mask]]:
    """Return a view's mask as it came where mending left it alone: what was made of it holds."""
    same = digest_of(mask.result().value) == digest_of(new)
    return mask if same else completed(Given.of(new))
