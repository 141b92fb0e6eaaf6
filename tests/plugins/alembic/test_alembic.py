"""Laws of the Alembic exporter, checked through the Alembic library's own reader."""

from __future__ import annotations

import errno
import logging
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from alembic3d import Abc, AbcGeom
from hairkit_plugins import alembic
from hairkit_plugins.alembic import curves, writer

from hairkit.errors import InputError
from hairkit.grooming.guide_weights import closest_guides
from hairkit.testing import bristle_groom
from hairkit.types.groom import Groom, HairMaterial
from hairkit.types.point_cache import PointCache
from hairkit.types.strands import Strands

ATTRIBUTES = {
    "groom_id": ("int32_t", "uni"),
    "groom_group_id": ("int32_t", "uni"),
    "groom_group_name": ("string", "uni"),
    "groom_guide": ("int32_t", "uni"),
    "groom_root_uv": ("float32_t[2]", "uni"),
    "hairkit_root_density": ("float32_t", "uni"),
    "groom_color": ("float32_t[3]", "vtx"),
    "groom_closest_guides": ("int32_t[3]", "uni"),
    "groom_guide_weights": ("float32_t[3]", "uni"),
}
"""Type and scope of each attribute; all but our own are those of Epic's specification 1.5."""


def hair_groom() -> Groom:
    """Return guides and hair of 3 to 9 points with widths, uv, groups and two colours."""
    groom = bristle_groom()
    rng = np.random.default_rng(3)
    counts = rng.integers(3, 10, len(groom.strands))
    shape = [
        root + np.linspace(0, 0.05, n)[:, None] * way + rng.normal(0, 1e-3, (n, 3)) * (n > 3)
        for root, way, n in zip(
            groom.strands.roots, groom.strands.tangents()[groom.strands.offsets[:-1]], counts,
            strict=True,
        )
    ]  # fmt: skip
    strands = Strands.from_list(shape)
    strands = replace(
        strands,
        widths=rng.uniform(3e-5, 1e-4, len(strands.points)),
        root_uv=rng.random((len(strands), 2)),
        group=np.arange(len(strands)) % 3,
        guide=np.arange(len(strands)) % 4 == 0,
    )
    look = HairMaterial(np.array([0.3, 0.2, 0.1]), np.array([0.6, 0.5, 0.4]))
    return replace(groom, strands=strands, material=look)


def written(groom: Groom, folder: Path, **options: Any) -> Path:
    """Return the path of the groom's .abc file."""
    path = folder / "groom.abc"
    assert alembic.export_groom(groom, path, alembic.Options(**options))
    return path


def opened(path: Path) -> tuple[Any, Any]:
    """Return the schemas of the file's first transform and of the curves under it."""
    top = Abc.IArchive(str(path)).getTop()
    assert top.getNumChildren() == 1
    groom = top.getChild(0)
    assert AbcGeom.IXform.matches(groom.getHeader())
    assert groom.getNumChildren() == 1  # no mesh: Unreal refuses grooms with one
    strands = groom.getChild(0)
    assert AbcGeom.ICurves.matches(strands.getHeader())
    return (
        AbcGeom.IXform(top, groom.getName()).getSchema(),
        AbcGeom.ICurves(groom, strands.getName()).getSchema(),
    )


def numbers(array: Any) -> np.ndarray[Any, Any]:
    """Return one of the library's arrays."""
    return np.array(memoryview(array))


def attributes(schema: Any) -> dict[str, Any]:
    """Return the curves' attribute properties by name."""
    found = schema.getArbGeomParams()
    properties = (found.getProperty(i) for i in range(found.getNumProperties()))
    return {item.getName(): item for item in properties}


@pytest.mark.parametrize("axis", ["y_up_metres", "unreal", "z_up_centimetres"])
def test_a_groom_comes_back(tmp_path: Path, axis: str) -> None:
    """Export then import is the identity within float32 for what the format declares."""
    groom = hair_groom()
    path = written(groom, tmp_path, axis=axis)
    back = alembic.import_groom(path, alembic.Options(axis=axis))
    have, want = back.strands, groom.strands
    np.testing.assert_array_equal(have.offsets, want.offsets)
    np.testing.assert_allclose(have.points, want.points, rtol=3e-7)
    np.testing.assert_allclose(have.widths, want.widths, rtol=3e-7)
    np.testing.assert_array_equal(have.root_uv, want.root_uv)
    np.testing.assert_array_equal(have.group, want.group)
    np.testing.assert_array_equal(have.guide, want.guide)
    for end in ("root_colour", "tip_colour"):
        np.testing.assert_allclose(
            getattr(back.material, end), getattr(groom.material, end), rtol=3e-7
        )


