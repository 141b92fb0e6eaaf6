"""Constants of the look of hair, which shaders and compiled loops share.

Light from a fibre is a cheap form of Marschner et al. 2003, Light Scattering from Human Hair
Fibers: R off the surface, TT through the fibre, TRT off its inner back, each a Gaussian about the
tilted cone; multiple scattering is the diffuse term of Kajiya and Kay (1989). What has no source
was chosen by eye.
"""

from __future__ import annotations

import numpy as np

TILT = np.float32(0.0524)
"""Cuticle tilt of 3 degrees, radians; R leans by -2, TT by 1, TRT by 3 times it."""
ROUGHNESS = np.float32(0.14)
"""Longitudinal width of R, radians; TT half, TRT twice as wide (Marschner)."""
FRESNEL = np.float32(0.0465)
"""Reflectance of keratin, index 1.55, at normal incidence."""
R_SCALE, TT_SHARE, TRT_SHARE = np.float32(0.16), np.float32(0.09), np.float32(0.17)
"""Strength of R over its reflectance, and those of TT and TRT."""
TT_FOCUS, TRT_FOCUS = np.float32(4), np.float32(3)
"""How fast TT and TRT fall with the cosine of the angle around the fibre."""
SPREAD = np.float32(0.12)
"""Range over which the angles of the lobes vary from hair to hair, radians."""
DIFFUSE = np.float32(0.26)
"""Scattered light across the fibre, and as much again towards the light."""
BOUNCED = np.float32(0.35)
"""Share of the sky's light that reaches hair below other hair, scattered by it."""
SKYWARD = np.float32(0.3)
"""Height of the direction, 1 up and -1 down, whose ambient light hair scatters."""
OTHER = np.float32(61.8034)
"""The fractional part of this times a strand's random number is another one."""
LEAST_POWER, POWERS = np.float32(0.85), np.float32(0.3)
"""Least exponent of a strand's colour, and its range from hair to hair."""
LEAST_BRIGHT, BRIGHTS = np.float32(0.3), np.float32(1.4)
"""Least factor of a strand's colour, and its range."""
DIRECTION_BASE = np.float32(0.2)
"""Least value of the colours that show directions, and range of their brightness."""
FILM = (2.51, 0.03, 2.43, 0.59, 0.14)
"""Film curve x (a x + b) / (x (c x + d) + e) of exposed radiance x: Narkowicz's fit of ACES."""
