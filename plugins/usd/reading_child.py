"""A program of its own: takes the curves, head and skeleton out of a USD file.

Asked to `read` the file `source`, it writes the arrays as they are in it to `target`, with the
transforms to the stage, and answers {} or {"error": ..., "kind": ...}. It runs apart because
usd-core, a C++ library, crashes on some damaged crate files.
"""

from __future__ import annotations

import json
import os
import re
from typing import Any

import numpy as np
import numpy.typing as npt

from hairkit import worker

MAX_POINTS = 64_000_000
"""Control points of all curves and meshes together, and primvars' values."""
MAX_PRIMS = 200_000
CURVE_PRIMVARS = (
    "groom_root_uv",
    "st",
    "groom_group_id",
    "groom_guide",
    "groom_color",
    "displayColor",
    "hairkit:root_triangle",
    "hairkit:root_barycentric",
)
OWN_ARRAYS = (
    *("curveVertexCounts", "faceVertexCounts", "faceVertexIndices", "widths"),
    *("order", "knots", "pointWeights"),
)
"""Attributes of one number an element: of curves, of meshes, of NURBS."""
_INSTEAD = {"st": "groom_root_uv", "displayColor": "groom_color"}
"""Attributes that are skipped if a better one was found."""
_INTERPOLATIONS = ("constant", "uniform", "varying", "vertex", "faceVarying")


class RefusedError(Exception):
    """The file is whole, but not read."""


def read(source: str, target: str) -> dict[str, str]:
    """Write the archive; return nothing, or the `error` and its `kind`."""
    from pxr import Tf

    save: Any = np.savez  # whose stubs take names of arrays for options
    try:
        save(target, **extract_arrays(source))
    except RefusedError as error:
        return {"kind": "refused", "error": str(error)}
    except Tf.ErrorException as error:
        return {"kind": "damaged", "error": _first_reason(error)}
    except MemoryError:
        return {"kind": "damaged", "error": "it unpacks to more memory than is allowed"}
    except (ValueError, TypeError, OverflowError, RuntimeError, RecursionError) as error:
        return {"kind": "damaged", "error": " ".join(str(error).split())[:200]}
    return {}


def extract_arrays(source: str) -> dict[str, npt.NDArray[Any]]:
    """Return arrays by name; `description` is JSON text as bytes."""
    from pxr import Sdf, Usd, UsdGeom, UsdSkel

    layer = Sdf.Layer.FindOrOpen(os.fsencode(source).decode())  # UTF-8 in any locale
    if layer is None:
        raise ValueError("the USD library cannot open it")
    _refuse_other_files(layer)
    stage = Usd.Stage.Open(layer, Usd.Stage.LoadNone)
    taken = _Taken()
    prims = Usd.PrimRange.Stage(stage, Usd.TraverseInstanceProxies())
    for number, prim in enumerate(prims):
        if number >= MAX_PRIMS:
            raise RefusedError(f"it has more than {MAX_PRIMS} prims")
        if prim.IsA(UsdGeom.BasisCurves) or prim.IsA(UsdGeom.NurbsCurves):
            taken.curves.append(taken.points(prim, "c", CURVE_PRIMVARS))
        elif prim.IsA(UsdGeom.Mesh) and prim.HasAttribute("primvars:hairkit:scalp"):
            taken.meshes.append(taken.points(prim, "m", ("st", "hairkit:scalp")))
        elif prim.IsA(UsdSkel.Skeleton):
            taken.take_joints(prim)
    description = {
        "up": str(UsdGeom.GetStageUpAxis(stage)),
        "metres": float(UsdGeom.GetStageMetersPerUnit(stage)),
        "metres_known": bool(UsdGeom.StageHasAuthoredMetersPerUnit(stage)),
        "curves": taken.curves,
        "meshes": taken.meshes,
        "settings": _settings(stage.GetDefaultPrim()),
    }
    taken.arrays["description"] = np.frombuffer(json.dumps(description).encode(), np.uint8)
    return taken.arrays


