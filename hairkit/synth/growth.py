"""Procedural grooms: strands grown from the scalp under combing, gravity and collision.

Meant for tests and for users without photos; `hairkit.synth.photograph` takes pictures of them.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np
from scipy.spatial import cKDTree

from hairkit.arrays import BoolArray, Float32Array, Int64Array, across, unit_vectors
from hairkit.errors import InputError
from hairkit.head_model.scalp import sample_roots
from hairkit.synth.bust import Bust, Obstacle
from hairkit.synth.grow_ponytails import choose_fringe, grow_tied
from hairkit.types.groom import Groom, HairMaterial
from hairkit.types.head import Head, Roots
from hairkit.types.strands import Strands

StyleName = Literal["straight", "wavy", "curly", "short", "parted", "tied"]


@dataclass(frozen=True)
class Style:
    """Parameters of a hairstyle; metres unless stated."""

    length: float
    points: int
    """Points a strand."""
    parting: float | None
    """Place of the parting, +x the subject's left; None combs away from the crown."""
    lift: float
    """Weight of the scalp's normal in the first direction; the rest is combing."""
    bend: float
    """Length over which gravity turns a strand down; infinity for hair that stands."""
    layer: float
    """Thickness of the hair over the head."""
    cut: float | None
    """Height below which hair is cut off."""
    wave_radius: float
    wave_pitch: float
    coil: float
    """0 waves in a plane, 1 round coils."""
    clumps: int
    clumping: float
    """Clumping of strands at the tip, 0 to 1."""
    frizz: float
    colour: tuple[float, float, float]
    """Linear RGB."""
    length_spread: float = 0.08
    """Standard deviation of strand lengths, share of the length."""
    tail: float = 0.0
    """Mean length of the tail behind the tie; 0 for loose hair."""


STYLES: dict[StyleName, Style] = {
    "straight": Style(
        length=0.38, points=72, parting=0.0, lift=0.3, bend=0.028, layer=0.014, cut=-0.30,
        wave_radius=0.0, wave_pitch=0.0, coil=0.0, clumps=500, clumping=0.35, frizz=0.0012,
        colour=(0.060, 0.036, 0.022),
    ),
    "wavy": Style(
        length=0.36, points=96, parting=0.015, lift=0.35, bend=0.03, layer=0.018, cut=-0.27,
        wave_radius=0.0065, wave_pitch=0.070, coil=0.4, clumps=180, clumping=0.6, frizz=0.002,
        colour=(0.115, 0.062, 0.030),
    ),
    "curly": Style(
        length=0.21, points=128, parting=-0.02, lift=0.5, bend=0.022, layer=0.026, cut=-0.20,
        wave_radius=0.0075, wave_pitch=0.034, coil=1.0, clumps=420, clumping=0.75, frizz=0.003,
        colour=(0.030, 0.019, 0.013),
    ),
    "short": Style(
        length=0.035, points=24, parting=None, lift=0.55, bend=0.12, layer=0.004, cut=None,
        wave_radius=0.0, wave_pitch=0.0, coil=0.0, clumps=900, clumping=0.3, frizz=0.0008,
        colour=(0.100, 0.058, 0.032), length_spread=0.15,
    ),
    "parted": Style(
        length=0.20, points=56, parting=0.03, lift=0.35, bend=0.03, layer=0.013, cut=-0.135,
        wave_radius=0.0, wave_pitch=0.0, coil=0.0, clumps=420, clumping=0.35, frizz=0.001,
        colour=(0.300, 0.190, 0.095),
    ),
    "tied": Style(
        length=0.32, points=72, parting=None, lift=0.3, bend=0.03, layer=0.008, cut=None,
        wave_radius=0.0, wave_pitch=0.0, coil=0.0, clumps=600, clumping=0.1, frizz=0.0008,
        colour=(0.110, 0.060, 0.030), tail=0.20,
    ),
}  # fmt: skip

