"""Hooks watched in plain Python: errors name the part, hook, line, array, index and size.

Compiled code checks no index: one past the end of an array reads or writes other memory, or ends
the process. NumPy takes a negative index from the end, which compiled `get` and `put` do not. So
hooks get arrays here that know their names and refuse both.
"""

from __future__ import annotations

import inspect
import sys
import traceback
from collections.abc import Callable, Iterable, Mapping
from functools import wraps
from typing import Any, Final, NamedTuple

import numpy as np
import numpy.typing as npt

from baldwinlab.api.checks.fixture import label
from baldwinlab.core.errors import BaldwinLabError
from baldwinlab.engine import poison
from baldwinlab.parts.part import Part, overridden_hooks

AXES: Final = {1: (("entry", "entries"),), 2: (("row", "rows"), ("column", "columns"))}
OUTPUTS: Final = {  # arrays that a hook fills, by the hook; see `_outputs` for the others
    "vary": "child",
    "vary_population": "children",
    "select": "parents",
    "select_with_genomes": "parents",
    "evaluate": "fitness",
}


class HookError(BaldwinLabError):
    """A hook that fails in plain Python; the message names the part, the hook and the line."""


class UnwrittenError(HookError):
    """A hook that leaves an output unwritten."""


class _Call(NamedTuple):
    part: type[Part]
    hook: str
    file: str

    def at(self, line: int | None) -> str:
        place = f"{label(self.part)}: {self.hook}"
        return place if line is None else f"{place}, line {line}"


class Watch:
    """Replace the hooks of parts, in this process, by watched ones."""

    def __init__(self, parts: Iterable[type[Part]]) -> None:
        self.unwritten_read = ""  # where a hook first read poison, with or without effect
        self._calls: list[_Call] = []
        self._named: dict[tuple[int, str], tuple[Any, Any]] = {}  # named tuples by address and name
        for part in parts:
            for hook in overridden_hooks(part):
                setattr(part, hook, staticmethod(self._watched(part, hook)))

    def _watched(self, part: type[Part], hook: str) -> Callable[..., Any]:
        function: Any = getattr(part, hook)
        names = list(inspect.signature(function).parameters)
        called = _Call(part, hook, function.__code__.co_filename)

        @wraps(function)
        def call(*arguments: Any) -> Any:
            given = dict(zip(names, arguments, strict=True))
            outputs = _outputs(part, hook, given)
            for array in outputs.values():
                array[...] = _erased(array)
            self._calls.append(called)
            try:
                result = function(*(self._add_name(value, name) for name, value in given.items()))
            except HookError:
                raise
            except Exception as error:  # whatever a hook raises
                where = called.at(_line(error, called.file))
                raise HookError(f"{where}: {_message(error)}") from None
            finally:
                self._calls.pop()
            for name, array in outputs.items():
                if (index := _first_erased(array)) is not None:
                    entry = f"{name}[{_index_text(index)}]"
                    raise UnwrittenError(f"{called.at(None)} leaves {entry} unwritten")
            return result

        return call

    def _add_name(self, value: Any, name: str) -> Any:
        """Return the value with arrays that know their names."""
        if isinstance(value, NamedArray):
            return value
        if isinstance(value, np.ndarray):
            named = value.view(NamedArray)
            named.name, named.watch = name, self
            return named
        if not isinstance(value, tuple):
            return value
        key = id(value), name
        if key not in self._named:
            self._named[key] = value, self._add_field_names(value, name)
        return self._named[key][1]

    def _add_field_names(self, value: Any, name: str) -> Any:
        if not hasattr(value, "_fields"):
            return tuple(
                self._add_name(each, f"{name}[{number}]") for number, each in enumerate(value)
            )
        fields = zip(value._fields, value, strict=True)
        return type(value)(*(self._add_name(each, f"{name}.{field}") for field, each in fields))

    def note_read(self, array: str, index: Any) -> None:
        """Remember the first place where a hook reads poison; later values may follow from it.

        Parameters
        ----------
        array
            The array.
        index
            The index.
        """
        if not self._calls or self.unwritten_read:
            return
        called = self._calls[-1]
        frame: Any = sys._getframe()
        while frame is not None and frame.f_code.co_filename != called.file:
            frame = frame.f_back
        where = called.at(frame.f_lineno if frame is not None else None)
        self.unwritten_read = f"{where}: {array}[{_index_text(index)}]"


class NamedArray(np.ndarray):
    """An array that refuses an index past its end or below 0, with its name."""

    name: str = ""  # empty for an array that is calculated from others
    watch: Watch | None = None

    def __getitem__(self, index: Any) -> Any:
        if not self.name:
            return super().__getitem__(index)
        self._require_within(index)
        value = super().__getitem__(index)
        if isinstance(value, NamedArray):
            value.name, value.watch = f"{self.name}[{_index_text(index)}]", self.watch
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
                below = "; an index must be at least 0" * (entry < 0)
                size = _size_text(self.shape, axis)
                raise IndexError(f"index {entry} of {self.name}, which has {size}{below}")


def _size_text(shape: tuple[int, ...], axis: int) -> str:
    entry, entries = AXES[len(shape)][axis] if len(shape) in AXES else ("entry", "entries")
    words = f"{shape[axis]} {entry if shape[axis] == 1 else entries}"
    return words if len(shape) in AXES else f"{words} along axis {axis}"


def _index_text(index: Any) -> str:
    entries = index if isinstance(index, tuple) else (index,)
    return ", ".join(":" if isinstance(entry, slice) else str(entry) for entry in entries)


def _is_poisoned(value: Any) -> bool:
    """Return whether a number was never written.

    Each kind of number is recognized by the pattern that other numbers seldom equal: no result of
    calculations with NaN, and no count.
    """
    pattern = poison.PATTERNS[poison.pattern_number()]
    if isinstance(value, np.floating):
        return bool(value == value.dtype.type(pattern.real))
    is_signed = isinstance(value, np.signedinteger)
    return is_signed and pattern.signed < 0 and bool(value == pattern.signed)


def _outputs(part: Any, hook: str, given: Mapping[str, Any]) -> dict[str, npt.NDArray[Any]]:
    """Return what a hook must fill, whatever it held before."""
    if hook == "measure":
        lane, first = given["world"] * given["model"].agents + given["agent"], given["first"]
        rows = slice(first, first + len(part.inputs))
        return {"state.activations": np.asarray(given["state"].activations)[rows, lane]}
    if hook == "inherit":  # a genome may have further genes, behind those of the action module
        return {"inherited": np.asarray(given["inherited"])[: given["learned"].size]}
    if hook not in OUTPUTS:
        return {}
    return {OUTPUTS[hook]: np.asarray(given[OUTPUTS[hook]])}


def _erased(array: npt.NDArray[Any]) -> float:
    return np.nan if array.dtype.kind == "f" else np.iinfo(array.dtype).min


def _first_erased(array: npt.NDArray[Any]) -> tuple[int, ...] | None:
    erased = np.isnan(array) if array.dtype.kind == "f" else array == np.iinfo(array.dtype).min
    return tuple(map(int, np.argwhere(erased)[0])) if erased.any() else None


def _line(error: Exception, file: str) -> int | None:
    """Return the line of the part's file that an error comes from."""
    frames = traceback.extract_tb(error.__traceback__)
    return next((frame.lineno for frame in reversed(frames) if frame.filename == file), None)


def _message(error: Exception) -> str:
    text = " ".join(str(error).split())
    return text if isinstance(error, IndexError) else f"{type(error).__name__}: {text}"
