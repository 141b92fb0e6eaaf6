"""SIMD lanes as a Numba type: arithmetic on `LANES` float32 at a time.

`load` reads a row of lanes of a field, one for each strand of a block, and `store` writes it; lanes
support arithmetic like numbers. Loops over plain numbers that compilers make vector code of take
twice the processor time, and code that runs one strand after the other five times.
"""

from __future__ import annotations

import operator
from collections.abc import Callable
from typing import Any

from llvmlite import ir
from numba import types
from numba.core.typing import templates as numba_templates
from numba.extending import intrinsic, lower_builtin, models, register_model

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
