"""Text over the picture, drawn on the CPU: read-outs, messages, the help sheet."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np

from hairkit.stored import Float32Array, UInt8Array
from hairkit.viewer.actions import ACTIONS
from hairkit.viewer.session import Session

FONT = cv2.FONT_HERSHEY_SIMPLEX
LINE = 18
"""Pixels from line to line."""
SIZE = 0.43
PAPER = (20, 22, 26)
"""sRGB of the box behind the text."""
OPACITY = 150
"""Of the box, of 255."""
MOUSE = (
    ("left drag", "orbit"),
    ("middle or shift+left drag", "pan"),
    ("wheel or right drag", "zoom"),
    ("double click", "recentre"),
    ("ctrl+left drag", "grab hair"),
    ("click", "numbers of a guide"),
    ("drop a file", "open it"),
)

_LABELS = {
    "PERIOD": ".",
    "LEFT_BRACKET": "[",
    "RIGHT_BRACKET": "]",
    "EQUAL": "+",
    "MINUS": "-",
    "KP_ADD": "num+",
    "KP_SUBTRACT": "num-",
    "SHIFT_TAB": "shift+tab",
}
KEY_COLUMN = 170
"""Pixels of the help sheet's first column."""


@dataclass(frozen=True)
class Readings:
    """Numbers of the last pictures."""

    fps: float = 0.0
    simulate_ms: float = 0.0
    draw_ms: float = 0.0
    stretch: float = 0.0
    energy: float = 0.0
    """Joules, kinetic and potential."""
    hairs: int = 0
    scale: float = 1.0
    renderer: str = ""


def status_lines(session: Session, readings: Readings) -> list[str]:
    """Return the read-outs as lines."""
    name = session.opened.path.name
    lines = [
        f"{name}: {len(session.body.guides)} guides, {readings.hairs} hairs,"
        f" {session.tuned.plugin}{', paused' if session.paused else ''}",
        f"{readings.fps:5.1f} fps   simulate {readings.simulate_ms:.1f} ms"
        f"   draw {readings.draw_ms:.1f} ms   scale {readings.scale:.2f}",
        f"stretch {100 * readings.stretch:.2f} %   energy {1e3 * readings.energy:.3g} mJ",
        readings.renderer,
    ]
    if session.wind.blowing:
        lines.append(f"wind {session.wind.speed:.1f} m/s from {session.wind.azimuth:.0f} deg")
    if session.recorder is not None:
        lines.append(f"recording {session.recorder.path}: {session.recorder.count}")
    return lines + _guide_lines(session)


def help_lines() -> list[str]:
    """Return the help sheet, `what<TAB>does`: mouse, then every action that has keys."""
    lines = [f"{what}\t{does}" for what, does in MOUSE]
    for action in ACTIONS.values():
        if action.keys:
            lines.append(f"{' '.join(map(key_label, action.keys))}\t{action.doc}")
    return lines


def key_label(key: str) -> str:
    """Return how a key is called on the keyboard: `N1` is `1`, `PERIOD` is `.`."""
    if key.startswith("N") and key[1:].isdigit():
        return key[1:]
    if len(key) == 1:
        return key
    return _LABELS.get(key, key.replace("CTRL_", "ctrl+").replace("_", " ").lower())


def overlay(size: tuple[int, int], session: Session, readings: Readings) -> UInt8Array | None:
    """Return text (H, W, 4) RGBA for a picture of `size`, None when there is none."""
    width, height = size
    image = np.zeros((height, width, 4), np.uint8)
    drawn = False
    if session.shown.numbers and not session.shown.help:
        _write(image, status_lines(session, readings), (10, 10))
        drawn = True
    if session.message:
        _write(image, [session.message], (10, height - LINE - 14))
        drawn = True
    if session.shown.help:
        _write(image, help_lines(), (14, 60))
        drawn = True
    return image if drawn else None


def _write(image: UInt8Array, lines: Sequence[str], corner: tuple[int, int]) -> None:
    """Write lines in a box with its top left corner there; what follows a tab is a column."""
    if not lines:
        return
    x, y = corner
    ink = np.zeros(image.shape[:2], np.uint8)
    widest = 0
    for index, line in enumerate(lines):
        for column, part in enumerate(line.split("\t")):
            left = x + KEY_COLUMN * column
            place = (left, y + LINE * index + LINE - 5)
            cv2.putText(ink, part, place, FONT, SIZE, 255, 1, cv2.LINE_AA)
            widest = max(widest, left - x + cv2.getTextSize(part, FONT, SIZE, 1)[0][0])
    low, high = (x - 6, y - 4), (x + widest + 6, y + LINE * len(lines) + 4)
    cv2.rectangle(image, low, high, (*PAPER, OPACITY), -1)
    # mixed here: drawing soft edges into the opacity would make them holes
    share = (ink / 255.0)[..., None]
    mixed = image * (1 - share) + np.array([240, 240, 240, 255]) * share
    image[:] = np.where(share > 0, mixed, image).astype(np.uint8)


def _guide_lines(session: Session) -> list[str]:
    """Return the numbers of the picked guide."""
    if session.picked is None:
        return []
    strands, points = session.tuned.simulator.strands, session.tuned.simulator.points
    low, high = strands.offsets[session.picked], strands.offsets[session.picked + 1]
    now = np.linalg.norm(np.diff(points[low:high], axis=0), axis=1).sum()
    rest = strands.lengths()[session.picked]
    root, tip = points[low], points[high - 1]
    return [
        f"guide {session.picked}: {high - low} points, {1e3 * rest:.1f} mm,"
        f" stretch {100 * (now / rest - 1):+.2f} %",
        f"root {_vector(root)}  tip {_vector(tip)} mm",
    ]


def _vector(point: Float32Array) -> str:
    return "(" + ", ".join(f"{1e3 * value:.0f}" for value in point) + ")"
