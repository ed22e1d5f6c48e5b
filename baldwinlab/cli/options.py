"""The command-line application of cyclopts, and the options that several commands share."""

from __future__ import annotations

import ast
import re
from collections.abc import Callable, Iterator, Sequence
from inspect import Parameter as SignatureParameter
from inspect import signature
from pathlib import Path
from typing import Annotated, Any, Final

from cyclopts import (
    UNSET,
    App,
    ArgumentCollection,
    CoercionError,
    CycloptsError,
    Group,
    MissingArgumentError,
    Parameter,
    Token,
    UnknownCommandError,
    UnusedCliTokensError,
)

from baldwinlab._version import __version__
from baldwinlab.core import console
from baldwinlab.core.files import parse_location
from baldwinlab.core.names import suggest

# The output of `baldwinlab` without arguments.
OVERVIEW: Final = """\
baldwinlab: experiments on evolution and lifetime learning.
Start: baldwinlab run evo/A evo+self-taught/A --runs 8
Look:  baldwinlab lab
Help:  baldwinlab --help"""
HELP: Final = """\
A laboratory for experiments on evolution and lifetime learning.

Start here:

    baldwinlab lab                           Watch evolution in the browser.
    baldwinlab run evo/A evo+self-taught/A   Compare evolution with and without learning.
    baldwinlab reproduce                     Reproduce the first paper.

`baldwinlab list presets` lists the experiments that you can run.
`baldwinlab COMMAND --help` explains a command and shows an example.
Studies are written to results/ in the working directory."""

# The folder that contains the package.
PACKAGE_PARENT: Final = Path(__file__).parents[2]
# Integers with more digits may exceed 64 bits.
MAX_DIGITS: Final = 18
# The types of arguments that are whole numbers.
INTEGERS: Final = (int, int | None)


def _read_location(kind: object, tokens: Sequence[Token]) -> Path:
    return parse_location(tokens[0].value)


def _format_default(value: Any) -> str | None:
    """Return a default for the help; None for an empty default, which the help text describes."""
    return None if value is False or value in (None, "", ()) else str(value)


def _check_values(app: App, commands: Sequence[str], arguments: ArgumentCollection) -> None:
    """Refuse empty values, which are the working directory as a path, and integers such as 1.5."""
    for argument in arguments:
        for token in argument.tokens:
            if not token.value and token.implicit_value is UNSET:
                raise MissingArgumentError(argument=argument)
            is_integer = re.fullmatch(rf"[+-]?[0-9]{{1,{MAX_DIGITS}}}", token.value)
            if argument.hint in INTEGERS and not is_integer:
                # For example 1.5, which cyclopts would round, and 0x10.
                rule = f"must be a whole number of at most {MAX_DIGITS} digits"
                raise CoercionError(msg=f"{token.value!r} {rule}", argument=argument, token=token)


def _format_error(error: CycloptsError) -> str:
    """Return an error as one sentence. For arguments, the usage of the command follows."""
    if isinstance(error, UnknownCommandError) and error.unused_tokens:
        unknown_command = error.unused_tokens[0]
        commands = [command for command in app if not command.startswith("-")]
        return f"there is no command {unknown_command!r}{suggest(unknown_command, commands)}"
    if isinstance(error, UnusedCliTokensError) and error.unused_tokens:
        problem = f"unexpected argument {' '.join(error.unused_tokens)!r}"
    elif isinstance(error, MissingArgumentError) and error.argument:
        name = error.argument.name
        is_option = name.startswith("-")
        problem = f"{name} needs a value" if is_option else f"{name} is missing"
    else:
        return " ".join(str(error).split())
    command = " ".join(["baldwinlab", *(error.command_chain or ())])
    arguments = _list_arguments(error.target) if error.target else ()
    usage = " ".join([command, *arguments])
    return f"{problem}; usage: {usage}; {command} --help lists the options"


