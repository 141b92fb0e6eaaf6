"""Laws of the drawn picture, on whatever OpenGL there is."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import cv2
import numpy as np
import pytest
from frame_pictures import (
    CAMERA,
    GREEN,
    GROOM,
    LOOK,
    changed,
    inputs,
    make_frame_renderer,
    picture,
    twin,
)

from hairkit.arrays import Float32Array
from hairkit.head_model.template import default_head
from hairkit.rendering.context import renderer
from hairkit.rendering.head import head_solid
from hairkit.simulation.motion import turn_about
from hairkit.types.camera import Camera
from hairkit.viewer.draw import mesh_layer
from hairkit.viewer.draw.frame import FrameRenderer
from hairkit.viewer.draw.hair_cpu import SoftHairPass
from hairkit.viewer.draw.hair_data import HairBody
from hairkit.viewer.draw.light_gpu import TURNS
from hairkit.viewer.draw.lines import LineSet
from hairkit.viewer.draw.mesh_cpu import SoftSolid
from hairkit.viewer.draw.meshes import SolidPass


def test_hair_is_drawn_where_the_camera_sees_it_and_nowhere_else(
    frame_renderer: FrameRenderer,
) -> None:
    """Pixels that change with the hair lie at projected hair; the front tips are covered."""
    with renderer():
        plain = inputs(show_head=False)
        hair = changed(
            picture(frame_renderer, plain), picture(frame_renderer, replace(plain, hair=None))
        )
    pixels = CAMERA.project(
        twin(frame_renderer.body, frame_renderer.body.guide_rest).reshape(-1, 3)
    )
    low, high = pixels.min(axis=0) - 4, pixels.max(axis=0) + 4
    rows, columns = np.nonzero(hair)
    assert len(rows) > 1000
    assert (columns >= low[0]).all()
    assert (columns <= high[0]).all()
    assert (rows >= low[1]).all()
    assert (rows <= high[1]).all()
    upper = CAMERA.project(np.array([0.0, 0.11, 0.0]))
    assert hair[int(upper[1]), int(upper[0])]


def test_the_head_hides_hair_behind_it(frame_renderer: FrameRenderer) -> None:
    """Hair whose every point lies behind the head leaves the picture as it is."""
    behind = frame_renderer.body.guide_rest * 0.2 + CAMERA.forward.astype(np.float32) * 0.3
    with renderer():
        bare = picture(frame_renderer, inputs(hair=None))
        hidden = picture(frame_renderer, inputs(guide_rows=behind, hair=replace(LOOK, hairs=80)))
        seen = picture(
            frame_renderer, inputs(guide_rows=behind, hair=replace(LOOK, hairs=80), show_head=False)
        )
        frame_renderer.draw(inputs(guide_rows=frame_renderer.body.guide_rest))
    centre = np.s_[55:66, 75:86]
    assert not changed(hidden, bare)[centre].any()
    assert changed(seen, hidden)[centre].any()


def test_the_head_is_drawn_in_the_first_picture_and_in_later_ones(
    frame_renderer: FrameRenderer,
) -> None:
    """Skin stands before the studio from the first picture on."""
    with renderer() as gl:
        fresh = make_frame_renderer(gl, soft=bool(frame_renderer.soft))
        first, without = (picture(fresh, inputs(hair=None, show_head=s)) for s in (True, False))
        again = picture(fresh, inputs(hair=None))
        fresh.release()
    assert changed(first, without)[60, 80]
    assert (first == again).all()


def test_colour_is_the_materials(frame_renderer: FrameRenderer) -> None:
    """Red hair is red, green hair green."""
    with renderer() as gl:
        green = make_frame_renderer(gl, soft=bool(frame_renderer.soft), colour=GREEN)
        pictures = [picture(drawn, inputs()) for drawn in (frame_renderer, green)]
        green.release()
        bare = picture(frame_renderer, inputs(hair=None))
    where = changed(pictures[0], bare) & changed(pictures[1], bare)
    means = [image[where].mean(axis=0) for image in pictures]
    assert means[0][0] > means[0][1] + 20
    assert means[1][1] > means[1][0] + 20


def test_a_head_and_its_camera_that_move_together_show_the_same_hair(
    frame_renderer: FrameRenderer,
) -> None:
    """Only their relation matters, studio apart: what moves with the head is drawn in its frame."""
    motion = turn_about(np.zeros(3), ("yaw", 0.7))
    with_head = replace(CAMERA, camera_from_head=CAMERA.camera_from_head @ np.linalg.inv(motion))
    with renderer():
        still, moved = (
            picture(frame_renderer, s)
            for s in (inputs(), inputs(camera=with_head, world_from_head=motion))
        )
        bare = picture(frame_renderer, inputs(hair=None, show_head=False))
    here = changed(still, bare)
    assert np.abs(still.astype(int) - moved)[here].mean() < 2


def test_two_pictures_of_the_same_are_the_same(frame_renderer: FrameRenderer) -> None:
    """Sums are whole numbers: the order in which cores add them does not show."""
    with renderer():
        assert (picture(frame_renderer, inputs()) == picture(frame_renderer, inputs())).all()


def test_thin_strands_are_calm(frame_renderer: FrameRenderer) -> None:
    """What hair darkens in all does not change when the picture slides by parts of a pixel."""
    few = replace(LOOK, hairs=150)
    sums = []
    with renderer():
        for slide in np.linspace(0, 1, 5):
            camera = replace(CAMERA, centre=CAMERA.centre + slide)
            bare = picture(frame_renderer, inputs(camera=camera, hair=None)).astype(float)
            sums.append(
                np.abs(picture(frame_renderer, inputs(camera=camera, hair=few)) - bare).sum()
            )
    assert np.ptp(sums) < 0.05 * np.mean(sums)


def test_lines_are_drawn_in_their_colour(frame_renderer: FrameRenderer) -> None:
    """A line across the picture before the head shows its colour at its middle."""
    ends = CAMERA.unproject(np.array([[20.0, 60.5], [140.0, 60.5]]), np.array([0.3, 0.3]))
    colours = np.tile(np.float32([0, 1, 0, 1]), (2, 1))
    line = LineSet(ends.astype(np.float32), np.array([0, 2]), colours)
    with renderer():
        drawn = picture(frame_renderer, inputs(hair=None, lines=((line, False),)))
    assert (np.abs(drawn[59:62, 80].astype(int) - [0, 255, 0]).max(axis=1) < 30).any()


def test_light_made_in_turns_is_light_made_at_once(frame_renderer: FrameRenderer) -> None:
    """After enough pictures of the same, a picture is that of a still."""
    with renderer():
        once = picture(frame_renderer, inputs())
        picture(frame_renderer, inputs(hair=None))  # other light
        for _ in range(2 * TURNS + 1):
            in_turns = picture(frame_renderer, inputs(whole_light=False))
    assert np.abs(once.astype(int) - in_turns).max() <= 1


def test_what_stays_is_drawn_again_with_new_light_only(
    frame_renderer: FrameRenderer, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The torso is drawn once in `TURNS` pictures of a head that turns, and is where it was."""
    count, kind = [0], SoftSolid if frame_renderer.soft else SolidPass
    draw = kind.draw
    with renderer():
        upload_torso(frame_renderer)

        def counted(part: Any, *values: Any) -> Any:
            count[0] += part is frame_renderer._meshes._solids["torso"]
            return draw(part, *values)

        monkeypatch.setattr(kind, "draw", counted)
        for turn in np.linspace(0.0, 0.3, 2 * TURNS):
            pose = turn_about(np.zeros(3), ("yaw", turn))
            turned = inputs(whole_light=False, solids=("torso",), world_from_head=pose)
            kept = picture(frame_renderer, turned)
        assert 2 <= count[0] <= 3
        frame_renderer._meshes.forget()
        anew = picture(frame_renderer, replace(turned, same_light=True))
    assert count[0] >= 3
    assert changed(kept, anew).mean() < 0.01


