"""SIMD lanes as Numba types: arithmetic on eight (or four) float32 at a time.

`load` reads the `LANES` numbers of a row of an array's last axis, one for each strand of a block,
and `store` writes them; lanes support arithmetic and comparison like numbers. `load_quad` and
`store_quad` do the same with four numbers. The result is vector code without the overlap checks
that loop vectorisers insert: it runs faster and compiles sooner.
"""

from __future__ import annotations

import operator
from collections.abc import Callable
from typing import Any

from llvmlite import ir
from numba import types
from numba.core.typing import templates as numba_templates
from numba.extending import intrinsic, lower_builtin, models, register_model

LANES = 8
"""Strands in a block: the float32 lanes of an AVX2 register."""

# Numba's own functions are not annotated.
templates: Any = numba_templates
lower: Any = lower_builtin
primitive: Any = models.PrimitiveModel
word: Callable[[Any], Any] = intrinsic
"""Declares an intrinsic of compiled functions from its code builder."""

_FAST = ("fast",)


class Lanes(types.Type):
    """The type of a vector of `count` float32."""

    def __init__(self, count: int) -> None:
        self.count, self.row = count, ir.VectorType(ir.FloatType(), count)
        super().__init__(name=f"Lanes({count})")


@register_model(Lanes)
class _LanesModel(primitive):  # type: ignore[misc] # Numba's class
    def __init__(self, manager: Any, kind: Lanes) -> None:
        super().__init__(manager, kind, kind.row)


lanes: Any = Lanes(LANES)
quad: Any = Lanes(4)


def _spread(builder: Any, value: Any, kind: Any, wanted: Lanes) -> Any:
    """Broadcast a number to all lanes; return lanes unchanged."""
    if isinstance(kind, Lanes):
        return value
    void = ir.Constant(wanted.row, ir.Undefined)
    mask = ir.Constant(ir.VectorType(ir.IntType(32), wanted.count), [0] * wanted.count)
    return builder.shuffle_vector(
        builder.insert_element(void, value, ir.IntType(32)(0)), void, mask
    )


def _declare(symbol: Any, instruction: str) -> None:
    """Declare a binary operator where both operands or one of them are lanes."""
    cases = [
        templates.signature(kind, *operands)
        for kind in (lanes, quad)
        for operands in ((kind, kind), (kind, types.float32), (types.float32, kind))
    ]
    kind = type(f"Lanes_{instruction}", (templates.ConcreteTemplate,), {"cases": cases})
    templates.infer_global(symbol)(kind)

    def build(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        wanted = sig.return_type
        a, b = (_spread(builder, v, k, wanted) for v, k in zip(args, sig.args, strict=True))
        return getattr(builder, instruction)(a, b, flags=_FAST)

    for case in cases:
        lower(symbol, *case.args)(build)


_declare(operator.add, "fadd")
_declare(operator.sub, "fsub")
_declare(operator.mul, "fmul")
_declare(operator.truediv, "fdiv")


def _address(context: Any, builder: Any, sig: Any, args: Any, kind: Lanes) -> Any:
    """Return the address of the row with index args[1] in the array args[0]."""
    made = context.make_array(sig.args[0])(context, builder, args[0])
    parts, kinds = [args[1]], [sig.args[1]]
    if getattr(sig.args[1], "count", 0):
        kinds = [*sig.args[1]]
        parts = [builder.extract_value(args[1], k) for k in range(len(kinds))]
    row: Any = None
    for k, (part, integer) in enumerate(zip(parts, kinds, strict=True)):
        part = context.cast(builder, part, integer, types.intp)
        if row is not None:
            size = builder.extract_value(made.shape, k)
            part = builder.add(builder.mul(row, size, flags=("nsw",)), part, flags=("nsw",))
        row = part
    first = builder.mul(row, ir.IntType(64)(kind.count), flags=("nsw",))
    return builder.bitcast(builder.gep(made.data, [first], inbounds=True), kind.row.as_pointer())


def _make_load(kind: Any) -> Any:
    """Make the intrinsic that loads lanes of a kind."""

    def take(context: Any, array: Any, index: Any) -> Any:
        def build(context: Any, builder: Any, sig: Any, args: Any) -> Any:
            loaded = builder.load(_address(context, builder, sig, args, kind))
            loaded.align = 4
            return loaded

        return kind(array, index), build

    return word(take)


def _make_store(kind: Any) -> Any:
    """Make the intrinsic that stores lanes of a kind."""

    def lay(context: Any, array: Any, index: Any, value: Any) -> Any:
        def build(context: Any, builder: Any, sig: Any, args: Any) -> Any:
            address = _address(context, builder, sig, args, kind)
            builder.store(_spread(builder, args[2], sig.args[2], kind), address, align=4)
            return context.get_dummy_value()

        return types.void(array, index, value), build

    return word(lay)


load, load_quad = _make_load(lanes), _make_load(quad)
"""Load a row of a contiguous array (..., W) or (..., 4); the index is an integer or a tuple."""
store, store_quad = _make_store(lanes), _make_store(quad)
"""Store a row: array, index, value."""


@word
def load_number(context: Any, array: Any, index: Any) -> Any:
    """Return a number of a contiguous array by its flat index; negative ones are not supported."""

    def build(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        made = context.make_array(sig.args[0])(context, builder, args[0])
        return builder.load(builder.gep(made.data, [args[1]], inbounds=True))

    return array.dtype(array, types.int64), build


@word
def lane_root(context: Any, value: Any) -> Any:
    """Return the square root."""

    def build(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        name, kind = f"llvm.sqrt.v{LANES}f32", ir.FunctionType(lanes.row, [lanes.row])
        function = builder.module.globals.get(name) or ir.Function(builder.module, kind, name)
        return builder.call(function, args, fastmath=_FAST)

    return lanes(lanes), build


@word
def whole(context: Any, value: Any) -> Any:
    """Truncate lanes to integers."""

    def build(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        cut = builder.fptosi(args[0], ir.VectorType(ir.IntType(32), LANES))
        return builder.sitofp(cut, lanes.row)

    return lanes(lanes), build


@word
def pick(context: Any, a: Any, b: Any, yes: Any, no: Any) -> Any:
    """Return `yes` in lanes where a < b, else `no`."""

    def build(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        a, b, yes, no = (_spread(builder, v, k, lanes) for v, k in zip(args, sig.args, strict=True))
        return builder.select(builder.fcmp_ordered("<", a, b, flags=_FAST), yes, no)

    return lanes(a, b, yes, no), build


@word
def any_below(context: Any, a: Any, b: Any) -> Any:
    """Return whether a < b in any lane."""

    def build(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        a, b = (_spread(builder, v, k, lanes) for v, k in zip(args, sig.args, strict=True))
        bits = builder.bitcast(builder.fcmp_ordered("<", a, b), ir.IntType(LANES))
        return builder.icmp_unsigned("!=", bits, ir.IntType(LANES)(0))

    return types.boolean(a, b), build


@word
def part_of(context: Any, value: Any, number: Any) -> Any:
    """Return one number of a quad."""

    def build(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        return builder.extract_element(args[0], args[1])

    return types.float32(quad, types.int64), build


@word
def quad_of(context: Any, a: Any, b: Any, c: Any, d: Any) -> Any:
    """Return a quad of four numbers."""

    def build(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        made = ir.Constant(quad.row, ir.Undefined)
        for k, value in enumerate(args):
            made = builder.insert_element(made, value, ir.IntType(32)(k))
        return made

    return quad(*[types.float32] * 4), build
