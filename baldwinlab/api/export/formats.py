"""Declarations of export formats, and the checks of an export's options.

Each `ExportFormat` in a module of this package is a format of a study. The command `export`,
`Study.export`, their error messages and the documentation read these declarations.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from functools import cache
from importlib import import_module
from pathlib import Path
from pkgutil import iter_modules
from typing import Any, Literal, NamedTuple

from baldwinlab.core import console
from baldwinlab.core.errors import RefusedError
from baldwinlab.core.extras import missing_extra_error
from baldwinlab.core.numbers import COUNTS, INDICES, require_whole_number
from baldwinlab.studies.status import format_incomplete_sentence
from baldwinlab.studies.store import StudyStore


class Option(NamedTuple):
    """An option of a format: `--NAME` of the command, and a keyword argument of the writer."""

    name: str
    type: Any  # int, str, list[str] or a Literal.
    help: str
    is_required: bool = False


class ExportFormat(NamedTuple):
    """An export format."""

    name: str
    content: str  # Content of the written file, a noun phrase.
    # Called as `write(source, path, force=..., **options)`. It returns a text for the terminal, and
    # raises BaldwinLabError. `source` is a StudyStore if the format needs a study.
    write: Callable[..., str]
    suffix: str = ""  # "": the file can have any suffix, and no suffix selects the format.
    options: tuple[Option, ...] = ()
    library: str = ""  # Optional library that the writer imports.
    extra: str = ""  # Extra of pyproject.toml with the library.
    # "experiment": a study, a preset or an experiment file. "": the format has fixed experiments.
    source: Literal["study", "experiment", ""] = "study"
    output: Literal["required", "optional", "none"] = "required"
    uses_parts: bool = False  # Whether custom parts can be given.


@cache
def study_formats() -> Mapping[str, ExportFormat]:
    """Return the formats of studies by name, in alphabetical order."""
    folder = str(Path(__file__).parent)
    modules = [import_module(f"{__package__}.{info.name}") for info in iter_modules([folder])]
    values = [value for module in modules for value in vars(module).values()]
    formats = {value.name: value for value in values if isinstance(value, ExportFormat)}
    return dict(sorted(formats.items()))


def list_suffixes(formats: Mapping[str, ExportFormat]) -> dict[str, str]:
    """Return the name of the format by suffix. Formats without a source have no suffix here."""
    return {
        format.suffix: format.name for format in formats.values() if format.suffix and format.source
    }


def list_without_output(formats: Mapping[str, ExportFormat]) -> list[str]:
    """Return the names of the formats that need no `--out`."""
    return [format.name for format in formats.values() if format.output != "required"]


def select_format(
    formats: Mapping[str, ExportFormat], name: str | None, path: Path | None
) -> ExportFormat:
    """Return the format with a name, or without a name, the format of the suffix of a file."""
    if name:
        if name not in formats:
            raise RefusedError(f"--format {name} must be {_join(formats)}")
        return formats[name]
    suffixes = list_suffixes(formats)
    if path is None:
        raise RefusedError(
            f"--out is missing: give a file that ends in {_join(suffixes)}; only --format "
            f"{_join(list_without_output(formats))} needs no file"
        )
    if path.suffix not in suffixes:
        endings = _join(f"{suffix} for {format}" for suffix, format in suffixes.items())
        raise RefusedError(f"--out {path} must end in {endings}; or give --format")
    return formats[suffixes[path.suffix]]


def write_export(
    formats: Mapping[str, ExportFormat],
    format: ExportFormat,
    source: Any,
    path: Path | None,
    options: Mapping[str, Any],
    *,
    force: bool,
) -> str:
    """Write a file, and return a text for the terminal. `options`: the given options by name."""
    require_options(formats, format, path, options)
    if format.library:
        require_library(format.library, format.extra, f"--format {format.name}")
    sentence = format_incomplete_sentence(source) if isinstance(source, StudyStore) else ""
    console.warn_if_any(sentence)
    text = format.write(source, path, force=force, **options)
    return f"{text}; the study has incomplete runs" if sentence else text


def require_options(
    formats: Mapping[str, ExportFormat],
    format: ExportFormat,
    path: Path | None,
    options: Mapping[str, Any],
) -> None:
    """Raise RefusedError if an option is missing or wrong, or has no effect in the format."""
    own_names = {option.name for option in format.options}
    for name, value in options.items():
        if name not in own_names:
            users = [
                other.name
                for other in formats.values()
                if name in {option.name for option in other.options}
            ]
            refuse_option(f"--{name}", users, format)
        if name in INDICES | COUNTS:
            require_whole_number(name, value)
    required = [option.name for option in format.options if option.is_required]
    if not options.keys() >= {*required}:
        needs = " and ".join(f"--{name} {name.upper()}" for name in required)
        raise RefusedError(f"--format {format.name} needs {needs}")
    if path is None:
        if format.output == "required":
            raise RefusedError(f"--out is missing: --format {format.name} needs the name of a file")
    elif format.output == "none":
        users = [other.name for other in formats.values() if other.output != "none"]
        refuse_option("--out", users, format)
    elif format.suffix and path.suffix != format.suffix:
        raise RefusedError(
            f"--out {path} must end in {format.suffix}, as --format {format.name} needs"
        )


def refuse_option(option: str, users: Iterable[str], format: ExportFormat) -> None:
    """Raise RefusedError for an option that only other formats use."""
    names = list(users)
    if names:
        raise RefusedError(f"{option} applies to --format {_join(names)}, not {format.name}")
    raise RefusedError(f"{option} does not apply to --format {format.name}")


def require_library(library: str, extra: str, feature: str) -> None:
    """Import an optional library, or raise RefusedError with the installation command."""
    try:
        import_module(library)
    except ImportError:
        raise missing_extra_error(extra, feature) from None


def _join(words: Iterable[str]) -> str:
    *first, last = words
    return f"{', '.join(first)} or {last}" if first else last
