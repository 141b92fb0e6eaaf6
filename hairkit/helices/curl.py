"""Curl of strands: radius, pitch and handedness.

Strands are put on helix arcs, which takes noise off, and parted into a course, the running mean
over a turn, and the swing about it. In a frame that does not turn about the course the swing of a
coil is a point that circles: its rate is one over the length of a turn, its distance the radius,
its sense the handedness. Waves in a plane go to and fro, which is as much right as left turning.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.ndimage import uniform_filter1d

from hairkit.arrays import Float64Array, Int64Array
from hairkit.helices.helix_strands import smooth_strands
from hairkit.types.groom import HairMaterial
from hairkit.types.strands import Strands

STEP = 0.001
"""Metres between the samples that curl is measured on."""
NOISE = 0.0006
"""Strands are first put on helix arcs within this mean distance, metres, which takes off noise."""
LONGEST_PITCH, SHORTEST_PITCH = 0.12, 0.006
"""Metres along the strand of one turn; slower swings belong to the strand's course."""
ROOT_PART = 0.03
"""Metres from the root, where curls have not grown in yet, that are left out."""
FEWEST_TURNS = 1.2
"""A strand with fewer turns has no curl."""
SMALLEST = 0.0018
"""Metres; swings below this radius are frizz."""
CLEAR = 0.35
"""Share of the swing's power that the turning frequency must hold."""
SAME_TURN = 0.03
"""Change of a turn's length, as a share of it, below which the course is not measured again."""
MOST_ROUNDS = 4
"""Times that the course is measured: it is what is slower than a turn, which is found by it."""
FEWEST_SAMPLES = 8
"""A swing of fewer samples has no frequency."""
PADDING = 8
"""Length of the transform over that of the swing: frequencies between whole numbers of turns."""
PEAK_BINS = 2 * PADDING
"""Half width of the spectrum's peak, in bins: a Hann window's main lobe."""
ONE_SIDED = 0.4
"""Difference of right and left turning power, as a share of both, from which curls have a hand."""


@dataclass(frozen=True, eq=False)
class Curl:
    """Curl of every strand; 0 where a strand has none."""

    radius: Float64Array
    """(S,) of the helix about its axis, metres."""
    pitch: Float64Array
    """(S,) length of one turn along the axis, metres."""
    handedness: Int64Array
    """(S,) 1 turns as a right-handed screw, -1 left-handed, 0 in a plane, both ways or none."""

    def __len__(self) -> int:
        return len(self.radius)

    @property
    def curled(self) -> np.ndarray[tuple[int, ...], np.dtype[np.bool_]]:
        """(S,) strands that have a curl."""
        return np.asarray(self.radius > 0)

    def written_to(self, material: HairMaterial) -> HairMaterial:
        """Return the material with the median radius and pitch of all strands."""
        radius, pitch, _ = self._median(np.ones(len(self), bool))
        return replace(material, curl_radius=radius, curl_pitch=pitch)

    def _median(
        self, chosen: np.ndarray[tuple[int, ...], np.dtype[np.bool_]]
    ) -> tuple[float, float, int]:
        some = chosen & self.curled
        if 2 * some.sum() <= chosen.sum():
            return 0.0, 0.0, 0
        hand = int(np.sign(np.median(self.handedness[some])))
        return float(np.median(self.radius[some])), float(np.median(self.pitch[some])), hand


def measure_curl(strands: Strands) -> Curl:
    """Return radius, pitch and handedness of every strand, root first."""
    if not len(strands):
        return _join([])
    smooth = smooth_strands(strands, NOISE).resampled_by_length(STEP)
    bounds = zip(smooth.offsets[:-1], smooth.offsets[1:], strict=True)
    return _join([_curl_of(smooth.points[a:b].astype(np.float64)) for a, b in bounds])


