"""Sixteen agents at a time: the arithmetic of networks on bundles of lanes.

A *lane* is one agent's column in an array [row, lane]. `get` and `put` take either one lane (an integer; the value is a
float32) or a *bundle* of sixteen neighbouring lanes (`bundle(first)`; the value is a vector of sixteen float32). All other
operations read the same for both, so a network is written once, as if for one agent, and compiled for sixteen: the compiler
keeps sums in registers, which its own vectoriser did not manage (37 ns a learning step against 10 ns).

The same serves an agent that looks at sixteen items at a time: then a lane is an item. Comparisons make *masks*, which `&` and
`|` join; `any_of` asks whether a mask is true anywhere.

Every operation is elementwise and IEEE, in the order written: a lane has the same bits alone and in a bundle. In compiled code
it is its own few instructions where it stands: a function for each would take as long to compile as the rest of the step.
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
"""Lanes in a bundle: one AVX-512 register of float32, and narrower machines use several; for browsers, wasm.py asks for 4."""

Lane = Any  # an integer, or a bundle of lanes
Value = Any  # a float32, or one for each lane of a bundle

Mask = Any  # a truth value, or one for each lane of a bundle

_VECTOR = ir.VectorType(ir.FloatType(), WIDTH)
_BITS = ir.VectorType(ir.IntType(1), WIDTH)
_WORD = ir.IntType(32)


class BundleType(types.Type):  # type: ignore[misc]
    """The first of sixteen neighbouring lanes."""

    def __init__(self) -> None:
        super().__init__("bundle")


class WideType(types.Type):  # type: ignore[misc]
    """Sixteen float32 values."""

    def __init__(self) -> None:
        super().__init__("wide")


class MaskType(types.Type):  # type: ignore[misc]
    """Sixteen truth values."""

    def __init__(self) -> None:
        super().__init__("mask")


BUNDLE, WIDE, MASK = BundleType(), WideType(), MaskType()


@register_model(BundleType)
class _BundleModel(models.PrimitiveModel):  # type: ignore[misc]
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


def bundle(first: int) -> Lane:
    """Return the SIMD block that starts at lane `first`.

    In plain Python and on a GPU, a block is the single lane `first`.
    """
    return first


def lanes_in_bundle() -> int:
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
    """As IEEE 754 rounds it, of a number or of a bundle's: Numba makes a call to libm of `math.sqrt`."""
    return math.sqrt(value)


Result = Callable[
    ..., Any
]  # from the types of the arguments to that of what comes out, None where they do not fit
Emit = Callable[
    [Any, Any, Any, Any], Any
]  # instructions: from a context, a builder, the signature and the arguments


def _instructions(
    function: Callable[..., Any], result: Result, patterns: list[tuple[Any, ...]], emit: Emit
) -> None:
    """Let compiled code do `function` by the instructions of `emit`, for arguments of these types."""
    type_callable(function)(lambda context: result)
    for pattern in patterns:
        lower_builtin(function, *pattern)(emit)


def _pointer(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
    """Where `array[row, lane]` lies, for an array, a row and a lane or a bundle."""
    array_type, *kinds = signature.args[:3]
    index_types = (types.intp if kind is BUNDLE else kind for kind in kinds)
    indices = zip(index_types, arguments[1:3], strict=True)
    pointer = item_address(context, builder, array_type, arguments[0], indices)
    return builder.bitcast(pointer, _VECTOR.as_pointer()) if BUNDLE in kinds else pointer


def _repeated(builder: Any, number: Any) -> Any:
    """A number for each lane of a bundle."""
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


def _bundle(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
    return cast_to_index(context, builder, arguments[0], signature.args[0])


def _width(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
    return index_constant(context, WIDTH)


_instructions(
    bundle,
    lambda first: BUNDLE if isinstance(first, types.Integer) else None,
    [(types.Integer,)],
    _bundle,
)
_instructions(lanes_in_bundle, lambda: types.intp, [()], _width)
_instructions(
    first_lane,
    lambda lane: types.intp if lane is BUNDLE else None,
    [(BUNDLE,)],
    lambda *known: known[3][0],
)
_instructions(lanes_of, lambda lane: types.intp if lane is BUNDLE else None, [(BUNDLE,)], _width)


def _get(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
    pointer = _pointer(context, builder, signature, arguments)
    if signature.return_type is not WIDE:
        return load_item(context, builder, signature.return_type, pointer)
    value = builder.load(pointer)
    value.align = 4
    return value


def _put(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
    array_type, _, lane, kind = signature.args
    pointer, value = _pointer(context, builder, signature, arguments), arguments[3]
    if lane is BUNDLE:
        builder.store(_widened(builder, value), pointer).align = 4
    else:
        store_item(context, builder, array_type.dtype, pointer, value, kind)
    return none_value(context)


def _get_type(array: Any, row: Any, lane: Any) -> Any:
    """A block is loaded as float32, so an array of another type is refused rather than misread."""
    if lane is BUNDLE:
        return WIDE if array.dtype == types.float32 else None
    return array.dtype


def _put_type(array: Any, row: Any, lane: Any, value: Any) -> Any:
    if lane is BUNDLE:
        return types.void if array.dtype == types.float32 and value in _VALUES else None
    return types.void if value is not WIDE else None


def _choose_type(mask: Any, a: Any, b: Any) -> Any:
    return WIDE if mask is MASK and a in _VALUES and b in _VALUES else None


_VALUES: Final = (WIDE, types.float32)
_ONE: Final = (types.Array, types.Integer, types.Integer)
_MANY: Final = (types.Array, types.Integer, BUNDLE)
_SINGLE: Final = [(*_ONE, types.Number), (*_ONE, types.Boolean)]
_instructions(get, _get_type, [_ONE, _MANY], _get)
_instructions(put, _put_type, [*_SINGLE, (*_MANY, WIDE), (*_MANY, types.float32)], _put)


def _operator(
    symbol: Callable[[Any, Any], Any], result: Any, build: Callable[[Any, Any, Any], Any]
) -> None:
    """Let an operator work on two bundles' values, or on a bundle's values and one float32."""
    pairs = [(WIDE, WIDE), (WIDE, types.float32), (types.float32, WIDE)]

    def emit(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        return build(builder, *(_widened(builder, each) for each in arguments))

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
    """Flip the sign bits: -0.0 and NaN too, as IEEE 754 and NumPy do."""
    return builder.fneg(arguments[0])


def _clamp(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
    value, limit = arguments
    return _smaller(
        builder,
        _larger(builder, value, _repeated(builder, builder.fneg(limit))),
        _repeated(builder, limit),
    )


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
    whole = builder.fptosi(arguments[1], ir.VectorType(_WORD, WIDTH))
    value = ir.Constant(_VECTOR, ir.Undefined)
    for lane in range(WIDTH):
        number = ir.Constant(_WORD, lane)
        entry = builder.load(builder.gep(data, [builder.extract_element(whole, number)]))
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


# Where a lane is by itself: the functions as they stand in Python.
_OF_ONE_LANE = (clamp, choose, any_of, negated, lookup, first_lane, lanes_of)
for _function in _OF_ONE_LANE:
    overload(_function, strict=False)(
        lambda *types, meaning=_function: None if {WIDE, MASK, BUNDLE} & set(types) else meaning
    )

FOR_ONE_LANE: Final = {
    each: each for each in (*_OF_ONE_LANE, bundle, lanes_in_bundle, get, put, square_root)
}
"""What a GPU compiles, where a thread has a lane to itself."""
