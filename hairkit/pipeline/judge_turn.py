"""Arrangements of the photos judged by their cameras: only the right one's fit all silhouettes.

What photos show one by one and in pairs leaves several arrangements nearly equal, most of all of
hair that is tied, or alike on both sides. For each of them the cameras are solved coarsely
(`hairkit.cameras.turn_fit`): the rays of every outline must touch all other silhouettes.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Self

import numpy as np

from hairkit.cameras.camera_search import Fit
from hairkit.cameras.turn_fit import Silhouettes, TurnFit, TurnOptions
from hairkit.types.capture import Capture
from hairkit.types.head import Head
from hairkit.types.mask import Mask
from hairkit.types.turnaround import Turnaround, moved_photos

OPTIONS = TurnOptions()
"""As a scene is solved: with half the contour points exchanged photos of a bob fitted better."""
COARSE, FINE, ROUNDS = 4.0, 1.0, 6
"""Times the noise of outlines first and then, and rounds of Gauss-Newton at each."""
NEAR = 0.4
"""An arrangement that costs so much more than the best at the coarse noise is not looked at with
the fine one. Costs of cameras are logarithms: the right arrangements of twelve turns cost 15 to 24
a view, wrong ones mostly 3 to 8 times as much, and at least 1.3 times."""
FITS = 45.0
"""Cost a view up to which cameras fit, and may overrule the photos. Right arrangements of rendered
heads cost 15 to 40. Of two photographed men every arrangement costs more than 300, of a third the
right one 63: their outlines do not fit together so well, and another order may cost less."""
UNSURE = 1.25
"""Margin below which the photos that may have another place are named."""
FREER = np.log(1.25)
"""Cost of a photo from above: its camera is freer than those of the ring."""
MOST_TOLD = 3
"""Photos that a doubt names."""


def judge_turn(
    capture: Capture, masks: tuple[Mask, ...], head: Head, turn: Turnaround
) -> Turnaround:
    """Return the arrangement that photos and cameras together fit best, and its margin.

    Where no cameras fit, the likeliest stays, with its margin.

    Parameters
    ----------
    capture
        Photos upright, in the order they were read.
    masks
        Of these photos.
    head
        Whose landmarks the faces show.
    turn
        The likeliest arrangement of the photos, with others in the order of their likelihood.
    """
    if not turn.others:
        return turn
    tried = (turn, *turn.others)
    fewest = min(int(each.above.sum()) for each in tried)
    told = (0.0, *(other.margin - 1 for other in turn.others))
    freer = [FREER * (int(each.above.sum()) - fewest) for each in tried]
    seen = Silhouettes.of(masks, head, OPTIONS)
    begun = [
        _Cameras.of(capture, masks, head, each, seen, sum(prior)).refined(COARSE)
        for each, *prior in zip(tried, told, freer, strict=True)
    ]
    begun.sort(key=lambda cameras: cameras.cost)
    coarse = [each.cost - begun[0].cost for each in begun]
    near = [each for each, more in zip(begun, coarse, strict=True) if more < NEAR]
    near = sorted((each.refined(FINE) for each in near), key=lambda cameras: cameras.cost)
    gaps = [each.cost - near[0].cost for each in near[1:]] + coarse[len(near) :]
    first, best, margin = near[0], near[0].turn, 1 + min(gaps)
    next_best = (*near, *begun[len(near) :])[1].turn
    if not first.fits:
        best, next_best, margin = turn, turn.others[0], turn.margin
    doubts = best.doubts
    if margin < UNSURE:
        doubts = (*doubts, _doubt(capture, best, next_best))
    judged: Turnaround = replace(best, margin=margin, doubts=doubts, others=())
    return judged


@dataclass(frozen=True, eq=False)
class _Cameras:
    """An arrangement and the cameras that fit it."""

    turn: Turnaround
    problem: TurnFit
    fit: Fit
    prior: float
    """What it costs beside the misfit of its cameras."""

    @classmethod
    def of(
        cls,
        capture: Capture,
        masks: Sequence[Mask],
        head: Head,
        turn: Turnaround,
        seen: Silhouettes,
        prior: float,
    ) -> Self:
        """Return the nominal cameras of an arrangement; `seen` is what all masks show."""
        ordered = tuple(masks[i] for i in turn.order)
        problem = TurnFit.of(
            capture.arranged(turn), ordered, head, OPTIONS, seen.arranged(turn.order)
        )
        return cls(turn, problem, problem.start(flat=False), prior)

    @property
    def cost(self) -> float:
        """Return what the arrangement costs by photos and cameras, a photo."""
        return self.prior + float(np.log(self.fit.cost))

    @property
    def fits(self) -> bool:
        """Return whether outlines and faces agree with the cameras."""
        return self.fit.cost < FITS * len(self.turn.names)

    def refined(self, noise: float) -> Self:
        """Return the cameras fitted to outlines of so many times their noise."""
        fit, _ = self.problem.search(ROUNDS).descend(self.fit, noise, ROUNDS)
        return replace(self, fit=fit)


def _doubt(capture: Capture, one: Turnaround, other: Turnaround) -> str:
    """Return which photos have another place in an arrangement that fits nearly as well."""
    moved = moved_photos(one.azimuth_deg, one.above, other.azimuth_deg, other.above)
    names = [capture.views[k].photo_name for k in np.flatnonzero(moved)]
    more = f" and {len(names) - MOST_TOLD} more" if len(names) > MOST_TOLD else ""
    listed = ", ".join(names[:MOST_TOLD]) + more
    return f"unsure: {listed} may have another place, which fits nearly as well"
