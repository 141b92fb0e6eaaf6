"""Write groom curves with the Alembic library, from NumPy's memory, as one file or none."""

from __future__ import annotations

import errno
import os
import shutil
import traceback
from pathlib import Path
from typing import Any

import imath
import numpy as np
from alembic3d import Abc, AbcCoreAbstract, AbcGeom

from hairkit.arrays import BoolArray
from hairkit.errors import InputError
from hairkit.storage import replace_file
from hairkit.system import utf8_name
from hairkit.version import __version__

from .contents import FINISHED, MAGIC
from .curves import GroomCurves

GROOM_VERSION = (1, 5)
"""Major and minor version of Unreal's groom schema."""
_OGAWA_BYTES = 16
"""Of the header of the file: magic number, version, place of the root group."""
_HEADER_BYTES, _ATTRIBUTES = 512, 32
"""More than the header of a property or frame takes, and more than there are properties."""
_UNIFORM, _VERTEX = AbcGeom.GeometryScope.kUniformScope, AbcGeom.GeometryScope.kVertexScope


def write_curves(curves: GroomCurves, path: Path) -> None:
    """Write the curves to `path`: afterwards it is the old file or the whole new one.

    Raises
    ------
    InputError
        There is no room for the file.
    """
    with replace_file(path, ".abc") as part:
        try:
            _make_room(part, _size(curves))
        except OSError as error:
            raise InputError(
                f"{path}: no room for {_size(curves)} bytes: {error.strerror}"
            ) from error
        try:
            _write(curves, part)
        except BaseException as error:
            # the library closes its file when the last of its objects goes, which frames hold
            traceback.clear_frames(error.__traceback__)
            raise
        if not _is_complete(part):
            raise InputError(f"{path}: the Alembic library did not write the whole file")


def _make_room(part: Path, size: int) -> None:
    """Raise `OSError` now where the disk is full: the library would end the process later."""
    with part.open("wb") as file:
        if hasattr(os, "posix_fallocate"):
            os.posix_fallocate(file.fileno(), 0, size)
    if shutil.disk_usage(part.parent).free < size - part.stat().st_size:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))


def _is_complete(path: Path) -> bool:
    """Return whether a file was closed and ends where its root group does, as Ogawa files do."""
    with path.open("rb") as file:
        head = file.read(_OGAWA_BYTES)
        if len(head) < _OGAWA_BYTES or head[:6] != MAGIC + bytes([FINISHED]):
            return False
        root = int.from_bytes(head[8:], "little")
        file.seek(root)
        children = int.from_bytes(file.read(8), "little")
        return path.stat().st_size == root + 8 + 8 * children


def _size(curves: GroomCurves) -> int:
    """Return at least the bytes of the file: its numbers, each sample's key, and headers."""
    frames = 1 if curves.cache is None else len(curves.cache)
    arrays = [curves.counts, curves.widths, curves.root_uv, curves.density, curves.group]
    # colours are three numbers a point, as places are
    size = sum(array.nbytes for array in arrays) + (frames + 1) * curves.points.nbytes
    # also each curve's number, guide flag, and three guides with weights
    objects = len(set(curves.group_names)) if curves.split else 1
    return size + 32 * len(curves.counts) + objects * _HEADER_BYTES * (frames + _ATTRIBUTES)


def _write(curves: GroomCurves, part: Path) -> None:
    # Abc.OArchive writes no date, unlike CreateArchiveWithInfo: equal grooms are equal files
    archive = Abc.OArchive(utf8_name(part))
    groom = AbcGeom.OXform(archive.getTop(), "groom")
    _write_groom_properties(groom, curves)
    sampling = 0
    if curves.cache is not None:
        step, start = 1.0 / curves.cache.frames_per_second, float(curves.cache.times[0])
        sampling = archive.addTimeSampling(AbcCoreAbstract.TimeSampling(step, start))
    names = np.asarray(curves.group_names if curves.split else [""] * len(curves.counts))
    for name in np.unique(names):
        parent = AbcGeom.OXform(groom, str(name)) if name else groom  # Blender takes its name
        schema = AbcGeom.OCurves(parent, "strands", sampling).getSchema()
        for number in range(1 if curves.cache is None else len(curves.cache)):
            schema.set(_sample(curves, number, names == name))
        if curves.attributes:
            _write_attributes(schema.getArbGeomParams(), curves, names == name)


