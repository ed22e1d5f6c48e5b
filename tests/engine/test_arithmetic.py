"""Test the arithmetic functions that do not call libm: accuracy, bits and machine code."""

from __future__ import annotations

import hashlib
import math
import re
from collections.abc import Callable
from decimal import Decimal, getcontext

import numba
import numpy as np
import numpy.typing as npt
import pytest
from scipy.special import ndtri

from baldwinlab.engine import arithmetic
from baldwinlab.engine.jit import OPTIONS, cached_jit
from baldwinlab.engine.simd import square_root
from tests.engine.processes import run_python

Function = Callable[[float], float]
Numbers = npt.NDArray[np.float64]
PYTHON: tuple[Function, ...] = (
    arithmetic.logarithm,
    arithmetic.power_of_ten,
    arithmetic.normal_quantile,
)
FUNCTIONS = logarithm, power_of_ten, normal_quantile = tuple(map(cached_jit, PYTHON))
sigmoid = cached_jit(arithmetic.sigmoid)
RANDOM = np.random.default_rng(1)
ARGUMENTS: dict[Function, Numbers] = {
    logarithm: np.concatenate(
        [
            np.exp(RANDOM.uniform(-744, 709, 2000)),
            RANDOM.uniform(0.5, 2, 2000),
            [5e-324, 1, 2.0**1023],
        ]
    ),
    power_of_ten: np.concatenate(
        [RANDOM.uniform(-307, 308.2, 2000), RANDOM.normal(0, 1, 2000), np.arange(-300.0, 308.0)]
    ),
    normal_quantile: np.concatenate(
        [
            RANDOM.uniform(0, 1, 4000),
            np.exp(RANDOM.uniform(-700, 0, 2000)),
            [2.0**-33, 1 - 2.0**-33],
        ]
    ),
}


def evaluate_all(function: Function, arguments: Numbers) -> Numbers:
    return np.array([function(argument) for argument in arguments.tolist()])


def units_in_last_place(actual: Numbers, expected: list[Decimal]) -> float:
    """Return the largest error, in units in the last place."""
    return max(
        float(abs(Decimal(value) - exact) / Decimal(math.ulp(float(exact))))
        for value, exact in zip(actual.tolist(), expected, strict=True)
    )


@pytest.mark.parametrize(
    ("function", "exact", "limit", "point"),
    [
        (logarithm, Decimal.ln, 1, (1, 0)),
        (power_of_ten, lambda x: Decimal(10) ** x, 2, (0, 1)),
    ],
)
def test_the_error_is_below_one_or_two_units_in_the_last_place(
    function: Function, exact: Callable[[Decimal], Decimal], limit: int, point: tuple[int, int]
) -> None:
    getcontext().prec = 40
    arguments = ARGUMENTS[function]
    expected = [exact(Decimal(argument)) for argument in arguments.tolist()]
    assert units_in_last_place(evaluate_all(function, arguments), expected) < limit
    argument, value = point
    assert function(argument) == value


def test_a_normal_quantile_is_symmetric_and_equals_that_of_scipy_to_fifteen_digits() -> None:
    arguments = ARGUMENTS[normal_quantile]
    np.testing.assert_allclose(
        evaluate_all(normal_quantile, arguments), ndtri(arguments), rtol=2e-15, atol=0
    )
    # 1 - p is exact for these numbers.
    dyadic: Numbers = RANDOM.integers(1, 2**32, 1000).astype(np.float64) * 2.0**-33
    np.testing.assert_array_equal(
        evaluate_all(normal_quantile, dyadic), -evaluate_all(normal_quantile, 1 - dyadic)
    )


@pytest.mark.parametrize(
    ("function", "argument", "expected"),
    [
        (logarithm, 0.0, -math.inf),
        (logarithm, -1.0, math.nan),
        (logarithm, math.inf, math.inf),
        (power_of_ten, 308.3, math.inf),
        (power_of_ten, 1e300, math.inf),
        (power_of_ten, -1e300, 0),
        (power_of_ten, -330, 0),
        (power_of_ten, -320.0, 1e-320),
        (power_of_ten, -math.inf, 0),
        (normal_quantile, 0.0, -math.inf),
        (normal_quantile, 1.0, math.inf),
        (normal_quantile, 0.5, 0),
        (normal_quantile, 1.5, math.nan),
        (normal_quantile, -0.5, math.nan),
        *((function, math.nan, math.nan) for function in FUNCTIONS),
    ],
)
def test_a_function_has_the_right_limits(
    function: Function, argument: float, expected: float
) -> None:
    np.testing.assert_equal(function(argument), expected)


