"""The compilation for a GPU, by numba-cuda. Only for machines where that package is installed."""

from __future__ import annotations

import hashlib
import pickle
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from importlib.metadata import version
from typing import Any

from numba.cuda import cgutils, types
from numba.cuda.codegen import CUDACodeLibrary
from numba.cuda.core import config
from numba.cuda.cudadrv import nvvm
from numba.cuda.dispatcher import _Kernel
from numba.cuda.extending import intrinsic
from numba.cuda.extending import overload as overload
from numba.cuda.serialize import dumps

from baldwinlab.engine.numba_internals.dispatchers import CodeStore, find_argument_types

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


class KernelStore:
    """The cache of the dispatcher of a kernel. The dispatcher calls it; `files` reads and writes.

    Only the machine code is stored. The LLVM code and PTX of a kernel are fifty times as large.
    """

    def __init__(self, files: CodeStore, options: dict[str, Any]) -> None:
        """Store the arguments. `options` are the options of the compilation."""
        self._files = files
        self._options = options

    def load_overload(self, signature: Any, context: Any) -> _Kernel | None:
        """Return the kernel of a signature, or None if no usable code is stored."""
        key = self._key(signature, context.codegen())
        content = self._files.read(key)
        kernel = content and _rebuild_kernel(content, signature)
        if content and not kernel:
            self._files.discard(key)
        return kernel or None

    def save_overload(self, signature: Any, kernel: _Kernel) -> None:
        """Store a kernel."""
        fields = kernel._reduce_states()
        library = fields.pop("codelibrary")._reduce_states()
        library |= {"llvm_strs": [], "ptx_cache": {}}
        self._files.write(self._key(signature, kernel.codegen), dumps((fields, library)))

    def _key(self, signature: Any, codegen: Any) -> str:
        """Return a hash of a signature, the options, the versions and the compute capability."""
        # The tuple has the version of the toolkit and the compute capability.
        values = (signature, self._options, version("numba-cuda"), codegen.magic_tuple())
        return hashlib.sha256(repr(values).encode()).hexdigest()[:32]


def _rebuild_kernel(content: bytes, signature: Any) -> _Kernel | None:
    """Return the kernel in a pickle, or None if it is damaged or not of `signature`."""
    try:
        fields, library = pickle.loads(content)
        kernel = _Kernel._rebuild(**fields, codelibrary=CUDACodeLibrary._rebuild(**library))
    except Exception:  # other bytes than a pickle can raise anything
        return None
    return kernel if tuple(kernel.signature.args) == tuple(signature) else None


def compile_kernel(
    kernel: Any, store: CodeStore | None, launch: tuple[Any, ...], arguments: tuple[Any, ...]
) -> Callable[..., None]:
    """Compile a kernel for the types of given arguments, or load its code from a store.

    `launch`: number of blocks, number of threads in a block, and stream. Returns the function that
    launches the kernel, which returns before the kernel ends.
    """
    if store:
        kernel._cache = KernelStore(store, kernel.targetoptions)
    compiled = kernel.compile(find_argument_types(kernel, arguments))
    configuration = kernel.configure(*launch)
    place = (configuration.griddim, configuration.blockdim, configuration.stream)
    # The dispatcher would compute the types of the sixty arrays of a state at every launch.
    return lambda *arguments: compiled.launch(arguments, *place)


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
