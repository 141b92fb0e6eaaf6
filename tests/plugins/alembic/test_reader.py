"""Laws of the Alembic importer: files of other programs, and damaged files."""

from __future__ import annotations

import contextlib
import struct
from pathlib import Path
from typing import Any

import imath
import numpy as np
import pytest
from alembic3d import Abc, AbcGeom
from fuzzing import CASES, damaged, long_run
from hairkit_plugins import alembic
from hairkit_plugins.alembic.curve_sets import CurveSet, read_curve_sets
from hypothesis import given
from hypothesis import strategies as st
from references import reference

from hairkit.errors import FormatError, HairkitError, InputError
from hairkit.testing import bristle_groom

CONSTANT = AbcGeom.GeometryScope.kConstantScope
UNIFORM = AbcGeom.GeometryScope.kUniformScope
VERTEX = AbcGeom.GeometryScope.kVertexScope
OPERATIONS = {
    "translate": [("setTranslation", imath.V3d(0.1, -0.2, 0.3))],
    "scale": [("setScale", imath.V3d(2, 3, 4))],
    "turn": [("setRotation", imath.V3d(1, 2, 3), 40.0)],
    "turns": [("setXRotation", 10.0), ("setYRotation", 20.0), ("setZRotation", 30.0)],
    "matrix": [("setMatrix", imath.M44d(0, 1, 0, 0, -2, 0, 0, 0, 0, 0, 3, 0, 4, 5, 6, 1))],
    "all": [
        ("setTranslation", imath.V3d(1, 2, 3)),
        ("setRotation", imath.V3d(0, 1, 1), -70.0),
        ("setScale", imath.V3d(2, 2, 2)),
    ],
}


def transform(parent: Any, name: str, operations: list[Any], inherits: bool = True) -> Any:
    """Write a transform and return it."""
    node = AbcGeom.OXform(parent, name)
    sample = AbcGeom.XformSample()
    sample.setInheritsXforms(inherits)
    for operation, *values in operations:
        getattr(sample, operation)(*values)
    node.getSchema().set(sample)
    return node


def points_of(seed: int, count: int) -> np.ndarray[Any, Any]:
    """Return (count, 3) points of a small cloud."""
    cloud = np.random.default_rng(seed).random((count, 3))
    return (0.2 * cloud).astype(np.float32)


def curves(
    parent: Any,
    counts: list[int],
    widths: list[float] | None = None,
    scope: Any = VERTEX,
    kind: Any = AbcGeom.CurveType.kLinear,
    name: str = "curves",
) -> Any:
    """Write curves through a cloud of points and return their schema."""
    sample = AbcGeom.OCurvesSchemaSample()
    points = points_of(len(counts), sum(counts))
    sample.setPositions(imath.V3fArrayFromBuffer(points))
    sample.setCurvesNumVertices(imath.IntArrayFromBuffer(np.array(counts, np.int32)))
    sample.setType(kind)
    sample.setWrap(AbcGeom.CurvePeriodicity.kNonPeriodic)
    sample.setBasis(AbcGeom.BasisType.kNoBasis)
    if widths is not None:
        array = imath.FloatArrayFromBuffer(np.array(widths, np.float32))
        sample.setWidths(AbcGeom.OFloatGeomParamSample(array, scope))
    schema = AbcGeom.OCurves(parent, name).getSchema()
    schema.set(sample)
    return schema


def world_points(node: Any, above: Any) -> list[np.ndarray[Any, Any]]:
    """Return the points of all curves under a node by the library's own matrices, in order."""
    found = []
    for number in range(node.getNumChildren()):
        child, here = node.getChild(number), above
        if AbcGeom.IXform.matches(child.getHeader()):
            sample = AbcGeom.IXform(node, child.getName()).getSchema().getValue()
            own = np.array([list(row) for row in sample.getMatrix()])
            here = own @ above if sample.getInheritsXforms() else own
        elif AbcGeom.ICurves.matches(child.getHeader()):
            sample = AbcGeom.ICurves(node, child.getName()).getSchema().getValue()
            points = np.array(memoryview(sample.getPositions()))
            found.append(points @ here[:3, :3] + here[3, :3])
        found += world_points(child, here)
    return found


def only_set(path: Path) -> CurveSet:
    """Return the one curve set of a file."""
    (found,) = read_curve_sets(path)
    return found


@pytest.mark.parametrize("name", OPERATIONS)
def test_transforms_are_those_of_the_library(tmp_path: Path, name: str) -> None:
    """Nested transforms, and one that does not inherit, put points where the library does."""
    path = tmp_path / "nested.abc"
    archive = Abc.OArchive(str(path))
    outer = transform(archive.getTop(), "outer", OPERATIONS[name])
    inner = transform(outer, "inner", OPERATIONS["all"])
    apart = transform(inner, "apart", OPERATIONS[name], inherits=False)
    for node in (inner, outer, apart):
        curves(node, [3, 4], [1e-4], CONSTANT)
    del archive, outer, inner, apart, node
    want = world_points(Abc.IArchive(str(path)).getTop(), np.eye(4))
    have = [found.points for found in read_curve_sets(path)]
    assert len(have) == len(want) == 3
    for own, library in zip(have, want, strict=True):
        np.testing.assert_allclose(own, library, rtol=1e-5, atol=1e-5)


