"""Laws of still pictures: samples, the lens, smooth edges, and hair that is whole."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from hairkit.arrays import Float64Array, UInt8Array
from hairkit.rendering.context import renderer
from hairkit.rendering.head import head_solid
from hairkit.testing import bristle_groom
from hairkit.types.camera import Camera
from hairkit.viewer.actions.actions import perform
from hairkit.viewer.draw.frame import FrameRenderer
from hairkit.viewer.draw.hair_data import HairBody
from hairkit.viewer.draw.interface import FrameInputs, HairLook
from hairkit.viewer.draw.still import LENS_SAMPLES, SAMPLES, Lens, Still, sample_camera
from hairkit.viewer.preview import Preview
from hairkit.viewer.session import Session

GROOM = bristle_groom()
CAMERA = Camera.on_turn(20.0, distance=0.6, focal=260.0, width=160, height=120)
WALLS = "green", "white"


def test_a_lens_blurs_by_the_depth_out_of_focus() -> None:
    """In focus a point stays within its pixel; elsewhere it moves by half the lens at most."""
    lens = Lens(0.04, 0.6)
    cameras = [sample_camera(CAMERA, lens, k) for k in range(lens.samples)]
    for depth in (0.6, 0.9):
        point = CAMERA.unproject(np.array([70.0, 40.0]), np.float64(depth))
        off = np.array([camera.project(point) for camera in cameras]) - [70.0, 40.0]
        expected = 0.02 * CAMERA.focal * abs(1 / 0.6 - 1 / depth)
        farthest = np.linalg.norm(off, axis=1).max()
        assert expected - 0.75 <= farthest <= expected + 0.75
        assert np.abs(off.mean(axis=0)).max() < 0.1
    assert lens.samples == LENS_SAMPLES
    assert Lens(0.0, 0.6).samples == SAMPLES


def test_a_still_is_the_mean_of_its_samples() -> None:
    """Rounded; a cleared one begins again."""
    still = Still()
    samples = np.random.default_rng(2).integers(0, 256, (16, 3, 4, 3)).astype(np.uint8)
    for sample in samples:
        mean = still.add(sample)
    np.testing.assert_allclose(mean, samples.mean(axis=0), atol=0.501)
    still.clear()
    np.testing.assert_array_equal(still.add(samples[0]), samples[0])


def see_through(frame: FrameRenderer, wanted: FrameInputs) -> Float64Array:
    """Return (H, W) the share of each pixel that lets the backdrop through."""
    pictures = []
    for wall in WALLS:
        frame.draw(replace(wanted, guide_rows=frame.body.guide_rest, backdrop=wall))
        pictures.append(frame.read().astype(float))
    frame.draw(replace(wanted, hair=None, show_head=False, backdrop=WALLS[1]))
    white = frame.read().astype(float)
    frame.draw(replace(wanted, hair=None, show_head=False, backdrop=WALLS[0]))
    wide = white[..., 0] - frame.read()[..., 0]
    share: Float64Array = (pictures[1] - pictures[0])[..., 0] / wide
    return share


@pytest.mark.parametrize("soft", [True, False], ids=["processor", "shaders"])
def test_the_edges_of_the_head_are_smooth_at_every_scale(soft: bool) -> None:
    """Most rows have a pixel at the outline that is partly head and partly backdrop.

    On software renderers once the picture is refined.
    """
    with renderer() as gl:
        frame = FrameRenderer(
            gl, head_solid(GROOM.head, GROOM.material), HairBody.of(GROOM, 200), soft
        )
        for scale in (1.0, 0.65):
            camera = CAMERA.resized(round(160 * scale), round(120 * scale))
            lens = Lens(0.0, 1.0)
            cameras = [sample_camera(camera, lens, k) for k in range(4)] if soft else [camera]
            seen = [see_through(frame, FrameInputs(c, np.eye(4), None, None)) for c in cameras]
            share = np.mean(seen, axis=0)
            inside = (share < 0.05).any(axis=1)
            partial = ((share > 0.1) & (share < 0.9)).any(axis=1)
            assert inside.sum() > 40 * scale
            assert partial[inside].mean() > 0.6
        frame.release()


def curtain(count: int) -> HairBody:
    """Return so many hanging strands in a thick sheet that slants away from the camera."""
    body = HairBody.of(GROOM, len(GROOM.strands))
    random = np.random.default_rng(5)
    x, thick = random.uniform(-0.08, 0.08, count), random.uniform(0, 0.03, count)
    t = np.linspace(0.1, -0.1, body.points_each)
    hair = np.stack(np.broadcast_arrays(x[:, None], t, (-2 * x - thick)[:, None]), axis=2)
    first = np.zeros((count, 3), np.int32)
    weights = np.tile(np.float32([1, 0, 0]), (count, 1))
    edges = np.diff(hair, axis=1, prepend=hair[:, :1]).astype(np.float32)
    edges[:, 0] = hair[:, 0] - body.guide_rest[0, 0]
    widths = np.full(edges.shape[:2], GROOM.material.width, np.float32)
    return replace(body, followed=first, weights=weights, edges=edges, widths=widths)


@pytest.mark.parametrize("soft", [True, False], ids=["processor", "shaders"])
@pytest.mark.parametrize("count", [100, 1000, 10_000, 100_000])
def test_hair_is_whole_however_many_strands_there_are(soft: bool, count: int) -> None:
    """A curtain hides the backdrop behind it; only one of a hundred strands has gaps."""
    look = HairLook(count, False)
    wanted = FrameInputs(CAMERA, np.eye(4), None, look, show_head=False, whole_light=True)
    with renderer() as gl:
        head = head_solid(GROOM.head, GROOM.material)
        frame = FrameRenderer(gl, head, curtain(count), soft)
        share = see_through(frame, wanted)
        frame.release()
    x, y = np.rint(CAMERA.project(np.array([[-0.06, 0.08, 0.12], [0.06, -0.08, -0.12]])).T)
    within = np.s_[int(y[0]) : int(y[1]), int(x[0]) : int(x[1])]
    assert share[within].size > 1000
    assert share[within].mean() < (0.3 if count == 100 else 0.02)


def still_of(preview: Preview) -> UInt8Array:
    """Return the complete still picture."""
    while preview.refine():
        pass
    return preview.picture().copy()


def test_a_picture_is_refined_sample_by_sample_and_then_left_alone(session: Session) -> None:
    """It nears the picture of many more pixels; what is complete is not drawn again."""
    perform(session, "hairs", {"count": 600})
    with renderer() as gl:
        preview = Preview(gl, session)
        preview.draw(still=True)
        plain = preview.picture().astype(float)
        drawn = []
        draw = preview.frame_renderer.draw
        preview.frame_renderer.draw = lambda given: (drawn.append(given), draw(given))[1]  # type: ignore[method-assign, func-returns-value]
        fine = still_of(preview)
        assert len(drawn) == SAMPLES
        assert not preview.refine()
        assert len(drawn) == SAMPLES
        session.size = (640, 480)
        session.shown.hairs = 600
        preview.draw(still=True)
        large = preview.picture().astype(float).reshape(120, 4, 160, 4, 3).mean(axis=(1, 3))
        preview.release()
    hair = np.s_[20:65, 30:130]
    assert np.abs(fine - large)[hair].mean() < 0.85 * np.abs(plain - large)[hair].mean()


def test_a_screenshot_is_a_still_picture(session: Session, tmp_path: Path) -> None:
    """Also the second one, after the view has changed."""
    pictures = []
    with renderer() as gl:
        preview = Preview(gl, session)
        for _ in range(2):
            perform(session, "screenshot", {"file": str(tmp_path / "a.png")})
            preview.frame(0.0)
            pictures.append(preview.picture().copy())
            perform(session, "orbit", {"right": 60.0})
        assert preview._still.count == SAMPLES
        preview.release()
    assert len(preview.written) == 2
    assert np.abs(pictures[0].astype(int) - pictures[1]).max() > 60


def test_light_turned_round_shines_on_the_other_side(session: Session) -> None:
    """The key light stands on the picture's left; turned by 90 degrees, on its right."""
    session.shown.hairs = 0
    perform(session, "look", {"name": "front"})
    sides = []
    with renderer() as gl:
        preview = Preview(gl, session)
        session.shown.colours = "length"  # without hair
        for degrees in (0.0, -90.0):
            perform(session, "light", {"degrees": degrees})
            preview.draw(still=True)
            face = preview.picture()[45:80, 60:100].astype(float).mean(axis=(0, 2))
            sides.append(face[:20].mean() - face[20:].mean())
        preview.release()
    assert sides[0] > 5
    assert sides[1] < -5


def test_backdrops_are_told_apart(session: Session) -> None:
    """The key goes round; a wrong name is told; green is one colour all over."""
    with renderer() as gl:
        preview = Preview(gl, session)
        seen = []
        for _ in range(5):
            preview.draw()
            picture = preview.picture()
            seen.append((session.shown.backdrop, tuple(picture[2, 2].tolist())))
            if session.shown.backdrop == "green":
                assert (picture[[2, 2, -3, -3], [2, -3, 2, -3]] == (0, 177, 64)).all()
            perform(session, "backdrop")
        preview.release()
    assert len(set(seen)) == 5
    assert session.shown.backdrop == "grey"
