"""Laws of 3D segments from a file: every form, what is refused, and that the field follows them."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from bun import ALONG, CENTRE, all_hair, bun, main_directions, off_deg, seen, turn
from hairkit_plugins.hybrid_field import Options, solve_field
from hairkit_plugins.hybrid_field.given_segments import read_segments, segments_in_hair
from hairkit_plugins.hybrid_field.photo_lines import STEP

from hairkit.arrays import Float32Array
from hairkit.errors import FormatError, InputError
from hairkit.field.growth_prior import measure_scalp_distance
from hairkit.testing import ball_head
from hairkit.types.orientation import OrientationMap, wrap_angle
from hairkit.types.parting import Parting
from hairkit.types.scene import Scene
from hairkit.types.strands import Strands
from hairkit.types.waves import Waves

UNIT = ALONG / np.linalg.norm(ALONG)


def cloud(count: int = 400) -> Float32Array:
    """Points in the bun."""
    way = np.random.default_rng(3).normal(size=(count, 3))
    points: Float32Array = (CENTRE + 0.05 * way / np.linalg.norm(way, axis=1)[:, None]).astype("f4")
    return points


def directions(read: Strands) -> Float32Array:
    ends = read.tips - read.roots
    result: Float32Array = ends / np.linalg.norm(ends, axis=1, keepdims=True)
    return result


def write_ply(path: Path, vertex: str, rows: list[str], more: str = "") -> Path:
    head = f"ply\nformat ascii 1.0\nelement vertex {len(cloud())}\n"
    head += "".join(f"property float {name}\n" for name in vertex.split())
    path.write_text(head + more + "end_header\n" + "\n".join(rows) + "\n")
    return path


@pytest.mark.parametrize("ending", ["npz", "ply"])
def test_a_cloud_of_directions_becomes_short_segments(tmp_path: Path, ending: str) -> None:
    """Each point with a direction of any length is the middle of a segment of two steps."""
    path = tmp_path / f"cloud.{ending}"
    points, along = cloud(), np.broadcast_to(3 * ALONG, (400, 3)).astype(np.float32)
    if ending == "npz":
        np.savez(path, points=points, directions=along)
    else:
        rows = [
            " ".join(map(repr, map(float, [*p, *d]))) for p, d in zip(points, along, strict=True)
        ]
        write_ply(path, "x y z nx ny nz", rows)
    read = read_segments(path)
    np.testing.assert_allclose((read.roots + read.tips) / 2, points, atol=1e-6)
    np.testing.assert_allclose(read.lengths(), 2 * STEP, rtol=1e-3)
    np.testing.assert_allclose(np.abs(directions(read) @ UNIT), 1, atol=1e-4)


@pytest.mark.parametrize("ending", ["npz", "ply"])
def test_polylines_keep_their_ways(tmp_path: Path, ending: str) -> None:
    """Ends stay; points lie two millimetres apart, whatever the spacing of the file."""
    path, points = tmp_path / f"lines.{ending}", cloud()
    if ending == "npz":
        np.savez(path, points=points, offsets=np.arange(0, 401, 4))
    else:
        rows = [" ".join(map(repr, map(float, p))) for p in points]
        rows += [f"{4 * line + k} {4 * line + k + 1}" for line in range(100) for k in range(3)]
        edges = "element edge 300\nproperty int vertex1\nproperty int vertex2\n"
        write_ply(path, "x y z", rows, edges)
    read = read_segments(path)
    np.testing.assert_allclose(read.roots, points[::4], atol=1e-6)
    np.testing.assert_allclose(read.tips, points[3::4], atol=1e-6)
    assert np.linalg.norm(np.diff(read.points[: read.counts[0]], axis=0), axis=1).max() <= STEP


def test_the_field_follows_given_segments_where_photos_are_wrong(tmp_path: Path) -> None:
    """Photos 30 degrees off: with the true segments held, the field is nearer to the truth."""
    path, hull, cameras = tmp_path / "lines.npz", bun(), turn()
    np.savez(path, points=cloud(3000), directions=np.broadcast_to(UNIT, (3000, 3)))
    maps = [seen(camera) for camera in cameras]
    wrong = tuple(OrientationMap(wrap_angle(m.angle + 0.5), m.confidence) for m in maps)
    scene = Scene(tuple("abcdefgh"), cameras, ball_head())
    errors = []
    options = Options(scalp_weight=0.0, pool=0.0, unslant=False, strand_weight=1000.0)
    for given in (None, path):
        field = solve_field(
            scene,
            tuple(all_hair(camera) for camera in cameras),
            wrong,
            hull,
            Waves(),
            measure_scalp_distance(ball_head(), hull),
            Parting(),
            replace(options, segments=given),
        )
        errors.append(np.median(off_deg(main_directions(field.tensors()[hull.dense]))))
    assert errors[1] < 8 < 15 < errors[0]


def test_segments_of_another_frame_or_unit_are_refused() -> None:
    """Millimetres, or a body elsewhere: the line says how few lie in the hair; few strays go."""
    lines = Strands(np.repeat(cloud(), 2, axis=0), np.arange(0, 801, 2))
    assert len(segments_in_hair(lines, bun(), Path("a.ply"))) == 400
    stray = replace(
        lines, points=lines.points + np.float32([0, 0, 9]) * (np.arange(800) < 100)[:, None]
    )
    assert len(segments_in_hair(stray, bun(), Path("a.ply"))) == 350
    for wrong in (1000 * lines.points, lines.points + np.float32([0, 1, 0])):
        with pytest.raises(InputError, match=r"a\.ply: 0 of 400 segments lie in the hair"):
            segments_in_hair(replace(lines, points=wrong), bun(), Path("a.ply"))


@pytest.mark.parametrize(
    ("arrays", "message"),
    [
        ({}, "has no points"),
        ({"points": np.zeros((4, 2))}, r"points has shape \(4, 2\)"),
        ({"points": np.zeros((4, 3))}, "has no offsets or directions"),
        ({"points": np.zeros((4, 3)), "offsets": np.array([0, 5])}, "do not rise from 0 to 4"),
        ({"points": np.zeros((4, 3)), "offsets": np.array([0.0, 4])}, "offsets are float64"),
        ({"points": np.zeros((4, 3)), "directions": np.ones((3, 3))}, "3 directions of 4 points"),
        ({"points": np.zeros((4, 3)), "directions": np.zeros((4, 3))}, "holds no segments"),
        ({"points": np.zeros((4, 3)), "offsets": np.array([0, 4])}, "holds no segments"),
        ({"points": np.full((4, 3), np.nan), "offsets": np.array([0, 4])}, "not finite"),
        ({"points": np.full((4, 3), 1e30), "offsets": np.array([0, 4])}, "points reach"),
        ({"points": np.array(["a"])}, "has no points"),
    ],
)
def test_other_content_is_refused_in_one_line(
    tmp_path: Path, arrays: dict[str, np.ndarray], message: str
) -> None:
    """Arrays of other names, shapes, kinds and values."""
    path = tmp_path / "wrong.npz"
    np.savez(path, **arrays)
    with pytest.raises(FormatError, match=message):
        read_segments(path)


def test_a_ply_without_lines_is_refused(tmp_path: Path) -> None:
    """Points alone say nothing about directions."""
    path = write_ply(tmp_path / "points.ply", "x y z", ["0 0 0"] * 400)
    with pytest.raises(FormatError, match="has no strands"):
        read_segments(path)
    path.write_text("ply\nformat ascii 1.0\nelement vertex 0\nproperty float u\nend_header\n")
    with pytest.raises(FormatError, match="no element vertex with x, y and z"):
        read_segments(path)
