"""Test that the private names of Numba exist, and that only `numba_internals` uses them.

Numba must call each method of the engine that overrides a method of Numba.
"""

from __future__ import annotations

import ast
import inspect
import re
from collections import Counter
from collections.abc import Callable, Iterable, Iterator
from functools import partial
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
from baldwinlab.engine import inlining, jit, numba_internals, reference
from baldwinlab.engine.cache import FileCodeStore
from baldwinlab.engine.numba_internals import dispatchers, pipeline
from tests.engine.numba_names import COMPILATION_NAMES, CUDA_NAMES, IMPORTED_NAMES, NAMES, Name

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


def resolve_path(path: str, roots: dict[str, Any]) -> Any:
    """Return the object of a dotted path that begins with a module or one of the roots."""
    first, *rest = path.split(".")
    value = roots.get(first)
    if value is None:
        value = import_module(first)
        while rest and inspect.ismodule(value) and not hasattr(value, rest[0]):
            value = import_module(f"{value.__name__}.{rest.pop(0)}")
    for part in rest:
        value = getattr(value, part)
    return value


def find_fault(name: Name, roots: dict[str, Any]) -> str:
    """Return a sentence if a name is missing or its signature has changed, else ""."""
    try:
        value = resolve_path(name.path, roots)
        if name.call is not None:
            parameters = name.call.split(", ")
            keywords = {word[:-1]: None for word in parameters if word.endswith("=")}
            positional = parameters[: len(parameters) - len(keywords)]
            inspect.signature(value).bind(*positional, **keywords)
    except (AttributeError, ImportError, TypeError) as error:
        fault = f"Numba's `{name.path}` is gone or has other parameters ({error})"
        return f"{fault}: baldwinlab uses it for {name.purpose}"
    return ""


def require(names: Iterable[Name], roots: dict[str, Any]) -> None:
    """Fail with one sentence for each name that is missing or has another signature."""
    faults = list(filter(None, (find_fault(name, roots) for name in names)))
    if faults:
        pytest.fail("\n".join(faults), pytrace=False)


def test_the_names_exist() -> None:
    require(IMPORTED_NAMES, {})


@pytest.mark.skipif(find_spec("numba_cuda") is None, reason="needs numba-cuda")
def test_the_names_of_the_gpu_compiler_exist() -> None:
    from numba import cuda

    require(CUDA_NAMES, {"configuration": cuda.jit(_add).configure(1, 1)})


class Pair(NamedTuple):
    left: float
    right: Any


def _add(pair: Any) -> Any:
    return pair.left + pair.right[0]


@pytest.fixture(scope="module")
def objects() -> dict[str, Any]:
    """Return objects of a compilation by Numba, by the first word of the paths above."""
    states = []
    managers = []

    class Compiler(CompilerBase):  # type: ignore[misc]
        def define_pipelines(self) -> list[Any]:
            states.append(self.state)
            managers.append(DefaultPassBuilder.define_nopython_pipeline(self.state))
            return managers

    dispatcher = numba.njit(pipeline_class=Compiler)(_add)
    assert dispatcher(Pair(2.0, np.array([3.0]))) == 5
    (result,) = dispatcher.overloads.values()
    (state,) = states
    (tuple_type,) = state.args
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


def test_a_compilation_has_the_names(objects: dict[str, Any]) -> None:
    require(COMPILATION_NAMES, objects)


def _invert(value: float) -> float:
    return 1 / value


def test_compiled_functions_have_the_parameters_that_web_pages_pass() -> None:
    code, symbol = dispatchers.compile_to_llvm(numba.njit(_invert), float64(float64))
    head = rf'define [^@]*\bi32 @"?{re.escape(symbol)}"?\(ptr [^,]*, ptr [^,]*, double '
    assert re.search(head, code), "`lowering.define_plain_function` has other parameters"


def test_calls_of_the_random_numbers_of_numba_are_recognized_by_name() -> None:
    dispatcher = numba.njit(lambda: np.random.random())  # noqa: NPY002
    dispatcher()
    code = next(iter(dispatcher.inspect_llvm().values()))
    declared = re.findall(r'declare [^@]*@"?([\w.]+)', code)
    assert any(re.match(dispatchers.RANDOM_SYMBOLS, name) for name in declared)
    assert all(re.match(dispatchers.RUNTIME_SYMBOLS, name) for name in declared), declared


PYTHON_NAMES = {"__init__", "copy", "encode", "get", "hexdigest", "join", "loads", "reset", "set"}
PYTHON_NAMES |= {"items", "pop", "sha256", "values"}
ENGINE_NAMES = {"_pass_builder", "discard", "finish_lowering", "library_class", "read", "write"}
ENGINE_NAMES |= {"read_bitcode", "_files", "_key", "_options"}
UNAMBIGUOUS = {"calltypes", "fndesc", "overloads", "targetctx", "typemap"}
AMBIGUOUS = {
    # Other packages have these names too.
    *("_name", "_replace", "return_type", "data_layout"),
    # llvmlite documents these names.
    *("as_pointer", "create_pass_builder", "emit_object", "parse_bitcode"),
    # Functions of `lowering.cgutils`.
    *("alloca_once", "gep_inbounds"),
    # A subclass defines these names.
    *("cache_path", "compile_extra"),
    # A field of `Reference` has this name.
    "tuple_type",
}


