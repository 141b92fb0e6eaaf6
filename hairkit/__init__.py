"""Eight photos around a head in, simulation-ready guide hair out.

>>> import hairkit
>>> groom = hairkit.reconstruct("photos/", "out/")  # doctest: +SKIP

Every name below is loaded when it is first used, so that `import hairkit` takes no time.

* `types`: frozen types between stages
* `cameras`: turntable, projection, silhouettes
* `imaging`: methods on images
* `helices`: helix arcs
* `head_model`: template head, scalp, distances
* `rendering`: pictures without a window
* `field`: methods on volumes
* `io`: files
* `nets`: networks of others, run in a process of their own
* `simulation`: contract of simulators, motion, wind
* `grooming`: methods on strands and grooms
* `batches`: many captures
* `studio`: from a camera to moving hair, in a browser
* `study`: questionnaires about reconstructions
* `synth`: procedural hair
* `pipeline`: recipes and runs
* `evaluation`: scores against ground truth
* `viewer`: the live preview
* `cli`: the command line
* `api`: the verbs of the front door
* `arrays`: array types
* `child_process`: a program that may crash without harm
* `colour`: the sRGB curve
* `compilation`: the line that says that kernels are compiled
* `errors`: errors that users can mend
* `html_page`: pages that need no server
* `hookspecs`: the hooks that plugins implement
* `kernel_cache`: compiled functions of the machine, and those that a wheel brings along
* `manager`: plugins by name
* `memory`: freed memory, kept for the next arrays
* `options`: options of plugins
* `parallel`: compiled loops on threads
* `progress`: progress reporting
* `remote`: files and folders at URLs
* `stages`: the graph of stages as data
* `storage`: safe files, frozen types as `.npz`
* `system`: what Linux, macOS and Windows do differently
* `testing`: a small head with hair for tests of plugins
* `version`: the version of this package
* `worker`: what plugins in environments of their own answer by
"""

from __future__ import annotations

import importlib
import os
import stat
import tempfile
from typing import TYPE_CHECKING, Any

from hairkit.version import __version__ as __version__

if TYPE_CHECKING:
    from hairkit.api import evaluate as evaluate
    from hairkit.api import export as export
    from hairkit.api import export_for as export_for
    from hairkit.api import read_groom as read_groom
    from hairkit.api import render as render
    from hairkit.api import sample_capture as sample_capture
    from hairkit.api import simulate as simulate
    from hairkit.api import wrap as wrap
    from hairkit.api import write_groom as write_groom
    from hairkit.batches.batch import batch as batch
    from hairkit.errors import HairkitError as HairkitError
    from hairkit.hookspecs import hookimpl as hookimpl
    from hairkit.hookspecs import hookspec as hookspec
    from hairkit.io.capture_reader import read_capture as read_capture
    from hairkit.io.head_reader import read_head as read_head
    from hairkit.manager import Manager as Manager
    from hairkit.options import option as option
    from hairkit.pipeline.recipe import Recipe as Recipe
    from hairkit.pipeline.recipe import load_recipe as load_recipe
    from hairkit.pipeline.reconstruct import reconstruct as reconstruct
    from hairkit.types.camera import Camera as Camera
    from hairkit.types.capture import Capture as Capture
    from hairkit.types.capture import View as View
    from hairkit.types.edits import Brush as Brush
    from hairkit.types.edits import Edit as Edit
    from hairkit.types.edits import Edits as Edits
    from hairkit.types.face import Face as Face
    from hairkit.types.groom import Groom as Groom
    from hairkit.types.groom import HairMaterial as HairMaterial
    from hairkit.types.groom import HairPhysics as HairPhysics
    from hairkit.types.head import Capsules as Capsules
    from hairkit.types.head import Head as Head
    from hairkit.types.head import Roots as Roots
    from hairkit.types.mask import Mask as Mask
    from hairkit.types.mask import Masks as Masks
    from hairkit.types.orientation import OrientationMap as OrientationMap
    from hairkit.types.parting import Parting as Parting
    from hairkit.types.person import Person as Person
    from hairkit.types.point_cache import PointCache as PointCache
    from hairkit.types.scene import Scene as Scene
    from hairkit.types.strands import Strands as Strands
    from hairkit.types.tie import Tail as Tail
    from hairkit.types.tie import Tie as Tie
    from hairkit.types.tie import TiedHair as TiedHair
    from hairkit.types.torso_shape import TorsoShape as TorsoShape
    from hairkit.types.turnaround import Turnaround as Turnaround
    from hairkit.types.volume import Hull as Hull
    from hairkit.types.volume import OrientationField as OrientationField
    from hairkit.types.volume import ScalpDistance as ScalpDistance
    from hairkit.types.volume import VoxelGrid as VoxelGrid
    from hairkit.types.waves import Waves as Waves