def test_widths_scale_with_their_transform(tmp_path: Path) -> None:
    """A diameter under a transform that doubles lengths is twice as large."""
    path = tmp_path / "scaled.abc"
    archive = Abc.OArchive(str(path))
    curves(transform(archive.getTop(), "a", OPERATIONS["all"]), [2, 3], [1e-4], CONSTANT)
    del archive
    np.testing.assert_allclose(only_set(path).widths, np.full(5, 2e-4), rtol=1e-6)


@pytest.mark.parametrize(
    ("widths", "scope", "want"),
    [
        ([3.0], CONSTANT, [3, 3, 3, 3, 3]),
        ([1.0, 2.0], UNIFORM, [1, 1, 2, 2, 2]),
        ([1.0, 2.0, 3.0, 4.0, 5.0], VERTEX, [1, 2, 3, 4, 5]),
        ([1.0, 2.0, 3.0, 4.0, 5.0], CONSTANT, [1, 2, 3, 4, 5]),
    ],
)
def test_widths_of_every_scope(
    tmp_path: Path, widths: list[float], scope: Any, want: list[int]
) -> None:
    """Widths are spread to points by their scope; where that cannot be, by their number."""
    path = tmp_path / "widths.abc"
    archive = Abc.OArchive(str(path))
    curves(archive.getTop(), [2, 3], widths, scope)
    del archive
    np.testing.assert_array_equal(only_set(path).widths, want)


def test_indexed_attributes_are_looked_up(tmp_path: Path) -> None:
    """Values that are stored once and named by index are those values."""
    path = tmp_path / "indexed.abc"
    archive = Abc.OArchive(str(path))
    attributes = curves(archive.getTop(), [2, 3, 2]).getArbGeomParams()
    group = AbcGeom.OInt32GeomParam(attributes, "groom_group_id", True, UNIFORM, 1)
    values = imath.IntArrayFromBuffer(np.array([7, 9], np.int32))
    index = imath.UnsignedIntArray(3)
    index[0], index[1], index[2] = 1, 0, 1
    group.set(AbcGeom.OInt32GeomParamSample(values, index, UNIFORM))
    del archive, attributes, group
    np.testing.assert_array_equal(only_set(path).group, [9, 7, 9])