def test_one_strand_comes_back(tmp_path: Path) -> None:
    """Where one value may belong to the object, the strand or a point, nothing is mixed up."""
    groom = hair_groom()
    keep = np.arange(len(groom.strands)) == 5
    path = written(groom.select(keep), tmp_path)
    back = alembic.import_groom(path, alembic.Options()).strands
    np.testing.assert_array_equal(back.points, groom.strands.select(keep).points)
    assert back.guide is None  # hair without any guide is all guides
    np.testing.assert_array_equal(back.group, [2])


def test_the_curl_is_told_in_the_unit_of_the_file(tmp_path: Path) -> None:
    """Radius and pitch stand beside the version; straight hair has neither."""
    straight = hair_groom()
    look = replace(straight.material, curl_radius=0.007, curl_pitch=0.027)
    curly = opened(written(replace(straight, material=look), tmp_path))[0].getUserProperties()
    radius, pitch = (
        curly.getProperty(f"hairkit_curl_{name}").getValue() for name in ("radius", "pitch")
    )
    assert pitch / radius == pytest.approx(0.027 / 0.007)
    assert radius in (pytest.approx(0.007), pytest.approx(0.7))
    plain = opened(written(straight, tmp_path))[0].getUserProperties()
    assert plain.getPropertyHeader("hairkit_curl_radius") is None


def test_unreal_finds_its_schema(tmp_path: Path) -> None:
    """Version 1.5 is on the first transform, each attribute has its type, scope and length."""
    groom = hair_groom()
    transform, schema = opened(written(groom, tmp_path))
    properties = transform.getUserProperties()
    for name, value in (("groom_version_major", 1), ("groom_version_minor", 5)):
        number = properties.getProperty(name)
        assert number.isScalar()
        assert (str(number.getDataType()), number.getValue()) == ("int16_t", value)
    assert properties.getProperty("groom_tool").getValue().startswith("hairkit")
    found = attributes(schema)
    assert set(found) == set(ATTRIBUTES)
    sizes = {"uni": len(groom.strands), "vtx": len(groom.strands.points)}
    for name, (kind, scope) in ATTRIBUTES.items():
        assert str(found[name].getDataType()) == kind
        assert found[name].getMetaData().get("geoScope") == scope
        assert len(found[name].getValue()) == sizes[scope]


def test_attributes_are_the_groom(tmp_path: Path) -> None:
    """What the library reads of each attribute is what the groom holds."""
    groom = hair_groom()
    found = attributes(opened(written(groom, tmp_path))[1])
    names = found.pop("groom_group_name").getValue()
    assert list(names) == [f"hair_{number}" for number in groom.strands.group]
    values = {name: numbers(item.getValue()) for name, item in found.items()}
    mix = closest_guides(groom.strands)
    np.testing.assert_array_equal(values["groom_id"], np.arange(len(groom.strands)))
    np.testing.assert_array_equal(values["groom_group_id"], groom.strands.group)
    np.testing.assert_array_equal(values["groom_guide"], groom.strands.guide)
    np.testing.assert_array_equal(values["groom_root_uv"], groom.strands.root_uv)
    np.testing.assert_array_equal(values["groom_closest_guides"], mix.guides)
    np.testing.assert_array_equal(values["groom_guide_weights"], mix.weights)
    assert groom.strands.guide is not None
    assert groom.strands.guide[values["groom_closest_guides"]].all()
    tips = values["groom_color"][groom.strands.offsets[1:] - 1]
    np.testing.assert_allclose(tips, np.tile(groom.material.tip_colour, (len(tips), 1)))


def test_curves_are_plain_polylines(tmp_path: Path) -> None:
    """Points, counts, diameters at every point and a uv for each curve; no empty NURBS arrays."""
    groom = hair_groom()
    schema = opened(written(groom, tmp_path))[1]
    sample = schema.getValue()
    assert sample.getType() == AbcGeom.CurveType.kLinear
    assert sample.getWrap() == AbcGeom.CurvePeriodicity.kNonPeriodic
    assert sample.getBasis() == AbcGeom.BasisType.kNoBasis
    np.testing.assert_array_equal(numbers(sample.getPositions()), groom.strands.points)
    np.testing.assert_array_equal(numbers(sample.getCurvesNumVertices()), groom.strands.counts)
    widths, uv = schema.getWidthsParam(), schema.getUVsParam()
    assert widths.getScope() == AbcGeom.GeometryScope.kVertexScope
    assert uv.getScope() == AbcGeom.GeometryScope.kUniformScope
    have = numbers(widths.getExpandedValue().getVals())
    np.testing.assert_array_equal(have, groom.strands.widths)
    for absent in ("Orders", "Knots", "PositionWeights"):
        assert not getattr(schema, f"get{absent}Property")().valid()


