"""Laws of the training of the hair network: its pictures, and the network in PyTorch."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest

from hairkit.imaging.hair_features import CHANNELS, GRID
from hairkit.synth.bust import Bust
from hairkit.types.mask import BACKGROUND, HAIR, PERSON
from training.hair_depth.grooms import random_groom
from training.hair_network import heads
from training.hair_network.bodies import dress
from training.hair_network.colours import noise, recolour
from training.hair_network.compose import label_shares
from training.hair_network.composer import compose, place
from training.hair_network.looks import fade_hair
from training.hair_network.renders import Render, read_renders


@pytest.fixture
def render() -> Render:
    """A head of 120 x 160 pixels: hair above, a face below, shoulders."""
    labels = np.full((160, 120), BACKGROUND, np.uint8)
    cv2.ellipse(labels, (60, 140), (50, 40), 0, 0, 360, PERSON, -1)
    cv2.ellipse(labels, (60, 70), (35, 50), 0, 0, 360, HAIR, -1)
    cv2.ellipse(labels, (60, 85), (24, 32), 0, 0, 360, PERSON, -1)
    head = np.zeros(labels.shape, np.uint8)
    cv2.ellipse(head, (60, 75), (30, 45), 0, 0, 360, 1, -1)
    image = np.random.default_rng(5).integers(0, 256, (*labels.shape, 3)).astype(np.uint8)
    angle = np.linspace(0, 2 * np.pi, 68, endpoint=False)
    points = np.stack([60 + 18 * np.cos(angle), 88 + 22 * np.sin(angle)], axis=1)
    points[36:48, 1], points[48:, 1] = 80, 102
    return Render("ball/photos/0_front.jpg", image, labels, head > 0, points)


def test_equal_seeds_make_equal_pictures(render: Render) -> None:
    """Pictures follow from the seed; they are of 640 pixels and have the three labels at most."""
    first, again = ([compose([render], rng) for _ in range(6)] for rng in map(_generator, (1, 1)))
    for one, other in zip(first, again, strict=True):
        assert np.array_equal(one.image, other.image)
        assert np.array_equal(one.labels, other.labels)
        assert one.image.shape == (*one.labels.shape, 3)
        assert 639 <= max(one.labels.shape) <= 640
        assert set(np.unique(one.labels)) <= {BACKGROUND, PERSON, HAIR}


def test_draped_hair_lies_on_the_shoulders(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """It ends below them, outside of the torso; its photos are read as renders."""
    groom = random_groom(2000, 60, draped=True)
    tips = groom.strands.points[groom.strands.offsets[1:] - 1].astype(np.float64)
    assert np.median(tips[:, 1]) < -0.22
    assert not Bust.under(groom.head).contains(tips).any()
    monkeypatch.setattr(heads, "STRANDS", 60)
    monkeypatch.setattr(heads, "SIZES", ((90, 120),))
    heads.photographed(tmp_path, draped=True, seed=2000)
    renders = read_renders(tmp_path)
    assert [each.labels.shape for each in renders] == [(120, 90)] * 8
    assert all(each.head.any() for each in renders)


def test_labels_move_with_the_picture(render: Render) -> None:
    """A picture of its own labels stays one in crops, turns and mirrors, but for edges."""
    large = render.labels.repeat(4, axis=0).repeat(4, axis=1)
    painted = np.repeat(large[..., None] / 255, 3, axis=2)
    for seed in range(8):
        picture, labels = place(_generator(seed), painted, large)
        wrong = np.abs(picture[..., 0] * 255 - labels) > 2
        edges = cv2.morphologyEx(labels, cv2.MORPH_GRADIENT, np.ones((17, 17))) > 0
        inside = (slice(8, -8), slice(8, -8))  # an edge may lie just outside of the picture
        assert not (wrong & ~edges)[inside].any()


def test_hair_of_another_colour_keeps_its_strands(render: Render) -> None:
    """The mean becomes the colour asked for, light and dark strands stay so, the rest is left."""
    hair = render.labels == HAIR
    lab = np.zeros((*hair.shape, 3), np.float32) + np.array((40, 5, 10), np.float32)
    lab[..., 0] += 3 * noise(_generator(2), hair.shape, 20, 2)
    changed = recolour(lab, hair, np.array([50.0, 3.0, 20.0]), 1.0)
    assert np.allclose(changed[hair].mean(axis=0), (50, 3, 20), atol=0.5)
    assert np.corrcoef(changed[hair][:, 0], lab[hair][:, 0])[0, 1] > 0.99
    assert np.array_equal(changed[~hair], lab[~hair])


def test_a_body_takes_no_skin_and_adds_no_hair(render: Render) -> None:
    """All hair was hair or grew on at the lower edge; bare skin and what was a person are one."""
    for seed in range(8):
        dressed, bare = dress(_generator(seed), render)
        assert dressed.image.shape[:2] == dressed.labels.shape == dressed.head.shape == bare.shape
        assert (dressed.labels[bare] == PERSON).all()
        left = (dressed.labels.shape[1] - render.labels.shape[1]) // 2
        old = dressed.labels[:160, left : left + 120]
        assert not ((old == HAIR) & (render.labels != HAIR)).any()
        assert not ((old == BACKGROUND) & (render.labels == PERSON)).any()


def test_a_fading_cut_keeps_the_hair_above(render: Render) -> None:
    """Hair becomes person from its lower edge on, on the head alone, in some of the pictures."""
    short = np.where(render.head, render.labels, np.uint8(BACKGROUND))
    lab = np.full((*short.shape, 3), 30, np.float32)
    skin, counts = np.array([70.0, 10, 15]), []
    for seed in range(12):
        painted, labels = fade_hair(_generator(seed), lab, short, render.head, skin)
        gone = (labels != short) & (short == HAIR)
        assert np.array_equal(labels != short, gone)
        assert (labels[gone] == PERSON).all()
        assert np.array_equal(painted[~render.head], lab[~render.head])
        counts.append(int(gone.sum()))
    assert min(counts) == 0 < max(counts)


def test_shares_of_labels_add_up(render: Render) -> None:
    """They are 1 together in the photo and 0 outside, and hair has the area of its label."""
    shares = label_shares(render.labels, (96, GRID))
    assert np.allclose(shares[:, :, :96].sum(axis=0), 1, atol=1e-5)
    assert not shares[:, :, 96:].any()
    area = shares[0].sum() / (96 * GRID)
    assert area == pytest.approx((render.labels == HAIR).mean(), abs=1e-4)


def test_numpy_runs_what_pytorch_trained(tmp_path: Path) -> None:
    """A step changes the weights; those written give the same scores in NumPy and PyTorch."""
    pytest.importorskip("torch", reason="training needs PyTorch, which is not installed")
    from training.hair_network import train

    rng = _generator(3)
    features = rng.normal(size=(4, CHANNELS, GRID, GRID)).astype(np.float16)
    shares = np.zeros((4, 3, GRID, GRID), np.uint8)
    shares[:, 0, :64], shares[:, 2, 64:] = 255, 255
    np.savez(tmp_path / "set.npz", features=features, shares=shares)
    words = [str(tmp_path / "set.npz"), "-o", str(tmp_path / "weights.npz"), "--steps", "2"]
    words += ["--batch", "2"]
    train.main(words)
    written: Any = np.load(tmp_path / "weights.npz")
    before = train.new_weights(0)
    assert set(written) == set(before)
    assert not np.allclose(written["exit.bias"], before["exit.bias"].numpy(), atol=1e-5)
    assert train.disagreement(tmp_path / "weights.npz", features[0]) < 1e-4
    old = ["--start", words[2], "--blend", words[2]]
    train.main([words[0], "-o", str(tmp_path / "again.npz"), "--steps", "1", "--new", "0", *old])
    again: Any = np.load(tmp_path / "again.npz")
    assert all(np.array_equal(again[name], written[name]) for name in before)


def test_a_wider_network_starts_as_the_narrow_one(monkeypatch: pytest.MonkeyPatch) -> None:
    """Channels that are added change no score."""
    torch = pytest.importorskip("torch", reason="training needs PyTorch, which is not installed")
    from training.hair_network import train

    wide = train.new_weights(1)
    monkeypatch.setattr(train, "WIDTHS", tuple(width - 8 for width in train.WIDTHS))
    narrow = train.new_weights(2)
    x = torch.from_numpy(_generator(4).normal(size=(1, CHANNELS, GRID, GRID)).astype(np.float32))
    first, second = (train.network(each, x) for each in (narrow, train.widen(narrow, wide)))
    assert np.allclose(first.numpy(), second.numpy(), atol=1e-4)


def _generator(seed: int) -> np.random.Generator:
    return np.random.default_rng(seed)