def split_paths(names: Iterable[Name]) -> set[str]:
    return {part for name in names for part in name.path.split(".")}


def list_attributes(path: Path) -> set[str]:
    """Return the attributes that a module uses, of any object."""
    tree = ast.parse(path.read_text("utf-8"))
    return {node.attr for node in ast.walk(tree) if isinstance(node, ast.Attribute)}


def list_imports(path: Path) -> Iterator[str]:
    """Yield the names of Numba's packages that a module imports, as dotted paths."""
    for node in ast.walk(ast.parse(path.read_text("utf-8"))):
        if isinstance(node, ast.Import):
            names = [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            names = [f"{node.module}.{alias.name}" for alias in node.names]
        else:
            continue
        yield from (name for name in names if name.split(".")[0] in ("numba", "llvmlite"))


def test_each_used_private_name_is_listed() -> None:
    used = set().union(*map(list_attributes, PACKAGE.glob("*.py")))
    assert used <= split_paths(NAMES) | PYTHON_NAMES | ENGINE_NAMES


def test_each_private_import_is_listed() -> None:
    listed = {path for name in NAMES for path in list_prefixes(name.path)}
    for path in PACKAGE.glob("*.py"):
        assert {name for name in list_imports(path) if not is_public(name)} <= listed, path.name


def list_prefixes(path: str) -> Iterator[str]:
    parts = path.split(".")
    yield from (".".join(parts[:end]) for end in range(1, len(parts) + 1))


def is_public(imported: str) -> bool:
    """Return whether a name is documented. `numba.core` is not documented."""
    module, _, name = imported.rpartition(".")
    return imported in PUBLIC_MODULES or (module in PUBLIC_MODULES and name != "core")


FORBIDDEN = {name for name in split_paths(NAMES) if "_" in name} | UNAMBIGUOUS
OTHER_MODULES = [module for module, path in MODULES.items() if PACKAGE not in path.parents]


def test_no_other_module_uses_a_private_name() -> None:
    forbidden = FORBIDDEN - AMBIGUOUS
    uses = {
        module: {name for name in list_imports(MODULES[module]) if not is_public(name)}
        | list_attributes(MODULES[module]) & forbidden
        for module in OTHER_MODULES
    }
    assert {module: names for module, names in uses.items() if names} == {}


HOOKS = [
    (pipeline.Library, "_optimize_functions"),
    (pipeline.Library, "_optimize_final_module"),
    (pipeline.LinkedLibrary, "_optimize_final_module"),
    (pipeline.LinkedLibrary, "_finalize_final_module"),
    (pipeline.LinkedLibrary, "get_pointer_to_function"),
    (pipeline.LinkedLibrary, "codegen"),
    (pipeline.LinkedLibrary, "set_env"),
    (pipeline.Lowering, "run_pass"),
    (pipeline.Compiler, "define_pipelines"),
    (inlining.Inlined, "compile_extra"),
    (dispatchers.CodeStore, "load_overload"),
    (dispatchers.CodeStore, "save_overload"),
    (reference._Attributes, "generic_resolve"),
]
"""The methods that override a method of Numba or that Numba calls by name."""


_inlined_add = jit.compiled(_add)


def _add_by_address(left: float, right: Any) -> Any:
    return _inlined_add(reference.as_pointer(Pair(left, right)))


def _compile_entry(store: Path) -> None:
    dispatcher = numba.njit(pipeline_class=pipeline.EntryCompiler, **jit.OPTIONS)(_add_by_address)
    dispatchers.set_code_store(dispatcher, FileCodeStore(store))
    arguments = (2.0, np.array([3.0]))
    types = dispatchers.find_argument_types(dispatcher, arguments)
    dispatcher.compile(types)
    assert dispatchers.find_compiled_function(dispatcher, types)(*arguments) == 5


def _counting(method: Any, count: Callable[[], None]) -> Any:
    """Return the method, or the property, with a count of its calls."""
    function = getattr(method, "fget", method)

    def call(*arguments: Any, **options: Any) -> Any:
        count()
        return function(*arguments, **options)

    return property(call) if isinstance(method, property) else call


@pytest.fixture(scope="module")
def calls(tmp_path_factory: pytest.TempPathFactory) -> Counter[tuple[type, str]]:
    """Count the calls of the hooks while an entry is compiled, stored and loaded."""
    counts: Counter[tuple[type, str]] = Counter()
    with pytest.MonkeyPatch.context() as patch:
        for hook in HOOKS:
            holder, name = hook
            count = partial(counts.update, [hook])
            patch.setattr(holder, name, _counting(vars(holder)[name], count))
        store = tmp_path_factory.mktemp("store")
        _compile_entry(store)
        _compile_entry(store)
    return counts


def test_numba_calls_each_hook(calls: Counter[tuple[type, str]]) -> None:
    uncalled = [f"{holder.__name__}.{name}" for holder, name in HOOKS if not calls[holder, name]]
    assert not uncalled, "Numba no longer calls these methods"
