"""Each private name of Numba that the engine uses is there, and only one package uses them."""

from __future__ import annotations

import ast
import inspect
import re
from collections.abc import Iterable, Iterator
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from typing import Any, NamedTuple

import numba
import numpy as np
import pytest
from llvmlite import ir
from numba import float64
from numba.core.compiler import CompilerBase, DefaultPassBuilder

import baldwinlab
from baldwinlab.engine import numba_internals
from baldwinlab.engine.numba_internals import dispatchers
from tests.engine.numba_names import IMPORTED, NAMES, OF_A_COMPILATION, OF_CUDA, Name

PACKAGE = Path(numba_internals.__file__).parent
ROOT = Path(baldwinlab.__file__).parent
MODULES = {
    ".".join(path.relative_to(ROOT).with_suffix("").parts).removesuffix(".__init__"): path
    for path in ROOT.rglob("*.py")
}
PUBLIC_MODULES = {
    "llvmlite",
    "llvmlite.binding",
    "llvmlite.ir",
    "numba",
    "numba.cuda",
    "numba.extending",
}


def find(path: str, roots: dict[str, Any]) -> Any:
    """The object of a dotted path, whose first parts are a module or one of the roots."""
    first, *rest = path.split(".")
    found = roots.get(first)
    if found is None:
        found = import_module(first)
        while rest and inspect.ismodule(found) and not hasattr(found, rest[0]):
            found = import_module(f"{found.__name__}.{rest.pop(0)}")
    for part in rest:
        found = getattr(found, part)
    return found


def require(name: Name, roots: dict[str, Any]) -> None:
    """Fail, with one sentence, where a name is gone or cannot be called as the engine calls it."""
    try:
        found = find(name.path, roots)
        if name.call is not None:
            parameters = name.call.split(", ")
            keywords = {each[:-1]: None for each in parameters if each.endswith("=")}
            positional = parameters[: len(parameters) - len(keywords)]
            inspect.signature(found).bind(*positional, **keywords)
    except (AttributeError, ImportError, TypeError) as error:
        fault = f"Numba's `{name.path}` is gone or has other parameters ({error})"
        pytest.fail(f"{fault}: baldwinlab uses it for {name.purpose}", pytrace=False)


@pytest.mark.parametrize("name", IMPORTED, ids=lambda name: name.path)
def test_a_name_is_there(name: Name) -> None:
    require(name, {})


@pytest.mark.skipif(find_spec("numba_cuda") is None, reason="needs numba-cuda")
@pytest.mark.parametrize("name", OF_CUDA, ids=lambda name: name.path)
def test_a_name_of_the_compiler_for_gpus_is_there(name: Name) -> None:
    require(name, {})


class Pair(NamedTuple):
    left: float
    right: Any


def _add(pair: Any) -> Any:
    return pair.left + pair.right[0]


@pytest.fixture(scope="module")
def objects() -> dict[str, Any]:
    """Objects of a compilation by Numba alone, by the names that begin the paths above."""
    states, managers = [], []

    class Compiler(CompilerBase):  # type: ignore[misc]
        def define_pipelines(self) -> list[Any]:
            states.append(self.state)
            managers.append(DefaultPassBuilder.define_nopython_pipeline(self.state))
            return managers

    dispatcher = numba.njit(pipeline_class=Compiler)(_add)
    assert dispatcher(Pair(2.0, np.array([3.0]))) == 5
    (result,), (state,), (tuple_type,) = dispatcher.overloads.values(), states, states[0].args
    block = next(iter(state.func_ir.blocks.values()))
    function = ir.Function(ir.Module(), ir.FunctionType(ir.VoidType(), []), "function")
    builder = ir.IRBuilder(function.append_basic_block())
    return {
        "array": state.targetctx.make_array(tuple_type.types[1])(state.targetctx, builder),
        "block": block,
        "call": next(filter(None, state.calltypes.values())),
        "dispatcher": dispatcher,
        "expression": next(block.find_exprs("getattr")),
        "library": result.library,
        "passes": managers[0],
        "result": result,
        "state": state,
        "tuple_type": tuple_type,
    }


