"""From compiled functions to a WebAssembly module, for browsers: the same instructions, so the same bits.

Numba's code for this machine is taken before it is optimised, told that it is WebAssembly's, and
optimised for that. An entry point takes addresses of named tuples (reference.py) and gives nothing
back. The module imports nothing but its memory.

A function that Numba finds in its cache comes without code to be retargeted, and a SIMD block is of
another width there. So this is done in a process of its own, `aside`, in which nothing is cached
and nothing has been compiled.
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
from baldwinlab.core.extras import missing_extra
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
LANES: Final = 4  # of float32 in a register
STACK: Final = 256 * 1024  # bytes
OF_C: Final = {
    "floorf": "llvm.floor.f32",
    "floor": "llvm.floor.f64",
}  # instructions of their own there: exact, as libm's are

Entry = tuple[
    Callable[..., Any], Sequence[Any]
]  # a function, and the types of its arguments, whose addresses it is given


def module(entries: Mapping[str, Entry]) -> bytes:
    """A WebAssembly module that exports these functions by name. Raises RefusedError where there is no linker."""
    linker = find_linker()
    llvm.initialize_all_targets()
    llvm.initialize_all_asmprinters()
    machine = llvm.Target.from_triple(TRIPLE).create_target_machine(features=FEATURES, opt=3)
    whole: Any = None
    for name, (function, arguments) in entries.items():
        one = llvm.parse_assembly(
            _retargeted(*_code(function, arguments), name, len(arguments), machine)
        )
        for each in (*one.functions, *one.global_variables):
            if not each.is_declaration and each.name != name:
                each.linkage = "internal"  # so that entry points may have the same callees
        if whole is None:
            whole = one
        else:
            whole.link_in(one)
    with unrolling(False):
        builder = make_pass_builder(machine, 3)
    builder.getModulePassManager().run(whole, builder)
    whole.verify()
    return _linked(linker, machine.emit_object(whole), entries)


def _code(function: Callable[..., Any], arguments: Sequence[Any]) -> tuple[str, str]:
    """A function in LLVM's language, not optimised, and its name there."""
    dispatcher = numba.njit(**UNWRAPPED, **OPTIONS)(function)
    return compile_to_llvm(dispatcher, types.void(*map(Reference, arguments)))


def _retargeted(text: str, symbol: str, name: str, count: int, machine: Any) -> str:
    """The same for WebAssembly, with a function of a plain name that takes so many addresses."""
    text = re.sub(
        r'(?m)^target datalayout = ".*"$', f'target datalayout = "{machine.target_data}"', text
    )
    text = re.sub(r'(?m)^target triple = ".*"$', f'target triple = "{TRIPLE}"', text)
    text = text.replace(" common ", " ")
    for function, instruction in OF_C.items():
        text = text.replace(f"@{function}(", f"@{instruction}(")
    return text + define_plain_function(name, symbol, count)


def find_linker() -> list[str]:
    """The command that links WebAssembly. Raises RefusedError where there is none."""
    for name in ("wasm-ld", *(f"wasm-ld-{version}" for version in range(22, 13, -1))):
        if found := shutil.which(name):
            return [found]
    if find_spec("ziglang"):
        return [sys.executable, "-m", "ziglang", "wasm-ld"]
    raise missing_extra("wasm", "the export of a custom part")


def _linked(linker: list[str], code: bytes, exported: Mapping[str, Any]) -> bytes:
    with tempfile.TemporaryDirectory() as folder:
        given, made = Path(folder) / "code.o", Path(folder) / "module.wasm"
        given.write_bytes(code)
        options = [
            "--no-entry",
            "--import-memory",
            "--strip-all",
            "--stack-first",
            "-z",
            f"stack-size={STACK}",
        ]
        names = [f"--export={name}" for name in (*exported, "__heap_base")]
        done = subprocess.run(
            [*linker, *options, *names, "-o", str(made), str(given)], capture_output=True, text=True
        )
        if done.returncode:
            raise RefusedError(
                f"the linker for WebAssembly failed: {' '.join(done.stderr.split())[:500]}"
            )
        return made.read_bytes()


# How a named tuple lies in the memory of a module.
def places(kind: Any) -> tuple[int, dict[str, int]]:
    """The size in bytes of what has a type of Numba's, and where each number and array in it is, as "network.sizes": 264."""
    llvm.initialize_all_targets()
    data = llvm.Target.from_triple(TRIPLE).create_target_machine(features=FEATURES).target_data
    shape = data_type(kind)
    return shape.get_abi_size(data), {
        name[1:]: offset for name, offset in _places(kind, shape, data, "", 0)
    }


def _places(kind: Any, shape: Any, data: Any, name: str, offset: int) -> Iterator[tuple[str, int]]:
    if not isinstance(kind, BaseTuple):
        yield name, offset
        return
    names = kind.fields if isinstance(kind, BaseNamedTuple) else range(len(kind))
    for number, (field, below) in enumerate(zip(names, kind.types, strict=True)):
        if isinstance(shape, ir.ArrayType):
            inner, at = shape.element, number * shape.element.get_abi_size(data)
        else:
            inner, at = shape.elements[number], shape.get_element_offset(data, number)
        yield from _places(below, inner, data, f"{name}.{field}", offset + at)


def aside(module_name: str, order: Any) -> Any:
    """What `main` of a module makes of an order, in a process in which nothing was compiled before. Both are JSON.

    Raises RefusedError with the process's own sentence.
    """
    with tempfile.TemporaryDirectory() as nowhere:
        own = {"BALDWINLAB_LANES": str(LANES), "NUMBA_OPT": "0", "BALDWINLAB_CACHE": nowhere}
        command = [sys.executable, "-m", module_name]
        done = subprocess.run(
            command,
            input=json.dumps(order),
            capture_output=True,
            text=True,
            env={**os.environ, **own},
        )
    if done.returncode:
        raise RefusedError(
            (done.stderr.strip().splitlines() or ["it could not be compiled for browsers"])[-1]
        )
    return json.loads(done.stdout)