def _write_groom_properties(groom: Any, curves: GroomCurves) -> None:
    """Write what Unreal looks for on the first transform under the top object, and the curl."""
    transform = AbcGeom.XformSample()
    transform.setInheritsXforms(True)
    groom.getSchema().set(transform)
    properties = groom.getSchema().getUserProperties()
    major, minor = GROOM_VERSION
    Abc.OInt16Property(properties, "groom_version_major").setValue(major)
    Abc.OInt16Property(properties, "groom_version_minor").setValue(minor)
    tool = f"hairkit {__version__}"
    Abc.OStringProperty(properties, "groom_tool").setValue(tool)
    if curves.curl is not None:
        for name, length in zip(("radius", "pitch"), curves.curl, strict=True):
            Abc.ODoubleProperty(properties, f"hairkit_curl_{name}").setValue(length)


def _sample(curves: GroomCurves, number: int, own: BoolArray) -> Any:
    """Return a frame's sample of some curves (S,); what does not change is in the first, and
    repeated by reference.

    Setters leave weights, orders and knots out; the constructor would write empty ones, which a
    reader could take for a NURBS curve without knots.
    """
    sample, rows = AbcGeom.OCurvesSchemaSample(), np.repeat(own, curves.counts)
    sample.setType(AbcGeom.CurveType.kLinear)
    sample.setWrap(AbcGeom.CurvePeriodicity.kNonPeriodic)
    sample.setBasis(AbcGeom.BasisType.kNoBasis)
    sample.setPositions(_imath(curves.frame(number)[rows]))
    if number == 0:
        widths, uv = _imath(curves.widths[rows]), _imath(curves.root_uv[own])
        sample.setCurvesNumVertices(_imath(curves.counts[own]))
        sample.setWidths(AbcGeom.OFloatGeomParamSample(widths, _VERTEX))
        sample.setUVs(AbcGeom.OV2fGeomParamSample(uv, _UNIFORM))
    return sample


def _write_attributes(attributes: Any, curves: GroomCurves, own: BoolArray) -> None:
    """Write the groom attributes of some curves (S,), of the types and scopes of Epic's table."""
    number, rows = np.flatnonzero(own).astype(np.int32), np.repeat(own, curves.counts)
    _write_attribute(attributes, "groom_id", "Int32", _UNIFORM, number)
    _write_attribute(attributes, "groom_group_id", "Int32", _UNIFORM, curves.group[own])
    if len(np.unique(curves.group)) > 1:
        names = imath.StringArray(len(number))
        for at, place in enumerate(number.tolist()):
            names[at] = curves.group_names[place]
        sample = AbcGeom.OStringGeomParamSample(names, _UNIFORM)
        AbcGeom.OStringGeomParam(attributes, "groom_group_name", False, _UNIFORM, 1).set(sample)
    _write_attribute(attributes, "groom_root_uv", "V2f", _UNIFORM, curves.root_uv[own])
    _write_attribute(attributes, "hairkit_root_density", "Float", _UNIFORM, curves.density[own])
    _write_attribute(attributes, "groom_color", "V3f", _VERTEX, curves.colour.at()[rows])
    if curves.guide is not None:
        guide = curves.guide[own].astype(np.int32)
        _write_attribute(attributes, "groom_guide", "Int32", _UNIFORM, guide)
    if curves.closest is not None:
        guides, weights = curves.closest.guides[own], curves.closest.weights[own]
        _write_attribute(attributes, "groom_closest_guides", "V3i", _UNIFORM, guides)
        _write_attribute(attributes, "groom_guide_weights", "V3f", _UNIFORM, weights)


def _write_attribute(attributes: Any, name: str, kind: str, scope: Any, values: Any) -> None:
    sample = getattr(AbcGeom, f"O{kind}GeomParamSample")(_imath(values), scope)
    getattr(AbcGeom, f"O{kind}GeomParam")(attributes, name, False, scope, 1).set(sample)


def _imath(values: np.ndarray[Any, Any]) -> Any:
    """Return (N,) or (N, 2 or 3) numbers as the library's array, copied by the buffer protocol."""
    name = {"f": "Float", "i": "Int"}[values.dtype.kind]
    if values.ndim == 2:
        name = f"V{values.shape[1]}{name[0].lower()}"
    return getattr(imath, f"{name}ArrayFromBuffer")(np.ascontiguousarray(values))
