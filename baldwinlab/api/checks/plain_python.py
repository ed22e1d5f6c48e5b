"""Check parts in plain Python: indices, outputs, and reads of unwritten memory.

Compiled code does not check indices. An index outside an array reads or writes other memory, or
ends the process. NumPy counts a negative index from the end, but compiled `get` and `put` do not.
A watched hook therefore gets arrays that refuse indices outside the array and negative indices.
Errors name the part, the hook, the line, the array, the index and the size.
"""

from __future__ import annotations

import inspect
import random
import sys
import traceback
import warnings
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from functools import reduce, wraps
from typing import Any, Final, NamedTuple

import numpy as np
import numpy.typing as npt

from baldwinlab.api.checks.findings import CheckFinding
from baldwinlab.api.checks.fixture import Case, PartGroup, make_cases, part_label
from baldwinlab.api.checks.processes import PLAIN_ENVIRONMENT, Process, ProcessEndError
from baldwinlab.api.checks.reproducibility import hash_runs
from baldwinlab.core.errors import BaldwinLabError
from baldwinlab.core.third_party_code import locate_error
from baldwinlab.engine import poison
from baldwinlab.parts.part import Part, overridden_hooks
from baldwinlab.parts.senses import count_inputs

AXIS_NOUNS: Final = {1: (("entry", "entries"),), 2: (("row", "rows"), ("column", "columns"))}
"""Singular and plural of the entries along each axis, by number of dimensions."""
OUTPUT_ARRAYS: Final = {
    "vary": "mating.child",
    "vary_population": "brood.children",
    "select": "generation.parents",
    "evaluate": "fitness",
}
"""The array that each hook fills. `_list_outputs` adds the hooks `measure` and `inherit`."""
VARIATION_HOOKS: Final = ("vary", "vary_population")
"""Hooks that create children."""
DESCRIPTIONS: Final = {
    "bounds": "it stays within its arrays, in plain Python",
    "unwritten": "no output and no result depends on memory that was never written",
}
Outcome = dict[str, Any]
"""The result of a group of parts.

The key "bits" has hashes by case. If the simulation fails, a key of `DESCRIPTIONS` has a message
instead. The key "read" describes the first read of unwritten memory.
"""


class HookError(BaldwinLabError):
    """Error of a hook in plain Python. The message names the part, the hook and the line."""


class UnwrittenError(HookError):
    """Error of a hook that leaves an output unwritten."""


class _Call(NamedTuple):
    """A call of a hook."""

    part: type[Part]
    hook: str
    file: str

    def describe(self, line: int | None) -> str:
        hook = f"{part_label(self.part)}: {self.hook}"
        return hook if line is None else f"{hook}, line {line}"


class Watch:
    """Replace the hooks of parts in this process by watched hooks.

    `unwritten_read`: the first read of unwritten memory, or an empty string.
    """

    def __init__(self, parts: Iterable[type[Part]]) -> None:
        self.unwritten_read = ""
        self._calls: list[_Call] = []
        # Cache by type and name of a tuple: the last tuple, and a copy of it with named arrays.
        self._named: dict[tuple[type, str], tuple[Any, Any]] = {}
        for part in parts:
            for hook in overridden_hooks(part):
                setattr(part, hook, staticmethod(self._watch_hook(part, hook)))

    def _watch_hook(self, part: type[Part], hook: str) -> Callable[..., Any]:
        function: Any = getattr(part, hook)
        names = list(inspect.signature(function).parameters)
        call = _Call(part, hook, function.__code__.co_filename)

        @wraps(function)
        def watched(*arguments: Any) -> Any:
            values = dict(zip(names, arguments, strict=True))
            outputs = _list_outputs(part, hook, values)
            for array in outputs.values():
                array[...] = _unwritten_value(array)
            self._calls.append(call)
            try:
                result = function(*(self._add_name(value, name) for name, value in values.items()))
            except HookError:
                raise
            # A hook can raise any exception.
            except BaseException as error:
                location = call.describe(_find_line(error, call.file))
                raise HookError(f"{location}: {_format_error(error)}") from None
            finally:
                self._calls.pop()
            for name, array in outputs.items():
                if (index := _find_first_unwritten(array)) is not None:
                    entry = f"{name}[{_format_index(index)}]"
                    raise UnwrittenError(f"{call.describe(None)} leaves {entry} unwritten")
            return result

        return watched

    def _add_name(self, value: Any, name: str) -> Any:
        """Return a view of an array, or a copy of a tuple of arrays, whose arrays have names."""
        if isinstance(value, NamedArray):
            return value
        if isinstance(value, np.ndarray):
            named = value.view(NamedArray)
            named.name = name
            named.watch = self
            return named
        if not isinstance(value, tuple):
            return value
        key = type(value), name
        if key not in self._named or self._named[key][0] is not value:
            self._named[key] = value, self._add_field_names(value, name)
        return self._named[key][1]

    def _add_field_names(self, value: Any, name: str) -> Any:
        if not hasattr(value, "_fields"):
            return tuple(
                self._add_name(entry, f"{name}[{index}]") for index, entry in enumerate(value)
            )
        fields = zip(value._fields, value, strict=True)
        return type(value)(*(self._add_name(entry, f"{name}.{field}") for field, entry in fields))

    def note_read(self, array: str, index: Any) -> None:
        """Store the first read of unwritten memory. The first read can cause later ones."""
        if not self._calls or self.unwritten_read:
            return
        call = self._calls[-1]
        frame: Any = sys._getframe()
        while frame is not None and frame.f_code.co_filename != call.file:
            frame = frame.f_back
        location = call.describe(frame.f_lineno if frame is not None else None)
        self.unwritten_read = f"{location}: {array}[{_format_index(index)}]"


