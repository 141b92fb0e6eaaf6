"""Strokes drawn with labelme are read, and a wrong file gets one line."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from hairkit.errors import InputError
from hairkit.io.strokes import Stroke, rasterise, read_strokes


def write(path: Path, *shapes: tuple[str, str, object]) -> Path:
    """Write labelme's JSON of (label, shape type, points)."""
    entries = [{"label": a, "shape_type": b, "points": c} for a, b, c in shapes]
    path.write_text(json.dumps({"imageWidth": 60, "imageHeight": 40, "shapes": entries}))
    return path


def test_shapes_come_as_lines_and_areas(tmp_path: Path) -> None:
    """Lines stay lines; polygons, rectangles and circles are areas; the rectangle stands apart."""
    file = write(
        tmp_path / "a.json",
        ("rectangle", "rectangle", [[50, 30], [10, 5]]),
        ("foreground", "linestrip", [[0, 0], [9, 9]]),
        ("background", "circle", [[30, 20], [35, 20]]),
        ("person", "rectangle", [[0, 0], [4, 4]]),
    )
    strokes = read_strokes(file)
    assert strokes.rectangle.tolist() == [[10, 5], [50, 30]]
    assert strokes.size == (60, 40)
    assert [(s.label, s.area) for s in strokes.strokes] == [
        ("foreground", False),
        ("background", True),
        ("person", True),
    ]
    circle = strokes.labelled("background")[0].points
    assert np.linalg.norm(circle - [30, 20], axis=1) == pytest.approx(np.full(len(circle), 5))


def test_scaling_scales_all(tmp_path: Path) -> None:
    """Points and rectangle scale with the photo."""
    file = write(
        tmp_path / "a.json",
        ("rectangle", "rectangle", [[10, 5], [50, 30]]),
        ("foreground", "point", [[4, 6]]),
    )
    scaled = read_strokes(file).scaled(0.5, 2)
    assert scaled.rectangle.tolist() == [[5, 10], [25, 60]]
    assert scaled.strokes[0].points.tolist() == [[2, 12]]


def test_samples_lie_on_the_stroke_close_together() -> None:
    """No two neighbouring samples are farther apart than the step; an area's outline closes."""
    square = np.array([[0.0, 0.0], [30.0, 0.0], [30.0, 30.0], [0.0, 30.0]])
    for area, length in ((True, 120), (False, 90)):
        samples = Stroke("foreground", area, square).sampled(2.0)
        steps = np.linalg.norm(np.diff(samples, axis=0), axis=1)
        assert steps.max() <= 2.0
        assert steps.sum() == pytest.approx(length)


def test_an_area_covers_its_inside_and_a_line_its_thickness() -> None:
    """Filled and drawn pixels are about as many as geometry says; far points do no harm."""
    square = np.array([[10.0, 10.0], [30.0, 10.0], [30.0, 30.0], [10.0, 30.0]])
    assert rasterise(Stroke("foreground", True, square), 60, 40, 1).sum() == pytest.approx(
        400, rel=0.15
    )
    line = Stroke("foreground", False, np.array([[5.0, 20.0], [55.0, 20.0]]))
    assert 5 <= rasterise(line, 60, 40, 5)[:, 30].sum() <= 7  # OpenCV's ends are round and wide
    far = Stroke("foreground", False, np.array([[-1e12, 20.5], [1e12, 20.5]]))
    assert rasterise(far, 60, 40, 1)[20].all()


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("hello", "no strokes could be read"),
        ("[1]", "no JSON object"),
        ("{}", "no list 'shapes'"),
        ('{"shapes": [3]}', "shape 0 is no JSON object"),
        ('{"shapes": [{"label": "hare", "shape_type": "line"}]}', "no label 'hare'"),
        ('{"shapes": [{"label": "person", "shape_type": "blob"}]}', "no shape_type 'blob'"),
        ('{"shapes": [{"label": "person", "shape_type": "line"}]}', "no list of pixel pairs"),
        (
            '{"shapes": [{"label": "person", "shape_type": "line", "points": [[1, NaN], [1, 2]]}]}',
            "not finite",
        ),
        (
            '{"shapes": [{"label": "person", "shape_type": "polygon", "points": [[1, 2]]}]}',
            "1 points, a polygon needs 3",
        ),
    ],
)
def test_a_wrong_file_gets_one_line(tmp_path: Path, text: str, reason: str) -> None:
    """Whatever is wrong, the file is named and the line says what."""
    (tmp_path / "a.json").write_text(text)
    with pytest.raises(InputError, match=reason) as caught:
        read_strokes(tmp_path / "a.json")
    assert "a.json" in str(caught.value)
    assert "\n" not in str(caught.value)


def test_the_radius_of_an_edge_brush_scales_with_the_photo(tmp_path: Path) -> None:
    """A stroke keeps its brush through scaling and turning; a radius must be a length."""
    shape = {"label": "foreground", "shape_type": "linestrip", "points": [[1, 2], [30, 40]]}
    file = tmp_path / "s.json"
    file.write_text(json.dumps({"shapes": [shape | {"radius": 12}], "imageWidth": 100}))
    strokes = read_strokes(file)
    assert strokes.strokes[0].radius == 12
    assert strokes.turned(1, 100, 80).strokes[0].radius == 12
    assert strokes.scaled(0.5, 0.5).strokes[0].radius == pytest.approx(6)
    for wrong in (0, -3, "wide", True, 1e9):
        file.write_text(json.dumps({"shapes": [shape | {"radius": wrong}]}))
        with pytest.raises(InputError, match="radius"):
            read_strokes(file)
