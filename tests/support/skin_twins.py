"""The twins of the skin's shaders in NumPy: the lobe of its oil, and scattering on a plane."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from hairkit.arrays import Float64Array
from hairkit.rendering.skin_lobe import diffusion_kernel
from hairkit.types.skin_look import SkinLook

_WALTER = (3.535, 2.181, 2.276, 2.577, 1.6)
"""Coefficients of Beckmann's shadowing, and where it ends (Walter et al. 2007)."""


def reflect(
    look: SkinLook, normal: npt.ArrayLike, light: npt.ArrayLike, eye: npt.ArrayLike
) -> Float64Array:
    """Return (N,) f (n.l), what the oil reflects of light for each steradian.

    `normal`, `light` and `eye` are unit vectors (N, 3), the last two away from the surface.
    """
    n, s, v = (np.atleast_2d(np.asarray(each, np.float64)) for each in (normal, light, eye))
    nl, nv = (n * s).sum(axis=1), (n * v).sum(axis=1)
    half = s + v
    half /= np.maximum(np.linalg.norm(half, axis=1, keepdims=True), 1e-12)
    nh, vh = np.maximum((n * half).sum(axis=1), 0), np.maximum((v * half).sum(axis=1), 0)
    alpha = look.roughness**2
    seen = (nl > 0) & (nv > 0)
    nl, nv = np.where(seen, nl, 1), np.where(seen, nv, 1)
    shape = distribution(look.lobe, alpha, nh) * shadowing(look.lobe, alpha, nl, nv, nh, vh)
    return np.asarray(np.where(seen, shape * fresnel(look.f0, vh) / (4 * nv), 0))


def below(look: SkinLook, nl: npt.ArrayLike, nv: npt.ArrayLike) -> Float64Array:
    """Return the share of light that enters the skin and leaves it again through the oil."""
    return (1 - fresnel(look.f0, nl)) * (1 - fresnel(look.f0, nv))


def distribution(lobe: str, alpha: float, nh: npt.ArrayLike) -> Float64Array:
    """Return the density of facets whose normals have the cosine `nh`, for each steradian."""
    c2 = np.asarray(nh, np.float64) ** 2
    if lobe == "ggx":
        return np.asarray(alpha**2 / (np.pi * (c2 * (alpha**2 - 1) + 1) ** 2))
    if lobe == "blinn_phong":
        power = max(2 / alpha**2 - 2, 0)
        return np.asarray((power + 2) / (2 * np.pi) * np.sqrt(c2) ** power)
    c2 = np.maximum(c2, 1e-6)
    return np.asarray(np.exp((c2 - 1) / (alpha**2 * c2)) / (np.pi * alpha**2 * c2**2))


def shadowing(
    lobe: str, alpha: float, nl: Float64Array, nv: Float64Array, nh: Float64Array, vh: Float64Array
) -> Float64Array:
    """Return the share of facets that light and eye both see, by the cosines between vectors."""
    if lobe in ("ggx", "beckmann"):
        return smith(lobe, alpha, nl) * smith(lobe, alpha, nv)
    return np.minimum(1, 2 * nh * np.minimum(nl, nv) / np.maximum(vh, 1e-6))


def smith(lobe: str, alpha: float, cosine: npt.ArrayLike) -> Float64Array:
    """Return the share of facets that are seen under a cosine."""
    c = np.asarray(cosine, np.float64)
    if lobe == "ggx":
        return np.asarray(2 * c / (c + np.sqrt(alpha**2 + (1 - alpha**2) * c**2)))
    a = c / (alpha * np.sqrt(np.maximum(1 - c**2, 1e-9)))
    top, square, low, high, end = _WALTER
    return np.asarray(np.where(a < end, a * (top + square * a) / (1 + a * (low + high * a)), 1.0))


def fresnel(f0: float, cosine: npt.ArrayLike) -> Float64Array:
    """Return the reflectance of a smooth surface under a cosine (Schlick 1994)."""
    return np.asarray(f0 + (1 - f0) * np.clip(1 - np.asarray(cosine, np.float64), 0, 1) ** 5)


def diffuse(light: Float64Array, look: SkinLook, metres: float) -> Float64Array:
    """Return flat light (H, W, 3) after both passes of the kernel, pixels of so many metres.

    The twin of `skin_diffuse.frag` on a plane that faces the camera; the edge is repeated.
    """
    kernel = diffusion_kernel(look)
    for axis in (0, 1):
        place = np.arange(light.shape[axis], dtype=np.float64)
        total = np.zeros_like(light)
        for *weights, offset in kernel:
            at = np.clip(place + offset / metres, 0, len(place) - 1)
            low = np.minimum(at.astype(int), len(place) - 2)
            part = (at - low).reshape([-1 if k == axis else 1 for k in range(3)])
            first, second = (np.take(light, low + k, axis=axis) for k in (0, 1))
            total += ((1 - part) * first + part * second) * weights
        light = total
    return light
