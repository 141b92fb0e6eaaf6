"""Text overlay, drawn on the CPU: read-outs, messages, the help sheet."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np

from hairkit.arrays import Float32Array, UInt8Array
from hairkit.viewer.actions.actions import ACTIONS
from hairkit.viewer.draw.colouring import legend
from hairkit.viewer.session import Session

FONT = cv2.FONT_HERSHEY_SIMPLEX
LINE_HEIGHT = 18
"""Pixels."""
SIZE = 0.43
"""Scale of the font."""
BACKGROUND = (20, 22, 26)
"""sRGB of the box behind the text."""
OPACITY = 165
"""Opacity of the box, 0 to 255."""
TEXT_COLOUR = (240, 240, 240, 255)
MOUSE = (
    ("left drag", "orbit"),
    ("middle or shift+left drag", "pan"),
    ("wheel or right drag", "zoom"),
    ("double click", "recentre"),
    ("ctrl+left drag", "grab hair"),
    ("click", "show length and stretch of a guide"),
    ("drop a file", "open it"),
)

_LABELS = {
    "PERIOD": ".",
    "LEFT_BRACKET": "[",
    "RIGHT_BRACKET": "]",
    "EQUAL": "+",
    "MINUS": "-",
    "ESCAPE": "esc",
}
_ARROWS = ("LEFT", "RIGHT", "UP", "DOWN")
GAP = 24
"""Pixels between columns."""
MARGIN = 20
"""Empty border of the help sheet and of a page of messages, pixels."""
CORNER = 10
"""Distance of the read-outs and messages from the edges of the picture, pixels."""
PADDING = (6, 4)
"""Space beside and above a text in its box, pixels."""
BASELINE = 5
"""Height of the baseline above the bottom of a line, pixels."""
NARROW = 640
"""Width of the picture below which only the first read-out is shown, pixels."""
SMALLEST = 0.75
"""Smallest scale of the help sheet; a window too small for it cuts it off."""


@dataclass(frozen=True)
class Readings:
    """Read-outs of the last frames."""

    fps: float = 0.0
    simulate_ms: float = 0.0
    draw_ms: float = 0.0
    stretch: float = 0.0
    energy: float = 0.0
    """Kinetic and potential, joules."""
    hairs: int = 0
    scale: float = 1.0
    renderer: str = ""


def status_lines(session: Session, readings: Readings) -> list[str]:
    """Return the read-outs as lines of text."""
    name, shown = session.opened.path.name, session.shown
    lines = [
        f"{name}: {len(session.body.guides)} guides{_hairs(session, readings)},"
        f" {session.simulation.plugin}{', paused' if session.paused else ''}",
        f"{readings.fps:.1f} fps   simulate {readings.simulate_ms:.1f} ms"
        f"   draw {readings.draw_ms:.1f} ms   scale {readings.scale:.2f}",
        f"stretch {100 * readings.stretch:.2f} %   energy {1e3 * readings.energy:.3g} mJ",
        readings.renderer,
    ]
    if session.brushing is not None:
        lines.append(session.brushing.told)
    if session.wind.blowing:
        lines.append(f"wind {session.wind.speed:.1f} m/s from {session.wind.azimuth:.0f} deg")
    if shown.through is not None:
        lines.append(f"camera of photo {shown.through}")
    if shown.colours != "hair":
        lines.append(legend(shown.colours, session.guide_rows(), session.body.guide_rest))
    if session.recorder is not None:
        lines.append(f"recording {session.recorder.path}: {session.recorder.count}")
    return lines + _guide_lines(session)


def _hairs(session: Session, readings: Readings) -> str:
    """Return the number of strands drawn and, if lowered to keep the frame time, requested."""
    wanted = session.shown.hairs
    if session.shown.guides_only or not readings.hairs:
        return ""
    return f", {readings.hairs}{f' of {wanted}' if readings.hairs < wanted else ''} hairs"


def help_lines() -> list[str]:
    """Return the help sheet, lines of `input<TAB>effect`: mouse, then actions with keys."""
    lines = [f"{what}\t{does}" for what, does in MOUSE]
    for action in ACTIONS.values():
        if action.keys:
            lines.append(f"{keys_label(list(action.keys))}\t{action.doc.removesuffix('.')}")
    return lines


def keys_label(keys: Sequence[str]) -> str:
    """Return the label of several keys: `ctrl+arrows`, `ctrl+J O I`, `F2 F3`, `[ ]`.

    >>> keys_label(["CTRL_LEFT", "CTRL_RIGHT", "CTRL_UP", "CTRL_DOWN"])
    'ctrl+arrows'
    """
    keys = [key for key in keys if not key.startswith("KP_")]  # same as + and -
    if len(keys) > 1 and all(key.startswith("CTRL_") for key in keys):
        return f"ctrl+{keys_label([key.removeprefix('CTRL_') for key in keys])}"
    if set(_ARROWS) <= set(keys):
        rest = [key_label(key) for key in keys if key not in _ARROWS]
        return " ".join(["arrows", *rest])
    return " ".join(map(key_label, keys))


def key_label(key: str) -> str:
    """Return the label of a key: `1` for `N1`, `.` for `PERIOD`."""
    if key.startswith("N") and key[1:].isdigit():
        return key[1:]
    for modifier in ("CTRL", "SHIFT"):
        if key.startswith(f"{modifier}_"):
            return f"{modifier.lower()}+{key_label(key.removeprefix(f'{modifier}_'))}"
    if len(key) == 1 or (key.startswith("F") and key[1:].isdigit()):
        return key
    return _LABELS.get(key, key.replace("_", " ").lower())


def overlay(size: tuple[int, int], session: Session, readings: Readings) -> UInt8Array | None:
    """Return the text overlay (H, W, 4) RGBA for a picture of `size`; None if it is empty."""
    width, height = size
    image = np.zeros((height, width, 4), np.uint8)
    drawn = False
    if session.shown.numbers and not session.shown.help:
        lines = status_lines(session, readings)
        _write(image, lines if width >= NARROW else lines[:1], (CORNER, CORNER))
        drawn = True
    if session.shown.help:
        _write_sheet(image, help_lines())
        drawn = True
    if session.message:
        lines = wrap_text(session.message, width - 2 * MARGIN)
        top = height - LINE_HEIGHT * len(lines) - CORNER - PADDING[1]
        _write(image, lines, (CORNER, top))
        drawn = True
    return image if drawn else None


def message_page(size: tuple[int, int], lines: Sequence[str]) -> UInt8Array:
    """Return a dark page (H, W, 4) RGBA with centred lines of text."""
    width, height = size
    page = np.empty((height, width, 4), np.uint8)
    page[:] = (*BACKGROUND, 255)
    whole = [part for line in lines for part in wrap_text(line, width - 2 * MARGIN)]
    widest = max((_width(line, 1.0) for line in whole), default=0)
    left = max((width - widest) // 2, MARGIN)
    top = max((height - LINE_HEIGHT * len(whole)) // 2, CORNER)
    _write(page, whole, (left, top))
    page[..., 3] = 255
    return page


def wrap_text(text: str, width: int) -> list[str]:
    """Break a text into lines of at most `width` pixels; a longer word gets its own line."""
    lines: list[str] = []
    for word in text.split():
        if lines and _width(f"{lines[-1]} {word}", 1.0) <= width:
            lines[-1] += f" {word}"
        else:
            lines.append(word)
    return lines


def _write_sheet(image: UInt8Array, lines: Sequence[str]) -> None:
    """Write tabulated lines in one or two columns, as large as fits."""
    height, width = image.shape[:2]
    best: tuple[float, list[Sequence[str]]] = (0.0, [])
    for columns in (1, 2):
        rows = -(-len(lines) // columns)
        parts = [lines[at : at + rows] for at in range(0, len(lines), rows)]
        wide = sum(sum(_widths(part, 1.0)) + 2 * GAP for part in parts)
        scale = min(1.0, (width - 2 * MARGIN) / wide, (height - 2 * MARGIN) / (LINE_HEIGHT * rows))
        if scale > best[0]:
            best = (scale, parts)
    scale, parts = best if best[0] > SMALLEST else (1.0, [lines])
    left = MARGIN
    for part in parts:
        _write(image, part, (left, MARGIN), scale)
        left += round(sum(_widths(part, scale)) + 2 * GAP * scale)


def _widths(lines: Sequence[str], scale: float) -> list[int]:
    """Return the widths of the columns that tabs separate, pixels."""
    cells = [line.split("\t") for line in lines]
    count = max((len(row) for row in cells), default=0)
    return [
        max(_width(row[column], scale) for row in cells if column < len(row))
        for column in range(count)
    ]


def _width(text: str, scale: float) -> int:
    return int(cv2.getTextSize(text, FONT, SIZE * scale, 1)[0][0])


def _write(
    image: UInt8Array, lines: Sequence[str], corner: tuple[int, int], scale: float = 1.0
) -> None:
    """Write lines into a box whose top left corner is `corner`; tabs separate columns."""
    if not lines:
        return
    height, widths = round(LINE_HEIGHT * scale), _widths(lines, scale)
    starts = np.cumsum([0, *(width + round(GAP * scale) for width in widths)]).tolist()
    left, top = max(corner[0] - PADDING[0], 0), max(corner[1] - PADDING[1], 0)
    right = corner[0] + starts[len(widths) - 1] + widths[-1] + PADDING[0]
    box = image[top : corner[1] + height * len(lines) + PADDING[1], left:right]
    ink = np.zeros(box.shape[:2], np.uint8)
    for index, line in enumerate(lines):
        for start, part in zip(starts, line.split("\t"), strict=False):
            place = (corner[0] - left + start, corner[1] - top + height * (index + 1) - BASELINE)
            cv2.putText(ink, part, place, FONT, SIZE * scale, 255, 1, cv2.LINE_AA)
    # blended here: antialiased text drawn into the alpha channel would punch holes
    share = (ink / np.float32(255))[..., None]
    ground, letters = np.array([*BACKGROUND, OPACITY]), np.array(TEXT_COLOUR)
    box[:] = (ground + share * (letters - ground)).astype(np.uint8)


def _guide_lines(session: Session) -> list[str]:
    """Return the read-outs of the picked guide."""
    if session.picked is None:
        return []
    strands, points = session.simulation.simulator.strands, session.simulation.simulator.points
    counts = session.body.guides.counts
    low, high = strands.offsets[session.picked], strands.offsets[session.picked + 1]
    now = np.linalg.norm(np.diff(points[low:high], axis=0), axis=1).sum()
    rest = strands.lengths()[session.picked]
    root, tip = points[low], points[high - 1]
    return [
        f"guide {session.picked}: {counts[session.picked]} points, {1e3 * rest:.1f} mm,"
        f" stretch {100 * (now / rest - 1):+.2f} %",
        f"root {_vector(root)}  tip {_vector(tip)} mm",
    ]


def _vector(point: Float32Array) -> str:
    return "(" + ", ".join(f"{1e3 * value:.0f}" for value in point) + ")"
