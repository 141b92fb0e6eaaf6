"""A working plugin package to start from: one module, its entry point, its test, its readme."""

from __future__ import annotations

import keyword
import os
import tempfile
import textwrap
from dataclasses import dataclass
from pathlib import Path

from hairkit.errors import InputError
from hairkit.manager import STAGES
from hairkit.options import unknown_name
from hairkit.pipeline.recipe import HOOKS


@dataclass(frozen=True)
class _Sketch:
    """The simplest method that fulfils a stage's contract."""

    summary: str
    imports: tuple[str, ...]
    option: str
    signature: str
    body: str
    after: str = ""
    """Code that follows the hook's function."""


def new_plugin(stage: str, name: str, folder: str | os.PathLike[str] | None = None) -> Path:
    """Write a plugin package and return its folder.

    Parameters
    ----------
    stage
        A stage's hook (`build_hull`) or its table in a recipe (`hull`).
    name
        The plugin's name: lower-case letters, digits and underscores.
    folder
        Where to write; `hairkit-NAME` in the current folder by default.

    Raises
    ------
    InputError
        There is no such stage, the name is no plugin's name, or the folder exists.
    """
    hook = HOOKS.get(stage, stage)
    if hook not in STAGES:
        raise InputError(unknown_name("stage", stage, [*HOOKS, *STAGES]))
    if not name.isidentifier() or keyword.iskeyword(name) or name != name.lower():
        raise InputError(
            f"plugin name is {name!r}, expected lower-case letters, digits and underscores"
        )
    target = Path(folder) if folder is not None else Path(f"hairkit-{name.replace('_', '-')}")
    if target.exists():
        raise InputError(f"{target}: exists already; remove it or choose another name or -o FOLDER")
    if not target.absolute().parent.is_dir():
        raise InputError(f"{target.absolute().parent}: no such folder")
    with tempfile.TemporaryDirectory(dir=target.absolute().parent, prefix=".hairkit-") as work:
        draft = Path(work) / "package"
        for path, text in _files(hook, name).items():
            (draft / path).parent.mkdir(parents=True, exist_ok=True)
            (draft / path).write_text(text, encoding="utf-8")
        draft.rename(target)
    return target


def _files(hook: str, name: str) -> dict[str, str]:
    distribution, module = f"hairkit-{name.replace('_', '-')}", f"hairkit_{name}"
    words = {"NAME": name, "DISTRIBUTION": distribution, "MODULE": module, "HOOK": hook}
    table = next((table for table, stage in HOOKS.items() if stage == hook), None)
    use = (
        f"hairkit reconstruct photos/ -o out/ --set {table}={name}"
        if table is not None
        else f"hairkit plugins {name}"
    )
    texts = {
        "pyproject.toml": _PYPROJECT,
        f"{module}.py": _module(hook),
        f"tests/test_{name}.py": _TEST,
        "README.md": _README.replace("USE", use),
    }
    for key, word in words.items():
        texts = {path: text.replace(key, word) for path, text in texts.items()}
    return texts


def _module(hook: str) -> str:
    sketch = _SKETCHES[hook]
    standard = sorted(line for line in sketch.imports if line.startswith(_STANDARD))
    if not any("dataclasses" in line for line in standard):
        standard.insert(0, "from dataclasses import dataclass")
    others = {*sketch.imports, *_ALWAYS} - set(standard)
    ordered = sorted(others, key=lambda line: (line.startswith("from"), line))
    words = {
        "SUMMARY": sketch.summary,
        "IMPORTS": "\n".join([*standard, "", *ordered]),
        "OPTION": sketch.option,
        "SIGNATURE": sketch.signature,
        "BODY": textwrap.indent(sketch.body.strip(), "    "),
        "AFTER": sketch.after,
    }
    text = _MODULE
    for key, word in words.items():
        text = text.replace(key, word)
    return text


_PYPROJECT = """\
[build-system]
requires = ["setuptools>=77"]
build-backend = "setuptools.build_meta"

[project]
name = "DISTRIBUTION"
version = "0.1.0"
description = "A hairkit plugin: NAME"
requires-python = ">=3.11"
dependencies = ["hairkit"]

[project.entry-points.hairkit]
NAME = "MODULE"

[tool.setuptools]
py-modules = ["MODULE"]
"""

_README = """\
# DISTRIBUTION

The hairkit plugin `NAME` for the stage `HOOK`.

    pip install -e .                      # hairkit finds it by its entry point
    python -m pytest                      # it obeys the contract
    USE

While you write it, `--plugin MODULE.py` loads the file without installing it (under the file's
name, `MODULE`).
"""

