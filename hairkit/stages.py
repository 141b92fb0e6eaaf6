"""The graph of stages as data: what is known of each stage without running it.

Tables of recipes, checks of results, made-up arguments for tests, scaffolds of plugins, progress in
the studio and the readers of work folders follow from these rows. What a stage takes is the
signature of its hook (`hairkit.hookspecs`); how results become arguments is in
`hairkit.pipeline.findings`.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable
from dataclasses import dataclass, replace
from enum import Enum
from typing import Any, Generic, TypeVar

from hairkit import hookspecs
from hairkit.types.capture import Capture
from hairkit.types.face import Face
from hairkit.types.framing import Framing
from hairkit.types.groom import Groom
from hairkit.types.hairline import Hairline
from hairkit.types.mask import Mask, Masks
from hairkit.types.orientation import OrientationMap
from hairkit.types.parting import Parting
from hairkit.types.person import Person
from hairkit.types.scene import Scene
from hairkit.types.skin import SkinMaps, Texture
from hairkit.types.strands import Strands
from hairkit.types.tie import TiedHair
from hairkit.types.turnaround import Turnaround
from hairkit.types.volume import Hull, OrientationField, ScalpDistance
from hairkit.types.waves import Waves

_Result = TypeVar("_Result")


class Draft(Enum):
    """What a draft, the quick groom after a change by hand, does with a result of the last run."""

    NEW = "makes it anew"
    KEPT = "reads it"
    DRAWN = "makes it anew where somebody drew, else reads it"


NEW, KEPT, DRAWN = Draft.NEW, Draft.KEPT, Draft.DRAWN


@dataclass(frozen=True, eq=False)
class Stage(Generic[_Result]):
    """One result of a run."""

    name: str
    """Of its file in the work folder, `NAME.npz` or `NAME-VIEW.npz`, and in progress."""
    makes: type[_Result]
    hook: str = ""
    """The hook of the plugins that make it; "" where hairkit makes it of other results."""
    words: str = ""
    """What is happening while it runs."""
    share: int = 0
    """Of the time of a whole run on photos alone, percent."""
    draft: Draft = NEW
    each: bool = False
    """True when every view has a result of its own."""
    several: bool = False
    """True when a recipe may name several plugins: the first that has an answer makes the result;
    all of them write files."""
    needed: bool = False
    """True when no recipe may leave it out."""
    absent: Callable[[], _Result] | None = None
    """Makes the result where a recipe leaves the stage out or no plugin has an answer."""
    of: Stage[_Result] | None = None
    """The stage that this is another result of, by the same plugins."""
    in_runs: bool = True
    """False for hooks that no reconstruction calls."""
    command: bool = True
    """False when no npz holds the result, so that its plugin cannot be a process of its own."""

    @property
    def takes(self) -> tuple[str, ...]:
        """Names of the arguments of its hook, without `options`."""
        names = inspect.signature(getattr(hookspecs, self.hook)).parameters
        return tuple(name for name in names if name != "options")

    @property
    def table(self) -> str:
        """The table of the recipe that names its plugins."""
        return self.name if self.of is None else self.of.name


# One row a result, in the order of a run. Shares are those of `run.json` of the sample's photos
# without masks.
CAPTURE = Stage("capture", Capture, "capture", "reading photos", several=True, command=False)
FACES = Stage(
    "landmarks", Face, "detect_landmarks", "looking for faces", 3, KEPT,
    each=True, several=True, absent=Face.absent,
)  # fmt: skip
PERSONS = Stage(
    "person", Person, "segment_person", "looking for the person", 2, KEPT,
    each=True, several=True, absent=Person.absent,
)  # fmt: skip
REGION = Stage("region", Framing, words="finding the person", draft=KEPT)
FRAMED = Stage("frame", Framing, words="finding the head", draft=KEPT)
TURN = Stage("turn", Turnaround, "find_turn", "ordering the photos", 1, KEPT)
FIRST_TURN = replace(TURN, name="first_turn", of=TURN)
LABELS = Stage(
    "segment", Mask, "segment", "finding hair", 13, DRAWN, each=True, several=True, needed=True
)
SCENE = Stage("scene", Scene, "estimate_scene", "placing cameras", 13, KEPT, needed=True)
FIRST_SCENE = replace(SCENE, name="first_scene", share=9, of=SCENE)
REFINED = Stage("refine", Masks, "refine_masks", "comparing masks", 11, KEPT)
FITTED = Stage("fit", Scene, "fit_head", "fitting the head", 2, KEPT)
SKIN = Stage("skin", SkinMaps, words="photographing the skin", share=14, draft=KEPT)
TEXTURE = Stage("texture", Texture, "enhance_texture", "sharpening the skin", draft=KEPT)
ORIENTED = Stage(
    "orient", OrientationMap, "orient", "following strands in photos", 8, DRAWN,
    each=True, needed=True,
)  # fmt: skip
HULL = Stage("hull", Hull, "build_hull", "carving the volume", 7, needed=True)
DISTANCE = Stage("distance", ScalpDistance, words="measuring thickness", share=1)
WAVES = Stage("waves", Waves, words="measuring waves", share=3, draft=KEPT)
TIES = Stage("ties", TiedHair, words="looking for ties", share=1)
PARTING = Stage("parting", Parting, words="finding the parting", share=1, draft=DRAWN)
FIELD = Stage("field", OrientationField, "solve_field", "spreading directions", 8, needed=True)
HAIRLINE = Stage("hairline", Hairline, words="finding the hairline", share=1, draft=KEPT)
TRACK = Stage("track", Strands, "track", "growing strands", 2, needed=True)
UNEDITED = Stage("groom", Groom, words="assembling the groom")
EDITED = Stage("edit", Groom, "edit_groom", "repeating what was drawn by hand")
SIMULATOR = Stage("simulator", object, "make_simulator", in_runs=False, command=False)
EXPORT = Stage("export", bool, "export_groom", "writing files", 2, several=True)
SHEET = Stage("sheet", bytes, words="drawing the overview", share=5)
IMPORT = Stage("import", Groom, "import_groom", in_runs=False)

ROWS: tuple[Stage[Any], ...] = tuple(
    value for value in list(globals().values()) if isinstance(value, Stage)
)
"""All of them."""
OF_NAME = {stage.name: stage for stage in ROWS}
OF_HOOK = {stage.hook: stage for stage in ROWS if stage.hook and stage.of is None}
OF_TABLE = {stage.name: stage for stage in OF_HOOK.values() if stage.in_runs}
"""The stages that a recipe names plugins for."""
RENAMED = {"head": "fit", "pbd": "rods"}
"""Tables of recipes, and plugins: what was so called until 0.2, and what it is called now."""


def renamed(plugin: str) -> str:
    """Return what an error adds where a plugin's name meant another plugin before; else ""."""
    now = RENAMED.get(plugin)
    return f"; what was {plugin} is {now} since 0.3: write {now}" if now else ""
