"""Laws of blood and melanin in an albedo."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from hairkit.arrays import UInt8Array
from hairkit.colour import linear_from_srgb
from hairkit.imaging.skin_colour import BLOOD, FULL, MELANIN, NEUTRAL, tint_albedo

SKIN = np.tile(np.array([205, 150, 125], np.uint8), (4, 4, 1))


def flat(level: int) -> UInt8Array:
    """Return a map of one level."""
    return np.full((4, 4), level, np.uint8)


def test_neutral_maps_change_nothing() -> None:
    """So does no map at all."""
    np.testing.assert_array_equal(tint_albedo(SKIN, flat(NEUTRAL), flat(NEUTRAL)), SKIN)
    np.testing.assert_array_equal(tint_albedo(SKIN), SKIN)


@given(st.integers(0, 255), st.integers(0, 255))
def test_log_albedo_is_linear_in_both(blood: int, melanin: int) -> None:
    """Its fall is the sum of the pigments' amounts times their absorptions."""
    made = tint_albedo(SKIN, flat(blood), flat(melanin))[0, 0] / 255
    amount = (np.array([blood, melanin]) - NEUTRAL) / (255 - NEUTRAL)
    wanted = linear_from_srgb(SKIN[0, 0] / 255)
    wanted = wanted * np.exp(-FULL * (amount[0] * BLOOD + amount[1] * MELANIN))
    clear = wanted < 0.95
    np.testing.assert_allclose(linear_from_srgb(made)[clear], wanted[clear], atol=0.006)


def test_more_pigment_is_never_brighter() -> None:
    """In any channel, for either map; maps of another size are brought to the albedo's."""
    for name in ("blood", "melanin"):
        levels = [tint_albedo(SKIN, **{name: flat(v)})[0, 0].astype(int) for v in (0, 90, 128, 255)]
        assert (np.diff(levels, axis=0) <= 0).all()
        larger = np.full((9, 7), 200, np.uint8)
        np.testing.assert_array_equal(
            tint_albedo(SKIN, **{name: larger}), tint_albedo(SKIN, **{name: flat(200)})
        )
