"""Test the options of compilation for a GPU, on machines without one."""

from __future__ import annotations

import ast
import gc
import re
import sys
from pathlib import Path
from typing import Any

import pytest

import baldwinlab
from baldwinlab.core.errors import RefusedError
from baldwinlab.engine import require_tested_version
from baldwinlab.engine.gpu import kernel
from tests.engine.gpu_code import compile_kernel, count_operations
from tests.models.miniworld.backends.test_cuda import make_experiments, make_kernels

PACKAGE = Path(baldwinlab.__file__).parent


def multiply_and_add(numbers: Any) -> None:
    numbers[0] = numbers[1] * numbers[2] + numbers[3]


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
