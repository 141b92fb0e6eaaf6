"""SIMD lanes as a Numba type, and vectors and unit quaternions (w, x, y, z) of lanes or numbers.

`load` reads a row of lanes of a field, one for each strand of a block, and `store` writes it; lanes
support arithmetic like numbers. Loops over plain numbers that compilers make vector code of take
twice the processor time, and code that runs one strand after the other five times. Constants are
float32, since Numba takes bare literals for float64.
"""

from __future__ import annotations

import operator
from collections.abc import Callable
from typing import Any, TypeVar

import numpy as np
from llvmlite import ir
from numba import types
from numba.core.typing import templates as numba_templates
from numba.extending import intrinsic, lower_builtin, models, register_model

from hairkit.parallel import compiled_with

LANES = 16
"""Strands in a block: the float32 lanes of two AVX2 registers, which hide each other's waits."""

# Numba's own functions are not annotated.
templates: Any = numba_templates
lower: Any = lower_builtin
primitive: Any = models.PrimitiveModel
word: Callable[[Any], Any] = intrinsic
"""Declares an intrinsic of compiled functions from its code builder."""

_ROW = ir.VectorType(ir.FloatType(), LANES)
_FAST = ("fast",)


class Lanes(types.Type):
    """The type of a vector of float32."""

    def __init__(self) -> None:
        super().__init__(name=f"Lanes({LANES})")


@register_model(Lanes)
class _LanesModel(primitive):  # type: ignore[misc] # Numba's class
    def __init__(self, manager: Any, kind: Lanes) -> None:
        super().__init__(manager, kind, _ROW)


lanes: Any = Lanes()


def _spread(builder: Any, value: Any, kind: Any) -> Any:
    """Broadcast a number to all lanes; return lanes unchanged."""
    if kind is lanes:
        return value
    void = ir.Constant(_ROW, ir.Undefined)
    mask = ir.Constant(ir.VectorType(ir.IntType(32), LANES), [0] * LANES)
    return builder.shuffle_vector(
        builder.insert_element(void, value, ir.IntType(32)(0)), void, mask
    )