class NamedArray(np.ndarray):
    """An array that refuses an index outside it and reports reads of unwritten memory."""

    name: str = ""  # The name of the array. Empty for a result of calculations.
    watch: Watch | None = None  # The watch that gets the reads.

    def __getitem__(self, index: Any) -> Any:
        if not self.name:
            return super().__getitem__(index)
        self._require_within(index)
        value = super().__getitem__(index)
        if isinstance(value, NamedArray):
            value.name = f"{self.name}[{_format_index(index)}]"
            value.watch = self.watch
        elif self.watch is not None and poison.is_on() and _is_poisoned(value):
            self.watch.note_read(self.name, index)
        return value

    def __setitem__(self, index: Any, value: Any) -> None:
        if self.name:
            self._require_within(index)
        super().__setitem__(index, value)

    def _require_within(self, index: Any) -> None:
        entries = index if isinstance(index, tuple) else (index,)
        for axis, entry in enumerate(entries):
            if entry is Ellipsis:
                return
            is_number = isinstance(entry, int | np.integer)
            if is_number and axis < self.ndim and not 0 <= entry < self.shape[axis]:
                message = (
                    f"index {entry} of {self.name}, which has {_format_size(self.shape, axis)}"
                )
                if entry < 0:
                    message += "; an index must be at least 0"
                raise IndexError(message)


def _format_size(shape: tuple[int, ...], axis: int) -> str:
    """Return the size of an axis with its noun, such as "5 columns"."""
    has_nouns = len(shape) in AXIS_NOUNS
    singular, plural = AXIS_NOUNS[len(shape)][axis] if has_nouns else ("entry", "entries")
    size = f"{shape[axis]} {singular if shape[axis] == 1 else plural}"
    return size if has_nouns else f"{size} along axis {axis}"


def _format_index(index: Any) -> str:
    entries = index if isinstance(index, tuple) else (index,)
    return ", ".join(":" if isinstance(entry, slice) else str(entry) for entry in entries)


def _is_poisoned(value: Any) -> bool:
    """Return whether a number equals the pattern of unwritten memory.

    Calculations and counts seldom result in the numbers of the patterns.
    """
    pattern = poison.PATTERNS[poison.pattern_number()]
    if isinstance(value, np.floating):
        return bool(value == value.dtype.type(pattern.real))
    is_signed = isinstance(value, np.signedinteger)
    return is_signed and pattern.signed < 0 and bool(value == pattern.signed)


def _list_outputs(part: Any, hook: str, values: Mapping[str, Any]) -> dict[str, npt.NDArray[Any]]:
    """Return the arrays that a hook must fill, by name."""
    if hook == "measure":
        lane = values["world"] * values["model"].agents + values["agent"]
        first = values["part"].first_input
        rows = slice(first, first + count_inputs(values["part"]))
        return {"state.activations": np.asarray(values["state"].activations)[rows, lane]}
    if hook == "inherit":
        # A genome can have further genes after those of the action module.
        inherited_genome = np.asarray(values["inherited_genome"])
        return {"inherited_genome[0]": inherited_genome[0, : values["learned"].size]}
    if hook not in OUTPUT_ARRAYS:
        return {}
    argument, *fields = OUTPUT_ARRAYS[hook].split(".")
    output = reduce(getattr, fields, values[argument])
    if hook in VARIATION_HOOKS and part.genes:
        # A variation with genes reads the genes of the child, the last entries of the first module.
        children = np.asarray(output)
        first_gene = values["part"].first_gene
        return {"first module": children[..., 0, :first_gene], "modules": children[..., 1:, :]}
    return {OUTPUT_ARRAYS[hook]: np.asarray(output)}


def _unwritten_value(array: npt.NDArray[Any]) -> float:
    """Return a value that no hook should write: NaN, or the smallest integer of the type."""
    return np.nan if array.dtype.kind == "f" else np.iinfo(array.dtype).min


