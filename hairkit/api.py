"""Functions of `import hairkit` that each do one command of the command line, on paths or objects.

They find plugins, open files and choose cameras as the command line does. `manager` holds the
plugins to use (None: the installed ones); further keywords are options of the plugin.
"""

from __future__ import annotations

import os
import tempfile
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from hairkit.errors import InputError
from hairkit.grooming.engine_files import ENGINES
from hairkit.io.capture_reader import TURN, WORKING_EDGE, read_capture, sample_folder
from hairkit.manager import Manager
from hairkit.options import unknown_name
from hairkit.pipeline.open_groom import load_groom, plugin_for
from hairkit.types.camera import Camera
from hairkit.types.capture import Capture
from hairkit.types.groom import Groom
from hairkit.types.point_cache import PointCache

if TYPE_CHECKING:  # these load OpenGL and Numba, so each verb imports its own
    from hairkit.arrays import UInt8Array
    from hairkit.evaluation import Evaluation, Prediction, Truth
    from hairkit.progress import Progress
    from hairkit.simulation import HeadMotion
    from hairkit.types.head import Head

StrPath = str | os.PathLike[str]


def sample_capture(max_edge: int = WORKING_EDGE) -> Capture:
    """Return the capture that ships with hairkit: eight rendered photos."""
    return read_capture(sample_folder(), max_edge)


def read_groom(
    path: StrPath, *, plugin: str | None = None, manager: Manager | None = None, **options: object
) -> Groom:
    """Return the groom in a file of any format that a plugin imports, or in a folder of results.

    The plugin is the one of the file's ending unless named.
    """
    return load_groom(manager or Manager.loaded(), Path(path), options, plugin)


def write_groom(groom: Groom, path: StrPath) -> None:
    """Write hairkit's own file (.npz), which keeps all of a groom; `export` writes other formats.

    Raises `InputError` for a name with another ending.
    """
    if Path(path).suffix.lower() != ".npz":
        raise InputError(f"{path}: hairkit's own file ends in .npz; use export for other formats")
    groom.save(path)


def export(
    groom: Groom | StrPath,
    path: StrPath,
    *,
    cache: PointCache | StrPath | None = None,
    plugin: str | None = None,
    manager: Manager | None = None,
    **options: object,
) -> None:
    """Write a groom in an engine's format: `export(groom, "hair.abc")`.

    Parameters
    ----------
    groom
        A groom, or what `read_groom` reads.
    path
        The file; its ending chooses the plugin unless `plugin` names one.
    cache
        The motion to write with it, from `simulate`; for formats that hold animation.
    options
        The export plugin's options; `hairkit plugins NAME` lists them.
    """
    plugins = manager or Manager.loaded()
    name = plugin or plugin_for(plugins, "export_groom", Path(path))
    with _cache_file(cache) as motion:
        values = options if motion is None else {**options, "cache": motion}
        checked = plugins.options(name, values)
        opened = _open(groom, plugins)
        plugins.call("export_groom", name, checked, groom=opened, path=Path(path))


def export_for(
    groom: Groom | StrPath, engine: str, folder: StrPath, *, manager: Manager | None = None
) -> tuple[Path, ...]:
    """Write what an engine takes into a folder, and return the files, the hair first.

    `export_for(groom, "unreal", "unreal/")`: format, axes, unit, guides or full hair, and names are
    those of the engine's page in the documentation (`hairkit.grooming.engine_files.ENGINES`). The
    folder is made where there is none. `InputError` for another engine, or a file in its place.
    """
    if engine not in ENGINES:
        raise InputError(unknown_name("engine", engine, ENGINES))
    files, plugins = ENGINES[engine], manager or Manager.loaded()
    opened, target = _open(groom, plugins), Path(folder)
    if target.exists() and not target.is_dir():
        raise InputError(f"{folder}: not a folder; choose another for the files")
    target.mkdir(parents=True, exist_ok=True)
    for file in files:
        path = target / file.name
        plugins.call("export_groom", file.plugin, file.options, groom=opened, path=path)
    return tuple(target / file.name for file in files)


def wrap(
    groom: Groom | StrPath,
    head: Head | StrPath,
    *,
    units: str = "m",
    up: str = "y",
    scalp: str | None = None,
    keep_root_uv: bool = False,
    manager: Manager | None = None,
) -> Groom:
    """Return a groom on another head of any mesh: `wrap(groom, "other.glb")`.

    Parameters
    ----------
    groom
        A groom, or what `read_groom` reads.
    head
        The other head, or its .obj, .ply or .glb file; the face along +Z (-Y where `up` is z).
    units, up, scalp
        How to read the file, as of `read_head`; without a marked scalp the groom's is carried over.
    keep_root_uv
        Keep the roots' old texture coordinates instead of taking those of the other head.
    """
    from hairkit.grooming.wrap import wrap_groom
    from hairkit.io.head_reader import BareHead, read_bare_head
    from hairkit.types.head import Head

    other = BareHead.of(head) if isinstance(head, Head) else read_bare_head(head, units, scalp, up)
    return wrap_groom(_open(groom, manager), other, keep_root_uv=keep_root_uv)


