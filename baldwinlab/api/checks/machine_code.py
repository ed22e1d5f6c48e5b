"""Check the machine code of hooks: float32, no call of libm, and its speed."""

from __future__ import annotations

import inspect
import re
import time
from typing import Any, Final

import numba
import numpy as np
from numba import types

from baldwinlab.api.checks.findings import FailsError, NotCheckedError
from baldwinlab.api.checks.fixture import (
    CHOICE_PATHS,
    SEED,
    PartGroup,
    breeding_arguments,
    is_of_miniworld,
    part_values,
)
from baldwinlab.engine.compile_errors import compile_error
from baldwinlab.engine.jit import OPTIONS
from baldwinlab.engine.numba_internals.dispatchers import (
    RANDOM_SYMBOLS,
    RUNTIME_SYMBOLS,
    UNWRAPPED,
    NumbaError,
)
from baldwinlab.experiment import assign
from baldwinlab.experiment.paths import look_up
from baldwinlab.experiment.registry import BUILT_IN
from baldwinlab.models.miniworld.allocation import make_model, make_state
from baldwinlab.papers.presets import load
from baldwinlab.parts.learning_rules import Synapse
from baldwinlab.parts.networks import Training
from baldwinlab.parts.part import BREEDING_KINDS, Part, overridden_hooks
from baldwinlab.parts.world_features import LineOfSight
from baldwinlab.simulation.simulate import simulate_batch

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


BASELINES: Final = {"learning rule": "self-taught"}
"""The built-in part to compare with; by default, the first one of the kind."""
N_ROUNDS: Final = 5


def check_arithmetic(group: PartGroup) -> str:
    """Check that the hooks of parts use portable arithmetic."""
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


def measure_speed(group: PartGroup) -> str:
    """Measure the speed of a part, relative to a built-in part of its kind."""
    if not is_of_miniworld(group.experiment):
        raise NotCheckedError("there is no built-in model to compare with")
    part = group.parts[-1]
    baseline = BASELINES.get(part.kind) or next(iter(BUILT_IN[part.kind]), None)
    title = f"the built-in {part.kind} {baseline!r}" if baseline else "a world without it"
    network = {} if "network.hidden" in part.required_settings else {"network": {"hidden": [10]}}
    lifetime = {"steps": 500 if part.kind in BREEDING_KINDS else 3000}
    timed_experiment = group.experiment.replace(
        population={"size": 20}, lifetime=lifetime, **network
    )
    value = baseline
    if part.kind in ("sense", "world feature"):
        value = f'["{baseline}"]' if baseline else "[]"
    settings = [f"{CHOICE_PATHS[part.kind]}={value}", *_default_settings(part)]
    seconds, built_in_seconds = _measure_seconds(
        timed_experiment, assign(timed_experiment, settings)
    )
    return f"{built_in_seconds / seconds:.2f} times the speed of {title}"


def _default_settings(part: type[Part]) -> list[str]:
    """Return the settings that the part requires, with their defaults."""
    defaults = {path: look_up(load("evo/A"), path)[0] for path in part.required_settings}
    return [
        f"{path}={list(value) if isinstance(value, tuple) else value}"
        for path, value in defaults.items()
    ]


def _measure_seconds(*experiments: Any) -> list[float]:
    """Return the shortest of `N_ROUNDS` times of each experiment, measured in turns."""
    shortest_seconds = [float("inf")] * len(experiments)
    # The first round compiles.
    for _ in range(N_ROUNDS + 1):
        for index, experiment in enumerate(experiments):
            start = time.perf_counter()
            simulate_batch(experiment, SEED, range(4))
            shortest_seconds[index] = min(shortest_seconds[index], time.perf_counter() - start)
    return shortest_seconds
