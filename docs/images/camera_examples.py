"""Right and wrong pictures for the studio's Camera page, drawn by hairkit's own renderer.

`python docs/images/camera_examples.py` writes them beside the pages, one for each fault of
`hairkit.studio.feedback` that a picture can show, and one without any.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np

from hairkit import studio
from hairkit.arrays import Float64Array, UInt8Array
from hairkit.head_model.template import default_head
from hairkit.rendering import Solid, draw_views
from hairkit.storage import write_bytes
from hairkit.studio.capture_guides import DISTANCE, LENS_MM, LOOK_AT, guide_at
from hairkit.studio.feedback import Feedback
from hairkit.synth.bust import Bust
from hairkit.synth.growth import grow
from hairkit.types.camera import Camera
from hairkit.types.capture import focal_from_equivalent
from hairkit.types.groom import Groom
from hairkit.types.person import Person

GOOD = "good"
"""Name of the picture without a fault."""
FOLDER = Path(studio.__file__).parent / "pages"
WIDTH, HEIGHT, QUALITY = 180, 240, 80
"""Pixels of a picture, and its JPEG quality."""
STRANDS = 12_000
SHIFT = 4
"""Bits of a pixel's fraction in which OpenCV takes points."""
DASH, LINE = 6, (214, 120, 10)
"""Pixels of a dash, and colour of the line that the hair should stay below."""
WALL = 205
"""Grey level of the wall."""
CLOTH = (0.045, 0.075, 0.16)
"""Linear RGB."""
DIM, GLARE, BLUR = 0.14, 105.0, 7.0
"""Factor of too little light, levels that too much adds, and pixels of a blurred picture."""
NEAR, FAR, ASIDE, HIGH, TURNED_DEG = 0.3, 2.8, 0.17, -0.14, -38.0
"""Metres to the head, beside and above it, and degrees, in pictures of a wrong place."""


@dataclass(frozen=True, eq=False)
class Example:
    """A picture of the view from the front."""

    name: str
    """`GOOD`, or the value of a `Feedback`."""
    image: UInt8Array
    """(H, W, 3) RGB."""
    person: Person
    landmarks: Float64Array
    """(68, 2) pixels."""


def draw_examples() -> Iterator[Example]:
    """Yield the pictures; needs OpenGL."""
    groom = grow("straight", default_head(), STRANDS)
    bust = Bust.under(groom.head)
    colours = np.tile(np.array(CLOTH, np.float32), (len(bust.vertices), 1))
    cloth = Solid(bust.vertices, bust.faces, bust.normals, colours, scatter=0.0)
    cameras = {
        GOOD: _camera(),
        Feedback.TOO_NEAR: _camera(NEAR),
        Feedback.TOO_FAR: _camera(FAR),
        Feedback.OUT_OF_FRAME: _camera(aside=ASIDE),
        Feedback.ABOVE_LINE: _camera(above=HIGH),
        Feedback.WRONG_ANGLE: _camera(turn=TURNED_DEG),
    }
    pictures = _draw(groom, cloth, list(cameras.values()))
    corners = groom.head.vertices[groom.head.landmark_vertices].astype(np.float64)
    faces = [camera.project(corners) for camera in cameras.values()]
    for name, (picture, person), face in zip(cameras, pictures, faces, strict=True):
        yield Example(str(name), picture, person, face)
    good, person = pictures[0]
    light = {
        Feedback.TOO_DARK: good * DIM,
        Feedback.TOO_BRIGHT: good + GLARE,
        Feedback.BLURRED: cv2.GaussianBlur(good, (0, 0), BLUR),
    }
    for code, levels in light.items():
        yield Example(code.value, np.clip(levels, 0, 255).astype(np.uint8), person, faces[0])


def _draw(groom: Groom, cloth: Solid, cameras: list[Camera]) -> list[tuple[UInt8Array, Person]]:
    """Return pictures before a wall, and the person: where a black wall makes no difference."""
    walls = [np.full((HEIGHT, WIDTH, 3), level, np.uint8) for level in (WALL, 0)]
    light, dark = (
        draw_views(groom, None, cameras, backgrounds=[wall] * len(cameras), solids=[cloth])
        for wall in walls
    )
    found = []
    for one, other in zip(light, dark, strict=True):
        through = np.clip((one.astype(int) - other).max(axis=-1) * 255 // WALL, 0, 255)
        found.append((one, Person((255 - through).astype(np.uint8))))
    return found


def _camera(
    distance: float = DISTANCE, aside: float = 0.0, above: float = 0.0, turn: float = 0.0
) -> Camera:
    return Camera.on_turn(
        turn,
        distance=distance,
        target=(LOOK_AT[0] + aside, LOOK_AT[1] + above, LOOK_AT[2]),
        focal=focal_from_equivalent(LENS_MM, WIDTH, HEIGHT),
        width=WIDTH,
        height=HEIGHT,
    )


def write_examples(folder: Path) -> None:
    """Write `example-NAME.jpg` for each picture, with the outline that the head should fill."""
    front = guide_at(0.0, 0.0)
    points = max(front.silhouette, key=len) * (WIDTH, HEIGHT) * 2**SHIFT
    for example in draw_examples():
        picture = example.image.copy()
        curve = [np.rint(points).astype(np.int32)]
        cv2.polylines(picture, curve, False, (255, 255, 255), 1, cv2.LINE_AA, SHIFT)
        if example.name in (GOOD, Feedback.ABOVE_LINE):
            row = round(front.line * HEIGHT)
            picture[row : row + 2, np.arange(WIDTH) // DASH % 2 == 0] = LINE
        data = cv2.imencode(".jpg", picture[..., ::-1], [cv2.IMWRITE_JPEG_QUALITY, QUALITY])[1]
        write_bytes(folder / f"example-{example.name}.jpg", data.tobytes())


if __name__ == "__main__":
    write_examples(FOLDER)
