"""Check the arithmetic of hooks (no float64, no libm), the speed, and the isolation of agents.

For the isolation, each hook runs twice for one agent. In the second run, the columns of all other
agents contain NaN or random numbers. Both runs must have the same results for the agent.
"""

from __future__ import annotations

import inspect
import re
import time
from collections.abc import Iterator
from typing import Any, Final, NamedTuple

import numba
import numpy as np
import numpy.typing as npt

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
from baldwinlab.evolution import draw_genomes, make_run_keys
from baldwinlab.experiment import assign
from baldwinlab.experiment.paths import look_up
from baldwinlab.experiment.registry import BUILT_IN
from baldwinlab.models.miniworld.allocation import list_parts, make_model, make_state
from baldwinlab.models.miniworld.backends.cpu import CpuBatch
from baldwinlab.models.miniworld.state import ARRAYS
from baldwinlab.papers.presets import load
from baldwinlab.parts.lane_check import PER_AGENT_HOOKS
from baldwinlab.parts.learning_rules import Synapse
from baldwinlab.parts.networks import Training
from baldwinlab.parts.part import BREEDING_KINDS, Part, overridden_hooks
from baldwinlab.parts.world_features import LineOfSight
from baldwinlab.simulation.simulate import simulate_batch

# The name of an external function in LLVM code, such as `declare float @expf(`.
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
"""The built-in part for comparing speed, by kind of part. Default: the first part of the kind."""
N_ROUNDS: Final = 5
TESTED_AGENT: Final = 2
"""Index of the agent for which the hooks run."""
STEPS: Final = 12
"""Number of steps before the hooks run."""


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
        # Reproduction calculates in float64. A feature with births calls it during lifetimes.
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
    """Return the LLVM code of a hook for a single lane, not for a SIMD block."""
    function: Any = getattr(part, name)
    compiled = numba.njit(**UNWRAPPED, **OPTIONS)(function)
    arguments = _make_arguments(group, part, name)
    try:
        names = inspect.signature(function).parameters
        compiled.compile(tuple(numba.typeof(arguments[argument]) for argument in names))
    except NumbaError as error:
        raise (compile_error(error, [function]) or error) from None
    return str(compiled.inspect_llvm(compiled.signatures[0]))


def _make_arguments(group: PartGroup, part: type[Part], hook: str) -> dict[str, Any]:
    """Return arguments of a hook, by name, in a new state of one world."""
    if part.kind in BREEDING_KINDS and hook != "end_step":
        arguments = breeding_arguments(np.random.default_rng(0), group.experiment)
        if part.kind == "stop":
            arguments["generation"] = 1
        return arguments | {"part": part_values(group.experiment, part)}
    zero = np.float32(0)
    further_arguments = {"x": zero, "y": zero, "line": LineOfSight(zero, zero, zero, zero)}
    state = make_state(group.experiment, 1)
    model = make_model(group.experiment, 1)
    return _list_agent_arguments(group.experiment, model, state, part) | further_arguments


def _list_agent_arguments(experiment: Any, model: Any, state: Any, part: Any) -> dict[str, Any]:
    """Return the arguments of hooks for the agent `TESTED_AGENT`, by name."""
    rate = state.rate[0, TESTED_AGENT]
    synapse = Synapse(
        number=0,
        weight=state.weights[0, TESTED_AGENT],
        x=state.activations[0, TESTED_AGENT],
        y=state.activations[-1, TESTED_AGENT],
        rate=rate,
    )
    training = Training(rate, state.weights, state.activations, state.errors, state.targets)
    return {
        **state._asdict(),
        "world": 0,
        "agent": TESTED_AGENT,
        "lane": TESTED_AGENT,
        "step": STEPS,
        "units": len(state.activations),
        "synapse": synapse,
        "training": training,
        "table": np.empty((len(state.weights), 3), np.float32),
        "model": model,
        "state": state,
        "part": part_values(experiment, part, state),
    }


def measure_speed(group: PartGroup) -> str:
    """Measure the speed of the last part, relative to a built-in part of the same kind."""
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
    """Return assignments of the default values to the settings that the part requires."""
    defaults = {path: look_up(load("evo/A"), path)[0] for path in part.required_settings}
    return [
        f"{path}={list(value) if isinstance(value, tuple) else value}"
        for path, value in defaults.items()
    ]


