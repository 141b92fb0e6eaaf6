"""Laws of the person's network."""

from __future__ import annotations

from pathlib import Path
from typing import Any, cast

import numpy as np
import pytest
from hairkit_plugins import mask_files, selfie
from hairkit_plugins.selfie import MODELS, Options, find_classes, segment_person

import hairkit
from hairkit.errors import ModelError
from hairkit.nets.model_folder import find_model, missing_models
from hairkit.nets.net_process import NetProcess, shared_nets
from hairkit.types.capture import View

MODEL = find_model("selfie_multiclass")
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

    def input_shape(self, model: Path) -> tuple[int, ...]:
        """Return what the file's name says."""
        return (1, 512, 512, 4) if model.name == "four.tflite" else (1, 64, 64, 3)

    def run(self, model: object, batch: Any) -> tuple[Any, ...]:
        """Return constant channels (N, 8, 8, C)."""
        return (np.broadcast_to(self._scores, (len(batch), 8, 8, len(self._scores))),)


@pytest.mark.parametrize("logits", [False, True])
@pytest.mark.parametrize("channels", [(0.2, 0.8), (0.1, 0.5, 0.1, 0.1, 0.1, 0.1)])
def test_a_network_of_the_users_is_taken(
    monkeypatch: pytest.MonkeyPatch, channels: tuple[float, ...], logits: bool
) -> None:
    """Classes come as probabilities or before softmax; all but the first are the person."""
    answers = cast(NetProcess, Answers(*channels, logits=logits))
    monkeypatch.setattr(selfie, "shared_nets", lambda: answers)
    maps = find_classes(PHOTO, Path("multiclass.tflite"), answers)
    assert maps.shape == (8, 8, len(channels))
    assert np.allclose(maps, channels, atol=1e-5)
    found = segment_person(view=VIEW, options=Options(model=Path("multiclass.tflite")))
    assert np.abs(found.alpha.astype(float) - 255 * (1 - channels[0])).max() <= 1
    assert bool(found.hair.size) == (len(channels) > 2)


@pytest.mark.parametrize(
    ("first", "second", "alpha", "hair"),
    [
        (1.0, (0.0, 0.9, 0.1), 1.0, 0.9),  # both see a person
        (1.0, (1.0, 0.0, 0.0), 0.5, 0.25),  # the second sees nobody: half may be hair
        (0.0, (0.0, 1.0, 0.0), 0.5, 0.5),  # the first sees nobody
        (None, (0.2, 0.6, 0.2), 0.8, 0.6),  # the second alone
    ],
)
def test_two_networks_share_the_person(
    monkeypatch: pytest.MonkeyPatch,
    first: float | None,
    second: tuple[float, ...],
    alpha: float,
    hair: float,
) -> None:
    """The person is the mean of both; the second's share of hair in its person holds for it."""
    there = {"selfie_segmentation": first is not None, "selfie_multiclass": True}
    monkeypatch.setattr(selfie, "find_model", lambda name: Path(name) if there[name] else None)
    monkeypatch.setattr(selfie, "shared_nets", lambda: None)
    said = {"selfie_segmentation": (first,), "selfie_multiclass": second}
    monkeypatch.setattr(
        selfie,
        "find_classes",
        lambda _, path, __: np.array(said[path.name], np.float32)[None, None],
    )
    found = segment_person(view=VIEW, options=Options())
    assert found.alpha[0, 0] == pytest.approx(255 * alpha, abs=1)
    assert found.hair[0, 0] == pytest.approx(255 * hair, abs=6)


def test_other_inputs_are_refused() -> None:
    """A network that wants four channels is named with what it wants."""
    with pytest.raises(ModelError, match=r"four\.tflite: wants \(1, 512, 512, 4\)"):
        find_classes(PHOTO, Path("four.tflite"), cast(NetProcess, Answers(1.0)))


def test_a_file_that_is_no_network_is_refused(tmp_path: Path) -> None:
    """The user's file is named in one line."""
    path = tmp_path / "net.tflite"
    path.write_text("no network")
    with pytest.raises(ModelError, match=r"net\.tflite: LiteRT cannot run this network"):
        segment_person(view=VIEW, options=Options(model=path))


def test_without_a_network_there_is_no_answer(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """The plugin abstains."""
    monkeypatch.setenv("HAIRKIT_MODELS", str(tmp_path))
    assert segment_person(view=VIEW, options=Options()) is None


@needs_network
def test_the_person_is_found_in_every_view_of_the_sample() -> None:
    """From all sides, person and mask share 0.85 or more of their union."""
    for view in hairkit.sample_capture().views:
        found = segment_person(view=view, options=Options()).alpha >= 128
        mask = mask_files.segment(view=view)
        assert mask is not None
        assert (found & mask.person).sum() > 0.85 * (found | mask.person).sum(), view.name


@needs_network
def test_the_mirror_image_has_the_mirrored_person() -> None:
    """The answer for the mirror image is the mirror image of the answer."""
    assert MODEL is not None
    image = hairkit.sample_capture().views[1].image
    plain = find_classes(image, MODEL, shared_nets())
    mirrored = find_classes(np.ascontiguousarray(image[:, ::-1]), MODEL, shared_nets())
    assert np.abs(plain[:, ::-1] - mirrored).max() < 0.01