def test_unreal_axes(tmp_path: Path) -> None:
    """axis=unreal: X stays, Y is what was out of the face, Z is up; all in centimetres."""
    groom = hair_groom()
    schema = opened(written(groom, tmp_path, axis="unreal"))[1]
    have = numbers(schema.getValue().getPositions())
    want = 100.0 * groom.strands.points[:, [0, 2, 1]]
    np.testing.assert_allclose(have, want, rtol=3e-7, atol=1e-9)
    widths = numbers(schema.getWidthsParam().getExpandedValue().getVals())
    np.testing.assert_allclose(widths, 100.0 * np.asarray(groom.strands.widths), rtol=3e-7)


def test_guides_alone_are_marked_only_when_asked(tmp_path: Path) -> None:
    """A file of guides alone leaves Unreal the choice of guides, and reads as guides again."""
    groom = bristle_groom()
    path = written(groom, tmp_path)
    assert "groom_guide" not in attributes(opened(path)[1])
    back = alembic.import_groom(path, alembic.Options()).strands.guide
    assert back is None or back.all()
    found = attributes(opened(written(groom, tmp_path, mark_guides=True))[1])
    assert numbers(found["groom_guide"].getValue()).all()


def test_hair_without_guides_has_none_to_follow(tmp_path: Path) -> None:
    """strands=hair writes groom_guide = 0 and no closest guides."""
    found = attributes(opened(written(hair_groom(), tmp_path, strands="hair"))[1])
    assert not numbers(found["groom_guide"].getValue()).any()
    assert "groom_closest_guides" not in found


