"""Skin in two layers (Weyrich et al. 2006): the kernel of what is scattered, and constants.

Above, a film of oil reflects: a microfacet lobe. Below, light that has entered is scattered: it
leaves the skin some millimetres away. Its profile around the place of entry is that of a single
exponential, R(r) = exp(-r / d) / (2 pi d r), d the diffuse mean free path, one for each channel.
On the screen it is applied by a separable kernel, the profile integrated across its direction
(Jimenez et al. 2015, the pre-integrated kernel), which is exact for light that varies along one
direction: a(x) = K0(|x| / d) / (pi d), K0 the modified Bessel function.
"""

from __future__ import annotations

import numpy as np

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
