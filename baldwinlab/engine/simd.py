"""SIMD arithmetic on blocks of sixteen lanes.

A *lane* is the column of one agent in an array [row, lane]. `get` and `put` take one lane (an
integer, with a float32 value) or a *SIMD block* of sixteen neighboring lanes (`simd_block(first)`,
with a vector of sixteen float32). All other operations have the same form for both. So the source
of a network is that of one agent, and it is compiled for sixteen. The compiler holds sums in
registers, which its own vectorizer did not (37 ns instead of 10 ns per learning step).

An agent can also process sixteen items at a time: then a lane is an item. Comparisons return
*masks*, which `&` and `|` combine. `any_of` returns whether a mask is true in any lane.

Every operation is elementwise and IEEE, in the order of the source, so a lane has the same bits
alone and in a block. Compiled code contains the instructions of an operation inline, because a
function for each operation would take as long to compile as the rest of the step.
"""

from __future__ import annotations

import math
import operator
import os
from collections.abc import Callable
from typing import Any, Final

import numpy as np
from llvmlite import ir
from numba import types
from numba.extending import lower_builtin, models, overload, register_model, type_callable

from baldwinlab.engine.numba_internals.lowering import (
    array_data,
    call_intrinsic,
    cast_to_index,
    index_constant,
    index_type,
    item_address,
    load_item,
    none_value,
    store_item,
)

WIDTH: Final = int(os.environ.get("BALDWINLAB_LANES", "16"))
"""Lanes in a SIMD block: one AVX-512 register of float32. `wasm` uses 4 for browsers."""

Lane = Any
"""An integer, or a SIMD block of lanes."""
Value = Any
"""A float32, or one for each lane of a SIMD block."""
Mask = Any
"""A Boolean, or one for each lane of a SIMD block."""

_VECTOR = ir.VectorType(ir.FloatType(), WIDTH)
_BITS = ir.VectorType(ir.IntType(1), WIDTH)
_WORD = ir.IntType(32)


class BlockType(types.Type):  # type: ignore[misc]
    """The first of sixteen neighboring lanes."""

    def __init__(self) -> None:
        super().__init__("lane_block")


class WideType(types.Type):  # type: ignore[misc]
    """Sixteen float32 values."""

    def __init__(self) -> None:
        super().__init__("wide")


class MaskType(types.Type):  # type: ignore[misc]
    """Sixteen Booleans."""

    def __init__(self) -> None:
        super().__init__("mask")


BLOCK = BlockType()
WIDE = WideType()
MASK = MaskType()


@register_model(BlockType)
class _BlockModel(models.PrimitiveModel):  # type: ignore[misc]
    def __init__(self, manager: Any, kind: Any) -> None:
        super().__init__(manager, kind, index_type())


@register_model(WideType)
class _WideModel(models.PrimitiveModel):  # type: ignore[misc]
    def __init__(self, manager: Any, kind: Any) -> None:
        super().__init__(manager, kind, _VECTOR)


@register_model(MaskType)
class _MaskModel(models.PrimitiveModel):  # type: ignore[misc]
    def __init__(self, manager: Any, kind: Any) -> None:
        super().__init__(manager, kind, _BITS)


def simd_block(first: int) -> Lane:
    """Return the SIMD block that starts at lane `first`.

    In plain Python and on a GPU, a block is the single lane `first`.
    """
    return first


def lanes_in_block() -> int:
    """Return the number of lanes in a SIMD block: 1 in plain Python and on a GPU."""
    return 1


def first_lane(lane: Lane) -> int:
    """Return the number of a lane, or of the first lane of a SIMD block."""
    return lane  # type: ignore[no-any-return]


def lanes_of(lane: Lane) -> int:
    """Return the number of lanes of a lane (1) or of a SIMD block."""
    return 1


def get(array: Any, row: int, lane: Lane) -> Value:
    """Return `array[row, lane]`, for one lane or a SIMD block."""
    return array[row, lane]


def put(array: Any, row: int, lane: Lane, value: Value) -> None:
    """Set `array[row, lane]` to `value`, for one lane or a SIMD block."""
    array[row, lane] = value


def clamp(value: Value, limit: np.float32) -> Value:
    """Return `value` limited to [-limit, limit]."""
    return min(max(value, -limit), limit)


def choose(mask: Mask, a: Value, b: Value) -> Value:
    """Return `a` in the lanes where the mask is true, and `b` in the others."""
    return a if mask else b


def any_of(mask: Mask) -> bool:
    """Return whether a mask is true in any lane."""
    return bool(mask)


def negated(mask: Mask) -> Mask:
    """Return the negation of a mask."""
    return not mask


def lookup(table: Any, index: Value) -> Value:
    """Return `table[index]`. The index is a whole number in float32."""
    return table[int(index)]


