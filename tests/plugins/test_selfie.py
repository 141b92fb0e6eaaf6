"""Laws of the person's network."""

from __future__ import annotations

from pathlib import Path
from typing import Any, cast

import numpy as np
import pytest
from hairkit_plugins import mask_files, selfie
from hairkit_plugins.selfie import MODELS, Options, find_classes, segment, segment_person

import hairkit
from hairkit.errors import FormatError, ModelError
from hairkit.nets.model_folder import find_model, missing_models
from hairkit.nets.net_process import NetProcess, shared_nets
from hairkit.types.capture import View
from hairkit.types.mask import HAIR, PERSON
from hairkit.types.person import Person

MODEL = find_model(*MODELS)
needs_network = pytest.mark.skipif(
    bool(missing_models(MODELS)), reason="the network is not installed: hairkit models install"
)
PHOTO = np.full((40, 30, 3), 128, np.uint8)
VIEW = View("front", 0.0, PHOTO)


class Answers:
    """A stand-in for the process: it gives every picture the same channels."""

    def __init__(self, *channels: float, logits: bool = False) -> None:
        self._scores = np.array(channels, np.float32)
        if logits:
            self._scores = np.log(self._scores)

    def run(self, model: object, batch: Any) -> tuple[Any, ...]:
        """Return constant channels (N, C, 8, 8)."""
        shape = (len(batch), len(self._scores), 8, 8)
        return (np.broadcast_to(self._scores[:, None, None], shape),)


@pytest.mark.parametrize("logits", [False, True])
@pytest.mark.parametrize("channels", [(0.2, 0.8), (0.1, 0.5, 0.1, 0.1, 0.1, 0.1)])
def test_a_network_of_the_users_is_taken(
    monkeypatch: pytest.MonkeyPatch, channels: tuple[float, ...], logits: bool
) -> None:
    """Classes come as probabilities or before softmax; all but the first are the person."""
    monkeypatch.setattr(selfie, "read_input_shape", lambda _: (1, 64, 64, 3))
    answers = cast(NetProcess, Answers(*channels, logits=logits))
    monkeypatch.setattr(selfie, "shared_nets", lambda: answers)
    maps = find_classes(PHOTO, Path("multiclass.tflite"), answers)
    assert maps.shape == (len(channels), *PHOTO.shape[:2])
    assert np.allclose(maps, np.array(channels)[:, None, None], atol=1e-5)
    found = segment_person(view=VIEW, options=Options(model=Path("multiclass.tflite")))
    assert np.abs(found.alpha.astype(float) - 255 * (1 - channels[0])).max() <= 1


@pytest.mark.parametrize(
    ("channels", "label", "known"),
    [((0.9,), HAIR, False), ((0.2, 0.8), HAIR, False), ((0.1, 0.8, 0.1), HAIR, True)],
)
def test_a_network_for_hair_makes_masks(
    monkeypatch: pytest.MonkeyPatch, channels: tuple[float, ...], label: int, known: bool
) -> None:
    """The only map, or the second, is the hair; further classes tell where the person is."""
    monkeypatch.setattr(selfie, "read_input_shape", lambda _: (1, 64, 64, 3))
    monkeypatch.setattr(selfie, "shared_nets", lambda: Answers(*channels))
    mask = segment(view=VIEW, options=Options(hair_model=Path("hair.tflite")))
    assert (mask.labels == label).all()
    assert mask.person_known == known
    hair = channels[min(1, len(channels) - 1)]
    assert mask.alpha is not None
    assert np.abs(mask.alpha.astype(float) - 255 * hair).max() <= 1


def test_the_views_person_is_kept_around_the_hair(monkeypatch: pytest.MonkeyPatch) -> None:
    """A segmenter of hair alone is completed by the person that was found before."""
    monkeypatch.setattr(selfie, "read_input_shape", lambda _: (1, 64, 64, 3))
    half = np.zeros((1, 1, 8, 8), np.float32)
    half[..., :4, :] = 1.0
    monkeypatch.setattr(selfie, "find_classes", lambda *_: half[0].repeat(5, 1).repeat(4, 2))
    person = Person(np.full((40, 32), 200, np.uint8))
    view = View("front", 0.0, np.zeros((40, 32, 3), np.uint8), person=person)
    mask = segment(view=view, options=Options(hair_model=Path("hair.tflite")))
    assert (mask.labels[:20] == HAIR).all()
    assert (mask.labels[20:] == PERSON).all()
    assert mask.person_known


def test_other_inputs_are_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    """A network that wants four channels is named with what it wants."""
    monkeypatch.setattr(selfie, "read_input_shape", lambda _: (1, 512, 512, 4))
    with pytest.raises(ModelError, match=r"hair\.tflite: wants \(1, 512, 512, 4\)"):
        find_classes(PHOTO, Path("hair.tflite"), cast(NetProcess, Answers(1.0)))


def test_a_file_that_is_no_network_is_refused(tmp_path: Path) -> None:
    """The user's file is checked before any process sees it."""
    path = tmp_path / "net.tflite"
    path.write_text("no network")
    with pytest.raises(FormatError, match="no TensorFlow Lite file"):
        segment_person(view=VIEW, options=Options(model=path))


def test_without_a_network_there_is_no_answer(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """The plugin abstains."""
    monkeypatch.setenv("HAIRKIT_MODELS", str(tmp_path))
    assert segment_person(view=VIEW, options=Options()) is None
    assert segment(view=VIEW, options=Options()) is None


@needs_network
def test_the_person_is_found_in_every_view_of_the_sample() -> None:
    """From all sides, person and mask share 0.93 or more of their union."""
    assert MODEL is not None
    for view in hairkit.sample_capture().views:
        found = find_classes(view.image, MODEL, shared_nets())[0] >= 0.5
        mask = mask_files.segment(view=view)
        assert mask is not None
        assert (found & mask.person).sum() > 0.93 * (found | mask.person).sum(), view.name


@needs_network
def test_the_mirror_image_has_the_mirrored_person() -> None:
    """The answer for the mirror image is the mirror image of the answer."""
    assert MODEL is not None
    image = hairkit.sample_capture().views[1].image
    plain = find_classes(image, MODEL, shared_nets())
    mirrored = find_classes(np.ascontiguousarray(image[:, ::-1]), MODEL, shared_nets())
    assert np.abs(plain[..., ::-1] - mirrored).max() < 0.01
