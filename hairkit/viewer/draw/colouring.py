"""Colour maps of guides: length, stretch, curvature, group or confidence."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from hairkit.arrays import Float32Array

COLOURINGS = ("hair", "direction", "length", "stretch", "curvature", "group", "confidence")
"""`hair` and `direction` apply to all hair, the others to guides."""
FULL_STRETCH = 0.02
"""Relative change of length shown in full red (longer) or blue (shorter)."""
FULL_CURVATURE = 0.98
"""Share of the points whose curvature is below what is shown in full red."""
_RAMP = np.array(
    [
        [0.16, 0.22, 0.60],
        [0.10, 0.58, 0.72],
        [0.36, 0.76, 0.36],
        [0.95, 0.80, 0.20],
        [0.85, 0.15, 0.12],
    ],
    np.float32,
)


def ramp(values: npt.ArrayLike) -> Float32Array:
    """Return sRGB (..., 3) for values in [0, 1]: blue, green, yellow, red."""
    place = np.clip(np.nan_to_num(np.asarray(values, np.float32)), 0, 1) * (len(_RAMP) - 1)
    low = np.minimum(place.astype(int), len(_RAMP) - 2)
    part = (place - low)[..., None]
    return np.asarray(_RAMP[low] * (1 - part) + _RAMP[low + 1] * part)


def point_values(
    by: str, rows: Float32Array, rest: Float32Array, given: Float32Array | None
) -> Float32Array:
    """Return values (G, m) in [0, 1] of guides at `rows` (G, m, 3), whose rest is `rest`.

    Groups and confidence are `given`.
    """
    step, was = np.diff(rows, axis=1), np.diff(rest, axis=1)
    length, before = np.linalg.norm(step, axis=2), np.linalg.norm(was, axis=2)
    if by == "stretch":
        change = length / np.maximum(before, 1e-9) - 1
        return _at_points(0.5 + 0.5 * change / FULL_STRETCH)
    if by == "curvature":
        bent = _curvatures(rows)
        return np.asarray(bent / _curvature_scale(bent), np.float32)
    if by in ("group", "confidence") and given is not None:
        return given
    whole = before.sum(axis=1, keepdims=True)
    share = whole / max(float(whole.max()), 1e-9)
    return np.repeat(share, rows.shape[1], axis=1).astype(np.float32)


def legend(by: str, rows: Float32Array, rest: Float32Array) -> str:
    """Return a one-line legend for guides at `rows` (G, m, 3); empty for `hair`."""
    if by == "direction":
        return "red: left and right, green: front and back, blue: up and down"
    if by == "length":
        longest = np.linalg.norm(np.diff(rest, axis=1), axis=2).sum(axis=1).max(initial=0.0)
        return f"length, blue 0 to red {1e3 * longest:.0f} mm"
    if by == "stretch":
        return f"stretch, blue -{100 * FULL_STRETCH:g} %, green 0, red +{100 * FULL_STRETCH:g} %"
    if by == "curvature":
        return f"curvature, blue 0 to red {_curvature_scale(_curvatures(rows)):.0f} 1/m"
    if by == "group":
        return "group, green 0 (seen in photos), red others (continued, where photos were few)"
    return "confidence, blue 0 to red 1" if by == "confidence" else ""


def _curvatures(rows: Float32Array) -> Float32Array:
    """Return the curvature (G, m) of guides, 1/m; 0 for guides of two points."""
    if rows.shape[1] < 3:
        return np.zeros(rows.shape[:2], np.float32)
    step = np.diff(rows, axis=1)
    length = np.linalg.norm(step, axis=2)
    unit = step / np.maximum(length, 1e-9)[..., None]
    cosine = np.clip(np.einsum("gkc,gkc->gk", unit[:, 1:], unit[:, :-1]), -1, 1)
    middle = np.arccos(cosine) / np.maximum(0.5 * (length[:, 1:] + length[:, :-1]), 1e-9)
    return np.pad(middle, ((0, 0), (1, 1)), mode="edge").astype(np.float32)


def _curvature_scale(bent: Float32Array) -> float:
    """Return the curvature shown in full red."""
    return max(float(np.quantile(bent, FULL_CURVATURE)), 1e-9) if bent.size else 1e-9


def _at_points(segments: npt.NDArray[np.floating]) -> Float32Array:
    """Average values of segments (G, m - 1) at the points (G, m)."""
    padded = np.pad(segments, ((0, 0), (1, 1)), mode="edge")
    return np.asarray(0.5 * (padded[:, 1:] + padded[:, :-1]), np.float32)
