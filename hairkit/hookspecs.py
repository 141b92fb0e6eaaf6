"""The contract: each step from photos to a groom and its motion is a hook for plugins.

A plugin is a module (or object) with functions marked `@hairkit.hookimpl` and, if it has any
settings, a frozen dataclass named `Options`. An implementation names only the arguments it needs;
pluggy passes those by name.
Stage hooks are called on one plugin, chosen by name in the recipe; notifications go to all plugins.
`options` is the plugin's own `Options` instance (None when it has none).
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import pluggy

if TYPE_CHECKING:
    from hairkit.simulation.simulator import Simulator
    from hairkit.types.capture import Capture, View
    from hairkit.types.edits import Edits
    from hairkit.types.face import Face
    from hairkit.types.finding import Finding
    from hairkit.types.groom import Groom
    from hairkit.types.head import Head, Roots
    from hairkit.types.mask import Mask, Masks
    from hairkit.types.orientation import OrientationMap
    from hairkit.types.parting import Parting
    from hairkit.types.person import Person
    from hairkit.types.scene import Scene
    from hairkit.types.skin import Texture
    from hairkit.types.strands import Strands
    from hairkit.types.texture_example import TextureExample
    from hairkit.types.tie import TiedHair
    from hairkit.types.turnaround import Turnaround
    from hairkit.types.volume import Hull, OrientationField, ScalpDistance
    from hairkit.types.waves import Waves

PROJECT = "hairkit"
hookspec = pluggy.HookspecMarker(PROJECT)
hookimpl = pluggy.HookimplMarker(PROJECT)

HOOKSPEC_VERSION = (1, 5)
"""Version of this contract. The second number grows when hooks or arguments are added, the first
when one is removed or changes; a plugin may check it when it is imported."""


@hookspec(firstresult=True)
def capture(source: str, max_edge: int, options: Any) -> Capture | None:
    """Return the photos of a path, or of another name that the plugin knows; None for others'.

    Photos whose long edge has more pixels are scaled down to `max_edge`.
    """


@hookspec(firstresult=True)
def detect_landmarks(view: View, options: Any) -> Face | None:
    """Find the face in one photo: its 68 landmarks and direction, in pixels of `view.image`."""


@hookspec(firstresult=True)
def segment_person(view: View, options: Any) -> Person | None:
    """Find the person in one photo, hair and clothes included, as a probability."""


@hookspec(firstresult=True)
def find_turn(
    capture: Capture, faces: tuple[Face, ...], persons: tuple[Person, ...], options: Any
) -> Turnaround | None:
    """Find from where each photo was taken: order, azimuths, elevations, which side is up."""


@hookspec(firstresult=True)
def segment(view: View, options: Any) -> Mask | None:
    """Label one photo: hair, the rest of the person, background. The mask has the photo's size."""


@hookspec(firstresult=True)
def estimate_scene(
    capture: Capture, masks: tuple[Mask, ...], head: Head, start: Scene | None, options: Any
) -> Scene | None:
    """Estimate the cameras of all views and the head's size and pose; `head` is not fitted yet.

    `start` is the scene of the masks before they were mended; None the first time.
    """


@hookspec(firstresult=True)
def refine_masks(
    capture: Capture, masks: tuple[Mask, ...], scene: Scene, options: Any
) -> Masks | None:
    """Mend the masks of all views together, guided by the cameras and the head; V masks again."""


@hookspec(firstresult=True)
def fit_head(capture: Capture, masks: tuple[Mask, ...], scene: Scene, options: Any) -> Scene | None:
    """Fit the shape of the scene's head to the photos, refine the cameras; its mesh is kept."""


@hookspec(firstresult=True)
def enhance_texture(
    texture: Texture, example: TextureExample | None, options: Any
) -> Texture | None:
    """Make a texture of the head finer, or filter it, after an example; it keeps its shape."""


@hookspec(firstresult=True)
def orient(view: View, mask: Mask, options: Any) -> OrientationMap | None:
    """Find the strand's 2D orientation at every hair pixel of one photo."""


@hookspec(firstresult=True)
def build_hull(
    scene: Scene, masks: tuple[Mask, ...], orientations: tuple[OrientationMap, ...], options: Any
) -> Hull | None:
    """Carve the volume that hair fills from the masks of all views."""


@hookspec(firstresult=True)
def solve_field(
    scene: Scene,
    masks: tuple[Mask, ...],
    orientations: tuple[OrientationMap, ...],
    hull: Hull,
    waves: Waves,
    scalp_distance: ScalpDistance,
    parting: Parting,
    tied: TiedHair,
    options: Any,
) -> OrientationField | None:
    """Fuse the 2D orientations of all views into 3D and fill the rest of the hull."""


@hookspec(firstresult=True)
def track(
    scene: Scene,
    masks: tuple[Mask, ...],
    orientations: tuple[OrientationMap, ...],
    hull: Hull,
    field: OrientationField,
    roots: Roots,
    waves: Waves,
    scalp_distance: ScalpDistance,
    parting: Parting,
    tied: TiedHair,
    options: Any,
) -> Strands | None:
    """Grow one strand from every root; strand s belongs to root s."""


@hookspec(firstresult=True)
def edit_groom(groom: Groom, edits: Edits, options: Any) -> Groom | None:
    """Do the strokes of an artist, in their order."""


@hookspec(firstresult=True)
def make_simulator(groom: Groom, options: Any) -> Simulator | None:
    """Return a simulator of the groom's guides, at rest."""


@hookspec(firstresult=True)
def export_groom(groom: Groom, path: Path, options: Any) -> bool | None:
    """Write the groom to `path` atomically and return True."""


@hookspec(firstresult=True)
def import_groom(path: Path, options: Any) -> Groom | None:
    """Read a file as a groom."""


@hookspec
def validate_groom(groom: Groom, path: Path, target: str) -> list[Finding] | None:
    """Check a file that was read as a groom against rules of a target: those of all plugins."""


@hookspec
def stage_finished(stage: str, seconds: float, result: Any) -> None:
    """Notification: a stage has ended, with its result."""


@hookspec
def groom_ready(groom: Groom) -> None:
    """Notification: the pipeline has made a groom."""
