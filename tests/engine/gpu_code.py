"""Machine code for a GPU, compiled and linked on a machine without one."""

from __future__ import annotations

import struct
from collections import Counter
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any

from baldwinlab.engine.gpu import without_contraction

if TYPE_CHECKING:
    # An environment with the locked versions of the users has no pytest.
    import pytest

# The lowest nine bits of an instruction of 16 bytes, from compute capability 7.0 on.
OPERATIONS = {0x20: "multiply", 0x21: "add", 0x23: "fused multiply-add"}


def use_device(monkeypatch: pytest.MonkeyPatch, compute_capability: tuple[int, int]) -> None:
    """Let numba-cuda compile and link for a device that the machine does not have."""
    device = SimpleNamespace(compute_capability=compute_capability)
    context = SimpleNamespace(device=device)
    monkeypatch.setattr("numba.cuda.dispatcher.get_current_device", lambda: device)
    monkeypatch.setattr("numba.cuda.cudadrv.devices.get_context", lambda: context)
    # After a compilation, the dispatcher loads the code on the device, and so links it before.
    monkeypatch.setattr(
        "numba.cuda.dispatcher._Kernel.bind", lambda self: self._codelibrary.get_cubin()
    )


def count_compilations(monkeypatch: pytest.MonkeyPatch) -> list[None]:
    """Return a list with an entry for each kernel that numba-cuda compiles from now on."""
    from numba.cuda.cudadrv import nvvm

    compilations: list[None] = []
    compile_ir = nvvm.compile_ir

    def count_and_compile(*arguments: Any, **options: Any) -> Any:
        compilations.append(None)
        return compile_ir(*arguments, **options)

    monkeypatch.setattr(nvvm, "compile_ir", count_and_compile)
    return compilations


def compile_kernel(kernel: Any, arguments: tuple[Any, ...]) -> Any:
    """Return the code library of a kernel for the device of the fixture `h200`.

    The options of the kernel are used, which `numba.cuda.compile_ptx` would not do.
    """
    from numba.cuda.dispatcher import _Kernel

    with without_contraction():
        return _Kernel(kernel.py_func, arguments, **kernel.targetoptions)._codelibrary


def count_operations(code: bytes) -> Counter[str]:
    """Return the number of each float32 operation in the machine code of a linked file (ELF)."""
    # The ELF header: address of the section table; size and number of sections; index of the names.
    (table,) = struct.unpack_from("<Q", code, 0x28)
    size, count, names = struct.unpack_from("<HHH", code, 0x3A)
    sections = [struct.unpack_from("<IIQQQQ", code, table + size * i) for i in range(count)]
    first_name = sections[names][4]
    instructions = [
        struct.unpack_from("<H", code, address)[0] & 0x1FF
        for name, *_, start, length in sections
        if code[first_name + name :].startswith(b".text.")
        for address in range(start, start + length, 16)
    ]
    return Counter(OPERATIONS[number] for number in instructions if number in OPERATIONS)