def _find_first_unwritten(array: npt.NDArray[Any]) -> tuple[int, ...] | None:
    is_unwritten = np.isnan(array) if array.dtype.kind == "f" else array == _unwritten_value(array)
    return tuple(map(int, np.argwhere(is_unwritten)[0])) if is_unwritten.any() else None


def _find_line(error: BaseException, file: str) -> int | None:
    """Return the line of the file in which the error was raised."""
    frames = traceback.extract_tb(error.__traceback__)
    return next((frame.lineno for frame in reversed(frames) if frame.filename == file), None)


def _format_error(error: BaseException) -> str:
    text = " ".join(str(error).split())
    return text if isinstance(error, IndexError) else f"{type(error).__name__}: {text}"


def simulate_cases(group: PartGroup, watch: Watch) -> Outcome:
    """Simulate all cases of a group in this process, with watched hooks."""
    watch.unwritten_read = ""
    bits: dict[str, list[str]] = {}
    # In compiled code, the result of such a division is 0 or infinite, without an error.
    warnings.filterwarnings("error", "divide by zero encountered in .*(floor_divide|remainder)")
    for case in make_cases(group):
        # Without these seeds, random numbers of a part would look like unwritten memory.
        random.seed(0)
        np.random.seed(0)  # noqa: NPY002
        try:
            bits[case.description] = hash_runs(case.experiment, group.seed, [0])
        except UnwrittenError as error:
            return {"unwritten": _add_case(str(error), case)}
        except HookError as error:
            return {"bounds": _add_case(str(error), case)}
        except (BaldwinLabError, ValueError) as error:
            message = f"{group.label}: {error}"
            return {"bounds": _add_case(message, case), "read": watch.unwritten_read}
        # The code of a part outside its hooks can raise any exception.
        except BaseException as error:
            return {"bounds": _add_case(f"{group.label}: {locate_error(error)}", case)}
    return {"bits": bits, "read": watch.unwritten_read}


def _add_case(message: str, case: Case) -> str:
    return f"{' '.join(message.split())} (with {case.description})"


def simulate_groups(groups: Sequence[PartGroup], seed: int) -> list[list[Outcome]]:
    """Return the outcomes [pattern][group]. Each pattern of unwritten memory has one process."""
    parts = list(dict.fromkeys(part for group in groups for part in group.parts))
    environments = [
        PLAIN_ENVIRONMENT | {poison.ENVIRONMENT_VARIABLE: str(number)} for number in poison.PATTERNS
    ]
    # All processes start before the first answer is read, so they run at the same time.
    processes = [Process("hooks", parts, environment, seed=seed) for environment in environments]
    return [_read_answers(process) for process in processes]


def _read_answers(process: Process) -> list[Outcome]:
    answers: list[Outcome] = []
    try:
        answers.extend(process.answers())
    except ProcessEndError as error:
        answers.append({"bounds": f"in plain Python, {error}"})
    return answers


def list_findings(
    groups: Sequence[PartGroup],
    outcomes: Sequence[Sequence[Outcome]],
    commands: Mapping[str, str],
) -> Iterator[CheckFinding]:
    """Yield a finding for each of `DESCRIPTIONS`, or only the failures if there are any.

    `outcomes`: [pattern][group], with patterns of unwritten memory.
    """
    # A process that ended early has fewer outcomes than groups, so `strict` is False.
    rows = zip(groups, *outcomes, strict=False)
    failures = [_find_failure(group, group_outcomes) for group, *group_outcomes in rows]
    for name, description in DESCRIPTIONS.items():
        message = next((failure[name] for failure in failures if name in failure), None)
        if message is None and any(failures):
            continue
        if message is None:
            worlds = sum(len(outcome["bits"]) for outcome in outcomes[0])
            yield CheckFinding(description, True, f"{worlds} small worlds", commands[name])
        else:
            yield CheckFinding(description, False, message, commands[name])


def _find_failure(group: PartGroup, outcomes: Sequence[Outcome]) -> Outcome:
    """Return {requirement: message} for the failure of a group, or an empty dict."""
    failed = [outcome for outcome in outcomes if "bits" not in outcome]
    if len(failed) == len(outcomes):
        return failed[0]
    reads = dict.fromkeys(outcome["read"] for outcome in outcomes if outcome.get("read"))
    hint = f"{'; '.join(reads)}: read before it was written" if reads else ""
    # The group fails under some patterns, so the results depend on unwritten memory.
    if failed:
        message = failed[0].get("bounds") or failed[0]["unwritten"]
        return {"unwritten": f"{hint}; therefore {message}" if hint else message}
    bits = [outcome["bits"] for outcome in outcomes]
    differing = [case for case in bits[0] if any(hashes[case] != bits[0][case] for hashes in bits)]
    if not differing:
        return {}
    reason = hint or f"{group.label}: results depend on it"
    return {"unwritten": f"{reason} (with {differing[0]})"}
