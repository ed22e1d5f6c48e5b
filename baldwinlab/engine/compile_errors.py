"""Errors of one sentence for custom hooks that Numba cannot compile."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable
from pathlib import Path
from types import FunctionType
from typing import Any, Final

from baldwinlab.core.errors import PartError

PACKAGE: Final = Path(__file__).parents[1]
# Characters of a reason.
MAX_LENGTH: Final = 300
BEGINS: Final = re.compile(r"Failed in nopython mode pipeline.*\n")
ENDS: Final = re.compile(
    r"\n\s*(There (are|is) \d+ candidate|During:|File \"|- Of which|- argument|$)"
)
POSITION: Final = re.compile(r'(?:File "|at )([^"\n]+?)(?:", line | \()(\d+)')
CALL: Final = re.compile(
    r"Function\((?P<function>.*)\) found for signature: >>> (?P<name>[^(]+)\((?P<types>.*)\)$"
)
NUMBER: Final = re.compile(r"float64|int\d|uint\d|Literal\[int\]|bool")
COMPARED: Final = "< <= > >="


def compile_error(error: Exception, hooks: Iterable[Callable[..., Any]]) -> PartError | None:
    """Return the error about the third-party hook that Numba cannot compile, or None."""
    functions = [hook for hook in hooks if isinstance(hook, FunctionType)]
    custom = [hook for hook in functions if PACKAGE not in Path(hook.__code__.co_filename).parents]
    # The innermost error is the last one.
    text = BEGINS.split(re.sub(r"\x1b\[[0-9;]*m", "", str(error)))[-1]
    reason = _translate(" ".join(ENDS.split(text)[0].split()))[:MAX_LENGTH]
    positions = [(Path(file).name, int(line)) for file, line in POSITION.findall(text)]
    for hook in custom:
        file = hook.__code__.co_filename
        lines = [line for _, _, line in hook.__code__.co_lines() if line]
        in_file = [line for name, line in positions if name == Path(file).name]
        within = [line for line in in_file if min(lines) <= line <= max(lines)]
        unknown = re.search(r"name '(\w+)' is not defined", text)
        if within or (unknown and unknown[1] in hook.__code__.co_names):
            line = within[0] if within else min(lines)
            return PartError(f"{hook.__qualname__} cannot be compiled ({file}:{line}): {reason}")
    # The error may be in a function that a hook calls.
    for name, line in positions:
        for file in {hook.__code__.co_filename for hook in custom}:
            if Path(file).name == name:
                return PartError(f"{file}:{line} cannot be compiled: {reason}")
    return None


def _translate(reason: str) -> str:
    """Return the reason of Numba, or a correction if it names types of the engine."""
    call = CALL.search(reason)
    kinds = set(re.findall(r"\b(?:wide|mask|lane_block)\b", call["types"])) if call else set()
    if call is None or not kinds:
        return reason
    name = call["name"] if call["name"].isidentifier() else call["function"]
    return _sentence(name, kinds, call["types"])


def _sentence(name: str, kinds: set[str], types: str) -> str:
    """Return the error of a call of `name`; `kinds` are the types of the engine among `types`."""
    if name in ("getitem", "static_getitem", "setitem", "static_setitem"):
        return (
            "a SIMD block is reached by no index; "
            "write get(array, row, lane) and put(array, row, lane, value)"
        )
    if name in ("get", "put"):
        return _sentence_on_array(name, types)
    if name == "choose":
        return (
            "choose(mask, a, b) takes a mask, and a and b in float32; write np.float32(0.5) for 0.5"
        )
    if "lane_block" in kinds:
        return (
            f"the lane is a SIMD block of agents and no number, so {name} does not take it; "
            "pass it to get and put as it is"
        )
    if "mask" in kinds:
        return _sentence_on_mask(name)
    if name in ("eq", "ne"):
        return f"SIMD blocks cannot be compared by == or !=; write {COMPARED}, joined by & and |"
    if name in ("max", "min", "maximum", "minimum", "fmax", "fmin"):
        sign = "<" if "min" in name else ">"
        return f"a SIMD block is no argument of {name}; write choose(a {sign} b, a, b)"
    if name == "bool":
        return (
            f"a SIMD block is neither true nor false; compare it by {COMPARED}, "
            "and write choose(mask, a, b)"
        )
    if name in ("pow", "ipow"):
        return "a SIMD block cannot be raised to a power; write x * x"
    if NUMBER.search(types):
        return (
            "a SIMD block holds float32; write np.float32(0.5) for 0.5, "
            "and np.float32(n) for an integer n"
        )
    return (
        f"a SIMD block is no argument of {name}; "
        f"it has + - * /, {COMPARED}, abs, clamp, choose, sigmoid and square_root"
    )


def _sentence_on_array(name: str, types: str) -> str:
    if re.match(r"array\([^)]*\), lane_block", types):
        arguments = "array, row, lane, value" if name == "put" else "array, row, lane"
        return f"the row comes before the lane; write {name}({arguments})"
    if not types.startswith("array(float32"):
        return (
            f"{name} reaches float32 arrays alone in a hook per agent; "
            "use a hook per world, such as observe_others, for integers"
        )
    return "put stores float32; write np.float32(0.5) for 0.5, and choose(mask, a, b) for a mask"


def _sentence_on_mask(name: str) -> str:
    if name in ("not_", "invert"):
        return "a mask of a SIMD block cannot be negated by not or ~; write negated(mask)"
    if name == "bool":
        return (
            "a mask of a SIMD block is true for some agents and false for others, "
            "so if, and, or and a < b < c cannot use it; "
            "write choose(mask, a, b), any_of(mask), & and |"
        )
    return (
        f"a mask of a SIMD block is no argument of {name}; "
        "it has & and |, negated, any_of and choose"
    )