def upload_torso(frame_renderer: FrameRenderer) -> None:
    """Upload a ball below the head as the torso."""
    below = replace(GROOM.head, vertices=GROOM.head.vertices - np.float32([0.05, 0.1, 0.0]))
    frame_renderer.upload_solid("torso", head_solid(below, GROOM.material))


NODDED = turn_about(np.zeros(3), ("pitch", 0.3))
CHANGES: dict[str, dict[str, Any]] = {
    "camera": {"camera": Camera.on_turn(60.0, distance=0.6, focal=260.0, width=160, height=120)},
    "head": {"world_from_head": NODDED, "solids": ()},
    "torso": {"world_from_torso": NODDED},
    "no head": {"show_head": False},
    "no torso": {"solids": ()},
    "floor": {"floor": -0.2},
    "exposure": {"exposure": 1.2},
    "lights": {"light_turn": 1.0},
    "backdrop": {"backdrop": "warm"},
    "skin": {"fine_skin": True},
    "no hair": {"hair": None},
    "size": {"camera": CAMERA.resized(96, 72)},
}


@pytest.mark.parametrize("what", CHANGES)
def test_a_kept_layer_is_a_fresh_one(frame_renderer: FrameRenderer, what: str) -> None:
    """Whatever changes, and back again: pictures are those of which nothing was kept.

    Only the torso keeps its light while the head moves, until the next light.
    """
    first = inputs(solids=("torso",))
    with renderer():
        upload_torso(frame_renderer)
        frame_renderer.draw(replace(first, guide_rows=frame_renderer.body.guide_rest))
        for wanted in (replace(first, **CHANGES[what]), first):
            kept = picture(frame_renderer, replace(wanted, same_light=True, whole_light=False))
            frame_renderer._meshes.forget()
            anew = picture(frame_renderer, replace(wanted, same_light=True, whole_light=False))
            np.testing.assert_array_equal(kept, anew)


