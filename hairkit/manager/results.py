"""Checks of the results of plugins: each has the type of its stage, and fits the arguments.

The types check their own arrays when they are made (shapes, ranges, finiteness). Here is what only
the stage knows: that a mask has its photo's size, that strand s starts at root s.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from hairkit.errors import DataError
from hairkit.stages import OF_HOOK
from hairkit.storage import file_state
from hairkit.types.capture import Capture
from hairkit.types.groom import Groom
from hairkit.types.mask import Masks
from hairkit.types.scene import Scene
from hairkit.types.skin import Texture
from hairkit.types.strands import Strands
from hairkit.types.turnaround import Turnaround
from hairkit.types.volume import OrientationField, VoxelGrid

ROOT_TOLERANCE = 1e-3
"""Metres that a strand may start from its root."""
CLOCK_STEP_S = 2.0
"""Coarsest time stamps of files (FAT): two writes closer than this may carry the same one."""


@dataclass(frozen=True)
class Call:
    """A stage's call: its arguments, and the state before it."""

    arguments: Mapping[str, Any]
    before: tuple[int, int, int] | None
    """Inode, size and time of the file that an export will replace; None where there is none."""
    fresh: bool
    """Whether it is too new for its time to tell whether it was replaced."""

    @classmethod
    def of(cls, arguments: Mapping[str, Any]) -> Call:
        """Return the call that is about to be made."""
        path = arguments.get("path")
        state = None if path is None else file_state(path)
        fresh = state is not None and time.time() - state[2] / 1e9 < CLOCK_STEP_S
        return cls(arguments, state, fresh)

    def remove_half_file(self) -> None:
        """Remove what an export that failed has left under the name of its file, not an old one."""
        path = self.arguments["path"]
        if path.is_file() and file_state(path) != self.before:
            path.unlink()


def check_result(hook: str, result: object, call: Call) -> None:
    """Raise `DataError` when a plugin's result is not what the stage asks for."""
    kind = OF_HOOK[hook].makes
    if not isinstance(result, kind):
        raise DataError(f"returned {type(result).__name__}, expected {kind.__name__}")
    for check in CHECKS.get(hook, ()):
        check(result, call)


def _photos_are_scaled(capture: Capture, call: Call) -> None:
    most = call.arguments["max_edge"]
    for view in capture.views:
        if max(view.width, view.height) > most:
            raise DataError(
                f"photo {view.name!r} has {view.width} x {view.height} pixels, expected a long"
                f" edge of at most {most}"
            )


def _views_have_names_of_their_own(capture: Capture, call: Call) -> None:
    names = [view.name for view in capture.views]
    twice = next((name for name in names if names.count(name) > 1), None)
    if twice is not None:
        raise DataError(f"two views have the name {twice!r}, expected each its own")


def _has_photo_size(what: str, field: str) -> Check:
    """Return the check that a picture of a result is as large as the photo."""

    def check(result: Any, call: Call) -> None:
        _check_size(what, getattr(result, field).shape, call.arguments["view"])

    return check


def _turn_has_each_photo(turn: Turnaround, call: Call) -> None:
    count = len(call.arguments["capture"].views)
    if len(turn.names) != count:
        raise DataError(f"the turn has {len(turn.names)} photos, expected {count}")


def _masks_have_photo_sizes(masks: Masks, call: Call) -> None:
    views = call.arguments["capture"].views
    if len(masks.views) != len(views):
        raise DataError(f"{len(masks.views)} masks, expected one for each of {len(views)} views")
    for view, mask in zip(views, masks.views, strict=True):
        _check_size(f"mask of view {view.name!r}", mask.labels.shape, view)


def _check_size(what: str, shape: tuple[int, ...], view: Any) -> None:
    if shape != (view.height, view.width):
        raise DataError(
            f"the {what} has {shape[1]} x {shape[0]} pixels,"
            f" expected {view.width} x {view.height}, as the photo has"
        )


def _scene_has_a_camera_per_photo(scene: Scene, call: Call) -> None:
    views = call.arguments["capture"].views
    names = tuple(view.name for view in views)
    if scene.names != names:
        raise DataError(
            f"the scene has the views {', '.join(scene.names)}, expected {', '.join(names)}"
        )
    for view, camera in zip(views, scene.cameras, strict=True):
        _check_size(f"camera of view {view.name!r}", (camera.height, camera.width), view)


def _head_keeps_its_mesh(scene: Scene, call: Call) -> None:
    old, new = call.arguments["scene"].head, scene.head
    for name in ("faces", "uv"):
        if not np.array_equal(getattr(old, name), getattr(new, name)):
            raise DataError(f"head {name} changed, expected those of the head that came in")


