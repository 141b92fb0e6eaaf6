"""Small motions of a hanging beam that its clamp shakes: the modal solution, exact in time."""

from __future__ import annotations

import numpy as np
from scipy.linalg import eigh

from hairkit.arrays import Float64Array

MODES, ELEMENTS = 12, 200


def modes(
    length: float, bending: float, gravity: float
) -> tuple[Float64Array, Float64Array, Float64Array]:
    """Return angular frequencies, tip displacements and participations of a hanging beam's modes.

    w'' B'' - (g (L - x) w')' by cubic Hermite elements, of unit mass per length; B = `bending` in
    m^4/s^2. Clamped at the top, free at the tip.
    """
    h = length / ELEMENTS
    scale = np.array([1, h, 1, h])
    both = np.outer(scale, scale)
    bend = np.array([[12, 6, -12, 6], [6, 4, -6, 2], [-12, -6, 12, -6], [6, 2, -6, 4]])
    taut = np.array([[36, 3, -36, 3], [3, 4, -3, -1], [-36, -3, 36, -3], [3, -1, -3, 4]])
    heavy = np.array([[156, 22, 54, -13], [22, 4, 13, -3], [54, 13, 156, -22], [-13, -3, -22, 4]])
    size = 2 * (ELEMENTS + 1)
    stiffness, mass, load = np.zeros((size, size)), np.zeros((size, size)), np.zeros(size)
    for e in range(ELEMENTS):
        at = slice(2 * e, 2 * e + 4)
        tension = gravity * (length - (e + 0.5) * h)
        stiffness[at, at] += both * (bending / h**3 * bend + tension / (30 * h) * taut)
        mass[at, at] += both * heavy * h / 420
        load[at] += scale * h * np.array([1 / 2, 1 / 12, 1 / 2, -1 / 12])
    square, shape = eigh(stiffness[2:, 2:], mass[2:, 2:], subset_by_index=[0, MODES - 1])
    return np.sqrt(square), shape[-2], shape.T @ load[2:]


def shaken_tip(
    time: Float64Array,
    size: float,
    hertz: float,
    drag: float,
    beam: tuple[Float64Array, Float64Array, Float64Array],
) -> Float64Array:
    """Return the tip's place while the clamp is at `size` sin(2 pi f t), from rest at t = 0.

    `drag` in 1/s is the rate of still air. With u = w - X: q'' + c q' + o^2 q = -p (X'' + c X').
    """
    turn = 2 * np.pi * hertz
    tip: Float64Array = size * np.sin(turn * time)
    for own, shape, part in zip(*beam, strict=True):
        push = part * size * (turn**2 - 1j * drag * turn)
        steady = push / (own**2 - turn**2 + 1j * drag * turn)
        start = -steady.imag
        speed = -part * size * turn - (1j * turn * steady).imag
        ring = np.sqrt(own**2 - drag**2 / 4)
        free = start * np.cos(ring * time) + (speed + drag / 2 * start) / ring * np.sin(ring * time)
        q = (steady * np.exp(1j * turn * time)).imag + np.exp(-drag / 2 * time) * free
        tip = tip + shape * q
    return tip
