"""Cameras refined from the nominal turn by landmarks and by the consistency of the silhouettes.

Levenberg-Marquardt on the turn's unknowns (`hairkit.cameras.turn_fit`), to whose landmarks those
are added that patches of skin carry to the neighbours (`.landmark_transfer`). Cameras are
orthographic where the capture says so.

* `landmark_transfer`: landmarks matched in neighbouring views
"""

from __future__ import annotations

from dataclasses import dataclass

from hairkit import Capture, Head, Mask, Scene, hookimpl
from hairkit.cameras.camera_search import Fit
from hairkit.cameras.turn_fit import TurnFit, TurnOptions
from hairkit.options import option
from hairkit.types.head import LANDMARKS

from .landmark_transfer import PatchSettings, transfer_landmarks


@dataclass(frozen=True)
class Options(TurnOptions):
    """Settings of the refinement; the spreads are of the prior."""

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
        best = search.find(problem.start(capture.orthographic), problem.turn.azimuths)
    else:
        best = problem.from_cameras(start.cameras)
        best = best if carries else search.settle(best)
    for _ in range(carries):
        transferred = _transferred(problem, capture, best)
        best = transferred.search(options.iterations).settle(best, (1.0,))
    names = tuple(view.name for view in capture.views)
    return Scene(names, problem.turn.cameras(best.vector), head, problem.residual_px(best))


def _transferred(problem: TurnFit, capture: Capture, fit: Fit) -> TurnFit:
    """Return the problem with landmarks transferred to other views by a solution."""
    assert problem.landmarks is not None
    places = (problem.landmarks.landmarks + fit.offset)[:LANDMARKS]
    cameras = problem.turn.cameras(fit.vector)
    more = transfer_landmarks(capture, cameras, problem.head, places, PatchSettings())
    return problem.with_sights(more)