def test_a_picture_without_hair_in_between_changes_nothing(frame_renderer: FrameRenderer) -> None:
    """Guides may be shown alone for a while: outlines are not smoothed twice after that."""
    wanted = inputs(solids=("torso",), same_light=True, whole_light=False)
    with renderer():
        upload_torso(frame_renderer)
        picture(frame_renderer, inputs(solids=("torso",)))
        before = picture(frame_renderer, wanted)
        picture(frame_renderer, replace(wanted, hair=None))
        np.testing.assert_array_equal(picture(frame_renderer, wanted), before)


def beside(mask: np.ndarray) -> np.ndarray:
    """Return which pixels are next to the edge of a mask (H, W)."""
    box, pixels = np.ones((3, 3)), mask.astype(np.uint8)
    result: np.ndarray = cv2.dilate(pixels, box) != cv2.erode(pixels, box)
    return result


def test_processor_and_shaders_draw_the_same_meshes(monkeypatch: pytest.MonkeyPatch) -> None:
    """Depth is the same, and so are colours up to where light is computed: vertices or pixels."""
    monkeypatch.setattr(mesh_layer, "EDGE_SAMPLES", 0)
    head = default_head()
    camera = Camera.on_turn(20.0, distance=0.6, focal=520.0, width=320, height=240)
    wanted = inputs(camera=camera, hair=None, world_from_head=NODDED)
    pictures, depths = [], []
    with renderer() as gl:
        for soft in (True, False):
            body = HairBody.of(GROOM, 100)
            stage = FrameRenderer(gl, head_solid(head, GROOM.material), body, soft)
            pictures.append(picture(stage, wanted).astype(int))
            depth = stage._meshes.depth_texture().read()
            depths.append(np.frombuffer(depth, np.float32).reshape(240, 320))
            stage.release()
    skin = depths[1] < 1
    outlines = beside(skin)  # smooth on the processor
    assert 0.2 < skin.mean() < 0.8
    assert ((depths[0] < 1) == skin).mean() > 0.9995
    assert np.quantile(np.abs(depths[0] - depths[1])[skin], 0.999) < 1e-4
    off = np.abs(pictures[0] - pictures[1]).max(axis=2)
    assert off[~skin & ~outlines].max() <= 1
    assert off[skin & ~outlines].mean() < 8


