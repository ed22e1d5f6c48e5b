"""Types, data models and LLVM instructions, for modules that emit instructions themselves.

`reference.py`, `simd.py` and `atomics.py` are such modules. A function of this module that emits
instructions takes Numba's lowering context and LLVM's builder first. `kind` is a type of Numba.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from llvmlite import ir
from numba import types
from numba.core import cgutils as cgutils
from numba.core.datamodel import default_manager
from numba.core.types.containers import BaseNamedTuple as BaseNamedTuple
from numba.core.types.containers import BaseTuple as BaseTuple
from numba.core.typing.templates import AttributeTemplate as AttributeTemplate
from numba.extending import infer_getattr as infer_getattr
from numba.extending import lower_getattr_generic as lower_getattr_generic


def named_tuple_class(kind: Any) -> Any:
    """Return the Python class of a type of named tuples."""
    return kind.instance_class


def data_type(kind: Any) -> Any:
    """Return the LLVM type of a value of the Numba type `kind` in memory."""
    return default_manager.lookup(kind).get_data_type()


def index_type() -> Any:
    """Return LLVM's type of an index."""
    return default_manager.lookup(types.intp).get_value_type()


def index_constant(context: Any, number: int) -> Any:
    """Return a constant index."""
    return context.get_constant(types.intp, number)


def cast_to_index(context: Any, builder: Any, value: Any, kind: Any) -> Any:
    """Return an integer of a type as an index."""
    return context.cast(builder, value, kind, types.intp)


def none_value(context: Any) -> Any:
    """Return Python's None."""
    return context.get_dummy_value()


def array_data(context: Any, builder: Any, kind: Any, array: Any) -> Any:
    """Return the address of an array's first item."""
    return context.make_array(kind)(context, builder, array).data


def item_address(
    context: Any,
    builder: Any,
    kind: Any,
    array: Any,
    indices: Iterable[tuple[Any, Any]],
) -> Any:
    """Return the address of an item of an array. `indices` has pairs of a type and a value."""
    structure = context.make_array(kind)(context, builder, array)
    numbers = [cast_to_index(context, builder, value, of) for of, value in indices]
    # `wraparound=False`: a negative index does not count from the end.
    return cgutils.get_item_pointer(context, builder, kind, structure, numbers, wraparound=False)


def load_item(context: Any, builder: Any, kind: Any, address: Any) -> Any:
    """Return the item of an array at an address."""
    return context.unpack_value(builder, kind, address)


def store_item(
    context: Any,
    builder: Any,
    kind: Any,
    address: Any,
    value: Any,
    value_kind: Any,
) -> None:
    """Store a value at the address of an item of an array."""
    context.pack_value(builder, kind, context.cast(builder, value, value_kind, kind), address)


def load_value(context: Any, builder: Any, kind: Any, address: Any) -> Any:
    """Return the value at an address, in the memory layout of the data model of `kind`."""
    return context.data_model_manager[kind].load_from_data_pointer(builder, address)


def spill_value(context: Any, builder: Any, kind: Any, value: Any) -> Any:
    """Store a value of a type on the stack, and return its address."""
    data = context.data_model_manager[kind].as_data(builder, value)
    return cgutils.alloca_once_value(builder, data)


def make_tuple(context: Any, builder: Any, kind: Any, values: list[Any]) -> Any:
    """Return a tuple of a type."""
    return context.make_tuple(builder, kind, values)


def call_intrinsic(builder: Any, name: str, kind: Any, arguments: Any) -> Any:
    """Call an intrinsic of LLVM with an argument and a result of the type `kind`."""
    return call_function(builder, name, ir.FunctionType(kind, [kind]), arguments)


def call_function(builder: Any, name: str, function_type: Any, arguments: Any) -> Any:
    """Call an intrinsic of LLVM, or a function of the libraries of the process, by its name."""
    function = cgutils.get_or_insert_function(builder.module, function_type, name)
    return builder.call(function, arguments)


def define_plain_function(name: str, symbol: str, count: int) -> str:
    """Return LLVM code of a function that takes `count` addresses and calls a compiled function.

    A function compiled by Numba returns a status. Its first two arguments are the address of the
    result and the address of the description of an exception.
    """
    parameters = ", ".join(f"ptr %a{number}" for number in range(count))
    arguments = ", ".join(["ptr %result", "ptr %fault", parameters])
    return f"""
define void @{name}({parameters}) {{
  %result = alloca ptr
  %fault = alloca ptr
  %status = call i32 @"{symbol}"({arguments})
  ret void
}}
"""
