"""Test the options of compilation for a GPU, on machines without one."""

from __future__ import annotations

import ast
import gc
import re
import sys
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

import baldwinlab
from baldwinlab.core.errors import InterruptedStudyError, RefusedError
from baldwinlab.engine import cache, require_tested_version
from baldwinlab.engine.gpu import explain_failure, kernel
from baldwinlab.models.miniworld.allocation import list_hooks, make_state
from tests.engine.gpu_code import (
    compile_kernel,
    count_compilations,
    count_operations,
    use_device,
)
from tests.engine.processes import run_python
from tests.models.miniworld.backends.test_cuda import make_experiments, make_kernels

PACKAGE = Path(baldwinlab.__file__).parent


def multiply_and_add(numbers: Any) -> None:
    numbers[0] = numbers[1] * numbers[2] + numbers[3]


def ignore(number: int) -> None:
    """A kernel that does nothing."""


def test_a_kernel_has_no_fused_multiply_add_before_and_after_linking(h200: None) -> None:
    from numba.cuda import types

    library = compile_kernel(kernel(32)(multiply_and_add), (types.float32[::1],))
    operations = re.findall(r"\b(?:mul|add|fma)\.\S*f32", library.get_asm_str())
    assert sorted(operations) == ["add.rn.f32", "mul.rn.f32"]
    assert count_operations(library.get_cubin().code) == {"multiply": 1, "add": 1}


def test_no_function_of_the_package_is_optimized_at_link_time(h200: None) -> None:
    from numba.cuda.dispatcher import CUDADispatcher

    for experiment in make_experiments():
        make_kernels(experiment)
    modules = [module for name, module in sys.modules.items() if name.startswith("baldwinlab.")]
    values = [value for module in modules for value in vars(module).values()]
    device_functions = [value for value in values if type(value) is CUDADispatcher]
    # `isinstance` fails for a weak reference to a deleted object.
    kernels = [
        value
        for value in gc.get_objects()
        if type(value) is CUDADispatcher and value.targetoptions["launch_bounds"]
    ]
    assert len(device_functions) > 4 and len(kernels) > 4
    functions = [*device_functions, *kernels]
    linked = [function for function in functions if function.targetoptions["lto"] is not False]
    assert [function.py_func.__qualname__ for function in linked] == []