CROWN_BACK = 0.035
"""The crown lies this far behind the head's origin."""
COMB_REACH = 0.05
"""Arc length over which combing fades."""
ROOT_REACH = 0.03
"""Arc length over which a strand reaches its layer, its wave and its clump."""
SKIN_GAP = 0.001
"""Hair keeps this far off the skin."""
MOST_STRANDS = 200_000

PARTING_REACH = 0.08
"""Behind the head's origin, the way from combing at the parting to combing from the crown."""
PARTING_DROP, PARTING_BACK = 0.25, 0.45
"""Combing down and back at the parting, over that to the side."""
COMB_JITTER = 0.12
"""Standard deviation of first directions, of a unit vector."""
LAYER_PARTS = (0.1, 0.6, 0.3)
"""Shares of the layer's thickness: least, by the root's height, at random."""
START_PULL = 0.6
"""Pull along the first direction at the root, over that of gravity."""
CUT_SPREAD = 0.008
"""Standard deviation of the height at which hair is cut."""
CLUMP_REACH = 0.03
"""Clumps gather strands by where they are after this length along their first direction."""
PHASE_SLOPE = np.array([30.0, 20.0, 40.0])
"""Radians of a wave's phase per metre between roots: neighbouring clumps wave nearly together."""
CLUMP_PHASE, STRAND_PHASE = 0.9, 0.35
"""Standard deviations of a wave's phase, radians."""
PITCH_SPREAD, RADIUS_SPREAD = 0.12, 0.2
"""Standard deviations between clumps, shares of a wave's pitch and radius."""
FLYAWAYS, FLYAWAY_FRIZZ = 0.02, 5.0
"""Share of strands that fly away, and how many times the frizz of others they have."""
FRIZZ_TURNS = (1.5, 4.0, 9.0)
"""Waves over a strand whose sum is its frizz."""
FRINGE_LENGTH = 0.10
"""Length of the loose strands over the forehead of tied hair, metres."""
TIP_LIGHTNESS = 1.25
"""Reflectance at the tips over that at the roots."""
_DOWN = np.array([0, -1, 0], np.float32)
_LEVEL = np.array([1, 0, 1], np.float32)


def grow(style: StyleName, head: Head, strands: int = 10_000, seed: int = 0) -> Groom:
    """Return a groom of a style, `strands` hairs on a head; equal seeds give equal hair.

    Raises
    ------
    InputError
        The style is none of `STYLES`, or the number of strands is out of bounds.
    """
    if style not in STYLES:
        raise InputError(f"no style {style!r}; styles: {', '.join(get_args(StyleName))}")
    if not 1 <= strands <= MOST_STRANDS:
        raise InputError(f"{strands} strands asked for, expected 1 to {MOST_STRANDS}")
    look = STYLES[style]
    generator = np.random.default_rng(seed)
    roots = sample_roots(head, strands, seed)
    obstacle = Obstacle.of(head, Bust.under(head))
    start = _start_directions(look, head, roots, generator)
    paths = _grow_paths(look, roots, start, obstacle, generator)
    if look.tail:
        paths = _tie(look, paths, head, roots, obstacle, generator)
    paths = _cut(look, paths, generator)
    clump = _clumps(look, roots, start, generator)
    paths = _gather_clumps(look, paths, clump, generator)
    paths = _wind_waves(look, paths, clump, generator) + _frizz(look, strands, generator)
    paths = _push_out(paths, obstacle)
    paths[:, 0] = roots.positions
    return Groom(
        Strands(paths.reshape(-1, 3), np.arange(strands + 1) * look.points, root_uv=roots.uv),
        head,
        roots.triangle,
        roots.barycentric,
        _material(look),
    )


def _tie(
    look: Style,
    loose: Float32Array,
    head: Head,
    roots: Roots,
    obstacle: Obstacle,
    generator: np.random.Generator,
) -> Float32Array:
    """Return strands (N, m, 3) of which all but the fringe run through a tie."""
    fringe = choose_fringe(roots, generator)
    paths = grow_tied(look.tail, look.points, head, roots, obstacle, generator)
    some = np.arange(look.points)[None, :, None] * FRINGE_LENGTH / look.length
    low = np.minimum(some.astype(np.int64), look.points - 2)
    short = np.take_along_axis(loose, low, axis=1) * (1 - (some - low))
    short += np.take_along_axis(loose, low + 1, axis=1) * (some - low)
    return np.where(fringe[:, None, None], short, paths).astype(np.float32)


