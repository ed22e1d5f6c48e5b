"""Options that functions of `bl` and commands share. An option is added here, and only here.

A function of `bl` takes the options as keyword arguments, and a command as options of the command
line. `AssayOptions` and `RunOptions` have the documentation for functions and commands.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable
from dataclasses import dataclass
from functools import wraps
from typing import Final, ParamSpec, TypedDict, TypeVar

from baldwinlab.core.names import suggest
from baldwinlab.core.numbers import require_whole_number
from baldwinlab.core.resources import Need
from baldwinlab.studies import executors
from baldwinlab.studies.executors import THREADS, Executor

_Arguments = ParamSpec("_Arguments")
_Result = TypeVar("_Result")


@dataclass(frozen=True, kw_only=True)
class AssayOptions:
    """Options of assays. They do not change results.

    Parameters
    ----------
    workers : int or None
        Number of threads, by default one per usable core; with the executor slurm, number of jobs.
    executor : str
        threads, dask:tcp://HOST:PORT, or slurm.
    force : bool
        Run even if less memory or disk is free than the estimate.
    """

    workers: int | None = None
    executor: str = THREADS.name
    force: bool = False

    def __post_init__(self) -> None:
        """Raise ArgumentError for an invalid number of workers, before anything is written."""
        if self.workers is not None:
            require_whole_number("workers", self.workers)

    def make_executor(self) -> Executor:
        """Return the executor."""
        return executors.choose_executor(self.executor, self.workers)


@dataclass(frozen=True, kw_only=True)
class RunOptions(AssayOptions):
    """Options of runs. They do not change results.

    Parameters
    ----------
    backend : str
        cpu, cuda, or auto (the fastest that is available).
    checkpoint : str
        Interval between two checkpoints of a run: seconds (60s) or generations (100).
    """

    backend: str = "auto"
    checkpoint: str = "60s"


ASSAY_DEFAULTS: Final = AssayOptions()
RUN_DEFAULTS: Final = RunOptions()


class AssayArguments(TypedDict, total=False):
    """The fields of `AssayOptions` as keyword arguments, for type checkers."""

    workers: int | None
    executor: str
    force: bool


class RunArguments(AssayArguments, total=False):
    """The fields of `RunOptions` as keyword arguments, for type checkers."""

    backend: str
    checkpoint: str


def list_options(
    options_class: type[AssayOptions],
) -> Callable[[Callable[_Arguments, _Result]], Callable[_Arguments, _Result]]:
    """Return a decorator that lists `**options` in the signature and docstring of a function."""

    def decorate(function: Callable[_Arguments, _Result]) -> Callable[_Arguments, _Result]:
        signature = inspect.signature(function)
        # The options replace `**options`, which is the last argument.
        *arguments, _ = signature.parameters.values()
        options = inspect.signature(options_class).parameters.values()
        signature = signature.replace(parameters=[*arguments, *options])
        names = [name for name in signature.parameters if name != "self"]

        @wraps(function)
        def call(*args: _Arguments.args, **kwargs: _Arguments.kwargs) -> _Result:
            for name in kwargs:
                if name not in names:
                    raise TypeError(
                        f"{function.__name__}() has no argument {name!r}{suggest(name, names)}"
                    )
            return function(*args, **kwargs)

        call.__dict__["__signature__"] = signature
        call.__doc__ = _list_in_docstring(inspect.getdoc(function) or "", options_class)
        return call

    return decorate


def _list_in_docstring(docstring: str, options_class: type[AssayOptions]) -> str:
    """Replace the entry `**options` of a docstring by the entries of the options."""
    # Base classes come first, as in the signature. The entries follow the line under "Parameters".
    classes = [base for base in reversed(options_class.__mro__) if issubclass(base, AssayOptions)]
    entries = [inspect.cleandoc(base.__doc__ or "").partition("---\n")[2] for base in classes]
    before, _, after = docstring.partition("**options\n")
    _, _, sections = after.partition("\n")
    return "\n".join([f"{before}{entries[0]}", *entries[1:], sections])


def exclude_remote_memory(need: Need, executor: Executor) -> Need:
    """Return the need of this machine, which is without memory if the workers are remote."""
    is_local = executor.name == THREADS.name
    return need if is_local else need._replace(memory=0)
