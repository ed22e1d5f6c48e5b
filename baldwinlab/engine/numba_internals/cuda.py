"""The compilation for a GPU, by numba-cuda. Only for machines where that package is installed."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from numba.cuda import cgutils, types
from numba.cuda.core import config
from numba.cuda.cudadrv import nvvm
from numba.cuda.extending import intrinsic
from numba.cuda.extending import overload as overload

config.CUDA_LOW_OCCUPANCY_WARNINGS = 0  # a study of a few runs has few threads


@contextmanager
def without_contraction() -> Iterator[None]:
    """Compile without fused multiply-adds, which NVVM emits and numba-cuda cannot switch off."""
    compile_ir = nvvm.compile_ir
    nvvm.compile_ir = lambda code, **options: compile_ir(code, **(options | {"fma": False}))
    try:
        yield
    finally:
        nvvm.compile_ir = compile_ir


@intrinsic
def any_lane(typing_context, array, lanes):  # type: ignore[no-untyped-def]
    """Return a view [row, lane] of an array [row, 1], with the same values in all lanes."""
    view = array.copy(layout="A")

    def generate(context, builder, signature, arguments):  # type: ignore[no-untyped-def]
        source = context.make_array(array)(context, builder, arguments[0])
        result = context.make_array(view)(context, builder)
        rows = cgutils.unpack_tuple(builder, source.strides)[0]
        strides = [rows, context.get_constant(types.intp, 0)]
        context.populate_array(
            result,
            data=source.data,
            shape=source.shape,
            strides=strides,
            itemsize=source.itemsize,
            meminfo=None,
        )
        return result._getvalue()

    return view(array, lanes), generate