@pytest.mark.parametrize("name", OF_A_COMPILATION, ids=lambda name: name.path)
def test_a_compilation_has_a_name(name: Name, objects: dict[str, Any]) -> None:
    require(name, objects)


def _invert(value: float) -> float:
    return 1 / value


def test_compiled_functions_are_called_as_pages_call_them() -> None:
    code, symbol = dispatchers.compile_to_llvm(numba.njit(_invert), float64(float64))
    head = rf'define [^@]*\bi32 @"?{re.escape(symbol)}"?\(ptr [^,]*, ptr [^,]*, double '
    assert re.search(head, code), "`lowering.define_plain_function` has other parameters"


def test_random_numbers_of_numba_are_found_by_the_names_of_their_functions() -> None:
    dispatcher = numba.njit(lambda: np.random.random())  # noqa: NPY002
    dispatcher()
    code = next(iter(dispatcher.inspect_llvm().values()))
    declared = re.findall(r'declare [^@]*@"?([\w.]+)', code)
    assert any(re.match(dispatchers.RANDOM_SYMBOLS, each) for each in declared)
    assert all(re.match(dispatchers.RUNTIME_SYMBOLS, each) for each in declared), declared


PYTHON = {"__init__", "copy", "encode", "get", "hexdigest", "join", "loads", "reset", "set"}
PYTHON |= {"sha256", "values"}
OF_THE_ENGINE = {"_pass_builder", "discard", "finish_lowering", "library_class", "read", "write"}
UNMISTAKABLE = {"calltypes", "fndesc", "overloads", "targetctx", "typemap"}
USED_ELSEWHERE = {
    *("_replace", "return_type", "data_layout"),  # other packages have these names too
    *("as_pointer", "create_pass_builder"),  # documented by llvmlite
    *("alloca_once", "gep_inbounds"),  # functions of `lowering.cgutils`
    *("cache_path", "compile_extra"),  # defined by a subclass
}


def parts_of(names: Iterable[Name]) -> set[str]:
    return {part for name in names for part in name.path.split(".")}


def attributes_of(path: Path) -> set[str]:
    """The attributes that a module uses, of whichever objects."""
    tree = ast.parse(path.read_text("utf-8"))
    return {node.attr for node in ast.walk(tree) if isinstance(node, ast.Attribute)}


def imports_of(path: Path) -> Iterator[str]:
    """The names of Numba's packages that a module imports, as dotted paths."""
    for node in ast.walk(ast.parse(path.read_text("utf-8"))):
        if isinstance(node, ast.Import):
            names = [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            names = [f"{node.module}.{alias.name}" for alias in node.names]
        else:
            continue
        yield from (name for name in names if name.split(".")[0] in ("numba", "llvmlite"))


def test_each_private_name_that_is_used_is_listed() -> None:
    used = set().union(*map(attributes_of, PACKAGE.glob("*.py")))
    assert used <= parts_of(NAMES) | PYTHON | OF_THE_ENGINE


def test_each_private_import_is_listed() -> None:
    listed = {path for name in NAMES for path in prefixes(name.path)}
    for path in PACKAGE.glob("*.py"):
        assert {name for name in imports_of(path) if not is_public(name)} <= listed, path.name


def prefixes(path: str) -> Iterator[str]:
    parts = path.split(".")
    yield from (".".join(parts[:end]) for end in range(1, len(parts) + 1))


def is_public(imported: str) -> bool:
    """Whether a name is of a documented module; `core` is one of `numba` and is not documented."""
    module, _, name = imported.rpartition(".")
    return imported in PUBLIC_MODULES or (module in PUBLIC_MODULES and name != "core")


FORBIDDEN = {each for each in parts_of(NAMES) if "_" in each} | UNMISTAKABLE
OTHERS = [module for module, path in MODULES.items() if PACKAGE not in path.parents]


@pytest.mark.parametrize("module", OTHERS)
def test_no_other_module_uses_a_private_name(module: str) -> None:
    path = MODULES[module]
    assert not {name for name in imports_of(path) if not is_public(name)}
    assert not attributes_of(path) & (FORBIDDEN - USED_ELSEWHERE)
