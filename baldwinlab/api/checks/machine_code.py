"""Check the machine code of hooks: no float64 in hooks of agents, and no call of libm."""

from __future__ import annotations

import inspect
import re
from typing import Any, Final

import numba
import numpy as np
from numba import types

from baldwinlab.api.checks.findings import FailsError
from baldwinlab.api.checks.fixture import BREEDS, Subject, breeding_arguments, values_of
from baldwinlab.engine.compile_errors import compile_error
from baldwinlab.engine.jit import OPTIONS
from baldwinlab.engine.numba_internals.dispatchers import (
    RANDOM_SYMBOLS,
    RUNTIME_SYMBOLS,
    UNWRAPPED,
    NumbaError,
)
from baldwinlab.models.miniworld.allocation import make_model, make_state
from baldwinlab.parts.part import Part, overridden_hooks

DECLARED: Final = re.compile(r"^declare [^\n]*?@\"?([\w.$]+)\"?\(", re.MULTILINE)
DOUBLE: Final = re.compile(
    r"= (fadd|fsub|fmul|fdiv|frem|fcmp|fpext|sitofp|uitofp)\b[^\n]*\bdouble\b"
)
OF_INTEGER: Final = re.compile(r"= [su]itofp\b[^\n]*\bto double\b")
HARMLESS: Final = re.compile(rf"{RUNTIME_SYMBOLS}|mem(set|cpy|move)$|llvm\.")
# Functions with the same results on every machine.
EXACT: Final = re.compile(r"(floor|ceil|trunc|rint|fabs|fmod|copysign|sqrt)f?$")
LIBM: Final = re.compile(
    r"llvm\.(sin|cos|tan|exp|exp2|exp10|log|log2|log10|pow|powi|fma|fmuladd)\."
)
RANDOM: Final = re.compile(RANDOM_SYMBOLS)


def check_arithmetic(subject: Subject) -> str:
    """Check that the hooks of parts use portable arithmetic.

    Parameters
    ----------
    subject
        The parts to check.

    Returns
    -------
    str
        A remark, or an empty string.

    Raises
    ------
    FailsError
        If a hook uses float64, libm, or random numbers of Numba.
    """
    hooks = [(part, name) for part in subject.parts for name in overridden_hooks(part)]
    if not hooks:
        return "it has no hooks of its own"
    for part, name in hooks:
        code = _code(subject, part, name)
        where = f"{part.__name__}.{name}"
        for symbol in DECLARED.findall(code):
            if RANDOM.match(symbol):
                raise FailsError(
                    f"{where} draws random numbers that no seed decides; take them from philox"
                )
            if LIBM.match(symbol) or not (HARMLESS.match(symbol) or EXACT.match(symbol)):
                raise FailsError(
                    f"{where} calls {symbol}, which has other bits elsewhere; "
                    "use baldwinlab.engine.arithmetic"
                )
        breeds = part.kind in BREEDS or getattr(part, "allows_births", False)
        if not breeds and DOUBLE.search(code):
            raise FailsError(f"{where} calculates in float64: {_reason_of_float64(code)}")
    return ""


def _reason_of_float64(code: str) -> str:
    if OF_INTEGER.search(code):
        return "an integer and a float32 make a float64; write np.float32(n) for an integer n"
    return "constants must be float32, such as np.float32(0.5)"


def _code(subject: Subject, part: type[Part], name: str) -> str:
    """Return the LLVM code of a hook for a single lane."""
    function: Any = getattr(part, name)
    compiled = numba.njit(**UNWRAPPED, **OPTIONS)(function)
    argument_types = _types(subject, part)
    try:
        compiled.compile(
            tuple(argument_types[name] for name in inspect.signature(function).parameters)
        )
    except NumbaError as error:
        raise (compile_error(error, [function]) or error) from None
    return str(compiled.inspect_llvm(compiled.signatures[0]))


def _types(subject: Subject, part: type[Part]) -> dict[str, Any]:
    """Return the types of the arguments of hooks, by name."""
    if part.kind in BREEDS:
        arguments = breeding_arguments(
            np.random.default_rng(0), len(subject.experiment.modules)
        ) | {"part": values_of(subject.experiment, part)}
        return {name: numba.typeof(value) for name, value in arguments.items()}
    state = make_state(subject.experiment, 1)
    single = dict.fromkeys(("x", "y", "dx", "dy", "rate"), types.float32)
    integers = dict.fromkeys(("world", "agent", "lane", "step", "first", "units"), types.int64)
    arrays = {
        name: numba.typeof(getattr(state, name))
        for name in ("weights", "activations", "errors", "targets")
    }
    arrays["genes"] = arrays["found"] = arrays["weights"]
    of_part = {
        "part": numba.typeof(values_of(subject.experiment, part, state)),
        "state": numba.typeof(state),
    }
    return {
        **single,
        **integers,
        **arrays,
        **of_part,
        "model": numba.typeof(make_model(subject.experiment, 1)),
    }
