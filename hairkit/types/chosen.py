"""What a user chooses that would otherwise be measured in the photos or fitted to them."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from hairkit.arrays import Float32Array, Float64Array
from hairkit.colour import linear_from_hex, srgb_from_linear
from hairkit.errors import InputError
from hairkit.options import option
from hairkit.types.edits import Edits
from hairkit.types.groom import HairMaterial
from hairkit.types.waves import Waves

_MILLIMETRE = 1e-3


@dataclass(frozen=True)
class ChosenHair:
    """Colour, width and curl of the hair; None leaves each to the photos."""

    root_colour: str | None = option(None, doc="Colour near the scalp, sRGB as #rrggbb.")
    tip_colour: str | None = option(None, doc="Colour at the tips, sRGB as #rrggbb.")
    width_mm: float | None = option(None, low=0.01, high=1, doc="Width of a strand.", unit="mm")
    curl_radius_mm: float | None = option(
        None, low=0, high=50, doc="Radius of the waves; 0 for straight hair.", unit="mm"
    )
    curl_pitch_mm: float | None = option(
        None, low=1, high=500, doc="Length of one turn of a wave.", unit="mm"
    )

    def __post_init__(self) -> None:
        for name in ("root_colour", "tip_colour"):
            said = getattr(self, name)
            if said is not None:
                linear_from_hex(said, name)
        if bool(self.curl_radius_mm) and self.curl_pitch_mm is None:
            raise InputError("curl_radius_mm needs curl_pitch_mm, the length of one turn")

    @classmethod
    def of(cls, look: HairMaterial) -> ChosenHair:
        """Return the choices that give a material."""
        curled = look.curl_radius > 0 and look.curl_pitch > 0
        return cls(
            _srgb(look.root_colour),
            _srgb(look.tip_colour),
            round(look.width / _MILLIMETRE, 4),
            round(look.curl_radius / _MILLIMETRE, 2) if curled else 0.0,
            round(look.curl_pitch / _MILLIMETRE, 2) if curled else None,
        )

    def waves(self, measured: Waves) -> Waves:
        """Return the waves that were chosen, or the measured ones."""
        if self.curl_radius_mm is None:
            return measured
        pitch = self.curl_pitch_mm if self.curl_radius_mm else 0.0
        return Waves(self.curl_radius_mm * _MILLIMETRE, (pitch or 0.0) * _MILLIMETRE)

    def material(self, measured: HairMaterial) -> HairMaterial:
        """Return the material with the colours and the width that were chosen."""
        known: dict[str, Any] = {
            name: linear_from_hex(said, name)
            for name in ("root_colour", "tip_colour")
            if (said := getattr(self, name)) is not None
        }
        if self.width_mm is not None:
            known["width"] = self.width_mm * _MILLIMETRE
        return replace(measured, **known)


@dataclass(frozen=True, eq=False)
class Chosen:
    """All choices of a capture."""

    hair: ChosenHair = field(default_factory=ChosenHair)
    head: Float64Array | None = None
    """(4, 4) similarity that moves the fitted head, metres in its own frame, or None."""
    settings: tuple[str, ...] = ()
    """Options of plugins, as `--set` takes them: `structure_tensor.window_sigma=16`."""
    edits: Edits = field(default_factory=Edits)
    """Strokes of brushes over the strands."""


def _srgb(linear: Float32Array) -> str:
    levels = np.rint(255 * np.clip(srgb_from_linear(linear), 0, 1)).astype(int)
    return "#" + "".join(f"{level:02x}" for level in levels)
