"""Sixteen agents at a time: the arithmetic of networks on bundles of lanes.

A *lane* is one agent's column in an array [row, lane]. `get` and `put` take either one lane (an integer; the value is a
float32) or a *bundle* of sixteen neighbouring lanes (`bundle(first)`; the value is a vector of sixteen float32). All other
operations read the same for both, so a network is written once, as if for one agent, and compiled for sixteen: the compiler
keeps sums in registers, which its own vectoriser did not manage (37 ns a learning step against 10 ns).

The same serves an agent that looks at sixteen items at a time: then a lane is an item. Comparisons make *masks*, which `&` and
`|` join; `any_of` asks whether a mask is true anywhere.

Every operation is elementwise and IEEE, in the order written: a lane has the same bits alone and in a bundle.
"""

from __future__ import annotations

import math
import operator
from collections.abc import Callable
from typing import Any, Final

import numpy as np
from llvmlite import ir
from numba.core import cgutils, types
from numba.extending import intrinsic, models, overload, register_model

WIDTH: Final = 16  # lanes in a bundle: one AVX-512 register of float32; narrower machines use several registers

Lane = Any  # an integer, or a bundle of lanes
Value = Any  # a float32, or one for each lane of a bundle

Mask = Any  # a truth value, or one for each lane of a bundle

_VECTOR = ir.VectorType(ir.FloatType(), WIDTH)
_BITS = ir.VectorType(ir.IntType(1), WIDTH)


class BundleType(types.Type):
    """The first of sixteen neighbouring lanes."""

    def __init__(self) -> None:
        super().__init__("bundle")


class WideType(types.Type):
    """Sixteen float32 values."""

    def __init__(self) -> None:
        super().__init__("wide")


class MaskType(types.Type):
    """Sixteen truth values."""

    def __init__(self) -> None:
        super().__init__("mask")


BUNDLE, WIDE, MASK = BundleType(), WideType(), MaskType()


@register_model(BundleType)
class _BundleModel(models.PrimitiveModel):  # type: ignore[misc]
    def __init__(self, manager: Any, kind: Any) -> None:
        super().__init__(manager, kind, manager.lookup(types.intp).get_value_type())


@register_model(WideType)
class _WideModel(models.PrimitiveModel):  # type: ignore[misc]
    def __init__(self, manager: Any, kind: Any) -> None:
        super().__init__(manager, kind, _VECTOR)


@register_model(MaskType)
class _MaskModel(models.PrimitiveModel):  # type: ignore[misc]
    def __init__(self, manager: Any, kind: Any) -> None:
        super().__init__(manager, kind, _BITS)


@intrinsic
def _sixteen_from(typing_context, first):  # type: ignore[no-untyped-def]
    return BUNDLE(types.intp), lambda context, builder, signature, arguments: arguments[0]


def bundle(first: int) -> Lane:
    """The bundle that begins with a lane; where a bundle is a single lane (`lanes_in_bundle`), that lane."""
    return first


@overload(bundle, target="cpu")
def _bundle(first):  # type: ignore[no-untyped-def]
    return lambda first: _sixteen_from(first)


def _pointer(context: Any, builder: Any, array_type: Any, array: Any, indices: list[Any]) -> Any:
    structure = context.make_array(array_type)(context, builder, array)
    pointer = cgutils.get_item_pointer(context, builder, array_type, structure, indices, wraparound=False)
    return builder.bitcast(pointer, _VECTOR.as_pointer())


@intrinsic
def _load(typing_context, array, row, lane):  # type: ignore[no-untyped-def]
    def generate(context, builder, signature, arguments):  # type: ignore[no-untyped-def]
        value = builder.load(_pointer(context, builder, signature.args[0], arguments[0], arguments[1:]))
        value.align = 4
        return value

    return WIDE(array, types.intp, BUNDLE), generate


@intrinsic
def _store(typing_context, array, row, lane, value):  # type: ignore[no-untyped-def]
    def generate(context, builder, signature, arguments):  # type: ignore[no-untyped-def]
        pointer = _pointer(context, builder, signature.args[0], arguments[0], arguments[1:3])
        builder.store(arguments[3], pointer).align = 4
        return context.get_dummy_value()

    return types.void(array, types.intp, BUNDLE, WIDE), generate


