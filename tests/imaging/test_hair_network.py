"""Laws of the hair network and of its features."""

from __future__ import annotations

from dataclasses import replace

import cv2
import numpy as np
import pytest

from hairkit.imaging import hair_network
from hairkit.imaging.hair_features import CHANNELS, GRID, hair_features
from hairkit.imaging.hair_network import LEAST_ODDS, find_hair, hair_probability
from hairkit.types.capture import View
from hairkit.types.person import Person


def photo(height: int = 160, width: int = 120) -> np.ndarray:
    """Return a random smooth picture (height, width, 3)."""
    rng = np.random.default_rng(4)
    noise = cv2.GaussianBlur(rng.normal(0, 400, (height, width, 3)), (0, 0), 3)
    return np.clip(128 + noise, 0, 255).astype(np.uint8)


def ring(centre: tuple[float, float], radius: float) -> np.ndarray:
    """Return 68 points on a circle, the eyes above and the mouth below its centre."""
    angle = np.linspace(0, 2 * np.pi, 68, endpoint=False)
    points = np.stack([np.cos(angle), np.sin(angle)], axis=1) * radius
    points[36:48], points[48:] = points[36:48] * 0.3 - (0, radius / 2), points[48:] * 0.3
    points[48:] += (0, radius / 2)
    return points + centre


@pytest.mark.parametrize("size", [(160, 120), (90, 300), (40, 40), (1, 7)])
def test_probabilities_add_up_to_one(size: tuple[int, int]) -> None:
    """Every cell of a photo of any shape gets three probabilities."""
    result = hair_probability(photo(*size), None, None)
    assert max(result.shape[:2]) == GRID
    assert np.allclose(result.sum(axis=-1), 1, atol=1e-4)


def test_a_mirrored_photo_has_the_mirrored_probability() -> None:
    """With the face and the person mirrored too; sums are made in another order."""
    image, centre = photo(128, 128), (70.0, 60.0)
    alpha = np.random.default_rng(1).integers(0, 256, (128, 128), np.uint8)
    person = Person(alpha, alpha // 2)
    landmarks = ring(centre, 20.0)
    first = hair_probability(image, person, landmarks)
    mirrored = landmarks * (-1, 1) + (128, 0)
    flip = np.ascontiguousarray
    second = hair_probability(flip(image[:, ::-1]), person.part(np.s_[:, ::-1]), mirrored)
    assert np.allclose(first, second[:, ::-1], atol=0.05)


def test_two_networks_are_multiplied() -> None:
    """What the person's network says of a class multiplies its odds; it is never quite sure."""
    image, alpha = photo(128, 128), np.full((128, 128), 200, np.uint8)
    alone = hair_probability(image, Person(alpha), None)
    both = hair_probability(image, Person(alpha, np.full_like(alpha, 200)), None)
    odds = alone * np.float32([200 / 255, LEAST_ODDS, 55 / 255])
    assert np.allclose(both, odds / odds.sum(axis=-1, keepdims=True), atol=1e-4)
    assert both[..., 0].mean() > alone[..., 0].mean()


def test_cells_off_the_photo_are_empty() -> None:
    """The photo fills the upper left of the grid and no other cell."""
    features = hair_features(photo(60, 120), None, ring((60, 30), 10))
    columns, rows = features.size
    assert (columns, rows) == (GRID, GRID // 2)
    assert features.values.shape == (CHANNELS, GRID, GRID)
    assert not features.values[:, rows:].any()
    assert (features.values[8, :rows] == 1).all()


@pytest.mark.parametrize("size", [(160, 120), (90, 300), (1, 7), (1, 1)])
def test_the_upper_middle_of_a_crop_is_seen_twice(
    size: tuple[int, int], monkeypatch: pytest.MonkeyPatch
) -> None:
    """The answer there is the mean of both, elsewhere and without a crop that of the whole."""
    height, width = size

    def answer(image: np.ndarray, *_: object) -> np.ndarray:
        whole = image.shape[:2] == size
        return np.full((10, 10, 3) if whole else (12, 9, 3), 0.8 if whole else 0.4, np.float32)

    monkeypatch.setattr(hair_network, "hair_probability", answer)
    monkeypatch.setattr(hair_network, "_ANSWERS", {})
    view = View("front", 0.0, photo(height, width))
    assert (find_hair(view) == np.float32(0.8)).all()
    found = find_hair(replace(view, cropped=(5, 5, 5 + width, 5 + height), photo_size=(400, 400)))
    assert np.allclose(found[:9, 1:9], 0.8 if size == (1, 1) else 0.6)
    assert np.allclose(found[9], 0.8)
    assert np.allclose(found[:, [0, 9]], 0.8)


def test_an_answer_is_remembered_by_what_was_asked(monkeypatch: pytest.MonkeyPatch) -> None:
    """The same photo is asked for once, another one again, and only the latest are kept."""
    asked = []

    def answer(image: np.ndarray, person: object, landmarks: object) -> np.ndarray:
        asked.append(int(image[0, 0, 0]))
        return np.full((2, 2, 3), asked[-1], np.float32)

    monkeypatch.setattr(hair_network, "hair_probability", answer)
    monkeypatch.setattr(hair_network, "_ANSWERS", {})
    most = hair_network._REMEMBERED
    views = [View("front", 0.0, np.full((4, 4, 3), k, np.uint8)) for k in range(most + 1)]
    for view in [*views[:most], *views[:most]]:
        assert (find_hair(view) == view.image[0, 0, 0]).all()
    assert asked == list(range(most))
    find_hair(views[most])
    find_hair(views[0])
    assert asked[most:] == [most, 0]
    assert len(hair_network._ANSWERS) == most
