"""Array type aliases, and the validation of arrays in frozen types."""

from __future__ import annotations

from typing import Any, TypeVar

import numpy as np
import numpy.typing as npt

from hairkit.errors import DataError, FormatError

Float32Array = npt.NDArray[np.float32]
Float64Array = npt.NDArray[np.float64]
Int32Array = npt.NDArray[np.int32]
Int64Array = npt.NDArray[np.int64]
UInt8Array = npt.NDArray[np.uint8]
UInt32Array = npt.NDArray[np.uint32]
BoolArray = npt.NDArray[np.bool_]

_Array = TypeVar("_Array", bound=npt.NDArray[Any])
_Number = TypeVar("_Number", bound=np.generic)

MAX_REACH = 1000.0
"""Metres from the origin that lengths and points of files may reach.

One kilometre out, float32 numbers are 0.06 mm apart, as wide as a hair is thick.
"""


def frozen_array(
    value: npt.ArrayLike, dtype: npt.DTypeLike, shape: tuple[int | None, ...], name: str
) -> npt.NDArray[Any]:
    """Return `value` as a read-only contiguous array; `None` in `shape` matches any size.

    An array that is read-only and owns its memory is shared, any other one copied. Raises
    `DataError` naming the array when the shape differs, a float is not finite, or numbers are not
    those of the type: complex ones, or parts where whole ones are wanted.
    """
    given = np.asarray(value)
    if given.dtype.kind == "c":
        raise DataError(f"{name} has complex numbers, expected real ones")
    array = np.ascontiguousarray(value, dtype=dtype)
    if array.dtype.kind in "iu" and given.dtype.kind == "f" and (given != array).any():
        raise DataError(f"{name} has numbers with fractions, expected whole ones")
    if array.ndim != len(shape) or any(
        want is not None and want != have for want, have in zip(shape, array.shape, strict=True)
    ):
        wanted = "(" + ", ".join("n" if n is None else str(n) for n in shape) + ")"
        raise DataError(f"{name} has shape {array.shape}, expected {wanted}")
    if array.dtype.kind == "f" and not _all_finite(array):
        raise DataError(
            f"{name} has {np.count_nonzero(~np.isfinite(array))} values that are not finite"
        )
    if array.base is not None or (array is value and array.flags.writeable):
        array = array.copy()
    array.setflags(write=False)
    return array


def freeze(
    owner: Any, name: str, dtype: npt.DTypeLike, shape: tuple[int | None, ...], label: str = ""
) -> Any:
    """Make a field of a frozen dataclass a `frozen_array`, and return that; None stays None.

    Errors call it by its label, or by its name.
    """
    value = getattr(owner, name)
    if value is not None:
        value = frozen_array(value, dtype, shape, label or name)
        object.__setattr__(owner, name, value)
    return value


def read_only(array: _Array) -> _Array:
    """Return an array that nobody writes again, so that `frozen_array` need not copy it."""
    array.setflags(write=False)
    return array


def for_kernel(array: npt.NDArray[_Number]) -> npt.NDArray[_Number]:
    """Return a read-only view of an array by rows: a kernel is compiled once for all of them."""
    return read_only(np.ascontiguousarray(array)[...])


def unit_vectors(vectors: npt.NDArray[np.floating[Any]]) -> npt.NDArray[Any]:
    """Return vectors (..., N) at length 1, those of nearly no length at less."""
    length = np.linalg.norm(vectors, axis=-1, keepdims=True)
    return np.asarray(vectors / np.maximum(length, 1e-9))


def across(axes: npt.NDArray[Any], vectors: npt.NDArray[Any]) -> npt.NDArray[Any]:
    """Return the parts of vectors (..., N) across the unit vectors `axes` (..., N)."""
    return np.asarray(vectors - (vectors * axes).sum(axis=-1, keepdims=True) * axes)


def check_reach(values: npt.NDArray[np.floating[Any]], source: object, name: str) -> None:
    """Raise `FormatError` naming the source where a length or coordinate is beyond `MAX_REACH`."""
    farthest = float(np.abs(values).max(initial=0.0))
    if not farthest <= MAX_REACH:
        raise FormatError(
            f"{source}: {name} reach {farthest:.3g} m, expected at most {MAX_REACH:g} m"
        )


def _all_finite(array: npt.NDArray[np.floating[Any]]) -> bool:
    """Return whether all numbers are finite; a finite sum proves it without a mask."""
    with np.errstate(over="ignore", invalid="ignore"):
        return bool(np.isfinite(array.sum()) or np.isfinite(array).all())