def _list_arguments(command: Callable[..., Any]) -> Iterator[str]:
    """Yield the arguments and the required options of a command, such as "--out OUT"."""
    for name, parameter in signature(command).parameters.items():
        word = name.upper()
        is_required = parameter.default is SignatureParameter.empty
        if parameter.kind is SignatureParameter.VAR_POSITIONAL:
            yield f"[{word}...]"
        elif parameter.kind is not SignatureParameter.KEYWORD_ONLY:
            yield word if is_required else f"[{word}]"
        elif is_required:
            yield f"--{name} {word}"


app = App(
    name="baldwinlab",
    help=HELP,
    version=__version__,
    error_formatter=lambda error: f"baldwinlab: {console.clip_for_terminal(_format_error(error))}",
    console=console.help_console,
    error_console=console.errors,
    # No option has a negative form, such as --no-force.
    default_parameter=Parameter(negative="", show_default=_format_default),
    config=_check_values,
    suppress_keyboard_interrupt=False,
    # Other formats would load a renderer, which takes a while.
    help_format="plaintext",
)
# In the help, the groups have the order of their keys. The options come last.
_options = Group("Options", sort_key=99)
for _flag in ("--help", "--version"):
    app[_flag].group = _options

# Annotation of a dataclass. Each field of the dataclass then becomes an option.
FIELDS: Final = Parameter(name="*")

Experiment = Annotated[
    str,
    Parameter(help="A preset, such as evo+self-taught/B, or an experiment file (.toml)."),
]
LOCATION: Final = "Directory of the study, or a URL such as s3://BUCKET/STUDY."
# The value is a Path, or for a URL an object of fsspec.
Directory = Annotated[Any, Parameter(converter=_read_location, help=LOCATION)]
Out = Annotated[Any, Parameter(converter=_read_location)]
Runs = Annotated[int, Parameter(help="Number of independent runs of each condition.")]
Seed = Annotated[int, Parameter(help="Seed of all random numbers, 0 to 2147483647.")]
Variant = Annotated[
    str,
    Parameter(help="Variant of the paper, see `baldwinlab list presets`."),
]
LastGenerations = Annotated[
    int,
    Parameter(
        name="--last-generations",
        help="Number of final generations that are averaged in each run.",
    ),
]
Baseline = Annotated[
    str,
    Parameter(
        help="Condition with which all others are compared, by default the first condition on "
        "the same map."
    ),
]
Assignments = Annotated[
    list[str] | None,
    Parameter(
        name="--set",
        consume_multiple=True,
        help="Change one or more settings: --set learning.rate=0.05 population.size=30. "
        "`baldwinlab show EXPERIMENT` lists all settings.",
    ),
]
Parts = Annotated[
    list[Path] | None,
    Parameter(
        name="--part",
        help="Python file with custom parts. Repeat the option for several files.",
    ),
]

Json = Annotated[
    bool, Parameter(name="--json", help="Print the results as JSON, and messages on stderr.")
]

OVERWRITE_FORCE: Final = "Overwrite a file at --out that this command did not write."
Force = Annotated[
    bool,
    Parameter(help=f"Run even if less memory or disk is free than the estimate. {OVERWRITE_FORCE}"),
]


def read_docstring(address: str) -> str:
    """Return the docstring of a function or class, such as "baldwinlab.cli.run:run".

    The docstring is read from the file, because importing the module takes seconds.
    """
    module, _, name = address.partition(":")
    path = PACKAGE_PARENT / module.replace(".", "/")
    path = path / "__init__.py" if path.is_dir() else path.with_suffix(".py")
    for node in ast.walk(ast.parse(path.read_text("utf-8"))):
        if isinstance(node, ast.FunctionDef | ast.ClassDef) and node.name == name:
            return ast.get_docstring(node) or ""
    return ""


def load_parts(files: Sequence[Path] | None) -> None:
    """Register the parts of installed packages and of `files`, before any experiment is read."""
    # Imported late, because `--help` needs no experiments.
    from baldwinlab.api.load import load_installed_parts

    load_installed_parts()
    if files:
        # Imported late, because loading the engine takes a while.
        from baldwinlab.experiment import registry
        from baldwinlab.parts.loading import load_file

        with registry.require_unique_parts():
            for file in files:
                load_file(file)