def test_the_neck_ends_in_the_collar_of_a_head_that_nods() -> None:
    """Its end goes with the torso, what is above its upper joint with the head, and it is whole."""
    head = default_head()
    nod = turn_about(head.joints[1].astype(np.float64), ("pitch", 0.4))
    with renderer() as gl:
        part = SolidPass(gl, head_solid(head, GROOM.material))
        part.place(np.linalg.inv(nod))
        bent = part.placed()
        part.release()
    rest, y = head.vertices, head.vertices[:, 1]
    above, below = y > head.joints[1, 1], y <= head.joints[0, 1]
    np.testing.assert_array_equal(bent.vertices[above], rest[above])
    in_world = bent.vertices @ nod[:3, :3].T + nod[:3, 3]
    assert below.sum() > 10
    np.testing.assert_allclose(in_world[below], rest[below], atol=1e-6)
    edges = np.concatenate([head.faces[:, [0, 1]], head.faces[:, [1, 2]]])
    was, now = (
        np.linalg.norm(v[edges[:, 0]] - v[edges[:, 1]], axis=1) for v in (rest, bent.vertices)
    )
    assert (np.abs(now - was) < 0.01).all()


def test_hair_behind_meshes_is_not_shaded() -> None:
    """Points are shaded where a stroke from them may be seen: of which an end or the middle is."""
    with renderer() as gl:
        frame_renderer = make_frame_renderer(gl, soft=True)
        picture(frame_renderer, inputs())
        hair = frame_renderer.hair
        assert isinstance(hair, SoftHairPass)
        state = hair._state
        looks, seen = state.looks[: LOOK.hairs, :, 3], state.seen[: LOOK.hairs]
        mesh = frame_renderer._meshes.depth.T.copy()  # type: ignore[attr-defined]
        frame_renderer.release()

    def behind(places: Float32Array) -> np.ndarray:
        x, y = (np.clip(places[..., n].astype(int), 0, s) for n, s in ((0, 159), (1, 119)))
        result: np.ndarray = places[..., 2] > mesh[y, x]
        return result

    ends = behind(seen)
    strokes = ends[:, 1:] & ends[:, :-1] & behind((seen[:, 1:] + seen[:, :-1]) / 2)
    hidden = np.pad(strokes, ((0, 0), (1, 0)), constant_values=True)
    hidden &= np.pad(strokes, ((0, 0), (0, 1)), constant_values=True)
    assert 0.2 < hidden.mean() < 0.8
    assert ((looks == 0) == hidden).mean() > 0.999  # places are rounded otherwise here


@pytest.mark.parametrize("place", [np.nan, np.inf, -np.inf, 1e30, -1e30])
def test_hair_that_is_nowhere_harms_nothing(place: float) -> None:
    """Guides without a place leave a picture, and the next one is as if they had never been."""
    with renderer() as gl:
        frame_renderer = make_frame_renderer(gl, soft=True)
        before = picture(frame_renderer, inputs())
        lost = frame_renderer.body.guide_rest.copy()
        lost[::2, 3:] = place
        assert picture(frame_renderer, inputs(guide_rows=lost)).shape == before.shape
        np.testing.assert_array_equal(picture(frame_renderer, inputs()), before)
        frame_renderer.release()


@pytest.mark.parametrize("smooth", [True, False])
@pytest.mark.parametrize("direction", [True, False])
def test_processor_and_shaders_draw_the_same(
    smooth: bool, direction: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Both ways to draw differ by roundings, and by how finely skin and shadows are sampled.

    Outlines of the head, which are smooth on the processor, are left out.
    """
    monkeypatch.setattr(mesh_layer, "EDGE_SAMPLES", 0)
    look = replace(LOOK, smooth=smooth, by_direction=direction, wider=2.0)
    wanted = inputs(hair=look)
    with renderer() as gl:
        stages = [make_frame_renderer(gl, soft=soft) for soft in (True, False)]
        first, second = (picture(frame_renderer, wanted).astype(int) for frame_renderer in stages)
        bare = picture(stages[0], inputs(hair=None))
        outlines = beside(stages[0]._meshes.depth.T < 1)  # type: ignore[attr-defined]
        for frame_renderer in stages:
            frame_renderer.release()
    off = np.abs(first - second)
    hair = changed(first, bare) & ~outlines
    assert hair.sum() > 1000
    assert off[hair].mean() < 3.5
    assert np.quantile(off[hair], 0.99) < 18
    assert abs((first - second)[hair].mean()) < 2
