"""Cameras refined from the nominal turn by landmarks and by the consistency of the silhouettes.

Levenberg-Marquardt on the turn's unknowns (`hairkit.cameras.turn_fit`), to whose landmarks those
are added that patches of skin carry to the neighbours (`.landmark_transfer`). Perspective and
orthographic cameras are both tried unless the capture or the options say which.

* `landmark_transfer`: landmarks matched in neighbouring views
"""

from __future__ import annotations

from dataclasses import dataclass

from hairkit import Capture, Head, Mask, Scene, hookimpl
from hairkit.cameras.camera_search import Fit, Search
from hairkit.cameras.turn_fit import TurnFit, TurnOptions
from hairkit.options import option
from hairkit.types.head import LANDMARKS

from .landmark_transfer import PatchSettings, transfer_landmarks

FLAT_NOISE = 4.0
"""Times the noise of outlines in the first rounds with orthographic cameras."""
FLAT_ROUNDS = 6
"""Rounds of that, of up to 16 that it would take to settle: its cost is within a tenth then."""
FLAT_HOPE, FLAT_WINS = 3.0, 1.1
"""Times the best cost from which such a solution is not settled, which takes off a half, and up to
which it is the best: it is 10 and more times on perspective captures, then 1.8 and 1.0 on an
orthographic one, which cameras 2 m away fit as well."""


@dataclass(frozen=True)
class Options(TurnOptions):
    """Settings of the refinement; the spreads are of the prior."""

    model: str = option(
        "auto",
        choices=("auto", "perspective", "orthographic"),
        doc="Kind of cameras; auto takes the kind that fits better.",
    )
    carries: int = option(
        2,
        low=0,
        high=9,
        doc="Rounds that transfer landmarks to neighbouring views by patches of skin.",
    )
    iterations: int = option(20, low=1, high=100, doc="Most rounds of Gauss-Newton.")


@hookimpl
def estimate_scene(
    capture: Capture, masks: tuple[Mask, ...], head: Head, start: Scene | None, options: Options
) -> Scene:
    """Solve for all cameras; the head keeps its shape and gives the world its frame and scale."""
    problem = TurnFit.of(capture, masks, head, options)
    search = problem.search(options.iterations)
    carries = options.carries if problem.landmarks is not None else 0
    if start is None:
        best = _from_nothing(problem, search, capture, options)
    else:
        best = problem.from_cameras(start.cameras)
        best = best if carries else search.settle(best)
    for _ in range(carries):
        transferred = _transferred(problem, capture, best)
        best = transferred.search(options.iterations).settle(best, 1)
    names = tuple(view.name for view in capture.views)
    return Scene(names, problem.turn.cameras(best.vector), head, problem.residual_px(best))


def _from_nothing(problem: TurnFit, search: Search, capture: Capture, options: Options) -> Fit:
    """Return the best cameras, perspective or orthographic, from the nominal turn on."""
    wanted = "orthographic" if capture.orthographic else "perspective"
    if options.model != "auto":
        wanted = options.model
    best = search.find(problem.start(wanted == "orthographic"), problem.turn.azimuths)
    if options.model == "auto" and not capture.orthographic:
        flat, _ = search.descend(problem.start(True), FLAT_NOISE, FLAT_ROUNDS)
        if search.cost(flat, problem.evidence(flat, 1.0)) < FLAT_HOPE * best.cost:
            flat = search.settle(flat, 1)
            best = flat if flat.cost < FLAT_WINS * best.cost else best
    return best


def _transferred(problem: TurnFit, capture: Capture, fit: Fit) -> TurnFit:
    """Return the problem with landmarks transferred to other views by a solution."""
    assert problem.landmarks is not None
    places = (problem.landmarks.landmarks + fit.offset)[:LANDMARKS]
    cameras = problem.turn.cameras(fit.vector)
    more = transfer_landmarks(capture, cameras, problem.head, places, PatchSettings())
    return problem.with_sights(more)