def _start_directions(
    look: Style, head: Head, roots: Roots, generator: np.random.Generator
) -> Float32Array:
    """Return (N, 3) first directions: the normal, and combing along the skin."""
    top = float(head.vertices[:, 1].max())
    crown = np.array([0.0, top, -CROWN_BACK], np.float32)
    away = roots.positions - crown
    if look.parting is not None:
        from_parting = roots.positions[:, 0] - look.parting
        side = np.where(from_parting >= 0, 1.0, -1.0)
        # at the back hair falls from the crown
        behind = np.clip(-roots.positions[:, 2] / PARTING_REACH, 0, 1)
        drop, back = np.full_like(side, -PARTING_DROP), np.full_like(side, -PARTING_BACK)
        parted = np.stack([side, drop, back], axis=1)
        away = (1 - behind[:, None]) * parted + behind[:, None] * unit_vectors(away)
    along = across(roots.normals, away)
    jitter = COMB_JITTER * generator.standard_normal((len(roots), 3))
    return unit_vectors(look.lift * roots.normals + unit_vectors(along) + jitter)


def _grow_paths(
    look: Style,
    roots: Roots,
    start: Float32Array,
    obstacle: Obstacle,
    generator: np.random.Generator,
) -> Float32Array:
    """Return (N, m, 3) smooth strands: each step turns towards gravity and slides over bodies."""
    count, m = len(roots), look.points
    spread = generator.standard_normal((count, 1)) * look.length_spread
    length = (look.length * np.clip(1 + spread, 0.5, 1.5)).astype(np.float32)
    step = length / (m - 1)
    # hair from higher roots lies over hair from lower ones
    height = roots.positions[:, 1:2]
    rank = (height - height.min()) / max(float(np.ptp(height)), 1e-6)
    least, by_height, chance = LAYER_PARTS
    layer = look.layer * (least + by_height * rank + chance * generator.random((count, 1)))
    paths = np.empty((count, m, 3), np.float32)
    paths[:, 0] = roots.positions
    direction = start
    for i in range(1, m):
        arc = step * i
        pull = _DOWN + START_PULL * np.exp(-arc / COMB_REACH) * start
        direction = unit_vectors(direction + step / look.bend * pull)
        ahead = paths[:, i - 1] + step * direction
        distance, outward = obstacle.at(ahead.astype(np.float32))
        wanted = np.maximum(layer * np.minimum(arc / ROOT_REACH, 1), SKIN_GAP)
        ahead = ahead + np.clip(wanted - distance, 0, step) * outward
        direction = unit_vectors(ahead - paths[:, i - 1])
        paths[:, i] = paths[:, i - 1] + step * direction
    return paths


def _cut(look: Style, paths: Float32Array, generator: np.random.Generator) -> Float32Array:
    """Return the strands cut off where they first come below the line, points spread again."""
    if look.cut is None:
        return paths
    line = look.cut + CUT_SPREAD * generator.standard_normal((len(paths), 1))
    return cut_strands(paths, paths[..., 1] < line)


def cut_strands(paths: Float32Array, beyond: BoolArray, least: int = 2) -> Float32Array:
    """Return strands (N, m, 3) cut off at their first point `beyond` (N, m), points spread again.

    Each keeps its first `least` segments.
    """
    count, m, _ = paths.shape
    last = np.where(beyond.any(axis=1), np.maximum(beyond.argmax(axis=1), least), m - 1)
    place = np.linspace(0, 1, m)[None, :] * last[:, None]
    low = np.minimum(place.astype(np.int64), m - 2)
    t = (place - low)[..., None].astype(np.float32)
    rows = np.arange(count)[:, None]
    return np.asarray(paths[rows, low] * (1 - t) + paths[rows, low + 1] * t)