def test_several_objects_become_one_groom(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    """Curves objects join in the file's order; single points go, splines are said to be bent."""
    path = tmp_path / "several.abc"
    archive = Abc.OArchive(str(path))
    top = archive.getTop()
    curves(top, [4, 1, 3], name="hair")
    guides = curves(top, [5, 2], kind=AbcGeom.CurveType.kCubic, name="guides").getArbGeomParams()
    guide = AbcGeom.OInt32GeomParam(guides, "groom_guide", False, CONSTANT, 1)
    one = imath.IntArrayFromBuffer(np.ones(1, np.int32))
    guide.set(AbcGeom.OInt32GeomParamSample(one, CONSTANT))
    del archive, top, guides, guide
    groom = alembic.import_groom(path, alembic.Options())
    np.testing.assert_array_equal(groom.strands.counts, [4, 3, 5, 2])
    np.testing.assert_array_equal(groom.strands.guide, [False, False, True, True])
    assert groom.strands.widths is None
    for said in ("fewer than two points", "control points", "no widths", "no root uv"):
        assert said in caplog.text


@pytest.mark.parametrize(
    ("name", "axis", "counts"),
    [
        ("blender_4.5.15_hair_curves", "y_up_metres", [5, 5, 5, 5]),
        ("groom_alembic3d_static", "unreal", [5] * 6),
        ("groom_own_writer_4frames", "unreal", [5] * 6),
    ],
)
def test_reference_files(name: str, axis: str, counts: list[int]) -> None:
    """Files of other writers are read as the Alembic library reads them."""
    path = reference(f"abc/{name}.abc")
    options = alembic.Options(axis=axis)
    strands = alembic.import_groom(path, options).strands
    np.testing.assert_array_equal(strands.counts, counts)
    (want,) = world_points(Abc.IArchive(str(path)).getTop(), np.eye(4))
    np.testing.assert_allclose(
        strands.points, options.space.points_to_head(want), rtol=1e-6, atol=1e-9
    )
    assert (strands.guide is None) == name.startswith("blender")


def small_file(folder: Path) -> bytes:
    """Return an .abc of a few guides and hairs."""
    groom = bristle_groom()
    few = groom.select(np.arange(len(groom.strands)) % 24 == 0)
    path = folder / "small.abc"
    alembic.export_groom(few, path, alembic.Options(mark_guides=True))
    return path.read_bytes()


def refused(folder: Path, data: bytes) -> str:
    """Return the one line that importing these bytes ends in."""
    path = folder / "damaged.abc"
    path.write_bytes(data)
    with pytest.raises(HairkitError) as caught:
        alembic.import_groom(path, alembic.Options())
    assert str(path) in str(caught.value)
    assert "\n" not in str(caught.value)
    return str(caught.value)


def test_what_is_no_finished_ogawa_file_is_told(tmp_path: Path) -> None:
    """Each kind of wrong file has its own reason."""
    good = small_file(tmp_path)
    assert "begin with 'Ogawa'" in refused(tmp_path, b"")
    assert "begin with 'Ogawa'" in refused(tmp_path, b"PK\3\4" + good)
    assert "abcconvert" in refused(tmp_path, b"\x89HDF\r\n\x1a\n" + good)
    assert "did not finish" in refused(tmp_path, good[:5] + b"\0" + good[6:])
    with pytest.raises(InputError, match="no such file"):
        alembic.import_groom(tmp_path / "none.abc", alembic.Options())


def test_truncated_files_are_refused(tmp_path: Path) -> None:
    """The root group is last, so that no shorter file is whole."""
    good = small_file(tmp_path)
    for part in (0.1, 0.5, 0.9, 0.999):
        refused(tmp_path, good[: int(part * len(good))])


def test_numbers_that_are_not_finite_are_refused(tmp_path: Path) -> None:
    """A NaN among the points is counted in the error."""
    good = small_file(tmp_path)
    point = bristle_groom().select(np.arange(len(bristle_groom().strands)) == 0).strands.points
    at = good.index(point[2].tobytes())
    text = refused(tmp_path, good[:at] + struct.pack("<f", float("nan")) + good[at + 4 :])
    assert "1 of the P are not finite" in text


def test_counts_that_lie_are_refused(tmp_path: Path) -> None:
    """Counts of points that do not add up, or would overflow, are told before memory is asked."""
    good = small_file(tmp_path)
    counts = np.full(4, 5, np.int32).tobytes()
    for lie in (-1, 6, 2**31 - 1):
        text = refused(tmp_path, good.replace(counts, struct.pack("<i", lie) + counts[4:], 1))
        assert "curves ask for another number" in text or "no points or counts" in text


def test_a_file_without_curves_is_told(tmp_path: Path) -> None:
    """An archive of transforms alone holds no groom."""
    archive = Abc.OArchive(str(tmp_path / "empty.abc"))
    transform(archive.getTop(), "nothing", [])
    del archive
    with pytest.raises(FormatError, match="without curves"):
        alembic.import_groom(tmp_path / "empty.abc", alembic.Options())


def test_deep_nesting_is_refused(tmp_path: Path) -> None:
    """Transforms in transforms end after a hundred levels."""
    archive = Abc.OArchive(str(tmp_path / "deep.abc"))
    node = archive.getTop()
    for _ in range(150):
        node = transform(node, "a", [])
    curves(node, [2])
    del archive, node
    with pytest.raises(FormatError, match="levels"):
        alembic.import_groom(tmp_path / "deep.abc", alembic.Options())


@pytest.mark.parametrize("children", [1, 2, 200])
def test_objects_in_themselves_are_refused(tmp_path: Path, children: int) -> None:
    """A tree whose branches lead back to its trunk ends in an error, soon."""
    data, top = 1 << 63, 16 + 8
    header = struct.pack("<I", 1) + b"a" + b"\0"
    headers = header * children + bytes(32)
    at = top + 8 * (children + 3)
    block = struct.pack("<Q", len(headers)) + headers
    group = struct.pack("<Q", children + 2) + struct.pack("<Q", 0)
    group += struct.pack("<Q", top) * children + struct.pack("<Q", data | at)
    root = struct.pack("<7Q", 6, data, data, top, data, data, data)
    start = at + len(block)
    text = b"Ogawa\xff\0\1" + struct.pack("<Q", start) + bytes(8) + group + block + root
    refused(tmp_path, text)


@long_run(CASES)
@given(data=st.data())
def test_damaged_bytes_give_a_groom_or_one_error(
    tmp_path_factory: pytest.TempPathFactory, data: st.DataObject
) -> None:
    """Damaged files never end in anything else than a groom or one error."""
    folder = tmp_path_factory.getbasetemp()
    groom, good = folder / "groom.npz", folder / "small.abc"
    if not good.exists():
        bristle_groom().save(groom)
        small_file(folder)
    path = folder / "damaged.abc"
    path.write_bytes(data.draw(damaged(good.read_bytes())))
    with contextlib.suppress(HairkitError):  # with a head, which takes long to be found else
        alembic.import_groom(path, alembic.Options(head=groom))
