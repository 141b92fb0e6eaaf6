"""How skin reflects and scatters light, beside its texture maps."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from hairkit.errors import InputError

LOBES = ("ggx", "beckmann", "blinn_phong", "torrance_sparrow")
"""Lobes of the oil, in the order of the shader `skin_lobe.glsl`."""


@dataclass(frozen=True)
class SkinLook:
    """How skin looks beside its albedo; roughness and reflectance are those of glTF and USD."""

    lobe: str = "ggx"
    """One of `LOBES`."""
    roughness: float = 0.55
    """0 to 1; the square root of the microfacets' alpha. A roughness map replaces it."""
    ior: float = 1.4
    """Refractive index of the oil."""
    mean_free_path: tuple[float, float, float] = (0.00367, 0.00137, 0.00068)
    """Diffuse mean free path of red, green and blue, metres; the sample skin1 of Jensen et al.
    2001. 0 does not scatter."""

    def __post_init__(self) -> None:
        if self.lobe not in LOBES:
            raise InputError(f"lobe is {self.lobe!r}, expected one of {', '.join(LOBES)}")
        if not 0 <= self.roughness <= 1 or not 1 <= self.ior <= 3 or min(self.mean_free_path) < 0:
            raise InputError(f"{self}: expected roughness 0 to 1, ior 1 to 3, paths of at least 0")

    @property
    def f0(self) -> float:
        """Reflectance at normal incidence: ((n - 1) / (n + 1))^2."""
        return ((self.ior - 1) / (self.ior + 1)) ** 2

    def uniforms(self) -> dict[str, Any]:
        """Return the values of `skin.glsl`."""
        lobe = LOBES.index(self.lobe)
        return {"u_lobe": lobe, "u_roughness": self.roughness, "u_f0": self.f0}