def simulate(
    groom: Groom | StrPath,
    frames: int = 120,
    *,
    fps: float = 60.0,
    shake: Sequence[str] = (),
    motion: HeadMotion | StrPath | None = None,
    wind: npt.ArrayLike = (0.0, 0.0, 0.0),
    turbulence: float = 0.0,
    gravity: float | None = None,
    warm_up: float = 0.0,
    simulator: str = "rods",
    manager: Manager | None = None,
    progress: Progress | None = None,
    **options: object,
) -> PointCache:
    """Simulate a groom's guides: `simulate(groom, 240, shake=["yaw:20:1.5"])`.

    Parameters
    ----------
    groom
        A groom, or what `read_groom` reads.
    frames, fps
        How many frames, and how many a second; the first is the captured hair at rest.
    shake
        Shakes of the head, `axis:degrees:hertz[:seconds]` with yaw, pitch or roll.
    motion
        Motion of the head, or a file of it; shakes are added to it.
    wind
        (3,) metres per second: +X the subject's left, +Y up, +Z out of the face.
    turbulence
        Gusts as a share of the wind.
    gravity
        Metres per second squared, downwards; the groom's when None.
    warm_up
        Seconds simulated before the first frame.
    simulator
        The simulator plugin; `options` are its own.
    """
    from hairkit.simulation import Weather, add_shakes, read_motion, run

    plugins = manager or Manager.loaded()
    opened = _open(groom, plugins)
    if not len(opened.strands):
        raise InputError("the groom holds no strands, so there is nothing to simulate")
    base = read_motion(Path(motion)) if isinstance(motion, (str, os.PathLike)) else motion
    pull = None if gravity is None else np.array([0.0, -gravity, 0.0])
    made = plugins.call("make_simulator", simulator, options, groom=opened)
    with plugins.guard("make_simulator", simulator):
        return run(
            made,
            add_shakes(shake, opened.head, base),
            frames,
            fps,
            weather=Weather(np.asarray(wind, np.float64), turbulence, pull),
            warm_up=warm_up,
            progress=progress,
        )


def render(
    groom: Groom | StrPath,
    path: StrPath | None = None,
    camera: str | tuple[float, float] | Camera = "front",
    *,
    size: tuple[int, int] = (1280, 720),
    hairs: int = 20_000,
    seed: int = 0,
    cache: PointCache | StrPath | None = None,
    frame: int = 0,
    manager: Manager | None = None,
) -> UInt8Array:
    """Return a picture (H, W, 3) uint8 RGB of a groom on its head, and write it to `path` if given.

    Parameters
    ----------
    groom
        A groom, or what `read_groom` reads.
    path
        A .png or .jpg file to write the picture to.
    camera
        A view of the turn (`front-left`), (azimuth, elevation) in degrees, both framing the whole
        groom, or a camera, whose own size holds.
    size
        Width and height in pixels.
    hairs
        Strands drawn: the guides and hair interpolated between them, chosen by `seed`.
    cache, frame
        A simulation of the groom, and the frame of it to draw.
    """
    from hairkit.grooming.densify import densify
    from hairkit.imaging.picture_file import write_picture
    from hairkit.rendering import draw
    from hairkit.rendering.framing import framing_cameras
    from hairkit.rendering.head import bust_solid
    from hairkit.simulation.posing import pose_groom, pose_hair, pose_torso

    shown, torso = _open(groom, manager), None
    hair = rest = densify(shown, hairs, seed)
    head = shown.head
    if cache is not None:
        motion = cache if isinstance(cache, PointCache) else PointCache.load(cache)
        hair = pose_hair(shown, rest, motion, frame)
        torso, shown = pose_torso(shown, motion, frame), pose_groom(shown, motion, frame)
    if not isinstance(camera, Camera):
        points = np.concatenate([shown.head.vertices, hair.points])
        camera = framing_cameras(points, [_direction(camera)], *size)[0]
    solids = [below] if (below := bust_solid(head, rest, torso)) else []
    picture = draw(hair, shown.head, camera, material=shown.material, solids=solids)
    if path is not None:
        write_picture(path, picture)
    return picture


def evaluate(
    out: Prediction | StrPath,
    truth: Truth | StrPath,
    *,
    scene: StrPath | None = None,
    consistency: bool = False,
) -> Evaluation:
    """Return the scores of a reconstruction against the truth of its capture.

    Parameters
    ----------
    out
        The folder that `reconstruct` wrote, or a groom's file with its `scene.json` beside it.
    truth
        The capture's truth folder.
    scene
        The cameras, where they lie elsewhere.
    consistency
        Measure the consistency of strands too, which is slower.
    """
    from hairkit import evaluation

    given = (
        out if isinstance(out, evaluation.Prediction) else evaluation.read_prediction(out, scene)
    )
    known = truth if isinstance(truth, evaluation.Truth) else evaluation.read_truth(truth)
    return evaluation.evaluate(given, known, consistency=consistency)


def _open(groom: Groom | StrPath, manager: Manager | None) -> Groom:
    return groom if isinstance(groom, Groom) else read_groom(groom, manager=manager)


def _direction(camera: str | tuple[float, float]) -> tuple[float, float]:
    if not isinstance(camera, str):
        return camera
    if camera not in TURN:
        raise InputError(f"no view {camera!r}, expected (azimuth, elevation) or one of {_VIEWS}")
    return TURN[camera], 0.0


_VIEWS = ", ".join(TURN)


@contextmanager
def _cache_file(cache: PointCache | StrPath | None) -> Iterator[Path | None]:
    """Yield the file that exporters read the motion from; a temporary one is deleted afterwards."""
    if not isinstance(cache, PointCache):
        yield None if cache is None else Path(cache)
        return
    with tempfile.TemporaryDirectory(prefix="hairkit-") as folder:
        cache.save(Path(folder) / "cache.npz")
        yield Path(folder) / "cache.npz"
