"""Test that Numba calls each method of the engine that overrides a method of Numba."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import numba
import numpy as np
import pytest

from baldwinlab.engine import inlining, jit, reference
from baldwinlab.engine.cache import FileCodeStore
from baldwinlab.engine.numba_internals import dispatchers, pipeline

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


class Pair(NamedTuple):
    left: float
    right: Any


def _add(pair: Any) -> Any:
    return pair.left + pair.right[0]


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
