"""Laws of what plugins return: right results pass, wrong ones are refused at once, with the place.

Every stage has its row in `WRONG`; a stage that is added without one fails here.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import ball_plugin
import numpy as np
import pytest
from answering_plugin import manager_answering
from swaying import Options as SwayingOptions
from swaying import Swaying

from hairkit.errors import InputError, PluginError, ResultError
from hairkit.stages import OF_HOOK
from hairkit.testing import stage_arguments
from hairkit.types.camera import Camera
from hairkit.types.capture import Capture, View
from hairkit.types.mask import Mask, Masks
from hairkit.types.orientation import OrientationMap
from hairkit.types.person import Person
from hairkit.types.scene import Scene
from hairkit.types.skin import SkinMaps, Texture
from hairkit.types.strands import Strands
from hairkit.types.turnaround import Turnaround
from hairkit.types.volume import Hull, VoxelGrid

Arguments = dict[str, Any]
OPTIONS = ball_plugin.Options()


def right(hook: str, given: Arguments) -> Any:
    """Return what the test plugin, or a simple simulator or importer, returns for a stage."""
    if hook == "make_simulator":
        return Swaying(given["groom"], SwayingOptions())
    if hook == "import_groom":
        return stage_arguments("make_simulator")["groom"]
    if hook == "fit_head":
        return given["scene"]
    if hook == "enhance_texture":
        return given["texture"]
    function = getattr(ball_plugin, hook)
    names = function.__code__.co_varnames[: function.__code__.co_argcount]
    return function(**{name: OPTIONS if name == "options" else given[name] for name in names})


def spoilt(array: Any, value: float) -> Any:
    """Return a copy with one number replaced."""
    copy = np.array(array)
    copy.flat[0] = value
    return copy


def angles(name: str, value: float) -> Callable[[Arguments], Any]:
    def make(given: Arguments) -> OrientationMap:
        good = right("orient", given)
        arrays = {"angle": good.angle, "confidence": good.confidence}
        return OrientationMap(**arrays | {name: spoilt(arrays[name], value)})

    return make


def scene(change: Callable[[Scene], Scene], hook: str) -> Callable[[Arguments], Any]:
    return lambda given: change(right(hook, given))


def small_cameras(found: Scene) -> Scene:
    cameras = [found.cameras[0].resized(48, 64), *found.cameras[1:]]
    return replace(found, cameras=tuple(cameras))


def turned_names(found: Scene) -> Scene:
    return replace(found, names=found.names[::-1])


def turned_faces(found: Scene) -> Scene:
    return replace(found, head=replace(found.head, faces=found.head.faces[:, ::-1]))


def nan_camera(found: Scene) -> Scene:
    camera = found.cameras[0]
    bad = Camera(
        spoilt(camera.camera_from_head, np.nan), camera.focal, camera.centre, camera.width,
        camera.height,
    )  # fmt: skip
    return replace(found, cameras=(bad, *found.cameras[1:]))


def field(**change: Any) -> Callable[[Arguments], Any]:
    def make(given: Arguments) -> Any:
        good = right("solve_field", given)
        parts = {name: of(getattr(good, name)) for name, of in change.items()}
        return replace(good, **parts)

    return make


def shifted(grid: VoxelGrid) -> VoxelGrid:
    return VoxelGrid(grid.origin + 0.01, grid.spacing, grid.shape)


def hull(**change: Any) -> Callable[[Arguments], Any]:
    def make(given: Arguments) -> Hull:
        good = right("build_hull", given)
        return replace(good, **{name: of(getattr(good, name)) for name, of in change.items()})

    return make


def strands(change: Callable[[Strands], Strands]) -> Callable[[Arguments], Any]:
    return lambda given: change(right("track", given))


def edited(**changes: Callable[[Any], Any]) -> Callable[[Arguments], Any]:
    return lambda given: replace(
        given["groom"], **{name: of(getattr(given["groom"], name)) for name, of in changes.items()}
    )


def simulator(**members: Any) -> Callable[[Arguments], Any]:
    def make(given: Arguments) -> Any:
        good = right("make_simulator", given)
        for name, value in members.items():
            setattr(good, name, value)
        return good

    return make


def writing(data: bytes | None, answer: bool = True) -> Callable[[Arguments], Any]:
    def make(given: Arguments) -> bool:
        if data is not None:
            given["path"].write_bytes(data)
        return answer

    return make


def imported(**change: Any) -> Callable[[Arguments], Any]:
    def make(given: Arguments) -> Any:
        good = right("import_groom", given)
        return replace(good, **{name: of(getattr(good, name)) for name, of in change.items()})

    return make


def turn(**change: Any) -> Callable[[Arguments], Any]:
    return lambda given: replace(right("find_turn", given), **change)


WRONG: dict[str, dict[str, Callable[[Arguments], Any]]] = {
    "capture": {
        "photo 'front' has 97 x 129 pixels, expected a long edge of at most 128": lambda _: Capture(
            (View("front", 0.0, np.zeros((129, 97, 3), np.uint8)),)
        ),
        "two views have the name 'front', expected each its own": lambda given: Capture(
            (right("capture", given).views[0],) * 2
        ),
        "a capture needs at least one view": lambda _: Capture(()),
    },
    "detect_landmarks": {
        "face presence is 2": lambda given: replace(right("detect_landmarks", given), presence=2),
        "face landmarks has shape": lambda given: replace(
            right("detect_landmarks", given), landmarks=np.zeros((5, 2))
        ),
    },
    "segment_person": {
        "the person has 5 x 4 pixels, expected 96 x 128": lambda _: Person(np.zeros((4, 5))),
    },
    "find_turn": {
        "turn order is": turn(order=np.zeros(8)),
        "turn elevation_deg is beyond": turn(elevation_deg=np.full(8, 91)),
        "turn names two photos alike": turn(names=("front",) * 8),
        "the turn has 1 photos, expected 8": lambda _: Turnaround(
            np.zeros(1), np.zeros(1), np.zeros(1), ("front",), 1.0, ""
        ),
    },
    "segment": {
        "the mask has 5 x 4 pixels, expected 96 x 128": lambda _: Mask(np.full((4, 5), 255), True),
        "mask holds the value 7": lambda _: Mask(np.full((128, 96), 7), True),
        "mask is empty": lambda _: Mask(np.zeros((128, 96)), True),
        "mask labels has shape": lambda _: Mask(np.full((128, 96, 3), 255), True),
    },
    "estimate_scene": {
        "camera of view 'front' has 48 x 64 pixels": scene(small_cameras, "estimate_scene"),
        "the scene has the views front-right, right": scene(turned_names, "estimate_scene"),
        "camera_from_head has 1 values that are not finite": scene(nan_camera, "estimate_scene"),
    },
    "refine_masks": {
        "7 masks, expected one for each of 8": lambda given: Masks(given["masks"][1:]),
        "the mask of view 'front' has 5 x 4": lambda given: Masks(
            (Mask(np.full((4, 5), 255), True), *given["masks"][1:])
        ),
    },
    "fit_head": {
        "camera of view 'front' has 48 x 64 pixels": scene(small_cameras, "fit_head"),
        "head faces changed": scene(turned_faces, "fit_head"),
    },
    "enhance_texture": {
        "the texture has 64 x 32 pixels, expected 64 x 64": lambda given: Texture.encode(
            given["texture"].pixels[:32]
        ),
        "the texture has 65 x 64 pixels": lambda given: Texture.encode(
            np.pad(given["texture"].pixels, ((0, 0), (0, 1), (0, 0)))
        ),
        "returned SkinMaps, expected Texture": lambda given: SkinMaps(given["texture"]),
    },
    "orient": {
        "angle has 1 values that are not finite": angles("angle", np.nan),
        "angles lie in": angles("angle", 3.2),
        "confidences lie in": angles("confidence", 1.5),
        "confidence has 1 values that are not finite": angles("confidence", np.inf),
        "the orientation map has 5 x 4 pixels, expected 96 x 128": lambda _: OrientationMap(
            np.zeros((4, 5)), np.zeros((4, 5))
        ),
    },
    "build_hull": {
        "hull head_distance has 1 values": hull(head_distance=lambda d: spoilt(d, np.nan)),
        "every dense cell must be a loose cell": hull(loose=np.zeros_like),
        "the hull is empty": hull(dense=np.zeros_like),
        "hull dense has shape": hull(dense=lambda d: d[1:]),
    },
    "solve_field": {
        "expected the hull's": field(grid=shifted),
        "field tensor has 1 values": field(tensor=lambda t: spoilt(t, np.nan)),
        "field confidence lies in": field(confidence=lambda c: spoilt(c, 1.5)),
        "field growth has 1 values": field(growth=lambda g: spoilt(g, -np.inf)),
    },
    "track": {
        "strands for": strands(lambda s: s.select(range(len(s) - 1))),
        "starts 50 mm from its root": strands(
            lambda s: replace(s, points=s.points + np.float32([0.05, 0, 0]))
        ),
        "strand points has 1 values": strands(
            lambda s: replace(s, points=spoilt(s.points, np.nan))
        ),
        "1 strands have fewer than two points": strands(
            lambda s: replace(s, offsets=np.r_[0, 0, s.offsets[2:]])
        ),
    },
    "edit_groom": {
        "no strand is left": edited(
            strands=lambda s: s.select([]),
            root_triangle=lambda t: t[:0],
            root_barycentric=lambda w: w[:0],
        ),
        "the head has other faces": edited(head=lambda h: replace(h, faces=h.faces[::-1])),
        "does not begin at the place": edited(
            strands=lambda s: replace(s, points=s.points + np.float32([0.05, 0, 0]))
        ),
    },
    "make_simulator": {
        "SimpleNamespace has no strands, options, time": lambda _: SimpleNamespace(),
        "Swaying.advance is not a method": simulator(advance=3),
        "Swaying.strands is int, expected Strands": simulator(strands=3),
        "Swaying.points has shape": simulator(points=np.zeros((2, 3))),
        "Swaying.time is nan": simulator(time=np.nan),
    },
    "export_groom": {
        "no file was written": writing(None),
        "the file that was written is empty": writing(b""),
        "returned False": writing(b"hair", answer=False),
    },
    "import_groom": {
        "strand points has 1 values": imported(
            strands=lambda s: replace(s, points=spoilt(s.points, np.nan))
        ),
        "root_triangle names faces": imported(root_triangle=lambda t: spoilt(t, -1)),
        "stiffness is nan, expected": imported(physics=lambda p: replace(p, stiffness=np.nan)),
        "width is inf, expected": imported(material=lambda m: replace(m, width=np.inf)),
        "root_colour has 3 values": imported(
            material=lambda m: replace(m, root_colour=np.full(3, np.nan))
        ),
    },
}
CASES = [(hook, reason) for hook, rows in WRONG.items() for reason in rows]


def test_every_stage_has_wrong_results_here() -> None:
    """A stage that is added to the contract is tested, too."""
    assert list(WRONG) == list(OF_HOOK)


@pytest.mark.parametrize("hook", OF_HOOK)
def test_a_right_result_passes(hook: str, tmp_path: Path) -> None:
    """The checks refuse nothing that a correct plugin returns."""
    manager = manager_answering(hook, lambda given: right(hook, given))
    assert manager.call(hook, "odd", **stage_arguments(hook, tmp_path)) is not None


@pytest.mark.parametrize(("hook", "reason"), CASES)
def test_a_wrong_result_names_plugin_stage_and_view(hook: str, reason: str, tmp_path: Path) -> None:
    """The error comes at once: plugin, distribution, stage, view or file, what was found."""
    arguments = stage_arguments(hook, tmp_path)
    with pytest.raises(ResultError) as caught:
        manager_answering(hook, WRONG[hook][reason]).call(hook, "odd", **arguments)
    text = str(caught.value)
    assert text.startswith(f"plugin 'odd' of studio-hair 1.2, '{hook}'")
    assert reason in text
    assert "\n" not in text
    about = arguments.get("view", SimpleNamespace(name=arguments.get("path", ""))).name
    assert str(about) in text
    assert isinstance(caught.value, InputError)


@pytest.mark.parametrize("hook", OF_HOOK)
@pytest.mark.parametrize("answer", [3, "x", np.zeros(3), [], object])
def test_a_result_of_another_type_is_refused(hook: str, answer: object, tmp_path: Path) -> None:
    """Nothing but the stage's own type passes, whatever it is."""
    with pytest.raises(ResultError, match=rf"plugin 'odd' of studio-hair 1.2, '{hook}'"):
        manager_answering(hook, lambda _: answer).call(
            hook, "odd", **stage_arguments(hook, tmp_path)
        )