def _declare(symbol: Any, instruction: str) -> None:
    """Declare a binary operator where both operands or one of them are lanes."""
    pairs = ((lanes, lanes), (lanes, types.float32), (types.float32, lanes))
    cases = [templates.signature(lanes, *operands) for operands in pairs]
    kind = type(f"Lanes_{instruction}", (templates.ConcreteTemplate,), {"cases": cases})
    templates.infer_global(symbol)(kind)

    def build(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        a, b = (_spread(builder, v, k) for v, k in zip(args, sig.args, strict=True))
        return getattr(builder, instruction)(a, b, flags=_FAST)

    for case in cases:
        lower(symbol, *case.args)(build)


_declare(operator.add, "fadd")
_declare(operator.sub, "fsub")
_declare(operator.mul, "fmul")
_declare(operator.truediv, "fdiv")


def _address(context: Any, builder: Any, sig: Any, args: Any) -> Any:
    """Return the address of row args[1] of the field args[0]."""
    made = context.make_array(sig.args[0])(context, builder, args[0])
    row = context.cast(builder, args[1], sig.args[1], types.intp)
    first = builder.mul(row, ir.IntType(64)(LANES), flags=("nsw",))
    return builder.bitcast(builder.gep(made.data, [first], inbounds=True), _ROW.as_pointer())


@word
def load(context: Any, field: Any, row: Any) -> Any:
    """Load a row of a field (rows, LANES) or (LANES,)."""

    def build(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        loaded = builder.load(_address(context, builder, sig, args))
        loaded.align = 4
        return loaded

    return lanes(field, row), build


@word
def store(context: Any, field: Any, row: Any, value: Any) -> Any:
    """Store a row."""

    def build(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        address = _address(context, builder, sig, args)
        builder.store(_spread(builder, args[2], sig.args[2]), address, align=4)
        return context.get_dummy_value()

    return types.void(field, row, value), build


@word
def root(context: Any, value: Any) -> Any:
    """Return the square root."""

    def build(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        name, kind = f"llvm.sqrt.v{LANES}f32", ir.FunctionType(_ROW, [_ROW])
        function = builder.module.globals.get(name) or ir.Function(builder.module, kind, name)
        return builder.call(function, args, fastmath=_FAST)

    return lanes(lanes), build


@word
def pick(context: Any, a: Any, b: Any, yes: Any, no: Any) -> Any:
    """Return `yes` in lanes where a < b, else `no`."""

    def build(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        a, b, yes, no = (_spread(builder, v, k) for v, k in zip(args, sig.args, strict=True))
        return builder.select(builder.fcmp_ordered("<", a, b, flags=_FAST), yes, no)

    return lanes(a, b, yes, no), build


@word
def least(context: Any, value: Any) -> Any:
    """Return the smallest number of all lanes."""

    def build(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        name, kind = f"llvm.vector.reduce.fmin.v{LANES}f32", ir.FunctionType(ir.FloatType(), [_ROW])
        function = builder.module.globals.get(name) or ir.Function(builder.module, kind, name)
        return builder.call(function, args, fastmath=_FAST)

    return types.float32(lanes), build


Vector = tuple[Any, Any, Any]
Frame = tuple[Any, Any, Any, Any]
_Function = TypeVar("_Function", bound=Callable[..., Any])

ZERO, ONE, TWO, HALF = np.float32(0), np.float32(1), np.float32(2), np.float32(0.5)
OPPOSITE = np.float32(1e-4)
"""Least 1 + cosine between an axis and where it is swung to."""
_ARC = [np.float32(c) for c in (0.9998660, -0.3302995, 0.1801410, -0.0851330, 0.0208351)]
_A, _B, _C, _D, _E = _ARC
_THIRD, _FIFTH, _SEVENTH = np.float32(1 / 3), np.float32(1 / 5), np.float32(1 / 7)
_HALF_PI, _SMALL = np.float32(np.pi / 2), np.float32(0.04)


def inlined(function: _Function) -> _Function:
    """Compile a function into its callers, so that loops over lanes become vector instructions."""
    return compiled_with(fastmath=True, forceinline=True)(function)


def stage(function: _Function) -> _Function:
    """Compile one step of the method for a block, by itself."""
    return compiled_with(fastmath=True)(function)


@inlined
def one(field: Any) -> Any:
    """Load a number (LANES,)."""
    return load(field, 0)


@inlined
def put_one(field: Any, value: Any) -> None:
    """Store a number."""
    store(field, 0, value)


@inlined
def three(field: Any) -> Vector:
    """Load a vector (3, LANES)."""
    return load(field, 0), load(field, 1), load(field, 2)


@inlined
def four(field: Any) -> Frame:
    """Load a quaternion (4, LANES)."""
    return load(field, 0), load(field, 1), load(field, 2), load(field, 3)


@inlined
def put(field: Any, value: Vector) -> None:
    """Store a vector."""
    store(field, 0, value[0])
    store(field, 1, value[1])
    store(field, 2, value[2])


@inlined
def put_four(field: Any, value: Frame) -> None:
    """Store a quaternion."""
    put(field, (value[0], value[1], value[2]))
    store(field, 3, value[3])


@inlined
def smaller(a: Any, b: Any) -> Any:
    """Return the smaller one."""
    return pick(a, b, a, b)


@inlined
def larger(a: Any, b: Any) -> Any:
    """Return the larger one."""
    return pick(a, b, b, a)


@inlined
def plus(a: Vector, b: Vector) -> Vector:
    """Return the sum."""
    return a[0] + b[0], a[1] + b[1], a[2] + b[2]


@inlined
def minus(a: Vector, b: Vector) -> Vector:
    """Return the difference."""
    return a[0] - b[0], a[1] - b[1], a[2] - b[2]


@inlined
def times(size: Any, a: Vector) -> Vector:
    """Return a multiple."""
    return size * a[0], size * a[1], size * a[2]


@inlined
def dot(a: Any, b: Any) -> Any:
    """Return the inner product of the first three components."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@inlined
def cross(a: Vector, b: Vector) -> Vector:
    """Return the vector product."""
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


@inlined
def turned(rows: Any, a: Vector) -> Vector:
    """Return a vector rotated by the first three columns of rows (3, 4)."""
    return dot(rows[0], a), dot(rows[1], a), dot(rows[2], a)


@inlined
def moved(rows: Any, a: Vector) -> Vector:
    """Return a point under the motion whose rows are (3, 4)."""
    return dot(rows[0], a) + rows[0][3], dot(rows[1], a) + rows[1][3], dot(rows[2], a) + rows[2][3]


@inlined
def rows_of(matrix: Any) -> Any:
    """Return (3, 4) as tuples, which stay in registers."""
    return (
        (matrix[0, 0], matrix[0, 1], matrix[0, 2], matrix[0, 3]),
        (matrix[1, 0], matrix[1, 1], matrix[1, 2], matrix[1, 3]),
        (matrix[2, 0], matrix[2, 1], matrix[2, 2], matrix[2, 3]),
    )


@inlined
def product(r: Frame, q: Frame) -> Frame:
    """Return the quaternion product r q."""
    return (
        r[0] * q[0] - r[1] * q[1] - r[2] * q[2] - r[3] * q[3],
        r[0] * q[1] + r[1] * q[0] + r[2] * q[3] - r[3] * q[2],
        r[0] * q[2] - r[1] * q[3] + r[2] * q[0] + r[3] * q[1],
        r[0] * q[3] + r[1] * q[2] - r[2] * q[1] + r[3] * q[0],
    )


@inlined
def third_axis(q: Frame) -> Vector:
    """Return the third axis of a frame."""
    return (
        TWO * (q[1] * q[3] + q[0] * q[2]),
        TWO * (q[2] * q[3] - q[0] * q[1]),
        ONE - TWO * (q[1] * q[1] + q[2] * q[2]),
    )


@inlined
def swing_frame(q: Frame, way: Vector) -> Frame:
    """Rotate a frame by the shortest arc that brings its third axis to `way`; normalise it."""
    axis = third_axis(q)
    about = cross(axis, way)
    q = product((larger(ONE + dot(axis, way), OPPOSITE), about[0], about[1], about[2]), q)
    size = ONE / root(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3])
    return size * q[0], size * q[1], size * q[2], size * q[3]


@inlined
def half_way(a: Frame, b: Frame, v: Vector) -> tuple[Vector, Vector]:
    """Return v rotated by the frame half way from a to b, and the axis of b a^-1 times the tangent
    of a quarter of its angle.

    The sum of two unit quaternions has the square 2 + 2 w, w their product.
    """
    w = a[0] * b[0] + a[1] * b[1] + a[2] * b[2] + a[3] * b[3]
    sign = pick(w, ZERO, -ONE, ONE)
    over = ONE / (ONE + sign * w)
    va, vb = (a[1], a[2], a[3]), (b[1], b[2], b[3])
    axis = plus(va, times(sign, vb))
    aside = cross(axis, v)
    turn = plus(times(a[0] + sign * b[0], aside), cross(axis, aside))
    vector = minus(minus(times(a[0], vb), times(b[0], va)), cross(vb, va))
    return plus(v, times(over, turn)), times(sign * over, vector)


@inlined
def twist_angle(a: Frame, b: Frame) -> Any:
    """Return twice the angle of (w, z) of a^-1 b: the twist between frames, radians.

    The arc tangent's polynomial is off by at most 1e-5 (Abramowitz and Stegun 1964, 4.4.49); for
    small twists it would be off by a share of 1.3e-4, so that there its series is taken.
    """
    w = a[0] * b[0] + a[1] * b[1] + a[2] * b[2] + a[3] * b[3]
    z = a[0] * b[3] - a[1] * b[2] + a[2] * b[1] - a[3] * b[0]
    z, w = pick(w, ZERO, ZERO - z, z), larger(w, ZERO - w)
    size = larger(z, ZERO - z)
    t = smaller(size, w) / larger(size, w)
    s = t * t
    wide = t * (_A + s * (_B + s * (_C + s * (_D + s * _E))))
    small = t * (ONE - s * (_THIRD - s * (_FIFTH - s * _SEVENTH)))
    angle = pick(s, _SMALL, small, wide)
    angle = TWO * pick(w, size, _HALF_PI - angle, angle)
    return pick(z, ZERO, ZERO - angle, angle)