def test_no_curve_has_more_points_than_unreal_reads(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    """Longer strands are resampled to 255 points, said aloud; the others stay as they are."""
    groom = hair_groom()
    turns = np.linspace(0, 20, 700)
    curl = np.stack([np.cos(turns) * 0.01, turns * 0.005, np.sin(turns) * 0.01], axis=1)
    parts = np.split(groom.strands.points, groom.strands.offsets[1:-1])
    strands = Strands.from_list([parts[0], curl + groom.strands.roots[1], *parts[2:]])
    path = written(replace(groom, strands=strands), tmp_path)
    assert "1 strands of more than 255" in caplog.text
    have = alembic.import_groom(path, alembic.Options()).strands
    np.testing.assert_array_equal(have.counts, np.minimum(strands.counts, 255))
    np.testing.assert_allclose(have.lengths()[1], strands.lengths()[1], rtol=1e-2)
    rest = np.arange(len(strands)) != 1
    np.testing.assert_array_equal(have.select(rest).points, strands.select(rest).points)


@pytest.mark.parametrize("limit", ["UNREAL_GROUP_CURVES", "UNREAL_GROUP_POINTS"])
def test_groups_beyond_unreal_are_refused_for_unreal(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture, limit: str
) -> None:
    """With axis=unreal a group too large is an error; else it is a warning."""
    groom = hair_groom()
    group = np.asarray(groom.strands.group)
    sizes = np.bincount(group if "CURVES" in limit else group[groom.strands.strand_of_point])
    monkeypatch.setattr(curves, limit, int(sizes.max()))
    written(groom, tmp_path, axis="unreal")
    monkeypatch.setattr(curves, limit, int(sizes.max()) - 1)
    with pytest.raises(InputError, match=f"group {sizes.argmax()} has {sizes.max()} "):
        written(groom, tmp_path, axis="unreal")
    written(groom, tmp_path)
    assert f"group {sizes.argmax()} has" in caplog.text


def swaying(groom: Groom, folder: Path, fps: float = 30.0) -> tuple[PointCache, Path]:
    """Return a cache of four frames of all strands, and its file."""
    away = np.linspace(0, 0.03, 4)[:, None, None] * groom.strands.arc_lengths()[:, None]
    frames = groom.strands.points + away * np.array([1.0, 0.0, 0.0])
    cache = PointCache(frames, 0.5 + np.arange(4) / fps, np.tile(np.eye(4), (4, 1, 1)))
    cache.save(folder / "cache.npz")
    return cache, folder / "cache.npz"


def test_a_cache_becomes_time_samples(tmp_path: Path) -> None:
    """Points are sampled at the cache's rate; widths, uv, counts are stored once."""
    groom = bristle_groom()
    cache, file = swaying(groom, tmp_path)
    schema = opened(written(groom, tmp_path, cache=file, axis="unreal"))[1]
    assert schema.getNumSamples() == 4
    for number, time in enumerate(cache.times):
        assert schema.getTimeSampling().getSampleTime(number) == pytest.approx(time)
        sample = schema.getValue(Abc.ISampleSelector(float(time)))
        want = 100.0 * cache.points[number][:, [0, 2, 1]]
        np.testing.assert_allclose(numbers(sample.getPositions()), want, rtol=3e-7, atol=1e-9)
        assert sample.getType() == AbcGeom.CurveType.kLinear
    assert schema.getNumVerticesProperty().isConstant()
    assert schema.getWidthsParam().isConstant()
    assert schema.getUVsParam().isConstant()
    assert all(item.getNumSamples() == 1 for item in attributes(schema).values())


def test_an_animation_is_read_at_its_first_frame(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    """Importing says how many frames there are."""
    groom = bristle_groom()
    cache, file = swaying(groom, tmp_path)
    path = written(groom, tmp_path, cache=file)
    back = alembic.import_groom(path, alembic.Options())
    np.testing.assert_allclose(back.strands.points, cache.points[0], rtol=3e-7)
    assert "4 frames" in caplog.text


def test_long_strands_move_as_they_rest(tmp_path: Path) -> None:
    """Frames of strands that are resampled are resampled likewise."""
    groom = bristle_groom()
    cache, file = swaying(groom, tmp_path)
    schema = opened(written(groom, tmp_path, cache=file, max_points=3))[1]
    sample = schema.getValue(Abc.ISampleSelector(float(cache.times[3])))
    want = replace(groom.strands, points=cache.points[3]).resampled(3).points
    np.testing.assert_allclose(numbers(sample.getPositions()), want, rtol=3e-7)


def test_uneven_frames_are_told(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    """Frames at odd times are written evenly, and that is said."""
    groom = bristle_groom()
    cache, file = swaying(groom, tmp_path)
    PointCache(cache.points, np.array([0, 0.1, 0.3, 0.31]), cache.head_from_rest).save(file)
    written(groom, tmp_path, cache=file)
    assert "not evenly spaced" in caplog.text


def test_strands_without_length_are_dropped(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    """Degenerate strands are counted in a warning and not written."""
    groom = hair_groom()
    points = np.array(groom.strands.points)
    points[: groom.strands.offsets[1]] = points[0]
    groom = replace(groom, strands=replace(groom.strands, points=points))
    schema = opened(written(groom, tmp_path))[1]
    assert schema.getValue().getNumCurves() == len(groom.strands) - 1
    assert "1 strands without length" in caplog.text


def test_roots_without_width_are_told(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    """Unity discards every width where one root has none; thin tips are nobody's concern."""
    groom = hair_groom()
    widths = np.array(groom.strands.widths)
    widths[groom.strands.offsets[1:] - 1] = 0
    written(replace(groom, strands=replace(groom.strands, widths=widths)), tmp_path)
    assert "0 wide" not in caplog.text
    widths[groom.strands.offsets[:2]] = 0
    written(replace(groom, strands=replace(groom.strands, widths=widths)), tmp_path)
    assert "2 strands are 0 wide at the root" in caplog.text


def test_equal_grooms_are_equal_files(tmp_path: Path) -> None:
    """No date and no path goes into the file."""
    first = written(hair_groom(), tmp_path).read_bytes()
    folder = tmp_path / "another"
    folder.mkdir()
    assert written(hair_groom(), folder).read_bytes() == first
    assert b"DateWritten" not in first


@pytest.mark.parametrize("failure", [KeyboardInterrupt(), RuntimeError("from the library")])
def test_a_failure_leaves_the_old_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, failure: BaseException
) -> None:
    """When writing breaks off, the old file is whole and nothing else is in the folder."""
    path = written(hair_groom(), tmp_path)
    old = path.read_bytes()

    def fail(*_: object) -> None:
        raise failure

    monkeypatch.setattr(writer, "_write_attributes", fail)
    with pytest.raises(type(failure)):
        written(bristle_groom(), tmp_path)
    assert path.read_bytes() == old
    assert list(tmp_path.iterdir()) == [path]


@pytest.mark.skipif(not hasattr(writer.os, "posix_fallocate"), reason="POSIX reserves the room")
def test_a_full_disk_is_told_before_the_library_writes(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The library ends the process when a write fails, so room is made first."""

    def full(*_: object) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(writer.os, "posix_fallocate", full)
    with pytest.raises(InputError, match="no room for"):
        written(bristle_groom(), tmp_path)
    assert not list(tmp_path.iterdir())


def test_the_room_made_is_enough(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    """What is reserved before writing is at least the size of the file, and not much more."""
    caplog.set_level(logging.CRITICAL)
    _, file = swaying(bristle_groom(), tmp_path)
    for groom, options in (
        (hair_groom(), {}), (hair_groom(), {"split": True}), (bristle_groom(), {"cache": file}),
    ):  # fmt: skip
        ready = alembic.prepare_export(groom, alembic.Options(**options))
        size = writer._size(curves.groom_curves(ready, alembic.Options(**options)))
        have = written(groom, tmp_path, **options).stat().st_size
        assert have <= size < 2 * have + 50_000
