"""Laws of the pictures and lines that a notebook shows for hairkit's types."""

from __future__ import annotations

import subprocess
import sys
from dataclasses import replace

import cv2
import numpy as np
import pytest

from hairkit.testing import ball_head, bristle_groom, turn_capture, turn_scene
from hairkit.types.camera import Camera
from hairkit.types.preview import BACKDROP, HAIR, SKIN, Previewed, draw_view
from hairkit.types.strands import Strands


def parts() -> list[Previewed]:
    """One of each type that is shown."""
    groom = bristle_groom()
    return [groom, groom.strands, groom.head, turn_capture(), turn_scene()]


@pytest.mark.parametrize("shown", parts(), ids=lambda shown: type(shown).__name__)
def test_a_type_is_shown_as_a_line_and_a_picture(shown: Previewed) -> None:
    """`repr` is one short line; the picture is a PNG with something in it, the HTML holds both."""
    line, data = repr(shown), shown._repr_png_()
    assert line.startswith(f"{type(shown).__name__}(")
    assert "\n" not in line
    assert len(line) < 100
    assert data is not None
    picture = cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_COLOR)
    assert picture is not None
    assert picture.std() > 1
    html = shown._repr_html_()
    assert "data:image/png;base64," in html
    assert line.split("(")[1] in html


def test_lines_say_what_is_there() -> None:
    """Counts and lengths are those of the object."""
    strands = Strands.from_list([[[0, 0, 0], [0, 0.1, 0]], [[0, 0, 0], [0, 0.2, 0], [0, 0.3, 0]]])
    assert repr(strands) == "Strands(2 strands, 5 points, 20.0 cm mean length)"
    assert repr(Strands.from_list([])) == "Strands(0 strands, 0 points)"
    assert repr(replace(turn_scene(), residual_px=1.234)).endswith("residual 1.23 px)")


def test_nothing_is_shown_as_text() -> None:
    """Without strands there is no picture, and the HTML is the line alone."""
    empty = Strands.from_list([])
    assert empty._repr_png_() is None
    assert empty._repr_html_() == "<code>Strands(0 strands, 0 points)</code>"


def view(distance: float) -> Camera:
    """Return a camera in front of the origin."""
    return Camera.on_turn(0.0, distance=distance, focal=100.0, width=80, height=60)


def test_what_is_nearer_hides_what_is_behind() -> None:
    """A strand in front of the head is seen, one behind it is not."""
    front = Strands.from_list([[[-0.05, 0, 0.5], [0.05, 0, 0.5]]])
    back = Strands.from_list([[[-0.05, 0, -0.5], [0.05, 0, -0.5]]])
    camera, head = view(1.0), ball_head()
    bare = draw_view(camera, head)
    assert (bare != BACKDROP).any()
    assert np.array_equal(draw_view(camera, head, back), bare)
    assert not np.array_equal(draw_view(camera, head, front), bare)


def test_a_strand_is_drawn_where_the_camera_sees_it() -> None:
    """The middle of the drawn pixels is where the camera projects the strand's middle."""
    strand = Strands.from_list([[[0.1, 0.05, 0], [0.2, 0.05, 0]]])
    camera = view(1.0)
    drawn = np.argwhere((draw_view(camera, None, strand) != BACKDROP).any(axis=2))
    wanted = camera.project([0.15, 0.05, 0.0])
    np.testing.assert_allclose(drawn.mean(axis=0)[::-1] + 0.5, wanted, atol=0.5)


def test_points_behind_the_camera_do_not_stop_the_drawing() -> None:
    """They have no pixel; the rest is drawn."""
    strand = Strands.from_list([[[0, 0, 2.0], [0, 0, 3.0]], [[-0.1, 0, 0], [0.1, 0, 0]]])
    assert (draw_view(view(1.0), None, strand) != BACKDROP).any()


def test_colours_are_dark_enough_on_the_backdrop() -> None:
    """Surfaces and strands differ from what is behind them."""
    assert max(*SKIN, *HAIR) < BACKDROP - 40


def test_a_picture_needs_no_opengl() -> None:
    """Showing a groom does not load moderngl."""
    code = (
        "import sys; from hairkit.testing import bristle_groom; bristle_groom()._repr_png_();"
        "print('moderngl' in sys.modules)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "False"