_TEST = '''\
"""Laws of the plugin `NAME`."""

from pathlib import Path

from hairkit.manager import Manager
from hairkit.testing import stage_arguments

import MODULE


def test_obeys_the_contract(tmp_path: Path) -> None:
    """On a small made-up head the plugin returns what the stage `HOOK` asks for."""
    manager = Manager()
    manager.register(MODULE, "NAME")
    arguments = stage_arguments("HOOK", tmp_path)
    assert manager.call("HOOK", "NAME", **arguments) is not None
'''

_MODULE = '''\
"""SUMMARY"""

from __future__ import annotations

IMPORTS


@dataclass(frozen=True)
class Options:
    """Settings of NAME."""

    OPTION


@hookimpl
def HOOK(SIGNATURE:
    """Replace this body by your method; what comes in and goes out is in docs/plugins.md."""
BODY
AFTER'''

_NUMPY = "import numpy as np"
_STANDARD = ("from dataclasses", "from pathlib")
_ALWAYS = ("from hairkit.hookspecs import hookimpl", "from hairkit.options import option")

_SKETCHES = {
    "segment": _Sketch(
        "Everything dark is hair.",
        (
            _NUMPY,
            "from hairkit.types.capture import View",
            "from hairkit.types.mask import HAIR, Mask",
        ),
        'threshold: int = option(90, low=1, high=254, doc="Darker pixels are hair.")',
        "view: View, options: Options) -> Mask | None",
        """
dark = view.image.mean(axis=-1) < options.threshold
labels = np.where(dark, HAIR, 0).astype(np.uint8)
return Mask(labels, person_known=False) if dark.any() else None""",
    ),
    "estimate_scene": _Sketch(
        "The nominal turn: every camera where the capture says, all at one distance.",
        (
            "from hairkit.types.camera import Camera",
            "from hairkit.types.capture import Capture",
            "from hairkit.types.head import Head",
            "from hairkit.types.scene import Scene",
        ),
        'distance: float = option(0.8, low=0.3, high=5.0, doc="From the head.", unit="m")',
        "capture: Capture, head: Head, options: Options) -> Scene",
        """
cameras = tuple(
    Camera.on_turn(
        view.azimuth_deg,
        distance=options.distance,
        focal=view.focal_px or 1.3 * view.height,
        width=view.width,
        height=view.height,
    )
    for view in capture.views
)
return Scene(tuple(view.name for view in capture.views), cameras, head)""",
    ),
    "fit_head": _Sketch(
        "Scale the head about its centre.",
        (
            "from dataclasses import dataclass, replace",
            "from hairkit.types.scene import Scene",
        ),
        'scale: float = option(1.0, low=0.5, high=2.0, doc="Factor on the head\'s size.")',
        "scene: Scene, options: Options) -> Scene",
        """
head = replace(scene.head, vertices=scene.head.vertices * options.scale)
return replace(scene, head=head)""",
    ),
    "orient": _Sketch(
        "Strands run across the gradient of brightness.",
        (
            "import cv2",
            _NUMPY,
            "from hairkit.types.capture import View",
            "from hairkit.types.mask import Mask",
            "from hairkit.types.orientation import OrientationMap, wrap_angle",
        ),
        'sigma: float = option(2.0, low=0.5, high=20.0, doc="Blur before.", unit="px")',
        "view: View, mask: Mask, options: Options) -> OrientationMap",
        """
grey = cv2.cvtColor(view.image, cv2.COLOR_RGB2GRAY).astype(np.float32)
grey = cv2.GaussianBlur(grey, (0, 0), options.sigma)
across_x, across_y = cv2.Sobel(grey, cv2.CV_32F, 1, 0), cv2.Sobel(grey, cv2.CV_32F, 0, 1)
strength = np.hypot(across_x, across_y) * mask.hair
angle = np.arctan2(across_y, across_x) + np.pi / 2  # along the strand
return OrientationMap(wrap_angle(angle), strength / max(float(strength.max()), 1e-6))""",
    ),
    "build_hull": _Sketch(
        "Cells outside the head that enough views see as hair.",
        (
            _NUMPY,
            "from scipy.spatial import cKDTree",
            "from hairkit.types.mask import Mask",
            "from hairkit.types.scene import Scene",
            "from hairkit.types.volume import Hull, VoxelGrid",
        ),
        'votes: int = option(4, low=1, high=8, doc="Views that must see hair.")',
        "scene: Scene, masks: tuple[Mask, ...], options: Options) -> Hull",
        """
head = scene.head
grid = VoxelGrid.around(head.vertices.min(axis=0) - 0.1, head.vertices.max(axis=0) + 0.1, 0.01)
centres = grid.centres().astype(np.float64)
votes = np.zeros(grid.shape, int)
for camera, mask in zip(scene.cameras, masks, strict=True):
    x, y = np.moveaxis(np.nan_to_num(np.floor(camera.project(centres)), nan=-1), -1, 0)
    inside = (x >= 0) & (y >= 0) & (x < camera.width) & (y < camera.height)
    votes[inside] += mask.hair[y[inside].astype(int), x[inside].astype(int)]
_, nearest = cKDTree(head.vertices).query(centres)
out = centres - head.vertices[nearest]  # signed by the nearest vertex's normal
distance = np.einsum("xyzc,xyzc->xyz", out, head.normals()[nearest]).astype(np.float32)
hair = (votes >= options.votes) & (distance > 0)
return Hull(grid, hair, hair, distance)""",
    ),
    "solve_field": _Sketch(
        "All hair hangs straight down.",
        (
            _NUMPY,
            "from hairkit.types.volume import Hull, OrientationField",
        ),
        'confidence: float = option(1.0, low=0.0, high=1.0, doc="Given to every cell.")',
        "hull: Hull, options: Options) -> OrientationField",
        """
tensor = np.zeros((*hull.grid.shape, 6), np.float32)
tensor[..., 1] = hull.loose  # yy: along the vertical
confidence = (options.confidence * hull.loose).astype(np.float32)
return OrientationField(hull.grid, tensor, confidence, np.maximum(hull.head_distance, 0))""",
    ),
    "track": _Sketch(
        "Straight bristles along the scalp's normals.",
        (
            _NUMPY,
            "from hairkit.types.head import Roots",
            "from hairkit.types.strands import Strands",
        ),
        'length: float = option(0.05, low=0.001, high=1.0, doc="Of a strand.", unit="m")',
        "roots: Roots, options: Options) -> Strands",
        """
along = np.linspace(0.0, options.length, 10, dtype=np.float32)[None, :, None]
points = roots.positions[:, None] + along * roots.normals[:, None]
offsets = np.arange(len(roots) + 1) * 10
return Strands(points.reshape(-1, 3), offsets, root_uv=roots.uv)""",
    ),
    "enhance_texture": _Sketch(
        "Sharpen by an unsharp mask.",
        (
            "import cv2",
            "from hairkit.arrays import UInt8Array",
            _NUMPY,
        ),
        'amount: float = option(0.5, low=0.0, high=3.0, doc="Share of the detail added.")',
        "texture: UInt8Array, options: Options) -> UInt8Array",
        """
blurred = cv2.GaussianBlur(texture, (0, 0), 2.0)
sharp = cv2.addWeighted(texture, 1 + options.amount, blurred, -options.amount, 0)
return np.asarray(sharp, np.uint8)""",
    ),
    "make_simulator": _Sketch(
        "Hair that does not move.",
        (
            "from hairkit.types.groom import Groom",
            "from hairkit.types.strands import Strands",
        ),
        'damping: float = option(0.05, low=0.0, high=1.0, doc="Loss of speed in a step.")',
        "groom: Groom, options: Options) -> Still",
        "return Still(groom)",
        '''

class Still:
    """A simulator whose guides stay where they are."""

    def __init__(self, groom: Groom) -> None:
        self._groom = groom

    def step(self, seconds: float) -> Strands:
        """Return the guides after a further time step."""
        return self._groom.strands
''',
    ),
    "export_groom": _Sketch(
        "One text line a point: strand, x, y, z.",
        (
            "from pathlib import Path",
            _NUMPY,
            "from hairkit.types.groom import Groom",
            "from hairkit.storage import write_text",
        ),
        'digits: int = option(6, low=1, high=9, doc="Decimals of a coordinate in metres.")',
        "groom: Groom, path: Path, options: Options) -> bool",
        """
strand = np.repeat(np.arange(len(groom.strands)), groom.strands.counts)
rows = zip(strand, groom.strands.points.tolist(), strict=True)
lines = (f"{s} " + " ".join(f"{c:.{options.digits}f}" for c in point) for s, point in rows)
write_text(path, "\\n".join(lines) + "\\n")
return True""",
    ),
    "import_groom": _Sketch(
        "Read the native form and thin it out.",
        (
            "from dataclasses import dataclass, replace",
            "from pathlib import Path",
            "from hairkit.types.groom import Groom",
        ),
        'every: int = option(1, low=1, high=1000, doc="Keep one strand of so many.")',
        "path: Path, options: Options) -> Groom",
        """
groom = Groom.load(path)
keep = range(0, len(groom.strands), options.every)
return replace(
    groom,
    strands=groom.strands.select(list(keep)),
    root_triangle=groom.root_triangle[list(keep)],
    root_barycentric=groom.root_barycentric[list(keep)],
)""",
    ),
}