@pytest.fixture
def load_machine_code(
    h200: None, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> Callable[..., tuple[bytes, bool]]:
    """Return a function that loads or compiles `multiply_and_add` in a new dispatcher.

    It returns the machine code, and whether it was compiled. The cache is in `tmp_path`.
    """
    from numba.cuda import types

    from baldwinlab.engine.gpu import without_contraction
    from baldwinlab.engine.numba_internals import cuda

    compilations = count_compilations(monkeypatch)

    def load(threads: int = 32) -> tuple[bytes, bool]:
        n_before = len(compilations)
        dispatcher: Any = kernel(threads)(multiply_and_add)
        dispatcher.typeof_pyval = lambda value: types.float32[::1]
        launch = (1, 1, 0)
        with without_contraction():
            cuda.compile_kernel(dispatcher, cache.FileCodeStore(tmp_path), launch, (None,))
        (compiled,) = dispatcher.overloads.values()
        return compiled._codelibrary.get_cubin().code, len(compilations) > n_before

    return load


def test_a_kernel_is_compiled_once_and_its_machine_code_is_stored(
    load_machine_code: Callable[..., tuple[bytes, bool]], tmp_path: Path
) -> None:
    code, is_compiled = load_machine_code()
    assert is_compiled
    assert count_operations(code) == {"multiply": 1, "add": 1}
    assert load_machine_code() == (code, False)
    (file,) = tmp_path.glob(f"*{cache.CODE_SUFFIX}")
    assert len(code) < file.stat().st_size < len(code) + 4096


def test_a_loaded_kernel_is_launched_with_the_given_arguments(
    h200: None, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from baldwinlab.engine.gpu import compile_kernel as load_kernel

    launches = []
    monkeypatch.setattr(
        "numba.cuda.dispatcher.launch",
        lambda stream, place, function, *arguments: launches.append((place, function, arguments)),
    )
    monkeypatch.setattr(
        "numba.cuda.codegen.CUDACodeLibrary.get_cufunc",
        lambda library: SimpleNamespace(kernel=library._entry_name),
    )
    monkeypatch.setattr(cache, "cache_directory", lambda functions: tmp_path)
    compilations = count_compilations(monkeypatch)
    for argument in (3, 4):
        launch = load_kernel(kernel(32)(ignore), (), (2, 5, 0), (0,))
        launch(argument)
    (first_place, first_function, first), (place, function, second) = launches
    assert len(compilations) == 1
    assert function == first_function
    assert [first[0].value, second[0].value] == [3, 4]
    assert place.grid == first_place.grid == (2, 1, 1)
    assert place.block == first_place.block == (5, 1, 1)


def test_other_options_and_devices_and_versions_have_other_machine_code(
    load_machine_code: Callable[..., tuple[bytes, bool]], monkeypatch: pytest.MonkeyPatch
) -> None:
    load_machine_code(threads=32)
    _, is_compiled = load_machine_code(threads=64)
    assert is_compiled
    with monkeypatch.context() as patch:
        use_device(patch, (8, 0))
        _, is_compiled = load_machine_code()
        assert is_compiled
    monkeypatch.setattr("baldwinlab.engine.numba_internals.cuda.version", lambda name: "0.30.5")
    _, is_compiled = load_machine_code()
    assert is_compiled


def test_damaged_machine_code_is_compiled_again(
    load_machine_code: Callable[..., tuple[bytes, bool]], tmp_path: Path
) -> None:
    load_machine_code()
    (file,) = tmp_path.glob(f"*{cache.CODE_SUFFIX}")
    for damage in (
        lambda: file.write_bytes(file.read_bytes()[:-1]),
        lambda: cache.FileCodeStore(tmp_path).write(file.stem, b"no pickle"),
    ):
        damage()
        code, is_compiled = load_machine_code()
        assert is_compiled
        assert count_operations(code) == {"multiply": 1, "add": 1}
        assert load_machine_code() == (code, False)


PRINT_FOLDERS = """
from tests.engine.test_gpu import list_cache_folders
print(*list_cache_folders())
"""


def list_cache_folders() -> list[str]:
    """Return the names of the cache folders of the kernels of all experiments."""
    names = []
    for experiment in make_experiments():
        hooks = list_hooks(make_state(experiment, 1))
        for function in make_kernels(experiment):
            directory = cache.cache_directory((function, *hooks))
            assert directory
            names.append(directory.name)
    return names


def test_kernels_have_the_same_cache_folders_in_every_process(h200: None) -> None:
    names = list_cache_folders()
    # Each experiment has a birth kernel and a simulation kernel, and some have equal parts.
    assert len(names) == 2 * len(make_experiments()) > len(set(names)) > len(names) // 2
    assert run_python(PRINT_FOLDERS).stdout.split() == names


def test_one_module_compiles_for_a_gpu() -> None:
    modules = {
        path.relative_to(PACKAGE).as_posix()
        for path in PACKAGE.rglob("*.py")
        for node in ast.walk(ast.parse(path.read_text("utf-8")))
        if isinstance(node, ast.Attribute) and ast.unparse(node).endswith("cuda.jit")
    }
    assert modules == {"engine/gpu.py"}


def test_a_numpy_that_the_gpu_compiler_cannot_use_is_refused_in_a_sentence() -> None:
    require_tested_version("numpy", "2.4.6")
    with pytest.raises(RefusedError, match=r"numpy 2\.5\.5 .* the GPU backend of baldwinlab"):
        require_tested_version("numpy", "2.5.5")


def test_a_gpu_that_disappears_is_reported_in_two_sentences() -> None:
    message = (
        r"^the GPU failed: Call to cuStreamSynchronize results in CUDA_ERROR_DEVICE_UNAVAILABLE\. "
        r"Repeat the command, or use the backend cpu$"
    )
    with pytest.raises(InterruptedStudyError, match=message), explain_failure():
        raise OSError("Call to cuStreamSynchronize results in CUDA_ERROR_DEVICE_UNAVAILABLE")