class _Taken:
    """Data found so far."""

    def __init__(self) -> None:
        self.arrays: dict[str, npt.NDArray[Any]] = {}
        self.curves: list[dict[str, Any]] = []
        self.meshes: list[dict[str, Any]] = []
        self.total = 0

    def points(self, prim: Any, letter: str, primvars: tuple[str, ...]) -> dict[str, Any]:
        """Take a prim's arrays; return its description, whose `name` begins their names."""
        from pxr import UsdGeom

        name = f"{letter}{len(self.curves) + len(self.meshes)}."
        attribute = prim.GetAttribute("points")
        time, frames = _time_of(attribute)
        self.put(name + "points", attribute.Get(time), 3)
        for own in OWN_ARRAYS:
            if prim.HasAttribute(own):
                when, _ = _time_of(prim.GetAttribute(own))
                self.put(name + own, prim.GetAttribute(own).Get(when), 1)
        found = {"widths": _curve_interpolation(prim)}
        every = UsdGeom.PrimvarsAPI(prim)
        for wanted in primvars:
            primvar = every.GetPrimvar(wanted)
            if _INSTEAD.get(wanted) in found:
                continue
            if primvar and primvar.HasValue():
                when, _ = _time_of(primvar.GetAttr())
                self.put(name + wanted, primvar.ComputeFlattened(when), None)
                found[wanted] = _word(primvar.GetInterpolation())
        matrix = UsdGeom.XformCache(time).GetLocalToWorldTransform(prim)
        return {
            "name": name,
            "path": str(prim.GetPath()),
            "frames": frames,
            "to_stage": [list(matrix.GetRow(row)) for row in range(4)],
            "interpolation": found,
            "shape": _shape(prim),
            "wrap": _text_of(prim, "wrap"),
        }

    def put(self, name: str, value: Any, columns: int | None) -> None:
        """Keep a value as an array, checked for its size."""
        if value is None:
            return
        array = np.asarray(value)
        if array.dtype.kind not in "iuf" or (columns == 3 and array.shape[1:] != (3,)):
            return
        self.total += len(array) if array.ndim else 1
        if self.total > MAX_POINTS * 8:
            raise RefusedError(f"it has more than {MAX_POINTS} points")
        self.arrays[name] = array

    def take_joints(self, prim: Any) -> None:
        """Keep the first skeleton's joints and where they are bound."""
        joints, binds = (prim.GetAttribute(name).Get() for name in ("joints", "bindTransforms"))
        if "joints" in self.arrays or not joints or not binds or len(joints) != len(binds):
            return
        self.arrays["joints"] = np.array([list(bind.GetRow(3))[:3] for bind in binds])
        names = [str(joint).rpartition("/")[2] for joint in joints]
        self.arrays["joint_names"] = np.frombuffer(json.dumps(names).encode(), np.uint8)


def _refuse_other_files(layer: Any) -> None:
    """Refuse what would make the library open other files: composition arcs and value clips."""
    from pxr import Sdf

    others = sorted(filter(None, layer.GetCompositionAssetDependencies()))
    if others:
        raise RefusedError(
            f"it refers to another file ({others[0]}); flatten it first: usdcat --flatten"
        )
    clips: list[str] = []

    def look(path: Any) -> None:
        spec = layer.GetObjectAtPath(path)
        if isinstance(spec, Sdf.PrimSpec) and (spec.HasInfo("clips") or spec.HasInfo("clipSets")):
            clips.append(str(path))

    layer.Traverse(Sdf.Path.absoluteRootPath, look)
    if clips:
        raise RefusedError(f"it has value clips in other files (at {clips[0]}); flatten it first")


def _time_of(attribute: Any) -> tuple[Any, int]:
    """Return when to read: at rest if there is a value, else at the first sample; and samples."""
    from pxr import Usd

    times = attribute.GetTimeSamples() if attribute else []
    rest = Usd.TimeCode.Default()
    if times and attribute.Get(rest) is None:
        return Usd.TimeCode(times[0]), len(times)
    return rest, len(times)


def _shape(prim: Any) -> str:
    """Return `linear`, the basis of cubic curves, or `nurbs`."""
    from pxr import UsdGeom

    if prim.IsA(UsdGeom.NurbsCurves):
        return "nurbs"
    kind = _text_of(prim, "type")
    return kind if kind in ("", "linear") else _text_of(prim, "basis")


def _text_of(prim: Any, name: str) -> str:
    return str(prim.GetAttribute(name).Get()) if prim.HasAttribute(name) else ""


def _curve_interpolation(prim: Any) -> str:
    from pxr import UsdGeom

    return _word(UsdGeom.Curves(prim).GetWidthsInterpolation()) if UsdGeom.Curves(prim) else ""


def _word(interpolation: Any) -> str:
    return str(interpolation) if interpolation in _INTERPOLATIONS else ""


def _settings(prim: Any) -> Any:
    """Return hairkit's custom data as plain numbers and lists."""
    held = prim.GetCustomDataByKey("hairkit") if prim else None
    return _plain(held, 0) if isinstance(held, dict) else {}


def _plain(value: Any, depth: int) -> Any:
    if isinstance(value, dict) and depth < 4:
        return {str(key): _plain(item, depth + 1) for key, item in value.items()}
    array = np.array(value)
    return array.tolist() if array.dtype.kind in "iuf" else None


def _first_reason(error: Exception) -> str:
    """Return what the library says, without its functions and files."""
    try:
        text = str(error)
    except UnicodeDecodeError as broken:  # the library quotes the damaged bytes
        text = broken.object.decode("utf-8", "replace")
    found = re.search(r": '(.*?)'?\s*(?:\n|$)", text)
    words = re.sub(r"pxrInternal\w*::", "", found.group(1) if found else text)
    return " ".join(words.split())[:200]


if __name__ == "__main__":
    worker.answer_questions({"read": lambda asked, _: read(asked["source"], asked["target"])})
