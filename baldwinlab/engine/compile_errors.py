"""Errors of one sentence for custom hooks that Numba cannot compile."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable
from pathlib import Path
from types import FunctionType
from typing import Any, Final

from baldwinlab.core.errors import PartError

PACKAGE_FOLDER: Final = Path(__file__).parents[1]
MAX_REASON_LENGTH: Final = 300
ANSI_COLOR: Final = re.compile(r"\x1b\[[0-9;]*m")
# In a message of Numba, the reason stands between matches of these two patterns.
REASON_START: Final = re.compile(r"Failed in nopython mode pipeline.*\n")
REASON_END: Final = re.compile(
    r"\n\s*(There (are|is) \d+ candidate|During:|File \"|- Of which|- argument|$)"
)
# Matches 'File "rule.py", line 12' and 'at rule.py (12)'.
POSITION_PATTERN: Final = re.compile(r'(?:File "|at )([^"\n]+?)(?:", line | \()(\d+)')
CALL_PATTERN: Final = re.compile(
    r"Function\((?P<function>.*)\) found for signature: >>> (?P<name>[^(]+)\((?P<types>.*)\)$"
)
NUMBER_TYPE_PATTERN: Final = re.compile(r"float64|int\d|uint\d|Literal\[int\]|bool")
COMPARISONS: Final = "< <= > >="


def find_custom_hooks(hooks: Iterable[Callable[..., Any]]) -> list[FunctionType]:
    """Return the hooks of third-party parts."""
    functions = [hook for hook in hooks if isinstance(hook, FunctionType)]
    return [
        hook for hook in functions if PACKAGE_FOLDER not in Path(hook.__code__.co_filename).parents
    ]


def compile_error(error: Exception, hooks: Iterable[Callable[..., Any]]) -> PartError | None:
    """Return the error about the third-party hook that Numba cannot compile, or None."""
    custom_hooks = find_custom_hooks(hooks)
    # Numba's message ends with the innermost error, which states the cause.
    plain_text = ANSI_COLOR.sub("", str(error))
    text = REASON_START.split(plain_text)[-1]
    words = REASON_END.split(text)[0].split()
    reason = _translate(" ".join(words))[:MAX_REASON_LENGTH]
    positions = [(Path(file).name, int(line)) for file, line in POSITION_PATTERN.findall(text)]
    for hook in custom_hooks:
        file = hook.__code__.co_filename
        source_lines = [line for _, _, line in hook.__code__.co_lines() if line]
        lines_in_file = [line for name, line in positions if name == Path(file).name]
        lines_in_hook = [
            line for line in lines_in_file if min(source_lines) <= line <= max(source_lines)
        ]
        # An error about an undefined name may have no line in the hook.
        unknown_name = re.search(r"name '(\w+)' is not defined", text)
        if lines_in_hook or (unknown_name and unknown_name[1] in hook.__code__.co_names):
            line = lines_in_hook[0] if lines_in_hook else min(source_lines)
            return PartError(f"{hook.__qualname__} cannot be compiled ({file}:{line}): {reason}")
    # The error may be in a function that a hook calls.
    for name, line in positions:
        for file in {hook.__code__.co_filename for hook in custom_hooks}:
            if Path(file).name == name:
                return PartError(f"{file}:{line} cannot be compiled: {reason}")
    return None


def _translate(reason: str) -> str:
    """Return Numba's reason, or advice if the reason contains types of the engine."""
    call = CALL_PATTERN.search(reason)
    engine_types = (
        set(re.findall(r"\b(?:wide|mask|lane_block)\b", call["types"])) if call else set()
    )
    if call is None or not engine_types:
        return reason
    name = call["name"] if call["name"].isidentifier() else call["function"]
    return _explain_call(name, engine_types, call["types"])


def _explain_call(name: str, engine_types: set[str], types: str) -> str:
    """Return the error of a call of `name` with argument `types`.

    `engine_types`: types of the engine that `types` contains: "wide", "mask" or "lane_block".
    """
    if name in ("getitem", "static_getitem", "setitem", "static_setitem"):
        return (
            "a SIMD block is reached by no index; "
            "write get(array, row, lane) and put(array, row, lane, value)"
        )
    if name in ("get", "put"):
        return _explain_array_call(name, types)
    if name == "choose":
        return (
            "choose(mask, a, b) takes a mask, and a and b in float32; write np.float32(0.5) for "
            "0.5, and if for a comparison of numbers, such as step < part.youth"
        )
    if "lane_block" in engine_types:
        return (
            f"the lane is a SIMD block of agents and no number, so {name} does not take it; "
            "pass it to get and put as it is"
        )
    if "mask" in engine_types:
        return _explain_mask_call(name)
    if name in ("eq", "ne"):
        return f"SIMD blocks cannot be compared by == or !=; write {COMPARISONS}, joined by & and |"
    if name in ("max", "min", "maximum", "minimum", "fmax", "fmin"):
        sign = "<" if "min" in name else ">"
        return f"a SIMD block is no argument of {name}; write choose(a {sign} b, a, b)"
    if name == "bool":
        return (
            f"a SIMD block is neither true nor false; compare it by {COMPARISONS}, "
            "and write choose(mask, a, b)"
        )
    if name in ("pow", "ipow"):
        return "a SIMD block cannot be raised to a power; write x * x"
    if NUMBER_TYPE_PATTERN.search(types):
        return (
            "a SIMD block holds float32; write np.float32(0.5) for 0.5, "
            "and np.float32(n) for an integer n; if a hook compares step with a setting, "
            "declare the setting as int: youth: int = Field(100, ...)"
        )
    return (
        f"a SIMD block is no argument of {name}; "
        f"it has + - * /, {COMPARISONS}, abs, clamp, choose, sigmoid and square_root"
    )


def _explain_array_call(name: str, types: str) -> str:
    if re.match(r"array\([^)]*\), lane_block", types):
        arguments = "array, row, lane, value" if name == "put" else "array, row, lane"
        return f"the row comes before the lane; write {name}({arguments})"
    if not types.startswith("array(float32"):
        return (
            f"{name} reaches float32 arrays alone in a hook per agent; "
            "use a hook per world, such as observe_others, for integers"
        )
    return "put stores float32; write np.float32(0.5) for 0.5, and choose(mask, a, b) for a mask"


def _explain_mask_call(name: str) -> str:
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
