"""Compile functions to a WebAssembly module for browsers.

The WebAssembly module executes the same floating-point instructions as the compiled code of this
machine, so the results are bit-identical. Numba generates LLVM code for this machine. The functions
below change the target of this code to WebAssembly and then optimize it. An entry point takes
addresses of named tuples (`reference.py`) and returns nothing. The WebAssembly module imports only
its memory.

The function `compile_in_subprocess` starts a new process without cached code for two reasons. A
function from Numba's cache has no LLVM code. A SIMD block has fewer lanes in a browser.
"""

from __future__ import annotations

import json
import os
import re
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator, Mapping, Sequence
from importlib.util import find_spec
from pathlib import Path
from typing import Any, Final

import llvmlite.binding as llvm
import numba
from llvmlite import ir
from numba import types

from baldwinlab.core.errors import RefusedError
from baldwinlab.core.extras import missing_extra_error
from baldwinlab.engine.jit import OPTIONS
from baldwinlab.engine.numba_internals.dispatchers import UNWRAPPED, compile_to_llvm
from baldwinlab.engine.numba_internals.lowering import (
    BaseNamedTuple,
    BaseTuple,
    data_type,
    define_plain_function,
)
from baldwinlab.engine.numba_internals.pipeline import make_pass_builder, unrolling
from baldwinlab.engine.reference import Reference

TARGET_TRIPLE: Final = "wasm32-unknown-unknown"
TARGET_FEATURES: Final = "+simd128,+bulk-memory,+sign-ext,+nontrapping-fptoint,+mutable-globals"
N_LANES: Final = 4
"""Number of float32 lanes in a SIMD register of WebAssembly, for `compile_in_subprocess`."""
OPTIMIZATION_LEVEL: Final = 3
MAX_REASON_LENGTH: Final = 500
# Versions of LLVM in names such as `wasm-ld-18`, the newest first: 22 to 14.
WASM_LD_VERSIONS: Final = range(22, 13, -1)
STACK_BYTES: Final = 256 * 1024
INTRINSIC_BY_FUNCTION: Final = {"floorf": "llvm.floor.f32", "floor": "llvm.floor.f64"}
"""LLVM intrinsic that replaces a function of libm. The two have the same, exact results."""

Entry = tuple[Callable[..., Any], Sequence[Any]]
"""A function and the types of its arguments. Arguments are passed by address."""


def module(entries: Mapping[str, Entry]) -> bytes:
    """Compile a WebAssembly module that exports functions. Raise RefusedError without a linker."""
    linker = find_linker()
    machine = _make_target_machine()
    linked_module: Any = None
    for name, (function, arguments) in entries.items():
        text, symbol = _compile(function, arguments)
        unit = llvm.parse_assembly(_retarget(text, symbol, name, len(arguments), machine))
        # Two entry points may call the same function. Internal linkage avoids duplicate symbols.
        for item in (*unit.functions, *unit.global_variables):
            if not item.is_declaration and item.name != name:
                item.linkage = "internal"
        if linked_module is None:
            linked_module = unit
        else:
            linked_module.link_in(unit)
    # The builder copies the setting of `unrolling`, so it is made within the block.
    with unrolling(False):
        builder = make_pass_builder(machine, OPTIMIZATION_LEVEL)
    builder.getModulePassManager().run(linked_module, builder)
    linked_module.verify()
    return _link(linker, machine.emit_object(linked_module), entries)


def _make_target_machine() -> Any:
    llvm.initialize_all_targets()
    llvm.initialize_all_asmprinters()
    return llvm.Target.from_triple(TARGET_TRIPLE).create_target_machine(
        features=TARGET_FEATURES, opt=OPTIMIZATION_LEVEL
    )


def _compile(function: Callable[..., Any], arguments: Sequence[Any]) -> tuple[str, str]:
    """Return (LLVM code of a function before optimization, name of the function in this code)."""
    dispatcher = numba.njit(**UNWRAPPED, **OPTIONS)(function)
    return compile_to_llvm(dispatcher, types.void(*map(Reference, arguments)))