def square_root(value: Value) -> Value:
    """Return the square root, rounded as in IEEE 754."""
    # Numba compiles `math.sqrt` to a call of libm.
    return math.sqrt(value)


Result = Callable[..., Any]
"""A function from argument types to the result type, or to None for other types."""
Emit = Callable[[Any, Any, Any, Any], Any]
"""A function of context, builder, signature and arguments that emits instructions."""


def _instructions(
    function: Callable[..., Any], result: Result, patterns: list[tuple[Any, ...]], emit: Emit
) -> None:
    """Compile calls of `function` to the instructions of `emit`, for the types of `patterns`."""
    type_callable(function)(lambda context: result)
    for pattern in patterns:
        lower_builtin(function, *pattern)(emit)


def _pointer(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
    """Return the address of `array[row, lane]`, for one lane or a SIMD block."""
    array_type, *kinds = signature.args[:3]
    index_types = (types.intp if kind is BLOCK else kind for kind in kinds)
    indices = zip(index_types, arguments[1:3], strict=True)
    pointer = item_address(context, builder, array_type, arguments[0], indices)
    return builder.bitcast(pointer, _VECTOR.as_pointer()) if BLOCK in kinds else pointer


def _repeated(builder: Any, number: Any) -> Any:
    """Return a vector with the same number in each lane."""
    undefined = ir.Constant(_VECTOR, ir.Undefined)
    single = builder.insert_element(undefined, number, ir.Constant(_WORD, 0))
    return builder.shuffle_vector(
        single, undefined, ir.Constant(ir.VectorType(_WORD, WIDTH), [0] * WIDTH)
    )


def _widened(builder: Any, value: Any) -> Any:
    return value if value.type == _VECTOR else _repeated(builder, value)


def _smaller(builder: Any, a: Any, b: Any) -> Any:
    return builder.select(builder.fcmp_ordered("<", a, b), a, b)


def _larger(builder: Any, a: Any, b: Any) -> Any:
    return builder.select(builder.fcmp_ordered(">", a, b), a, b)


def _block(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
    return cast_to_index(context, builder, arguments[0], signature.args[0])


def _width(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
    return index_constant(context, WIDTH)


_instructions(
    simd_block,
    lambda first: BLOCK if isinstance(first, types.Integer) else None,
    [(types.Integer,)],
    _block,
)
_instructions(lanes_in_block, lambda: types.intp, [()], _width)
_instructions(
    first_lane,
    lambda lane: types.intp if lane is BLOCK else None,
    [(BLOCK,)],
    lambda context, builder, signature, arguments: arguments[0],
)
_instructions(lanes_of, lambda lane: types.intp if lane is BLOCK else None, [(BLOCK,)], _width)


def _get(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
    pointer = _pointer(context, builder, signature, arguments)
    if signature.return_type is not WIDE:
        return load_item(context, builder, signature.return_type, pointer)
    value = builder.load(pointer)
    value.align = 4
    return value


def _put(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
    array_type, _, lane, kind = signature.args
    pointer = _pointer(context, builder, signature, arguments)
    value = arguments[3]
    if lane is BLOCK:
        builder.store(_widened(builder, value), pointer).align = 4
    else:
        store_item(context, builder, array_type.dtype, pointer, value, kind)
    return none_value(context)


def _get_type(array: Any, row: Any, lane: Any) -> Any:
    """Return the type of `get`, or None for a block of an array that is not float32."""
    if lane is BLOCK:
        return WIDE if array.dtype == types.float32 else None
    return array.dtype


def _put_type(array: Any, row: Any, lane: Any, value: Any) -> Any:
    if lane is BLOCK:
        return types.void if array.dtype == types.float32 and value in _VALUES else None
    return types.void if value is not WIDE else None


def _choose_type(mask: Any, a: Any, b: Any) -> Any:
    return WIDE if mask is MASK and a in _VALUES and b in _VALUES else None


_VALUES: Final = (WIDE, types.float32)
_ONE: Final = (types.Array, types.Integer, types.Integer)
_MANY: Final = (types.Array, types.Integer, BLOCK)
_SINGLE: Final = [(*_ONE, types.Number), (*_ONE, types.Boolean)]
_instructions(get, _get_type, [_ONE, _MANY], _get)
_instructions(put, _put_type, [*_SINGLE, (*_MANY, WIDE), (*_MANY, types.float32)], _put)


def _operator(
    symbol: Callable[[Any, Any], Any], result: Any, build: Callable[[Any, Any, Any], Any]
) -> None:
    """Compile an operator on two vectors, or on a vector and a float32."""
    pairs = [(WIDE, WIDE), (WIDE, types.float32), (types.float32, WIDE)]

    def emit(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        return build(builder, *(_widened(builder, argument) for argument in arguments))

    _instructions(symbol, lambda a, b: result if (a, b) in pairs else None, pairs, emit)


def _operator_of_masks(
    symbol: Callable[[Any, Any], Any], build: Callable[[Any, Any, Any], Any]
) -> None:
    def emit(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        return build(builder, *arguments)

    _instructions(
        symbol, lambda a, b: MASK if a is MASK and b is MASK else None, [(MASK, MASK)], emit
    )


_operator(operator.add, WIDE, lambda builder, a, b: builder.fadd(a, b))
_operator(operator.sub, WIDE, lambda builder, a, b: builder.fsub(a, b))
_operator(operator.mul, WIDE, lambda builder, a, b: builder.fmul(a, b))
_operator(operator.truediv, WIDE, lambda builder, a, b: builder.fdiv(a, b))
_operator(operator.lt, MASK, lambda builder, a, b: builder.fcmp_ordered("<", a, b))
_operator(operator.le, MASK, lambda builder, a, b: builder.fcmp_ordered("<=", a, b))
_operator(operator.gt, MASK, lambda builder, a, b: builder.fcmp_ordered(">", a, b))
_operator(operator.ge, MASK, lambda builder, a, b: builder.fcmp_ordered(">=", a, b))
_operator_of_masks(operator.and_, lambda builder, a, b: builder.and_(a, b))
_operator_of_masks(operator.or_, lambda builder, a, b: builder.or_(a, b))


def _magnitude(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
    return call_intrinsic(builder, f"llvm.fabs.v{WIDTH}f32", _VECTOR, arguments)


def _minus(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
    """Flip the sign bits, also of -0.0 and NaN, as IEEE 754 and NumPy do."""
    return builder.fneg(arguments[0])


def _clamp(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
    value, limit = arguments
    lower = _repeated(builder, builder.fneg(limit))
    upper = _repeated(builder, limit)
    return _smaller(builder, _larger(builder, value, lower), upper)


def _choose(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
    mask, a, b = arguments
    return builder.select(mask, _widened(builder, a), _widened(builder, b))


def _any_of(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
    word = builder.bitcast(arguments[0], ir.IntType(WIDTH))
    return builder.icmp_unsigned("!=", word, ir.Constant(ir.IntType(WIDTH), 0))


def _negated(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
    return builder.not_(arguments[0])


def _lookup(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
    data = array_data(context, builder, signature.args[0], arguments[0])
    indices = builder.fptosi(arguments[1], ir.VectorType(_WORD, WIDTH))
    value = ir.Constant(_VECTOR, ir.Undefined)
    for lane in range(WIDTH):
        number = ir.Constant(_WORD, lane)
        entry = builder.load(builder.gep(data, [builder.extract_element(indices, number)]))
        value = builder.insert_element(value, entry, number)
    return value


def _square_root(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
    kind = arguments[0].type
    name = f"llvm.sqrt.v{WIDTH}f32" if kind == _VECTOR else f"llvm.sqrt.{kind.intrinsic_name}"
    return call_intrinsic(builder, name, kind, arguments)


def _is_root(value: Any) -> Any:
    return value if value is WIDE or isinstance(value, types.Float) else None


_CHOICES: Final = [(MASK, a, b) for a in _VALUES for b in _VALUES]
_instructions(abs, lambda value: WIDE if value is WIDE else None, [(WIDE,)], _magnitude)
_instructions(operator.neg, lambda value: WIDE if value is WIDE else None, [(WIDE,)], _minus)
_instructions(
    clamp, lambda value, limit: WIDE if (value, limit) == _VALUES else None, [_VALUES], _clamp
)
_instructions(choose, _choose_type, _CHOICES, _choose)
_instructions(any_of, lambda mask: types.boolean if mask is MASK else None, [(MASK,)], _any_of)
_instructions(negated, lambda mask: MASK if mask is MASK else None, [(MASK,)], _negated)
_instructions(
    lookup, lambda table, index: WIDE if index is WIDE else None, [(types.Array, WIDE)], _lookup
)
_instructions(square_root, _is_root, [(types.Float,), (WIDE,)], _square_root)


# For one lane, the Python functions are compiled.
_OF_ONE_LANE = (clamp, choose, any_of, negated, lookup, first_lane, lanes_of)
for _function in _OF_ONE_LANE:
    overload(_function, strict=False)(
        lambda *types, meaning=_function: None if {WIDE, MASK, BLOCK} & set(types) else meaning
    )

FOR_ONE_LANE: Final = {
    function: function
    for function in (*_OF_ONE_LANE, simd_block, lanes_in_block, get, put, square_root)
}
"""The functions that a GPU compiles, where a thread computes one lane."""