def _curl_of(points: Float64Array) -> tuple[float, float, int]:
    """Return radius, pitch and handedness of one strand sampled every `STEP` metres."""
    step = np.linalg.norm(np.diff(points, axis=0), axis=1).mean()
    skip = int(ROOT_PART / step)
    points = points[min(skip, len(points) // 4) :]
    window = LONGEST_PITCH
    found = (0.0, 0.0, 0)
    for _ in range(MOST_ROUNDS):
        found, turn = _measure(points, step, window)
        if not turn or abs(turn - window) < SAME_TURN * window:
            break
        window = turn
    return found


def _measure(
    points: Float64Array, step: float, window: float
) -> tuple[tuple[float, float, int], float]:
    """Return radius, pitch, handedness and the strand's length of a turn (0: none).

    The course is the running mean over `window`; the rest, seen in a frame that does not turn about
    the course, is a point in the complex plane that circles.
    """
    count = len(points)
    size = max(3, min(round(window / step), count // 2))
    course = uniform_filter1d(points, size, axis=0, mode="nearest")
    edge = size // 2
    inner = slice(edge, count - edge)
    swing, course = (points - course)[inner], course[inner]
    if len(swing) < FEWEST_SAMPLES:
        return (0.0, 0.0, 0), 0.0
    along = np.gradient(course, axis=0)
    pace = np.linalg.norm(along, axis=1)
    first, second = _parallel_frame(along / np.maximum(pace, 1e-12)[:, None])
    place = (swing * first).sum(1) + 1j * (swing * second).sum(1)
    rate, share, side = _turning(place)
    turn = 1 / rate * step if rate > 0 else 0.0
    turns = (len(points) * step) / turn if turn else 0.0
    if share < CLEAR or turns < FEWEST_TURNS or not SHORTEST_PITCH <= turn <= LONGEST_PITCH:
        return (0.0, 0.0, 0), turn if SHORTEST_PITCH <= turn <= LONGEST_PITCH else 0.0
    # a running mean over `size` samples keeps this much of a swing
    kept = 1 - np.sinc(size * rate)
    radius = float(np.sqrt((np.abs(place) ** 2).mean()) / kept)
    hand = int(np.sign(side)) if abs(side) > ONE_SIDED else 0
    if hand == 0:
        radius *= float(np.sqrt(2))  # of a wave in a plane: its amplitude
    if radius < SMALLEST:
        return (0.0, 0.0, 0), turn
    return (radius, turn * float(pace.mean()) / step, hand), turn


def _turning(place: np.ndarray[tuple[int], np.dtype[np.complex128]]) -> tuple[float, float, float]:
    """Return cycles a sample, the share of power there, and right minus left power over both."""
    padded = PADDING * len(place)
    window = np.hanning(len(place))
    power = np.abs(np.fft.fft((place - place.mean()) * window, padded)) ** 2
    half = padded // 2
    right, left = power[1:half], power[-1:-half:-1]
    both = right + left
    peak = int(np.argmax(both))
    near = slice(max(0, peak - PEAK_BINS), peak + PEAK_BINS + 1)
    total = both.sum()
    if total <= 0:
        return 0.0, 0.0, 0.0
    a, b = right[near].sum(), left[near].sum()
    return (peak + 1) / padded, float((a + b) / total), float((a - b) / (a + b))


def _parallel_frame(tangents: Float64Array) -> tuple[Float64Array, Float64Array]:
    """Return two normals (N, 3) that do not turn about the tangents (parallel transport)."""
    first = np.empty_like(tangents)
    spare = np.eye(3)[np.argmin(np.abs(tangents[0]))]
    first[0] = np.cross(tangents[0], spare)
    first[0] /= np.linalg.norm(first[0])
    for k in range(len(tangents) - 1):
        total = tangents[k + 1] + tangents[k]
        # the smallest rotation that takes one tangent to the next
        moved = first[k] - total * (first[k] @ tangents[k + 1]) / max(total @ tangents[k], 1e-9)
        first[k + 1] = moved - tangents[k + 1] * (moved @ tangents[k + 1])
        first[k + 1] /= max(np.linalg.norm(first[k + 1]), 1e-12)
    return first, np.cross(tangents, first)


def _join(found: list[tuple[float, float, int]]) -> Curl:
    radius, pitch, hand = zip(*found, strict=True) if found else ((), (), ())
    return Curl(np.array(radius, float), np.array(pitch, float), np.array(hand, np.int64))
