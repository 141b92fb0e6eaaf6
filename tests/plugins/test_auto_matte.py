"""Laws of the segmentation without strokes, on a painted portrait."""

from __future__ import annotations

import json
from pathlib import Path

import cv2
import numpy as np
import pytest
from hairkit_plugins import auto_matte, grabcut

from hairkit.errors import InputError
from hairkit.types.capture import View
from hairkit.types.mask import BACKGROUND, HAIR, PERSON

WIDTH, HEIGHT = 210, 280


def portrait(bald: bool = False) -> tuple[np.ndarray, np.ndarray]:
    """Return a photo of a head with dark hair (or none) and blue coat, and its labels."""
    rng = np.random.default_rng(7)
    truth = np.zeros((HEIGHT, WIDTH), np.uint8)
    cv2.ellipse(truth, (105, 275), (85, 70), 0, 0, 360, PERSON, -1)
    coat = truth == PERSON
    cv2.rectangle(truth, (88, 170), (122, 230), PERSON, -1)
    cv2.ellipse(truth, (105, 115), (55, 75), 0, 0, 360, PERSON if bald else HAIR, -1)
    cv2.ellipse(truth, (105, 135), (34, 50), 0, 0, 360, PERSON, -1)
    photo = np.empty((HEIGHT, WIDTH, 3), np.float32)
    photo[:] = (150, 165, 175)
    photo[truth == PERSON] = (205, 155, 130)
    photo[coat & (truth == PERSON) & (np.arange(HEIGHT)[:, None] > 205)] = (40, 60, 120)
    photo[truth == HAIR] = (55, 42, 32)
    streaks = rng.normal(0, 14, (1, WIDTH, 1)) + rng.normal(0, 6, (HEIGHT, WIDTH, 1))
    photo += np.where((truth == HAIR)[..., None], streaks, 0)
    photo += rng.normal(0, 3, photo.shape)
    return np.clip(photo, 0, 255).astype(np.uint8), truth


def overlap(found: np.ndarray, true: np.ndarray) -> float:
    return float((found & true).sum() / (found | true).sum())


def test_a_portrait_needs_no_strokes() -> None:
    """Hair and person are found from what portraits have in common."""
    photo, truth = portrait()
    mask = auto_matte.segment(view=View("front", 0.0, photo), options=auto_matte.Options())
    assert mask.person_known
    assert overlap(mask.hair, truth == HAIR) > 0.85
    assert overlap(mask.person, truth != BACKGROUND) > 0.9


def test_a_mirrored_photo_has_the_mirrored_mask() -> None:
    """Left and right are alike, but for the order in which sums are made."""
    photo, _ = portrait()
    masks = [
        auto_matte.segment(view=View("front", 0.0, image), options=auto_matte.Options()).hair
        for image in (photo, np.ascontiguousarray(photo[:, ::-1]))
    ]
    assert overlap(masks[0], masks[1][:, ::-1]) > 0.95


def test_equal_photos_have_equal_masks() -> None:
    """Nothing is left to chance."""
    photo, _ = portrait()
    view = View("front", 0.0, photo)
    first = auto_matte.segment(view=view, options=auto_matte.Options())
    cv2.setRNGSeed(5)
    second = auto_matte.segment(view=view, options=auto_matte.Options())
    assert np.array_equal(first.labels, second.labels)


def test_landmarks_mark_the_face() -> None:
    """Where landmarks say that a face is, there is no hair, however dark it is."""
    photo, _ = portrait()
    photo[120:160, 90:120] = (60, 45, 35)
    angle = np.linspace(0, 2 * np.pi, 68, endpoint=False)
    ring = np.array([105, 140]) + 22 * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    ring[27:] = np.array([105, 140]) + 20 * np.stack(
        [np.cos(np.linspace(0, 6.2, 41)), np.sin(np.linspace(0, 6.2, 41))], axis=1
    )
    view = View("front", 0.0, photo, landmarks=ring)
    mask = auto_matte.segment(view=view, options=auto_matte.Options())
    assert not mask.hair[125:155, 95:115].any()


@pytest.mark.parametrize("kind", ["bald", "empty"])
def test_no_hair_is_told_in_one_line(kind: str) -> None:
    """A bald head or an empty room gives no mask but what to do."""
    photo = portrait(bald=True)[0] if kind == "bald" else np.full((200, 150, 3), 128, np.uint8)
    with pytest.raises(InputError, match=r"photo front.*strokes") as caught:
        auto_matte.segment(view=View("front", 0.0, photo), options=auto_matte.Options())
    assert "\n" not in str(caught.value)


def test_the_opacity_agrees_with_the_labels() -> None:
    """Pixels of hair are opaque for the most part, and pixels off its edges are clear."""
    photo, _ = portrait()
    mask = auto_matte.segment(view=View("front", 0.0, photo), options=auto_matte.Options())
    assert mask.alpha is not None
    assert (mask.alpha[mask.hair] > 0.29 * 255).all()
    assert (mask.alpha[~mask.hair] <= 0.61 * 255).all()


def test_hair_is_found_in_a_rendered_capture(captures: Path) -> None:
    """The back of a head with wavy hair is found in a picture of a path tracer."""
    pixels = cv2.imread(str(captures / "wavy/photos/4_back.jpg"))
    truth = cv2.imread(str(captures / "wavy/masks/4_back.png"), cv2.IMREAD_GRAYSCALE)
    view = View("back", 180.0, np.ascontiguousarray(pixels[..., ::-1]))
    mask = auto_matte.segment(view=view, options=auto_matte.Options())
    assert overlap(mask.hair, truth == HAIR) > 0.75


def test_a_stroke_corrects_the_mask(tmp_path: Path) -> None:
    """What a stroke is on is as it says, and so is what is like it nearby; the rest stays."""
    photo, _ = portrait()
    file = tmp_path / "front.json"

    def segment(label: str, points: list[list[float]]) -> np.ndarray:
        shape = {"label": label, "shape_type": "linestrip", "points": points}
        document = {"flags": {"corrects": True}, "shapes": [shape] if points else []}
        file.write_text(json.dumps(document))
        view = View("front", 0.0, photo, strokes_path=file)
        assert grabcut.segment(view=view, options=grabcut.Options()) is None
        return auto_matte.segment(view=view, options=auto_matte.Options()).hair

    automatic = segment("foreground", [])
    coat = [[60.0, 250.0], [150.0, 250.0]]
    added = segment("foreground", coat)
    assert not automatic[250, 60:150].any()
    assert added[250, 65:145].mean() > 0.9
    crown = [[90.0, 60.0], [120.0, 60.0]]
    removed = segment("background", crown)
    assert automatic[60, 90:120].mean() > 0.9
    assert removed[60, 93:117].mean() < 0.1
    assert overlap(segment("background", [[5.0, 5.0], [5.0, 60.0]]), automatic) > 0.97
