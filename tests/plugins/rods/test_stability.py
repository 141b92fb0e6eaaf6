"""The plugin's rods against the loads at which rods buckle, coil up and leave their plane.

The least stiffness of small motions about the equilibrium, by the forces of the twin,
passes 0 at the critical load; runs in time a little below and above it agree.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from hairkit_plugins.rods.linear_system import Rates, assemble
from hairkit_plugins.rods.rods import (
    Rods,
    State,
    balance_load,
    rest_state,
    transport_frames,
    twist_between,
)
from rods_bench import (
    DENSITY,
    DOWN,
    LENGTH,
    NOTHING,
    WEIGHT,
    G,
    balanced,
    clamped,
    displaced,
    load_of,
    naturally_bent,
    rods_of,
    settled,
    spun,
    straight,
)
from rods_modes import linearised, one_of
from rods_reference import substep
from scipy.integrate import solve_bvp, solve_ivp
from scipy.optimize import brentq
from scipy.special import jv

from hairkit.arrays import Float64Array
from hairkit.simulation import quaternion

EI, GJ = 1e-8, 0.77e-8


def critical(lowest: Callable[[float], float], expected: float) -> float:
    """Return where the least stiffness passes 0, within a fifth of what is expected."""
    return float(brentq(lowest, 0.8 * expected, 1.2 * expected, xtol=1e-3 * expected))


def test_upright_hair_falls_over_beyond_the_critical_length() -> None:
    """Gamma_c = 7.8373: at 7.5 a small lean heals, at 8.2 it grows."""
    gamma = np.array([7.5, 8.2])
    bending = WEIGHT * LENGTH**3 / gamma[:, None]
    rods = rods_of(straight(2, 33, (0, 1, 0)), DENSITY, bending, straight=True)
    lean = 1e-3 * LENGTH * np.linspace(0, 1, 33)[:, None] ** 2 * np.array([1.0, 0, 0])
    tip = settled(rods, DOWN, start=displaced(rods, lean), drag=1.0, step=0.02, steps=300).position[
        :, -1, 0
    ]
    assert abs(tip[0]) < 0.5 * lean[-1, 0]
    assert tip[1] > 10 * lean[-1, 0]


def test_a_column_buckles_under_eulers_load() -> None:
    """P_c = pi^2 EI / 4 L^2 on the free end of a column: to 0.2 %."""

    def lowest(load: float) -> float:
        rods = rods_of(straight(1, 25, (0, 1, 0)), DENSITY, EI, straight=True)
        force = np.zeros((25, 3))
        force[-1, 1] = -load * EI / LENGTH**2
        return linearised(rods, rest_state(rods), force).lowest()

    assert critical(lowest, np.pi**2 / 4) == pytest.approx(np.pi**2 / 4, rel=0.002)


@pytest.mark.parametrize(("order", "factor"), [(-1 / 4, 2), (-1 / 6, 6)])
def test_a_level_strand_turns_aside_under_prandtls_load(order: float, factor: float) -> None:
    """Lateral buckling: P_c = 4.013 sqrt(EI GJ) / L^2, w_c = 12.85 sqrt(EI GJ) / L^3, to 0.3 %.

    A strand whose natural curvature carries its load straight has the second variation of a strip,
    EI v''^2 / 2 + GJ phi'^2 / 2 - M phi v'', so that phi'' + M^2 phi / (EI GJ) = 0. With M = P x
    from the tip, or w x^2 / 2, phi is sqrt(x) J(c x^2 / 2), or sqrt(x) J(c x^3 / 3), J of order
    -1/4, or -1/6, and c = P, or w / 2, over sqrt(EI GJ): it is held where J has its first zero.
    """
    law = factor * brentq(lambda x: jv(order, x), 1.5, 2.5)

    def lowest(share: float) -> float:
        rods, force = borne_straight(np.array([share]), factor == 2, 21)
        return linearised(rods, rest_state(rods), force[0]).lowest()

    assert law == pytest.approx(4.0126 if factor == 2 else 12.854, abs=1e-3)
    assert critical(lowest, law) == pytest.approx(law, rel=0.003)


def test_a_level_strand_stays_below_prandtls_load_and_turns_aside_above() -> None:
    """In time: at 0.9 of 12.85 sqrt(EI GJ) / L^3 a push aside dies, at 1.1 it grows."""
    rods, force = borne_straight(np.array([0.9, 1.1]) * 12.854, False, 16)
    aside = 1e-4 * LENGTH * np.linspace(0, 1, 16)[:, None] ** 2 * np.array([0, 0, 1.0])
    start = displaced(rods, aside)
    state = settled(rods, NOTHING, force=force, start=start, step=1 / 100, steps=200)
    pushes = np.abs(state.position[:, -1, 2]) / aside[-1, 2]
    assert pushes[0] < 0.5
    assert pushes[1] > 2.0


@pytest.mark.parametrize("taut", [25.0, 100.0])
def test_a_twisted_taut_rod_coils_up_as_greenhill_says(taut: float) -> None:
    """The torque at which a rod between clamps leaves its line, T L^2 / EI = 25 and 100: to 2 %.

    u = y + i z has EI u'''' - i M u''' - T u'' = 0 between clamps: a linear part and two waves. The
    long rod's limit M_c = 2 sqrt(EI T), where the waves meet, is approached from above.
    """
    nodes = 33

    def lowest(torque: float) -> float:
        rods = clamped(rods_of(straight(1, nodes), DENSITY, EI, GJ, straight=True))
        free_length = LENGTH * (nodes - 2) / (nodes - 1)
        turn = torque * EI / free_length / GJ * rods.length[0, 0]
        frames = balanced(rods, spun(rods.frames, turn * np.arange(nodes - 1.0)[None]))
        force, along = np.zeros((nodes, 3)), np.zeros((3 * nodes, 1))
        force[-1, 0] = taut * EI / free_length**2
        along[[-6, -3]] = 1.0
        free = np.hstack([np.eye(3 * nodes)[:, 6:-6], along])
        return linearised(rods, replace(rest_state(rods), frames=frames), force, free).lowest()

    law = greenhill(taut)
    assert 1.0 < law / (2 * np.sqrt(taut)) < (1.1 if taut > 50 else 1.3)
    assert critical(lowest, law) == pytest.approx(law, rel=0.02)


def greenhill(taut: float) -> float:
    """Return the least torque M L / EI of a clamped rod in tension T L^2 / EI = `taut`."""

    def clamping(torque: float) -> float:
        middle, apart = torque / 2, np.sqrt(torque**2 / 4 - taut)
        one, two = 1j * (middle + apart), 1j * (middle - apart)
        a, b = np.exp(one), np.exp(two)
        rows = [[1, 0, 1, 1], [0, 1, one, two], [1, 1, a, b], [0, 1, one * a, two * b]]
        # the determinant has the phase of i exp(i M / 2), and a zero where the waves meet
        return float((np.linalg.det(rows) * np.exp(-1j * middle)).imag / apart)

    torques = 2 * np.sqrt(taut) * np.linspace(1.001, 2.0, 400)
    signs = np.sign([clamping(torque) for torque in torques])
    first = int(np.flatnonzero(np.diff(signs))[0])
    return float(brentq(clamping, torques[first], torques[first + 1]))


MICHELL = 2 * np.pi * np.sqrt(3) * EI / GJ


def test_a_twisted_ring_leaves_its_plane_as_michell_says() -> None:
    """Tw_c = 2 pi sqrt(3) EI / GJ, to 1.5 % with 24 segments and 0.7 % with 36.

    EI t x t' + M t is balanced by a constant force. Small a along the radius and b across the plane
    obey a' = M b and b'' + b + M a' = 0 (EI and the radius 1): waves of n = 2, 3, ... around the
    ring need M^2 = n^2 - 1, and M = GJ Tw / 2 pi.
    """
    for segments, tolerance in ((24, 0.015), (36, 0.007)):

        def lowest(twist: float, segments: int = segments) -> float:
            rods, state = ring(segments, twist)
            free = np.eye(3 * rods.nodes)[:, 6:-6]
            # a turn of the ring about the held segment costs nothing: hold the opposite node, too
            opposite = 3 * (segments // 2) + 2
            return linearised(rods, state, None, free[:, free[opposite] == 0]).lowest()

        assert critical(lowest, MICHELL) == pytest.approx(MICHELL, rel=tolerance)


def test_a_ring_trades_twist_for_writhe() -> None:
    """In time: flat at 0.9 of Michell's twist, coiled up at 1.25; Lk = Tw + Wr stays, to 1e-3.

    Wr is Gauss's double integral over the closed line, Tw the sum of the elements' twists.
    """
    for share, coils in ((0.9, False), (1.25, True)):
        rods, state = ring(24, share * MICHELL)
        wave = np.cos(2 * np.pi * np.arange(-0.5, 25) / 12)
        wave[[0, 1, -2, -1]] = 0.0
        twisted = displaced(rods, 1e-3 * LENGTH * wave[:, None] * np.array([0, 0, 1.0]))
        turn = share * MICHELL * np.arange(25.0)[None] / 24
        state = replace(twisted, frames=spun(twisted.frames, turn))
        firm = np.where(np.isin(np.arange(26), [1, 24, 25]), 1e12, 0.0)[None]
        system = assemble(rods, Rates(np.full_like(rods.mass, 4.0), 0.0, firm), 1 / 2000)
        for _ in range(200):
            state = substep(rods, system, state, load_of(), None, 2)
        before = rods.before(state.frames)
        twist = float(twist_between(before, state.frames)[0, 1:].sum()) / (2 * np.pi)
        bent = writhe(state.position[0, :-2])
        assert twist + bent == pytest.approx(share * MICHELL / (2 * np.pi), abs=1e-3)
        assert (abs(bent) > 0.1) == coils


def test_a_curved_strand_leaves_its_plane_where_its_linear_theory_says() -> None:
    """Natural curvature 4 / L upwards, clamped level: the weight at which it goes, to 1.5 %.

    Bend and twist: `leaving` derives the theory and shoots it from the clamp, about the elastica.
    """
    ratio = np.array([0.5, 0.77])  # GJ / EI
    laws = [brentq(leaving, 4.0, 13.0, args=(4.0, r), xtol=1e-3) for r in ratio]
    shares = np.array([0.94, 1.0, 1.06])
    weights = np.outer(laws, shares).ravel() * EI / LENGTH**3
    torsion = np.repeat(ratio, 3)[:, None] * EI
    rods = rods_of(straight(6, 33), weights[:, None] / G, EI, torsion, straight=True)
    rods = naturally_bent(rods, np.full(6, 4.0))
    state = settled(rods, DOWN, drag=10.0, step=1 / 100, steps=300)
    frames = transport_frames(state.frames, quaternion.normalize(np.diff(state.position, axis=1)))
    stiffness = np.empty(6)
    for k in range(6):
        one = State(
            *(a[k : k + 1] for a in (state.position, state.velocity, frames, state.acceleration))
        )
        weight = rods.mass[k][:, None] * DOWN
        stiffness[k] = linearised(one_of(rods, k), one, weight).lowest()
    for three in stiffness.reshape(2, 3):
        assert three[0] > 0 > three[2]
        assert np.interp(0.0, -three, shares) == pytest.approx(1.0, rel=0.015)


def leaving(gamma: float, natural: float, ratio: float) -> float:
    """Return what passes 0 where the plane elastica under its weight lets a sideways motion grow.

    Lengths by L, moments by EI / L. Directions of the plane shape turn as d, with the moment
    m = d' - natural and the force (along, across) of what is beyond. Small turns a about the normal
    and f about the tangent change bending by A = a' + f d', torsion by T / ratio = f' - a d', and
    the second variation A^2 / 2 + T^2 / 2 ratio - m (f A - a T / ratio) / 2 + along a^2 / 2 -
    across a f / 2 is least where A' = along a - across f + T (m / ratio - d'), T' = natural A. Both
    vanish at the tip.
    """
    s = np.linspace(0, 1, 41)
    guess = np.stack([natural * s - gamma / 6 * s * (2 - s), natural + 0 * s])
    plane = solve_bvp(
        lambda s, y: np.array([y[1], gamma * (1 - s) * np.cos(y[0])]),
        lambda a, b: np.array([a[0], b[1] - natural]), s, guess, tol=1e-6, max_nodes=100_000,
    )  # fmt: skip
    assert plane.success

    def slope(s: float, y: Float64Array) -> Float64Array:
        turn, bend = plane.sol(s)
        along, across = -gamma * (1 - s) * np.sin(turn), -gamma * (1 - s) * np.cos(turn)
        a, f, big_a, torque = y.reshape(4, 2)
        force = along * a - across * f + torque * ((bend - natural) / ratio - bend)
        return np.concatenate([big_a - f * bend, torque / ratio + a * bend, force, natural * big_a])

    start = np.array([0, 0, 0, 0, 1.0, 0, 0, 1.0])
    end = solve_ivp(slope, (0, 1), start, rtol=1e-7, atol=1e-9).y[4:, -1].reshape(2, 2)
    return float(np.linalg.det(end))


def borne_straight(load: Float64Array, at_tip: bool, nodes: int) -> tuple[Rods, Float64Array]:
    """Return level strands that carry loads (S,) straight, and the forces (S, n, 3), newtons."""
    rods = rods_of(straight(len(load), nodes), DENSITY, EI, GJ)
    share = np.where(np.arange(nodes) == nodes - 1, 1.0, 0.0) if at_tip else rods.mass[0]
    total = load[:, None, None] * np.sqrt(EI * GJ) / LENGTH**2
    force = total * share[:, None] / share.sum() * DOWN / G
    return balance_load(rods, force), force


def ring(segments: int, twist: float) -> tuple[Rods, State]:
    """Return a naturally straight rod closed to a ring, its last segment on the first, twisted."""
    turn = 2 * np.pi * (np.arange(segments + 2) - 0.5) / segments
    points = LENGTH / (2 * np.pi) * np.stack([np.cos(turn), np.sin(turn), 0 * turn], axis=-1)
    rods = clamped(rods_of(points[None], DENSITY, EI, GJ, straight=True))
    even = spun(rods.frames, twist * np.arange(segments + 1.0)[None] / segments)
    return rods, replace(rest_state(rods), frames=balanced(rods, even))


def writhe(corner: Float64Array) -> float:
    """Return the writhe of a closed line: solid angles of all pairs of sides (Gauss) over 2 pi."""
    count = len(corner)
    i, j = np.triu_indices(count, 2)
    keep = (j + 1) % count != i
    i, j = i[keep], j[keep]
    after = np.roll(corner, -1, axis=0)
    a, b, c, d = (
        corner[j] - corner[i],
        after[j] - corner[i],
        after[j] - after[i],
        corner[j] - after[i],
    )
    faces = [quaternion.normalize(np.cross(*pair)) for pair in ((a, b), (b, c), (c, d), (d, a))]
    sines = [(faces[k] * faces[(k + 1) % 4]).sum(axis=1) for k in range(4)]
    angle = np.arcsin(np.clip(sines, -1, 1)).sum(axis=0)
    side = np.cross(after[j] - corner[j], after[i] - corner[i])
    return float((angle * np.sign((side * a).sum(axis=1))).sum() / (2 * np.pi))