def _retarget(text: str, symbol: str, name: str, n_arguments: int, machine: Any) -> str:
    """Return LLVM code for WebAssembly, in which `name` passes `n_arguments` to `symbol`."""
    text = re.sub(
        r'(?m)^target datalayout = ".*"$', f'target datalayout = "{machine.target_data}"', text
    )
    text = re.sub(r'(?m)^target triple = ".*"$', f'target triple = "{TARGET_TRIPLE}"', text)
    # WebAssembly has no symbols with common linkage.
    text = text.replace(" common ", " ")
    for function, instruction in INTRINSIC_BY_FUNCTION.items():
        text = text.replace(f"@{function}(", f"@{instruction}(")
    return text + define_plain_function(name, symbol, n_arguments)


def find_linker() -> list[str]:
    """Return the command that links WebAssembly. Raise RefusedError if no linker is installed."""
    for name in ("wasm-ld", *(f"wasm-ld-{version}" for version in WASM_LD_VERSIONS)):
        if path := shutil.which(name):
            return [path]
    if find_spec("ziglang"):
        return [sys.executable, "-m", "ziglang", "wasm-ld"]
    raise missing_extra_error("wasm", "the export of a custom part")


def _link(linker: list[str], code: bytes, exported: Mapping[str, Any]) -> bytes:
    with tempfile.TemporaryDirectory() as folder:
        source = Path(folder) / "code.o"
        target = Path(folder) / "module.wasm"
        source.write_bytes(code)
        options = [
            "--no-entry",
            "--import-memory",
            "--strip-all",
            "--stack-first",
            "-z",
            f"stack-size={STACK_BYTES}",
        ]
        # The linker defines `__heap_base`, the address of the first free byte.
        names = [f"--export={name}" for name in (*exported, "__heap_base")]
        command = [*linker, *options, *names, "-o", str(target), str(source)]
        result = subprocess.run(command, capture_output=True, text=True)
        if result.returncode:
            reason = " ".join(result.stderr.split())[:MAX_REASON_LENGTH]
            raise RefusedError(f"the linker for WebAssembly failed: {reason}")
        return target.read_bytes()


def memory_offsets(tuple_type: Any) -> tuple[int, dict[str, int]]:
    """Return the size of a type in WebAssembly memory and the offsets of its fields, in bytes.

    The name of a field is a path, such as "network.sizes".
    """
    data = _make_target_machine().target_data
    llvm_type = data_type(tuple_type)
    # `_memory_offsets` returns names that begin with a dot.
    offsets = {
        name[1:]: offset for name, offset in _memory_offsets(tuple_type, llvm_type, data, "", 0)
    }
    return llvm_type.get_abi_size(data), offsets


def _memory_offsets(
    numba_type: Any, llvm_type: Any, data: Any, name: str, offset: int
) -> Iterator[tuple[str, int]]:
    if not isinstance(numba_type, BaseTuple):
        yield name, offset
        return
    is_named = isinstance(numba_type, BaseNamedTuple)
    names = numba_type.fields if is_named else range(len(numba_type))
    fields = zip(names, numba_type.types, strict=True)
    for number, (field_name, field_type) in enumerate(fields):
        # A tuple of equal types is an array of LLVM, and other tuples are structures.
        if isinstance(llvm_type, ir.ArrayType):
            field_llvm_type = llvm_type.element
            start = number * field_llvm_type.get_abi_size(data)
        else:
            field_llvm_type = llvm_type.elements[number]
            start = llvm_type.get_element_offset(data, number)
        yield from _memory_offsets(
            field_type, field_llvm_type, data, f"{name}.{field_name}", offset + start
        )


def compile_in_subprocess(module_name: str, request: Any) -> Any:
    """Run a Python module in a new process without cached code, and return its output.

    The module reads `request` as JSON from standard input and writes its output as JSON. Raise
    RefusedError with the error message of the process if the process fails.
    """
    with tempfile.TemporaryDirectory() as folder:
        variables = {
            "BALDWINLAB_LANES": str(N_LANES),
            # The code is optimized for WebAssembly, and not before by Numba.
            "NUMBA_OPT": "0",
            "BALDWINLAB_CACHE": folder,
        }
        result = subprocess.run(
            [sys.executable, "-m", module_name],
            input=json.dumps(request),
            capture_output=True,
            text=True,
            env={**os.environ, **variables},
        )
    if result.returncode:
        lines = result.stderr.strip().splitlines()
        raise RefusedError(lines[-1] if lines else "the engine could not be compiled for browsers")
    return json.loads(result.stdout)