@intrinsic
def _repeat(typing_context, value):  # type: ignore[no-untyped-def]
    def generate(context, builder, signature, arguments):  # type: ignore[no-untyped-def]
        undefined = ir.Constant(_VECTOR, ir.Undefined)
        single = builder.insert_element(undefined, arguments[0], ir.Constant(ir.IntType(32), 0))
        return builder.shuffle_vector(single, undefined, ir.Constant(ir.VectorType(ir.IntType(32), WIDTH), [0] * WIDTH))

    return WIDE(types.float32), generate


def _elementwise(operand: Any, result: Any, build: Callable[[Any, Any, Any], Any]) -> Any:
    """An operation operand x operand -> result from the function that emits its instructions."""

    @intrinsic
    def operation(typing_context, a, b):  # type: ignore[no-untyped-def]
        return result(operand, operand), lambda context, builder, signature, arguments: build(builder, *arguments)

    return operation


def _overload_on_values(symbol: Callable[[Any, Any], Any], result: Any, build: Callable[[Any, Any, Any], Any]) -> None:
    """Let an operator work on two bundles' values, or on a bundle's values and one float32."""
    operation = _elementwise(WIDE, result, build)

    @overload(symbol)
    def implement(a, b):  # type: ignore[no-untyped-def]
        if a is WIDE and b is WIDE:
            return lambda a, b: operation(a, b)
        if a is WIDE and b is types.float32:
            return lambda a, b: operation(a, _repeat(b))
        if a is types.float32 and b is WIDE:
            return lambda a, b: operation(_repeat(a), b)
        return None


def _overload_on_masks(symbol: Callable[[Any, Any], Any], build: Callable[[Any, Any, Any], Any]) -> None:
    operation = _elementwise(MASK, MASK, build)

    @overload(symbol)
    def implement(a, b):  # type: ignore[no-untyped-def]
        return (lambda a, b: operation(a, b)) if a is MASK and b is MASK else None


_overload_on_values(operator.add, WIDE, lambda builder, a, b: builder.fadd(a, b))
_overload_on_values(operator.sub, WIDE, lambda builder, a, b: builder.fsub(a, b))
_overload_on_values(operator.mul, WIDE, lambda builder, a, b: builder.fmul(a, b))
_overload_on_values(operator.truediv, WIDE, lambda builder, a, b: builder.fdiv(a, b))
_overload_on_values(operator.lt, MASK, lambda builder, a, b: builder.fcmp_ordered("<", a, b))
_overload_on_values(operator.le, MASK, lambda builder, a, b: builder.fcmp_ordered("<=", a, b))
_overload_on_values(operator.gt, MASK, lambda builder, a, b: builder.fcmp_ordered(">", a, b))
_overload_on_values(operator.ge, MASK, lambda builder, a, b: builder.fcmp_ordered(">=", a, b))
_overload_on_masks(operator.and_, lambda builder, a, b: builder.and_(a, b))
_overload_on_masks(operator.or_, lambda builder, a, b: builder.or_(a, b))

_smaller = _elementwise(WIDE, WIDE, lambda builder, a, b: builder.select(builder.fcmp_ordered("<", a, b), a, b))
_larger = _elementwise(WIDE, WIDE, lambda builder, a, b: builder.select(builder.fcmp_ordered(">", a, b), a, b))


@intrinsic
def _choose(typing_context, mask, a, b):  # type: ignore[no-untyped-def]
    return WIDE(MASK, WIDE, WIDE), lambda context, builder, signature, arguments: builder.select(*arguments)


@intrinsic
def _gather(typing_context, table, index):  # type: ignore[no-untyped-def]
    def generate(context, builder, signature, arguments):  # type: ignore[no-untyped-def]
        structure = context.make_array(signature.args[0])(context, builder, arguments[0])
        whole = builder.fptosi(arguments[1], ir.VectorType(ir.IntType(32), WIDTH))
        value = ir.Constant(_VECTOR, ir.Undefined)
        for lane in range(WIDTH):
            number = ir.Constant(ir.IntType(32), lane)
            entry = builder.load(builder.gep(structure.data, [builder.extract_element(whole, number)]))
            value = builder.insert_element(value, entry, number)
        return value

    return WIDE(table, WIDE), generate


@intrinsic
def _any(typing_context, mask):  # type: ignore[no-untyped-def]
    def generate(context, builder, signature, arguments):  # type: ignore[no-untyped-def]
        word = builder.bitcast(arguments[0], ir.IntType(WIDTH))
        return builder.icmp_unsigned("!=", word, ir.Constant(ir.IntType(WIDTH), 0))

    return types.boolean(MASK), generate


