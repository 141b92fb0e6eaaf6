"""Laws of the shaded pictures."""

from __future__ import annotations

import os
import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest

from hairkit.colour import srgb_from_linear
from hairkit.errors import InputError, RenderError
from hairkit.rendering import Lights, display_width, draw, draw_views
from hairkit.rendering import context as context_module
from hairkit.rendering.context import BACKENDS, renderer
from hairkit.rendering.head import SKIN
from hairkit.rendering.light import hair_density, light_volume
from hairkit.testing import bristle_groom
from hairkit.types.camera import Camera
from hairkit.types.groom import HairMaterial
from hairkit.types.skin import SkinMaps, Texture
from hairkit.types.strands import Strands

CAMERA = Camera.on_turn(20.0, distance=0.8, focal=140.0, width=80, height=60)


def test_a_picture_has_the_size_asked_for_and_the_background_where_nothing_is() -> None:
    """Far from hair and head the given background shows unchanged; on them it does not."""
    background = np.full((60, 80, 3), (10, 200, 90), np.uint8)
    picture = draw(bristle_groom(), None, CAMERA, background=background)
    assert picture.shape == (60, 80, 3)
    assert (picture[0] == background[0]).all()
    assert (picture[30, 40] != background[30, 40]).any()
    assert draw(bristle_groom(), None, CAMERA, width=40).shape == (30, 40, 3)


def test_fair_hair_is_brighter_than_dark_hair() -> None:
    """The material's colour decides the brightness and the hue of the hair."""
    groom = bristle_groom()
    dark, fair, red = (
        draw(groom, None, CAMERA, material=HairMaterial(np.array(c), np.array(c)))[20:26, 36:44]
        for c in ((0.02, 0.02, 0.02), (0.5, 0.5, 0.5), (0.5, 0.05, 0.05))
    )
    assert fair.mean() > dark.mean() + 40
    assert red[..., 0].mean() > red[..., 2].mean() + 40


@pytest.mark.parametrize(("count", "wider"), [(1_000, 5), (50_000, 2), (200_000, 1)])
def test_few_strands_are_as_wide_as_a_full_head_of_hair_needs(count: int, wider: float) -> None:
    """Below a fifth of its 100,000 hairs they become no wider."""
    strands = Strands(np.zeros((2 * count, 3), np.float32), np.arange(count + 1) * 2)
    assert display_width(strands, HairMaterial(width=1e-4)) == pytest.approx(wider * 1e-4)


def test_views_drawn_together_equal_views_drawn_alone() -> None:
    """`draw_views` shares its preparation but not its pictures."""
    groom = bristle_groom()
    cameras = [Camera.on_turn(a, distance=0.6, focal=140.0, width=80, height=60) for a in (0, 90)]
    together = draw_views(groom, None, cameras)
    alone = [draw(groom, None, camera) for camera in cameras]
    assert all((a == b).all() for a, b in zip(together, alone, strict=True))
    assert (together[0] != together[1]).any()


def test_light_fades_into_the_hair() -> None:
    """Transmittance lies in [0, 1], is whole outside, and falls along the light's way."""
    generator = np.random.default_rng(0)
    roots = generator.uniform(-0.05, 0.05, (3000, 3)).astype(np.float32)
    strands = Strands.from_list([[p, p + np.float32([0, 0.01, 0])] for p in roots])
    lights = Lights.studio((1, 0, 0), (0, 0, -1))
    volume = light_volume(hair_density(strands, ()), lights)
    reached = volume.transmittance
    assert reached.min() >= 0
    assert reached.max() <= 1 + 1e-6
    middle = reached[:, reached.shape[1] // 2, reached.shape[2] // 2, 0]
    assert middle[-1] == pytest.approx(1, abs=1e-3)
    inside = middle[4:-4]
    assert (np.diff(inside) > -0.02).all()
    assert inside[0] < 0.7 * inside[-1]


def test_a_picture_of_another_aspect_is_refused() -> None:
    """Width and height that would distort the camera give one line that says so."""
    with pytest.raises(InputError, match="aspect"):
        draw(bristle_groom(), None, CAMERA, width=100, height=20)
    with pytest.raises(InputError, match="background has shape"):
        draw(bristle_groom(), None, CAMERA, background=np.zeros((3, 3, 3), np.uint8))


def test_a_renderer_that_is_not_there_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    """An unknown backend, and none that works, each give one line with the cure."""
    monkeypatch.setenv("HAIRKIT_GL", "glide")
    with pytest.raises(RenderError, match="'glide', expected one of egl, osmesa"):
        context_module._create()
    monkeypatch.delenv("HAIRKIT_GL")

    def refuse(backend: str) -> None:
        raise OSError(f"no {backend} here")

    monkeypatch.setattr(context_module, "_open", refuse)
    with pytest.raises(RenderError, match=r"no egl here.*no osmesa here.*apt-get install"):
        context_module._create()


def test_an_error_left_in_opengl_is_reported() -> None:
    """A block that leaves an OpenGL error raises, and the next one works again."""
    with pytest.raises(RenderError, match="GL_INVALID_ENUM"), renderer() as gl:
        gl.context.enable_direct(0xDEAD)
    with renderer() as gl:
        assert gl.backend in BACKENDS


def test_both_backends_draw_the_same() -> None:
    """OSMesa, in a process of its own, draws what the first backend draws."""
    script = (
        "import sys; from hairkit.errors import RenderError\n"
        "from hairkit.rendering import draw; from hairkit.testing import bristle_groom\n"
        "from hairkit.types.camera import Camera\n"
        "camera = Camera.on_turn(20.0, distance=0.8, focal=140.0, width=80, height=60)\n"
        "try: sys.stdout.buffer.write(draw(bristle_groom(), None, camera).tobytes())\n"
        "except RenderError as error: sys.exit(f'unavailable {error}')"
    )
    environment = {**os.environ, "HAIRKIT_GL": "osmesa"}
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, env=environment)
    if done.returncode and b"unavailable" in done.stderr:
        pytest.skip(f"no OSMesa: {done.stderr.decode().strip()}")
    assert done.returncode == 0, done.stderr.decode()
    other = np.frombuffer(done.stdout, np.uint8).reshape(60, 80, 3).astype(int)
    assert np.abs(other - draw(bristle_groom(), None, CAMERA)).mean() < 1


def test_a_picture_of_one_colour_is_that_colour_of_skin() -> None:
    """A head whose albedo is white times the skin's colour looks like a head without a picture."""
    groom = bristle_groom()
    skin = np.rint(255 * srgb_from_linear(np.array(SKIN, np.float64))).astype(np.uint8)
    maps = SkinMaps(Texture.encode(np.tile(skin, (8, 8, 1))))
    plain = draw(groom, None, CAMERA).astype(int)
    pictured = draw(groom, replace(groom.head, maps=maps), CAMERA).astype(int)
    assert np.abs(plain - pictured).max() <= 3
    blue = SkinMaps(Texture.encode(np.tile(np.array([0, 0, 255], np.uint8), (8, 8, 1))))
    coloured = draw(groom, replace(groom.head, maps=blue), CAMERA).astype(int)
    assert (coloured[40:44, 38:42, 2] > coloured[40:44, 38:42, 0] + 40).all()
