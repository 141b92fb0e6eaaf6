"""The head placed by hand: the pose in `capture.toml`, with cameras exactly on the nominal turn."""

from __future__ import annotations

from hairkit import Capture, Head, Mask, Scene, hookimpl
from hairkit.cameras.similarity import move_head
from hairkit.cameras.turntable import NominalOptions, nominal_cameras
from hairkit.errors import InputError


@hookimpl
def estimate_scene(
    capture: Capture, masks: tuple[Mask, ...], head: Head, options: NominalOptions
) -> Scene:
    """Return the nominal turn seen from the head; `InputError` when the capture gives no pose."""
    if capture.head_pose is None:
        raise InputError(
            "the capture gives no head pose for the plugin 'manual';"
            " add [head] to capture.toml or use the plugin 'silhouette'"
        )
    names = tuple(view.name for view in capture.views)
    return move_head(Scene(names, nominal_cameras(capture, options), head), capture.head_pose)