@intrinsic
def _root(typing_context, value):  # type: ignore[no-untyped-def]
    def generate(context, builder, signature, arguments):  # type: ignore[no-untyped-def]
        instruction = builder.module.declare_intrinsic("llvm.sqrt", [arguments[0].type])
        return builder.call(instruction, arguments)

    return value(value), generate


def lanes_in_bundle() -> int:
    """Sixteen; where a bundle is a single lane (in plain Python, and on a GPU, for a thread has but one), one."""
    return 1


def get(array: Any, row: int, lane: Lane) -> Value:
    """`array[row, lane]`, for a lane or a bundle."""
    return array[row, lane]


def put(array: Any, row: int, lane: Lane, value: Value) -> None:
    """`array[row, lane] = value`, for a lane or a bundle."""
    array[row, lane] = value


def clamp(value: Value, limit: np.float32) -> Value:
    """`value`, but no further from 0 than `limit`."""
    return min(max(value, -limit), limit)


def choose(mask: Mask, a: Value, b: Value) -> Value:
    """`a` where the mask is true, else `b`."""
    return a if mask else b


def any_of(mask: Mask) -> bool:
    """Whether a mask is true anywhere."""
    return bool(mask)


def negated(mask: Mask) -> Mask:
    """True where the mask is not."""
    return not mask


def square_root(value: Value) -> Value:
    """As IEEE 754 rounds it, of a number or of a bundle's: Numba makes a call to libm of `math.sqrt`."""
    return math.sqrt(value)


@overload(square_root, target="cpu", inline="always")
def _square_root(value):  # type: ignore[no-untyped-def]
    return lambda value: _root(value)


@overload(lanes_in_bundle, target="cpu")
def _lanes_in_bundle():  # type: ignore[no-untyped-def]
    return lambda: WIDTH


@overload(get, inline="always")
def _get(array, row, lane):  # type: ignore[no-untyped-def]
    if lane is BUNDLE:
        return lambda array, row, lane: _load(array, row, lane)
    return lambda array, row, lane: array[row, lane]


@overload(put, inline="always")
def _put(array, row, lane, value):  # type: ignore[no-untyped-def]
    if lane is BUNDLE and value is WIDE:
        return lambda array, row, lane, value: _store(array, row, lane, value)
    if lane is BUNDLE:
        return lambda array, row, lane, value: _store(array, row, lane, _repeat(value))

    def store(array, row, lane, value):  # type: ignore[no-untyped-def]
        array[row, lane] = value

    return store


@overload(clamp)
def _clamp(value, limit):  # type: ignore[no-untyped-def]
    if value is WIDE:
        return lambda value, limit: _smaller(_larger(value, _repeat(-limit)), _repeat(limit))
    return lambda value, limit: min(max(value, -limit), limit)


def _widen(value: Value) -> Value:
    """`value` for each lane of a bundle."""
    return value


@overload(_widen)
def _widen_value(value):  # type: ignore[no-untyped-def]
    return (lambda value: value) if value is WIDE else (lambda value: _repeat(value))


def lookup(table: Any, index: Value) -> Value:
    """`table[index]`, where the index is a whole number held as a float32."""
    return table[int(index)]


@overload(lookup)
def _lookup(table, index):  # type: ignore[no-untyped-def]
    if index is WIDE:
        return lambda table, index: _gather(table, index)
    return lambda table, index: table[int(index)]


@overload(choose)
def _choose_for_lanes(mask, a, b):  # type: ignore[no-untyped-def]
    if mask is MASK:
        return lambda mask, a, b: _choose(mask, _widen(a), _widen(b))
    return lambda mask, a, b: a if mask else b


@overload(any_of)
def _any_of(mask):  # type: ignore[no-untyped-def]
    if mask is MASK:
        return lambda mask: _any(mask)
    return lambda mask: mask


@intrinsic
def _not(typing_context, mask):  # type: ignore[no-untyped-def]
    return MASK(MASK), lambda context, builder, signature, arguments: builder.not_(arguments[0])


@overload(negated)
def _negated(mask):  # type: ignore[no-untyped-def]
    if mask is MASK:
        return lambda mask: _not(mask)
    return lambda mask: not mask


@overload(abs)
def _magnitude(value):  # type: ignore[no-untyped-def]
    return (lambda value: _larger(value, _repeat(np.float32(0)) - value)) if value is WIDE else None


# What a GPU compiles, where a thread has a lane to itself: the functions as they stand in Python.
_SAME = (bundle, lanes_in_bundle, get, put, clamp, choose, any_of, negated, lookup, square_root)
FOR_ONE_LANE: Final = {each: each for each in _SAME}