def _measure_seconds(*experiments: Any) -> list[float]:
    """Return the shortest of `N_ROUNDS` times of each experiment, measured alternately."""
    shortest_seconds = [float("inf")] * len(experiments)
    # The first round compiles.
    for _ in range(N_ROUNDS + 1):
        for index, experiment in enumerate(experiments):
            start = time.perf_counter()
            simulate_batch(experiment, SEED, range(4))
            shortest_seconds[index] = min(shortest_seconds[index], time.perf_counter() - start)
    return shortest_seconds


class _OwnedArray(NamedTuple):
    """An array of a state or a part, with its name and owner."""

    name: str
    owner: str
    values: npt.NDArray[Any]


def check_lane_isolation(group: PartGroup) -> str:
    """Check that per-agent hooks neither read nor write the data of other agents."""
    hooks = [
        (part, name)
        for part in group.parts
        for name in overridden_hooks(part)
        if name in PER_AGENT_HOOKS
    ]
    if not is_of_miniworld(group.experiment) or not hooks:
        return "it has no hook per agent"
    experiment = group.experiment
    batch = CpuBatch(experiment, group.seed, [0])
    batch.begin(0, draw_genomes(experiment, make_run_keys(group.seed, [0], 0)))
    batch.simulate(0, STEPS)
    for part, name in hooks:
        # None: random numbers.
        for garbage in (np.nan, None):
            _check_hook(group, batch, part, name, garbage)
    return ""


def _check_hook(
    group: PartGroup, batch: CpuBatch, part: Any, name: str, garbage: float | None
) -> None:
    """Call a hook with true and with changed data of the other agents, and compare the states."""
    clean = _copy(batch.state)
    dirty = _copy(batch.state)
    random = np.random.default_rng(group.seed)
    for _, owner, array in _list_arrays(dirty):
        if owner == "agent":
            columns = np.arange(array.shape[-1]) != TESTED_AGENT
            array[..., columns] = _make_garbage(array, random, garbage)[..., columns]
    before = _copy(dirty)
    clean_result = _call_hook(group.experiment, batch, clean, part, name)
    dirty_result = _call_hook(group.experiment, batch, dirty, part, name)
    hook = f"{part.__name__}.{name}"
    if clean_result != dirty_result:
        raise FailsError(f"{hook} returns a result that depends on other agents")
    for old, expected, actual in zip(*map(_list_arrays, (before, clean, dirty)), strict=True):
        is_of_agents = actual.owner == "agent"
        column = (..., TESTED_AGENT) if is_of_agents else ...
        if actual.values[column].tobytes() != expected.values[column].tobytes():
            raise FailsError(f"{hook} makes {actual.name} of an agent depend on other agents")
        if is_of_agents and _bytes_of_others(actual.values) != _bytes_of_others(old.values):
            raise FailsError(f"{hook} writes {actual.name} of other agents")


def _bytes_of_others(array: npt.NDArray[Any]) -> bytes:
    """Return the bytes of the columns of all agents except `TESTED_AGENT`."""
    return np.delete(array, TESTED_AGENT, -1).tobytes()


def _call_hook(experiment: Any, batch: CpuBatch, state: Any, part: Any, name: str) -> Any:
    """Call a hook for one agent, in plain Python."""
    arguments = _list_agent_arguments(experiment, batch.model, state, part)
    function = getattr(part, name)
    names = inspect.signature(function).parameters
    with np.errstate(all="ignore"):
        try:
            return function(*(arguments[argument] for argument in names))
        except (IndexError, ValueError) as error:
            raise FailsError(
                f"{part.__name__}.{name} fails if the data of other agents change: {error}"
            ) from None


def _make_garbage(
    array: npt.NDArray[Any], random: np.random.Generator, value: float | None
) -> npt.NDArray[Any]:
    """Return an array of `value`. For integers, or if `value` is None, return random numbers."""
    if array.dtype.kind != "f":
        return random.integers(0, 4, array.shape).astype(array.dtype)
    if value is not None:
        return np.full_like(array, value)
    return random.normal(0, 9, array.shape).astype(array.dtype)


def _copy(entry: Any) -> Any:
    if isinstance(entry, np.ndarray):
        return entry.copy()
    if isinstance(entry, tuple):
        copies = map(_copy, entry)
        return type(entry)(*copies) if hasattr(entry, "_fields") else tuple(copies)
    return entry


def _list_arrays(state: Any) -> Iterator[_OwnedArray]:
    """Yield the arrays of a state and of its parts, without arrays of the run."""
    for name, array in ARRAYS.items():
        yield _OwnedArray(name, array.owner, getattr(state, name))
    for _, values in list_parts(state):
        for name, array in type(values).part.arrays.items():
            if array.owner == "run":
                continue
            yield _OwnedArray(name, array.owner, getattr(values, name))
