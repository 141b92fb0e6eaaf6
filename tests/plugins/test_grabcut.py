"""Laws of the segmentation from strokes, on a painted head."""

from __future__ import annotations

import json
from pathlib import Path

import cv2
import numpy as np
import pytest
from hairkit_plugins import grabcut

from hairkit.errors import FormatError, InputError
from hairkit.types.capture import View
from hairkit.types.mask import BACKGROUND, HAIR, PERSON

WIDTH, HEIGHT = 150, 200


def painted_head() -> tuple[np.ndarray, np.ndarray]:
    """Return a photo (H, W, 3) of a face, a coat and dark streaky hair, and its true labels."""
    rng = np.random.default_rng(3)
    truth = np.zeros((HEIGHT, WIDTH), np.uint8)
    cv2.ellipse(truth, (75, 190), (60, 50), 0, 0, 360, PERSON, -1)
    cv2.ellipse(truth, (75, 85), (42, 55), 0, 0, 360, HAIR, -1)
    cv2.ellipse(truth, (75, 100), (24, 34), 0, 0, 360, PERSON, -1)
    colours = {BACKGROUND: (170, 180, 190), PERSON: (200, 150, 130), HAIR: (60, 45, 35)}
    photo = np.zeros((HEIGHT, WIDTH, 3), np.float32)
    for label, colour in colours.items():
        photo[truth == label] = colour
    photo[(truth == PERSON) & (np.arange(HEIGHT)[:, None] > 140)] = (50, 70, 120)
    streaks = rng.normal(0, 18, (1, WIDTH, 1)) + rng.normal(0, 6, (HEIGHT, WIDTH, 1))
    photo += np.where((truth == HAIR)[..., None], streaks, 0)
    photo += rng.normal(0, 3, photo.shape)
    return np.clip(photo, 0, 255).astype(np.uint8), truth


def shape(label: str, kind: str, points: list[list[float]]) -> dict[str, object]:
    return {"label": label, "shape_type": kind, "points": points}


SHAPES = [
    shape("rectangle", "rectangle", [[30, 27], [120, 143]]),
    shape("foreground", "linestrip", [[45, 100], [50, 60], [75, 45], [100, 60], [104, 100]]),
    shape("background", "linestrip", [[75, 80], [75, 120]]),
    shape("background", "polygon", [[60, 160], [90, 160], [90, 190], [60, 190]]),
    shape("background", "linestrip", [[10, 100], [15, 20], [75, 10], [135, 20]]),
]


def view_with(tmp_path: Path, shapes: list[dict[str, object]], scale: float = 1.0) -> View:
    photo, _ = painted_head()
    size = {"imageWidth": round(WIDTH * scale), "imageHeight": round(HEIGHT * scale)}
    path = tmp_path / "strokes.json"
    path.write_text(json.dumps({"shapes": shapes, **size}))
    return View("front", 0.0, photo, strokes_path=path)


def overlap(found: np.ndarray, true: np.ndarray) -> float:
    return float((found & true).sum() / (found | true).sum())


def test_strokes_find_hair_and_person(tmp_path: Path) -> None:
    """A few strokes are enough for hair and person on a head whose parts differ."""
    mask = grabcut.segment(view=view_with(tmp_path, SHAPES), options=grabcut.Options())
    _, truth = painted_head()
    assert mask.person_known
    assert overlap(mask.hair, truth == HAIR) > 0.93
    assert overlap(mask.person, truth != BACKGROUND) > 0.95


def test_equal_input_gives_equal_masks(tmp_path: Path) -> None:
    """The clustering is seeded anew in each call, whatever OpenCV's generator did in between."""
    view = view_with(tmp_path, SHAPES)
    for model in ("layered", "opencv"):
        options = grabcut.Options(model=model)
        first = grabcut.segment(view=view, options=options)
        cv2.setRNGSeed(99)
        assert np.array_equal(first.labels, grabcut.segment(view=view, options=options).labels)


