"""What the commands share: the application and its options."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Sequence
from inspect import signature
from pathlib import Path
from typing import Annotated, Any

from cyclopts import (
    App,
    CycloptsError,
    MissingArgumentError,
    Parameter,
    Token,
    UnknownCommandError,
    UnusedCliTokensError,
)

from baldwinlab._version import __version__
from baldwinlab.core import console
from baldwinlab.core.files import location
from baldwinlab.core.suggestions import suggest


def _location(kind: object, tokens: Sequence[Token]) -> Path:
    return location(tokens[0].value)


def _whole(kind: object, tokens: Sequence[Token]) -> int:
    """A whole number, in digits: 1.5 is not rounded, and 0x10 is not read."""
    word = tokens[0].value
    if not re.fullmatch(r"[+-]?[0-9]{1,18}", word):
        raise ValueError(f"{word!r} must be a whole number of at most 18 digits")
    return int(word)


def _sentence(error: CycloptsError) -> str:
    """What is wrong with the words of a command, and what to write."""
    if isinstance(error, UnknownCommandError) and error.unused_tokens:
        name, known = error.unused_tokens[0], [name for name in app if not name.startswith("-")]
        return f"there is no command {name!r}{suggest(name, known)}"
    if isinstance(error, UnusedCliTokensError) and error.unused_tokens:
        wrong = f"{' '.join(error.unused_tokens)!r} is too much"
    elif isinstance(error, MissingArgumentError) and error.argument:
        wrong = f"{error.argument.name} {'needs a value' if error.argument.name.startswith('-') else 'is missing'}"
    else:
        return " ".join(str(error).split())
    command = " ".join(["baldwinlab", *(error.command_chain or ())])
    usage = " ".join([command, *(_usage(error.target) if error.target else ())])
    return f"{wrong}; write: {usage}; for its options see {command} --help"


def _usage(command: Callable[..., Any]) -> Iterator[str]:
    """The words after a command's name, but for options that may be left out: DIRECTORY --out OUT."""
    for name, parameter in signature(command).parameters.items():
        needed = (
            parameter.default is parameter.empty and parameter.kind is not parameter.VAR_POSITIONAL
        )
        if parameter.kind is parameter.KEYWORD_ONLY:
            yield from [f"--{name} {name.upper()}"] if needed else []
        else:
            yield name.upper() if needed else f"[{name.upper()}]"


app = App(
    name="baldwinlab",
    help="A laboratory for experiments on evolution and lifetime learning. First steps: `presets` lists experiments, "
    "`show` the fields of one, `run` runs some, `report` writes their results, `replay` a film.",
    version=__version__,
    error_formatter=lambda error: f"baldwinlab: {console.clip_for_terminal(_sentence(error))}",
    error_console=console.errors,
    suppress_keyboard_interrupt=False,
    help_format="plaintext",  # to load Markdown takes a while
)

Whole = Annotated[int, Parameter(converter=_whole)]
PerhapsWhole = Annotated[int | None, Parameter(converter=_whole)]
Runs = Annotated[Whole, Parameter(help="independent runs of each condition")]
Variant = Annotated[str, Parameter(help="a named variant, laid over; see `baldwinlab presets`")]
Seed = Annotated[Whole, Parameter(help="the seed that all randomness comes from")]
Workers = Annotated[
    PerhapsWhole, Parameter(help="threads, all cores unless given; with --executor slurm, jobs")
]
LOCATION = "directory of the study, or a URL such as s3://BUCKET/STUDY"
Directory = Annotated[
    Any, Parameter(converter=_location, help=LOCATION)
]  # a Path, or for a URL what fsspec makes of it
Out = Annotated[
    Any, Parameter(converter=_location, help=f"{LOCATION}; a folder in results/ unless given")
]
BackendName = Annotated[
    str, Parameter(name="--backend", help="cpu, cuda, or auto for the fastest there is")
]
Executor = Annotated[
    str, Parameter(name="--executor", help="threads, dask:tcp://HOST:PORT, or slurm")
]
Last = Annotated[
    Whole, Parameter(help="a run counts with its average over so many last generations")
]
Baseline = Annotated[
    str,
    Parameter(
        help="the condition with which all others are compared; see docs/reference/file-formats.md"
    ),
]
SET = "change fields: --set learning.rate=0.05 population.size=30; `baldwinlab show EXPERIMENT` lists all fields"
Assignments = Annotated[
    list[str] | None, Parameter(name="--set", negative="", consume_multiple=True, help=SET)
]
NamedExperiment = Annotated[
    str,
    Parameter(help="a preset such as evo+self-taught/B, or an experiment file that ends in .toml"),
]

FORCE = "run although less memory or disk is free than estimated, and overwrite a file that this command did not write"
Force = Annotated[bool, Parameter(negative="", help=FORCE)]
Parts = Annotated[
    list[Path] | None,
    Parameter(name="--part", negative="", help="a file with a part of your own; repeatable"),
]


def load_parts(files: Sequence[Path] | None) -> None:
    """Make known the parts that installed packages bring, and those in files, before any experiment is read."""
    from baldwinlab.api.load import load_installed  # here, because help needs no experiments

    load_installed()
    if files:
        from baldwinlab.parts import load_file  # here, because to load the engine takes a while

        for file in files:
            load_file(file)
