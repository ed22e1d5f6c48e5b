"""Machine code for a GPU, compiled and linked on a machine without one."""

from __future__ import annotations

import struct
from collections import Counter
from typing import Any

from baldwinlab.engine.gpu import without_contraction

# The lowest nine bits of an instruction of 16 bytes, from compute capability 7.0 on.
OPERATIONS = {0x20: "multiply", 0x21: "add", 0x23: "fused multiply-add"}


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