_HOMES = {
    "api": "evaluate export export_for read_groom render sample_capture simulate wrap write_groom",
    "batches.batch": "batch",
    "errors": "HairkitError",
    "hookspecs": "hookimpl hookspec",
    "io.capture_reader": "read_capture",
    "io.head_reader": "read_head",
    "manager": "Manager",
    "options": "option",
    "pipeline.recipe": "Recipe load_recipe",
    "pipeline.reconstruct": "reconstruct",
    "types.camera": "Camera",
    "types.capture": "Capture View",
    "types.edits": "Brush Edit Edits",
    "types.face": "Face",
    "types.groom": "Groom HairMaterial HairPhysics",
    "types.head": "Capsules Head Roots",
    "types.mask": "Mask Masks",
    "types.orientation": "OrientationMap",
    "types.parting": "Parting",
    "types.person": "Person",
    "types.point_cache": "PointCache",
    "types.scene": "Scene",
    "types.strands": "Strands",
    "types.tie": "Tail Tie TiedHair",
    "types.torso_shape": "TorsoShape",
    "types.turnaround": "Turnaround",
    "types.volume": "Hull OrientationField ScalpDistance VoxelGrid",
    "types.waves": "Waves",
}
"""Public names, by the module that defines them, the same as in the imports for type checkers.

No public name may be that of a module in this folder: importing the module would hide it.
"""

_HOME_OF = {name: f"hairkit.{module}" for module, names in _HOMES.items() for name in names.split()}
__all__ = sorted(_HOME_OF)


def __getattr__(name: str) -> Any:
    if name not in _HOME_OF:
        raise AttributeError(f"module 'hairkit' has no attribute {name!r}")
    value = getattr(importlib.import_module(_HOME_OF[name]), name)
    globals()[name] = value  # found without this function from now on
    return value


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})


def _choose_kernel_cache() -> None:
    """Let Numba keep compiled code in the folder for temporary files, if nowhere else.

    Numba keeps it beside the sources or in the user's cache; where it can write to neither, its
    cached functions cannot even be imported. Others must not be able to write to the folder,
    because Numba runs what it finds there.
    """
    cache = os.path.expanduser("~/.cache")
    while not os.path.exists(cache) and cache != os.path.dirname(cache):
        cache = os.path.dirname(cache)
    if "NUMBA_CACHE_DIR" in os.environ or any(os.access(p, os.W_OK) for p in (__path__[0], cache)):
        return
    from hairkit.system import user_id

    user = user_id()
    folder = os.path.join(tempfile.gettempdir(), f"hairkit-kernels-{user}")
    try:
        os.makedirs(folder, stat.S_IRWXU, exist_ok=True)
        found = os.lstat(folder)
    except OSError:
        return
    private = stat.S_ISDIR(found.st_mode) and not stat.S_IMODE(found.st_mode) & ~stat.S_IRWXU
    if private and found.st_uid == user:
        os.environ["NUMBA_CACHE_DIR"] = folder  # Numba reads it when it is first imported


_choose_kernel_cache()
