"""The head placed by hand: the pose in `capture.toml`, with cameras exactly on the nominal turn."""

from __future__ import annotations

from dataclasses import dataclass

from hairkit import Capture, Head, Mask, Scene, hookimpl
from hairkit.cameras.similarity import move_head
from hairkit.cameras.turntable import Turn
from hairkit.errors import InputError
from hairkit.io.photos import focal_from_equivalent
from hairkit.options import option


@dataclass(frozen=True)
class Options:
    """Settings of the nominal cameras."""

    model: str = option(
        "perspective", choices=("orthographic", "perspective"), doc="Kind of the nominal cameras."
    )
    focal_equivalent: float = option(
        42.0, low=10, high=1000, unit="mm", doc="Without EXIF or capture.toml, full frame."
    )
    distance: float = option(
        0.7, low=0.1, high=20, doc="From the cameras to the turn's centre.", unit="m"
    )


@hookimpl
def estimate_scene(
    capture: Capture, masks: tuple[Mask, ...], head: Head, options: Options
) -> Scene:
    """Return the nominal turn seen from the head; `InputError` when the capture gives no pose."""
    if capture.head_pose is None:
        raise InputError(
            "the capture gives no head pose for the plugin 'manual';"
            " add [head] to capture.toml or use the plugin 'silhouette'"
        )
    view = capture.views[0]
    usual = focal_from_equivalent(options.focal_equivalent, *view.photo_size) / view.scale
    orthographic = options.model == "orthographic" or capture.orthographic
    perspective = 0.0 if orthographic else 1 / options.distance
    cameras = Turn.of(capture).nominal((view.focal_px or usual) / options.distance, perspective)
    names = tuple(view.name for view in capture.views)
    return move_head(Scene(names, tuple(cameras), head), capture.head_pose)