def print_bits() -> None:
    for function in FUNCTIONS:
        print(hashlib.sha256(evaluate_all(function, ARGUMENTS[function]).tobytes()).hexdigest())
    print(hashlib.sha256(np.array([sigmoid(z) for z in grid()], np.float32).tobytes()).hexdigest())


def test_plain_python_gives_the_same_bits(capsys: pytest.CaptureFixture[str]) -> None:
    print_bits()
    code = "from tests.engine.test_arithmetic import print_bits; print_bits()"
    done = run_python(code, environment={"NUMBA_DISABLE_JIT": "1", "PYTHONWARNINGS": "error"})
    assert done.stdout == capsys.readouterr().out


@pytest.mark.parametrize("function", PYTHON)
def test_the_machine_code_calls_only_functions_of_python(function: Function) -> None:
    # The package compiles no C wrapper either. Whether LLVM removes its unused code can differ.
    fresh = numba.njit(no_cfunc_wrapper=True, **OPTIONS)(function)
    fresh(0.25)
    (code,) = fresh.inspect_llvm().values()
    declared = re.findall(r"^declare .*?@([\w.$]+)\(", code, re.MULTILINE)
    assert "PyFloat_FromDouble" in declared
    assert [name for name in declared if not name.startswith("Py")] in (
        [],
        ["llvm.fabs.f64"],
        ["llvm.fabs.f64", "llvm.sqrt.f64"],
    )


def test_gpu_code_rounds_every_operation_and_calls_no_function(h200: None) -> None:
    from numba.cuda import compile_ptx, types

    from baldwinlab.engine.gpu import without_contraction

    def kernel(out: Numbers, x: float) -> None:
        out[0] = arithmetic.logarithm(x)
        out[1] = arithmetic.power_of_ten(x)
        out[2] = arithmetic.normal_quantile(x)

    with without_contraction():
        code, _ = compile_ptx(kernel, (types.float64[::1], types.float64), cc=(9, 0))
    operations = set(
        re.findall(
            r"^\s+(?:@\S+ )?((?:add|sub|mul|div|fma|mad|rcp|sqrt|ex2|lg2)\.\S*f64)",
            code,
            re.MULTILINE,
        )
    )
    assert operations == {"add.rn.f64", "sub.rn.f64", "mul.rn.f64", "div.rn.f64", "sqrt.rn.f64"}
    assert not re.search(r"^\s+call", code, re.MULTILINE)


def test_a_square_root_is_correctly_rounded() -> None:
    root = numba.njit(lambda x: square_root(x))
    for number in RANDOM.uniform(0, 1e6, 100).tolist():
        assert root(number) == math.sqrt(number)
        assert root(np.float32(number)) == np.sqrt(np.float32(number))


share_of_turn = cached_jit(arithmetic.share_of_turn)


def test_the_share_of_a_turn_equals_the_arctangent_to_the_precision_of_float32() -> None:
    for u, v in RANDOM.normal(size=(4000, 2)).astype(np.float32):
        share = share_of_turn(u, v)
        assert abs(share - math.atan2(v, u) / math.tau % 1) < 1e-7
        assert np.float32(share) == arithmetic.share_of_turn(u, v), "plain Python has other bits"
    quarters = [
        share_of_turn(np.float32(u), np.float32(v))
        for u, v in ((1, 0), (0, 3), (-2, 0), (0, -1), (0, 0))
    ]
    assert quarters == [0, 0.25, 0.5, 0.75, 0]


def grid() -> list[np.float32]:
    values = np.concatenate(
        [
            np.linspace(-20, 20, 40_001),
            np.geomspace(1e-30, 1e30, 4_001),
            -np.geomspace(1e-30, 1e30, 4_001),
        ]
    )
    return list(values.astype(np.float32))


def logistic(z: float) -> float:
    return 1 / (1 + math.exp(-z)) if z > -700 else 0.0


def test_the_sigmoid_is_the_logistic_function_between_0_and_1_to_the_precision_of_float32() -> None:
    for z in grid():
        value = sigmoid(z)
        assert isinstance(value, float | np.float32) and 0 < value < 1
        assert abs(float(value) - logistic(float(z))) < 2.5e-7
        assert abs(float(value) + float(sigmoid(-z)) - 1) < 1e-7
    assert sigmoid(np.float32(0)) == sigmoid(np.float32(-0.0)) == 0.5
