"""Load memory into the processor's cache before it is read."""

from __future__ import annotations

from typing import Any

from llvmlite import ir
from numba import types
from numba.extending import lower_builtin, type_callable

from baldwinlab.engine.numba_internals.lowering import call_function, item_address, none_value


def prefetch(array: Any, row: int, column: int) -> None:
    """Load the cache line of `array[row, column]`. The item need not exist.

    Plain Python does nothing.
    """


def _emit_prefetch(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
    array_type, row_type, column_type = signature.args
    array, row, column = arguments
    indices = [(row_type, row), (column_type, column)]
    address = item_address(context, builder, array_type, array, indices)
    byte_pointer, int32 = ir.IntType(8).as_pointer(), ir.IntType(32)
    # The line is read, should be in all levels of the cache, and contains data.
    is_write, locality, is_data = (ir.Constant(int32, number) for number in (0, 3, 1))
    address = builder.bitcast(address, byte_pointer)
    arguments = [address, is_write, locality, is_data]
    function_type = ir.FunctionType(ir.VoidType(), [byte_pointer, int32, int32, int32])
    call_function(builder, "llvm.prefetch.p0", function_type, arguments)
    return none_value(context)


type_callable(prefetch)(
    lambda context: lambda array, row, column: types.void if array.ndim == 2 else None
)
lower_builtin(prefetch, types.Array, types.Integer, types.Integer)(_emit_prefetch)
