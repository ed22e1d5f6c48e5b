"""Check the machine code of hooks: no float64 in hooks of agents, and no call of libm."""

from __future__ import annotations

import inspect
import re
from typing import Any, Final

import numba
import numpy as np
from numba import types

from baldwinlab.api.checks.findings import FailsError
from baldwinlab.api.checks.fixture import PartGroup, breeding_arguments, part_values
from baldwinlab.engine.compile_errors import compile_error
from baldwinlab.engine.jit import OPTIONS
from baldwinlab.engine.numba_internals.dispatchers import (
    RANDOM_SYMBOLS,
    RUNTIME_SYMBOLS,
    UNWRAPPED,
    NumbaError,
)
from baldwinlab.models.miniworld.allocation import make_model, make_state
from baldwinlab.parts.networks import Training
from baldwinlab.parts.part import BREEDING_KINDS, Part, overridden_hooks
from baldwinlab.parts.synapses import Synapse
from baldwinlab.parts.world_features import LineOfSight

DECLARED_SYMBOL: Final = re.compile(r"^declare [^\n]*?@\"?([\w.$]+)\"?\(", re.MULTILINE)
FLOAT64_INSTRUCTION: Final = re.compile(
    r"= (fadd|fsub|fmul|fdiv|frem|fcmp|fpext|sitofp|uitofp)\b[^\n]*\bdouble\b"
)
INTEGER_TO_FLOAT64: Final = re.compile(r"= [su]itofp\b[^\n]*\bto double\b")
HARMLESS_SYMBOL: Final = re.compile(rf"{RUNTIME_SYMBOLS}|mem(set|cpy|move)$|llvm\.")
# Functions with the same results on every machine.
EXACT_SYMBOL: Final = re.compile(r"(floor|ceil|trunc|rint|fabs|fmod|copysign|sqrt)f?$")
LIBM_SYMBOL: Final = re.compile(
    r"llvm\.(sin|cos|tan|exp|exp2|exp10|log|log2|log10|pow|powi|fma|fmuladd)\."
)
RANDOM_SYMBOL: Final = re.compile(RANDOM_SYMBOLS)


def check_arithmetic(group: PartGroup) -> str:
    """Check that the hooks of parts use portable arithmetic.

    Returns a remark, or an empty string.
    """
    hooks = [(part, name) for part in group.parts for name in overridden_hooks(part)]
    if not hooks:
        return "it has no hooks"
    for part, name in hooks:
        code = _compile_to_llvm(group, part, name)
        hook = f"{part.__name__}.{name}"
        for symbol in DECLARED_SYMBOL.findall(code):
            if RANDOM_SYMBOL.match(symbol):
                raise FailsError(
                    f"{hook} draws random numbers that do not depend on the seed; use philox"
                )
            if LIBM_SYMBOL.match(symbol) or not (
                HARMLESS_SYMBOL.match(symbol) or EXACT_SYMBOL.match(symbol)
            ):
                raise FailsError(
                    f"{hook} calls {symbol}, which differs between machines; "
                    "use baldwinlab.engine.arithmetic"
                )
        is_of_evolution = part.kind in BREEDING_KINDS and name != "end_step"
        allows_float64 = is_of_evolution or getattr(part, "allows_births", False)
        if not allows_float64 and FLOAT64_INSTRUCTION.search(code):
            raise FailsError(f"{hook} calculates in float64: {_explain_float64(code)}")
    return ""


def _explain_float64(code: str) -> str:
    if INTEGER_TO_FLOAT64.search(code):
        return "an integer and a float32 make a float64; write np.float32(n) for an integer n"
    return "constants must be float32, such as np.float32(0.5)"


def _compile_to_llvm(group: PartGroup, part: type[Part], name: str) -> str:
    """Return the LLVM code of a hook for a single lane."""
    function: Any = getattr(part, name)
    compiled = numba.njit(**UNWRAPPED, **OPTIONS)(function)
    argument_types = _argument_types(group, part, name)
    try:
        names = inspect.signature(function).parameters
        compiled.compile(tuple(argument_types[argument] for argument in names))
    except NumbaError as error:
        raise (compile_error(error, [function]) or error) from None
    return str(compiled.inspect_llvm(compiled.signatures[0]))


def _argument_types(group: PartGroup, part: type[Part], hook: str) -> dict[str, Any]:
    """Return the types of the arguments of a hook, by name."""
    if part.kind in BREEDING_KINDS and hook != "end_step":
        arguments = breeding_arguments(np.random.default_rng(0), group.experiment) | {
            "part": part_values(group.experiment, part)
        }
        if part.kind == "stop":
            arguments["generation"] = 1
        return {name: numba.typeof(value) for name, value in arguments.items()}
    state = make_state(group.experiment, 1)
    zero = np.float32(0)
    training = Training(zero, state.weights, state.activations, state.errors, state.targets)
    return {
        **dict.fromkeys(("x", "y"), types.float32),
        **dict.fromkeys(("world", "agent", "lane", "step", "units"), types.int64),
        **dict.fromkeys(("weights", "genes", "table"), numba.typeof(state.weights)),
        "activations": numba.typeof(state.activations),
        "line": numba.typeof(LineOfSight(zero, zero, zero, zero)),
        "synapse": numba.typeof(Synapse(0, zero, zero, zero, zero)),
        "training": numba.typeof(training),
        "part": numba.typeof(part_values(group.experiment, part, state)),
        "state": numba.typeof(state),
        "model": numba.typeof(make_model(group.experiment, 1)),
    }