def _clumps(
    look: Style, roots: Roots, start: Float32Array, generator: np.random.Generator
) -> Int64Array:
    """Return (N,) the strand that leads each strand's clump: near, and combed to the same side."""
    place = roots.positions + CLUMP_REACH * start
    leaders = generator.permutation(len(roots))[: min(look.clumps, len(roots))]
    return np.asarray(leaders[cKDTree(place[leaders]).query(place)[1]])


def _gather_clumps(
    look: Style, paths: Float32Array, clump: Int64Array, generator: np.random.Generator
) -> Float32Array:
    t = np.linspace(0, 1, look.points, dtype=np.float32)[None, :, None]
    strength = look.clumping * generator.random((len(paths), 1, 1), dtype=np.float32) ** 0.5
    return paths + strength * t * (paths[clump] - paths)


def _wind_waves(
    look: Style, paths: Float32Array, clump: Int64Array, generator: np.random.Generator
) -> Float32Array:
    """Return strands wound about their paths; a clump waves together."""
    if look.wave_radius == 0:
        return paths
    count = len(paths)
    first, second = _frames(paths)
    step = np.linalg.norm(np.diff(paths, axis=1), axis=2)
    arc = np.concatenate([np.zeros((count, 1)), np.cumsum(step, axis=1)], axis=1)
    phase = paths[clump, 0] @ PHASE_SLOPE
    phase += CLUMP_PHASE * generator.standard_normal(count)[clump]
    phase += STRAND_PHASE * generator.standard_normal(count)
    pitch = look.wave_pitch * (1 + PITCH_SPREAD * generator.standard_normal(count)[clump])
    radius = look.wave_radius * (1 + RADIUS_SPREAD * generator.standard_normal(count)[clump])
    turn = phase[:, None] + 2 * np.pi * arc / pitch[:, None]
    swell = radius[:, None] * np.minimum(arc / (2 * ROOT_REACH), 1)
    wave = np.cos(turn)[..., None] * first + look.coil * np.sin(turn)[..., None] * second
    return np.asarray(paths + swell[..., None] * wave, np.float32)


def _frames(paths: Float32Array) -> tuple[Float32Array, Float32Array]:
    """Return two (N, m, 3) unit vectors across each path, the first level and along the head."""
    tangent = unit_vectors(np.gradient(paths, axis=1))
    outward = paths.mean(axis=1, keepdims=True) * _LEVEL
    sideways = np.cross(np.broadcast_to(-_DOWN, outward.shape), outward)
    first = unit_vectors(across(tangent, sideways))
    return first, np.cross(tangent, first).astype(np.float32)


def _frizz(look: Style, count: int, generator: np.random.Generator) -> Float32Array:
    """Return (N, m, 3) small random offsets, a few strands flying away further."""
    t = np.linspace(0, 1, look.points)[None, :, None]
    amount = look.frizz * np.where(generator.random((count, 1, 1)) < FLYAWAYS, FLYAWAY_FRIZZ, 1.0)
    total = np.zeros((count, look.points, 3))
    for turns in FRIZZ_TURNS:
        axis = generator.standard_normal((count, 1, 3))
        phase = 2 * np.pi * generator.random((count, 1, 1))
        total += axis * np.sin(phase + 2 * np.pi * turns * t) / turns
    return np.asarray(amount * np.sqrt(t) * total, np.float32)


def _push_out(paths: Float32Array, obstacle: Obstacle) -> Float32Array:
    """Return the strands with every point pushed out of head and torso."""
    points = paths.reshape(-1, 3)
    for _ in range(2):
        distance, outward = obstacle.at(points)
        points = points + np.maximum(SKIN_GAP - distance, 0) * outward
    return points.reshape(paths.shape)


def _material(look: Style) -> HairMaterial:
    root = np.array(look.colour)
    tip = np.minimum(root * TIP_LIGHTNESS, 1)
    return HairMaterial(root, tip, curl_radius=look.wave_radius, curl_pitch=look.wave_pitch)
