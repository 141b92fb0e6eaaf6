"""Skin in two layers (Weyrich et al. 2006): the twins of its shaders in NumPy.

Above, a film of oil reflects: a microfacet lobe. Below, light that has entered is scattered: it
leaves the skin some millimetres away. Its profile around the place of entry is that of a single
exponential, R(r) = exp(-r / d) / (2 pi d r), d the diffuse mean free path, one for each channel.
On the screen it is applied by a separable kernel, the profile integrated across its direction
(Jimenez et al. 2015, the pre-integrated kernel), which is exact for light that varies along one
direction: a(x) = K0(|x| / d) / (pi d), K0 the modified Bessel function.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from hairkit.arrays import Float64Array
from hairkit.types.skin_look import SkinLook

LIFT = np.float32(0.007)
"""Metres above the skin where light is looked up: its own cells of the coarse volume are dark."""
WRAP = (np.float32(0.28), np.float32(0.18), np.float32(0.14))
"""How far red, green and blue light reach past the terminator, as a cosine."""
TAPS = 17
"""Samples of the kernel: the middle, and as many to either side."""
REACH = 4.0
"""Largest offset of a sample, in the longest mean free path; 0.6 % of the light goes farther."""
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


def diffusion_kernel(look: SkinLook) -> Float64Array:
    """Return (TAPS, 4) weights of red, green and blue, and the offset in metres; the middle first.

    Offsets grow with the square of their number. A weight is the kernel's integral over the cell
    around its offset, and each channel's sum is 1.
    """
    half = (TAPS - 1) // 2
    reach = REACH * max(look.mean_free_path)
    offsets = reach * (np.arange(half + 1) / half) ** 2
    edges = np.append(0.5 * (offsets[1:] + offsets[:-1]), reach)
    weights = np.zeros((half + 1, 3))
    for channel, path in enumerate(look.mean_free_path):
        share = _within(edges / path) if path > 0 else np.ones(half + 1)
        weights[:, channel] = np.diff(share, prepend=0.0) / share[-1]
    sides = np.column_stack([0.5 * weights[1:], offsets[1:]])
    mirrored = sides * [1, 1, 1, -1]
    middle = np.append(weights[0], 0.0)
    return np.concatenate([middle[None], sides, mirrored])


def _within(distance: Float64Array) -> Float64Array:
    """Return the share of light within a distance in mean free paths: 2 / pi int_0^x K0."""
    from scipy.special import iti0k0

    return np.asarray(2 / np.pi * iti0k0(distance)[1])


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