@pytest.mark.parametrize("hook", OF_HOOK)
def test_nothing_is_no_result(hook: str, tmp_path: Path) -> None:
    """None is refused where no other plugin is left to ask."""
    with pytest.raises(
        PluginError, match=f"'odd' of studio-hair 1.2 returned nothing from '{hook}"
    ):
        manager_answering(hook, lambda _: None).call(hook, "odd", **stage_arguments(hook, tmp_path))


def test_an_old_file_is_not_taken_for_a_new_one(tmp_path: Path) -> None:
    """An exporter that leaves an earlier file as it was has written nothing."""
    arguments = stage_arguments("export_groom", tmp_path)
    path = arguments["path"]
    path.write_bytes(b"hair of last week")
    os.utime(path, (1e9, 1e9))
    with pytest.raises(ResultError, match="nothing was written; the file there is an older one"):
        manager_answering("export_groom", writing(None)).call("export_groom", "odd", **arguments)
    for data in (b"hair of this week", b"hair of last week"):
        os.utime(path, (1e9, 1e9))
        manager_answering("export_groom", writing(data)).call("export_groom", "odd", **arguments)


@pytest.mark.parametrize("error", [ValueError("no"), InputError("no"), KeyboardInterrupt()])
def test_a_failed_export_leaves_no_half_file(error: BaseException, tmp_path: Path) -> None:
    """What it wrote goes; an old file that it did not touch stays."""
    arguments = stage_arguments("export_groom", tmp_path)
    path: Path = arguments["path"]

    def fail(asked: Any, *, written: bool) -> bool:
        if written:
            path.write_bytes(b"half")
        raise error

    path.write_bytes(b"hair of last week")
    for written, left in ((False, True), (True, False)):
        manager = manager_answering("export_groom", partial(fail, written=written))
        with pytest.raises((PluginError, InputError, KeyboardInterrupt)):
            manager.call("export_groom", "odd", **arguments)
        assert path.exists() == left