def _texture_keeps_its_shape(texture: Texture, call: Call) -> None:
    height, width = call.arguments["texture"].pixels.shape[:2]
    found = texture.pixels.shape[:2]
    factor = max(found[0] // height, 1)
    if found != (factor * height, factor * width):
        raise DataError(
            f"the texture has {found[1]} x {found[0]} pixels,"
            f" expected {width} x {height} or a multiple of it"
        )


def _field_is_on_the_hull(field: OrientationField, call: Call) -> None:
    found, wanted = field.grid, call.arguments["hull"].grid
    if (found.shape, found.spacing, *found.origin) != (
        wanted.shape,
        wanted.spacing,
        *wanted.origin,
    ):
        raise DataError(f"the field has {_words(found)}, expected the hull's {_words(wanted)}")


def _words(grid: VoxelGrid) -> str:
    size, origin = " x ".join(map(str, grid.shape)), ", ".join(f"{x:.4g}" for x in grid.origin)
    return f"{size} cells of {grid.spacing:.4g} m from ({origin})"


def _groom_has_hair_on_its_head(groom: Groom, call: Call) -> None:
    from hairkit.head_model.scalp import evaluate  # not needed by most commands

    if not len(groom.strands):
        raise DataError("no strand is left, expected hair")
    if not np.array_equal(groom.head.faces, call.arguments["groom"].head.faces):
        raise DataError("the head has other faces, expected those of the head that came in")
    places = evaluate(groom.head, groom.root_triangle, groom.root_barycentric)
    if np.abs(groom.strands.roots - places).max(initial=0.0) > ROOT_TOLERANCE:
        raise DataError("a strand does not begin at the place of the head that bears its root")


def _a_strand_starts_at_each_root(strands: Strands, call: Call) -> None:
    roots = call.arguments["roots"]
    if len(strands) != len(roots):
        raise DataError(
            f"{len(strands)} strands for {len(roots)} roots, expected one for each, in their order"
        )
    gap = np.linalg.norm(strands.roots - roots.positions, axis=1)
    if gap.max(initial=0.0) > ROOT_TOLERANCE:
        worst = int(gap.argmax())
        raise DataError(
            f"strand {worst} starts {1000 * gap[worst]:.3g} mm from its root,"
            f" expected at most {1000 * ROOT_TOLERANCE:.3g} mm"
        )


def _is_a_simulator(simulator: Any, call: Call) -> None:
    from hairkit.simulation.simulator import Simulator  # not needed by most commands

    kind = type(simulator).__name__
    members = {name: value for name, value in vars(Simulator).items() if name[0] != "_"}
    missing = [name for name in members if not hasattr(simulator, name)]
    if missing:
        raise DataError(
            f"{kind} has no {', '.join(missing)}; expected the members of"
            " hairkit.simulation.Simulator"
        )
    for name, value in members.items():
        if not isinstance(value, property) and not callable(getattr(simulator, name)):
            raise DataError(f"{kind}.{name} is not a method, expected one")
    if not isinstance(simulator.strands, Strands):
        raise DataError(f"{kind}.strands is {type(simulator.strands).__name__}, expected Strands")
    check_points(simulator, simulator.points)
    if not np.isfinite(simulator.time):
        raise DataError(f"{kind}.time is {simulator.time}, expected seconds")


def check_points(simulator: Any, points: Any) -> None:
    """Raise `DataError` unless a simulator's points are finite and as many as its strands have."""
    kind, wanted = type(simulator).__name__, simulator.strands.points.shape
    if np.shape(points) != wanted:
        raise DataError(f"{kind}.points has shape {np.shape(points)}, expected {wanted}")
    if not np.isfinite(points).all():
        raise DataError(f"{kind}.points holds numbers that are not finite")


def _wrote_the_file(written: bool, call: Call) -> None:
    path = call.arguments["path"]
    if not written:
        raise DataError("returned False, expected True after the file is written")
    if not path.is_file():
        raise DataError("no file was written")
    if not path.stat().st_size:
        raise DataError("the file that was written is empty")
    if call.before is not None and not call.fresh and file_state(path) == call.before:
        raise DataError("nothing was written; the file there is an older one")


Check = Callable[[Any, Call], None]

CHECKS: dict[str, tuple[Check, ...]] = {
    "capture": (_photos_are_scaled, _views_have_names_of_their_own),
    "segment_person": (_has_photo_size("person", "alpha"),),
    "find_turn": (_turn_has_each_photo,),
    "segment": (_has_photo_size("mask", "labels"),),
    "estimate_scene": (_scene_has_a_camera_per_photo,),
    "refine_masks": (_masks_have_photo_sizes,),
    "fit_head": (_scene_has_a_camera_per_photo, _head_keeps_its_mesh),
    "enhance_texture": (_texture_keeps_its_shape,),
    "orient": (_has_photo_size("orientation map", "angle"),),
    "solve_field": (_field_is_on_the_hull,),
    "track": (_a_strand_starts_at_each_root,),
    "edit_groom": (_groom_has_hair_on_its_head,),
    "make_simulator": (_is_a_simulator,),
    "export_groom": (_wrote_the_file,),
}
"""What holds of the result of a stage hook besides its type."""
