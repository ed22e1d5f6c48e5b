"""Compile functions to a WebAssembly module for browsers: the same instructions, so the same bits.

The LLVM code of Numba for this machine is retargeted to WebAssembly before optimization, and then
optimized for it. An entry point takes addresses of named tuples (`reference.py`) and returns
nothing. The module imports only its memory.

A function from the cache of Numba has no LLVM code, and SIMD blocks have another width in browsers.
So `compile_in_subprocess` uses a new process without cached code.
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
from baldwinlab.engine.numba_internals.libraries import make_pass_builder, unrolling
from baldwinlab.engine.numba_internals.lowering import (
    BaseNamedTuple,
    BaseTuple,
    data_type,
    define_plain_function,
)
from baldwinlab.engine.reference import Reference

TRIPLE: Final = "wasm32-unknown-unknown"
FEATURES: Final = "+simd128,+bulk-memory,+sign-ext,+nontrapping-fptoint,+mutable-globals"
LANES: Final = 4
"""Lanes of float32 in a register of WebAssembly."""
STACK: Final = 256 * 1024
"""Bytes of the stack."""
INTRINSICS: Final = {"floorf": "llvm.floor.f32", "floor": "llvm.floor.f64"}
"""Functions of libm that are exact, and instructions of WebAssembly."""

Entry = tuple[Callable[..., Any], Sequence[Any]]
"""A function, and the types of its arguments, which it gets by address."""


def module(entries: Mapping[str, Entry]) -> bytes:
    """Compile a WebAssembly module that exports functions by name.

    Raises RefusedError if there is no linker.
    """
    linker = find_linker()
    llvm.initialize_all_targets()
    llvm.initialize_all_asmprinters()
    machine = llvm.Target.from_triple(TRIPLE).create_target_machine(features=FEATURES, opt=3)
    linked: Any = None
    for name, (function, arguments) in entries.items():
        text, symbol = _compile(function, arguments)
        unit = llvm.parse_assembly(_retarget(text, symbol, name, len(arguments), machine))
        # Entry points may have the same callees, so these are internal.
        for item in (*unit.functions, *unit.global_variables):
            if not item.is_declaration and item.name != name:
                item.linkage = "internal"
        if linked is None:
            linked = unit
        else:
            linked.link_in(unit)
    with unrolling(False):
        builder = make_pass_builder(machine, 3)
    builder.getModulePassManager().run(linked, builder)
    linked.verify()
    return _link(linker, machine.emit_object(linked), entries)


def _compile(function: Callable[..., Any], arguments: Sequence[Any]) -> tuple[str, str]:
    """Return the LLVM code of a function before optimization, and the name of its symbol."""
    dispatcher = numba.njit(**UNWRAPPED, **OPTIONS)(function)
    return compile_to_llvm(dispatcher, types.void(*map(Reference, arguments)))


def _retarget(text: str, symbol: str, name: str, count: int, machine: Any) -> str:
    """Return LLVM code for WebAssembly, with a function `name` that takes `count` addresses."""
    text = re.sub(
        r'(?m)^target datalayout = ".*"$', f'target datalayout = "{machine.target_data}"', text
    )
    text = re.sub(r'(?m)^target triple = ".*"$', f'target triple = "{TRIPLE}"', text)
    text = text.replace(" common ", " ")
    for function, instruction in INTRINSICS.items():
        text = text.replace(f"@{function}(", f"@{instruction}(")
    return text + define_plain_function(name, symbol, count)


def find_linker() -> list[str]:
    """Return the command that links WebAssembly; raise RefusedError if there is none."""
    for name in ("wasm-ld", *(f"wasm-ld-{version}" for version in range(22, 13, -1))):
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
            f"stack-size={STACK}",
        ]
        names = [f"--export={name}" for name in (*exported, "__heap_base")]
        command = [*linker, *options, *names, "-o", str(target), str(source)]
        result = subprocess.run(command, capture_output=True, text=True)
        if result.returncode:
            reason = " ".join(result.stderr.split())[:500]
            raise RefusedError(f"the linker for WebAssembly failed: {reason}")
        return target.read_bytes()


def memory_offsets(kind: Any) -> tuple[int, dict[str, int]]:
    """Return the size of a type in the memory of a module, and the offsets of its fields.

    Both are in bytes. The name of a field is a path, such as "network.sizes".
    """
    llvm.initialize_all_targets()
    data = llvm.Target.from_triple(TRIPLE).create_target_machine(features=FEATURES).target_data
    shape = data_type(kind)
    offsets = {name[1:]: offset for name, offset in _memory_offsets(kind, shape, data, "", 0)}
    return shape.get_abi_size(data), offsets


def _memory_offsets(
    kind: Any, shape: Any, data: Any, name: str, offset: int
) -> Iterator[tuple[str, int]]:
    if not isinstance(kind, BaseTuple):
        yield name, offset
        return
    names = kind.fields if isinstance(kind, BaseNamedTuple) else range(len(kind))
    for number, (field, below) in enumerate(zip(names, kind.types, strict=True)):
        if isinstance(shape, ir.ArrayType):
            inner = shape.element
            start = number * inner.get_abi_size(data)
        else:
            inner = shape.elements[number]
            start = shape.get_element_offset(data, number)
        yield from _memory_offsets(below, inner, data, f"{name}.{field}", offset + start)


def compile_in_subprocess(module_name: str, order: Any) -> Any:
    """Run `main` of a module in a new process without cached code, and return its result.

    `order` and the result are JSON. Raises RefusedError with the error of the process.
    """
    with tempfile.TemporaryDirectory() as folder:
        variables = {
            "BALDWINLAB_LANES": str(LANES),
            "NUMBA_OPT": "0",
            "BALDWINLAB_CACHE": folder,
        }
        result = subprocess.run(
            [sys.executable, "-m", module_name],
            input=json.dumps(order),
            capture_output=True,
            text=True,
            env={**os.environ, **variables},
        )
    if result.returncode:
        lines = result.stderr.strip().splitlines()
        raise RefusedError(lines[-1] if lines else "the engine could not be compiled for browsers")
    return json.loads(result.stdout)