def test_opencv_model_is_hair_only(tmp_path: Path) -> None:
    """OpenCV's GrabCut has two classes, so nobody knows where the person is."""
    options = grabcut.Options(model="opencv", iterations=5)
    mask = grabcut.segment(view=view_with(tmp_path, SHAPES), options=options)
    assert not mask.person_known
    assert overlap(mask.hair, painted_head()[1] == HAIR) > 0.7


def test_strokes_scale_with_the_photo(tmp_path: Path) -> None:
    """Strokes drawn on the photo at three times the size mean the same."""
    shapes = [{**s, "points": (3 * np.array(s["points"])).tolist()} for s in SHAPES]
    small = grabcut.segment(view=view_with(tmp_path, SHAPES), options=grabcut.Options())
    large = grabcut.segment(view=view_with(tmp_path, shapes, 3.0), options=grabcut.Options())
    assert overlap(small.hair, large.hair) > 0.98


def test_no_hair_beyond_the_rectangle(tmp_path: Path) -> None:
    """The rectangle holds all hair, but for what foreground strokes add."""
    shapes = [shape("rectangle", "rectangle", [[30, 27], [120, 90]]), *SHAPES[1:]]
    mask = grabcut.segment(view=view_with(tmp_path, shapes), options=grabcut.Options())
    assert not mask.hair[94:, :40].any()
    assert not mask.hair[104:].any()


def test_without_person_strokes_the_person_is_unknown(tmp_path: Path) -> None:
    """When all background strokes lie on the backdrop, 0 only means that it is no hair."""
    mask = grabcut.segment(
        view=view_with(tmp_path, [SHAPES[1], SHAPES[4]]), options=grabcut.Options()
    )
    assert not mask.person_known
    assert not (mask.labels == PERSON).any()


def test_person_strokes_are_taken_at_their_word(tmp_path: Path) -> None:
    """A stroke labelled person marks the person wherever it lies."""
    shapes = [*SHAPES[:2], {**SHAPES[2], "label": "person"}, *SHAPES[3:]]
    mask = grabcut.segment(view=view_with(tmp_path, shapes), options=grabcut.Options())
    assert mask.labels[100, 75] == PERSON


def test_no_strokes_is_no_mask() -> None:
    """A view without strokes is left to the next plugin."""
    view = View("front", 0.0, painted_head()[0])
    assert grabcut.segment(view=view, options=grabcut.Options()) is None


def test_brightness_presets_keep_black_and_white() -> None:
    """Every preset keeps the ends of the scale and the order of brightness."""
    ramp = np.repeat(np.arange(256, dtype=np.uint8)[None, :, None], 3, axis=2)
    for preset in ("as_is", "brighter", "much_brighter", "darker"):
        out = grabcut.brighten(ramp, preset)[0, :, 0].astype(int)
        assert (out[0], out[-1]) == (0, 255)
        assert (np.diff(out) >= 0).all()


@pytest.mark.parametrize(
    ("shapes", "scale", "wanted"),
    [
        (SHAPES[2:], 1.0, "no foreground"),
        (SHAPES[1:2], 1.0, "no background"),
        (SHAPES, (2.0, 1.0), "drawn on a photo"),
    ],
)
def test_wrong_strokes_get_one_line(
    tmp_path: Path, shapes: list[dict[str, object]], scale: object, wanted: str
) -> None:
    """Strokes that cannot be used are told in one line that names the file."""
    view = view_with(tmp_path, shapes)
    if isinstance(scale, tuple):
        document = json.loads(view.strokes_path.read_text())
        document["imageWidth"] *= 2
        view.strokes_path.write_text(json.dumps(document))
    with pytest.raises(InputError, match=wanted) as caught:
        grabcut.segment(view=view, options=grabcut.Options())
    assert "\n" not in str(caught.value)
    assert "strokes.json" in str(caught.value)


def test_damaged_strokes_are_a_format_error(tmp_path: Path) -> None:
    """A file that is no JSON is told as such."""
    view = view_with(tmp_path, SHAPES)
    view.strokes_path.write_text('{"shapes": [')
    with pytest.raises(FormatError):
        grabcut.segment(view=view, options=grabcut.Options())
