"""Functions that load custom parts from files and packages, and copy parts to other processes.

A file is executed only if the user passes it with `--part`, imports it, or installs its package.
The source that a study stores is never executed. The name of the loaded module contains the hash of
the code, so versions of a part share compiled code only if they differ in comments and docstrings.

A pickle of an experiment, or of a part that was loaded from a file, contains the text of the file,
because another process may not have loaded the file. The process that reads the pickle executes the
text, unless the same part is loaded already. A part from an importable module is imported instead.
"""

from __future__ import annotations

import copyreg
import hashlib
import re
import sys
from collections.abc import Iterable
from contextlib import suppress
from importlib import import_module
from importlib.machinery import SourceFileLoader
from importlib.metadata import entry_points
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path
from tokenize import TokenError
from types import ModuleType
from typing import Any, Final, NamedTuple

from baldwinlab.core.errors import PartError
from baldwinlab.core.files import PART_FILE, read_text
from baldwinlab.core.third_party_code import run_third_party_code
from baldwinlab.engine.fingerprint import remove_comments
from baldwinlab.experiment import registry
from baldwinlab.experiment.added_parts import custom_choices
from baldwinlab.parts.part import Part, PartMeta

# Beginning of the names of loaded modules.
MODULE_PREFIX: Final = "baldwinlab_part_"
ENTRY_POINT_GROUP: Final = "baldwinlab.parts"
# Names of the module of a script: in its own process, and in a process that the script starts.
MAIN_MODULES: Final = ("__main__", "__mp_main__")


class Source(NamedTuple):
    """Source of a custom part, as a study stores it.

    Attributes
    ----------
    kind : str
        Kind of the part, such as "learning rule".
    name : str
        Name of the part.
    text : str
        Text of the file.
    file : str
        Name of the file, without folders.
    """

    kind: str
    name: str
    text: str
    file: str

    @property
    def sha256(self) -> str:
        """The SHA-256 of the text."""
        return hashlib.sha256(self.text.encode()).hexdigest()


def load_file(path: str | Path) -> ModuleType:
    """Execute a file with parts and register the parts, which replace parts with the same names.

    Parameters
    ----------
    path : str or Path
        Python file.

    Returns
    -------
    module
        The module that was made from the file.

    Raises
    ------
    PartError
        If the file cannot be read or executed, or has no part.
    """
    file = Path(path)
    try:
        text = read_text(file, PART_FILE)
    except (OSError, ValueError) as error:
        reason = error.strerror if isinstance(error, OSError) else error
        raise PartError(f"cannot read the part {file}: {reason}") from None
    return load_text(text, file)


def load_text(text: str, file: Path) -> ModuleType:
    """Execute the text of a file with parts and register the parts.

    `file`: name of the file, for error messages. It need not exist.
    """
    name = _name_module(text)
    previous_module = sys.modules.get(name)
    if previous_module is not None and previous_module.__dict__["__source__"] == text:
        _register_parts(previous_module)
        return previous_module
    previous_parts = registry.custom_parts()
    # The loader accepts a file with any suffix.
    loader = SourceFileLoader(name, str(file))
    spec = spec_from_file_location(name, file, loader=loader)
    assert spec is not None
    module = module_from_spec(spec)
    module.__dict__["__source__"] = text
    sys.modules[name] = module
    try:
        label = f"{file} cannot be loaded"
        boundary = run_third_party_code(label, lambda: {file.name: label})
        with registry.require_unique_parts(), boundary:
            exec(compile(text, str(file), "exec"), module.__dict__)
        if not _register_parts(module):
            raise PartError(
                f"{file} has no part: it must define a class that derives from a kind of part and "
                "has a name"
            )
    # An interruption must not leave a part of the file registered, either.
    except BaseException:
        del sys.modules[name]
        if previous_module is not None:
            sys.modules[name] = previous_module
        _restore_registry(previous_parts)
        raise
    return module


def _name_module(text: str) -> str:
    """Return the name of the module of a part. Compiled code contains it.

    A change of comments, docstrings or blank lines changes the name only if it moves an error.
    """
    code = text
    # The compiler reports invalid code.
    with suppress(SyntaxError, TokenError):
        code = remove_comments(text)
        lines = enumerate(text.split("\n"))
        code += str([number for number, line in lines if re.search(r"\b(raise|assert)\b", line)])
    return f"{MODULE_PREFIX}{hashlib.sha256(code.encode()).hexdigest()[:16]}"


def parts_in(module: ModuleType) -> list[Any]:
    """Return the parts that a module defines, in the order of their definition."""
    classes = [value for value in vars(module).values() if isinstance(value, type)]
    return [
        part
        for part in classes
        if issubclass(part, Part) and part.name and part.__module__ == module.__name__
    ]


def _register_parts(module: ModuleType) -> bool:
    """Register the parts of a module. Return False if it has none."""
    parts = parts_in(module)
    for part in parts:
        registry.add(part.kind, part.name, part)
    return bool(parts)


def _restore_registry(parts: dict[tuple[str, str], type]) -> None:
    """Remove custom parts that are not in `parts`, and register all of `parts`."""
    for kind, name in registry.custom_parts():
        if (kind, name) not in parts:
            registry.remove(kind, name)
    for (kind, name), part in parts.items():
        registry.add(kind, name, part)


def load_entry_points() -> None:
    """Import the modules of the entry-point group `baldwinlab.parts` of installed packages.

    A part that was loaded from a file is not replaced.

    Raises
    ------
    PartError
        If a module cannot be imported.
    """
    loaded_parts = registry.custom_parts()
    with registry.require_unique_parts():
        for entry in entry_points(group=ENTRY_POINT_GROUP):
            with run_third_party_code(f"the part {entry.name!r} ({entry.value}) cannot be loaded"):
                entry.load()
    # Entry points may have replaced parts that were loaded from files.
    for (kind, name), part in loaded_parts.items():
        registry.add(kind, name, part)


def sources_of(experiments: Iterable[Any]) -> tuple[Source, ...]:
    """Return the sources of the custom parts that experiments choose.

    Parameters
    ----------
    experiments : iterable of BaseExperiment
        The experiments.

    Returns
    -------
    tuple of Source
        Sources, sorted by kind and name.

    Raises
    ------
    PartError
        If a part is not loaded, or has no source file.
    """
    custom_parts = {choice for experiment in experiments for choice in custom_choices(experiment)}
    return tuple(source_of(kind, name) for kind, name in sorted(custom_parts))


def source_of(kind: str, name: str) -> Source:
    """Return the source of a custom part."""
    part = registry.custom_parts().get((kind, name))
    if part is None:
        raise PartError(f"the {kind} {name!r} is not loaded: {registry.PART_HINT}")
    module = sys.modules[part.__module__]
    text = getattr(module, "__source__", None)
    if text is None:
        try:
            text = Path(str(module.__file__)).read_text("utf-8")
        except (OSError, AttributeError, UnicodeDecodeError):
            raise PartError(
                f"the {kind} {name!r} has no file: define it in a file, so that a study can store "
                "its source"
            ) from None
    return Source(kind, name, text, Path(str(module.__file__)).name)


class PartOrigin(NamedTuple):
    """Origin of a custom part."""

    kind: str
    name: str
    module: str
    text: str | None  # Text of the file. None without a file, for example in a notebook.
    file: str  # Path of the file, for messages.

    def describe(self) -> str:
        """Return kind, name and file of the part."""
        return f"the {self.kind} {self.name!r} of {self.file}"

    def load(self) -> None:
        """Load the part, unless it is loaded. Raise PartError if a different part is loaded."""
        key = self.kind, self.name
        if key not in registry.custom_parts():
            _load_module(self)
        if self.text is not None and _read_text(*key) != self.text:
            raise PartError(
                f"{self.describe()} differs from the {self.kind} of this name that this process "
                "has loaded: load one of them in a new process, or give it another name"
            )


def _find_origin(part: Any) -> PartOrigin:
    file = str(getattr(sys.modules.get(part.__module__), "__file__", None) or part.__module__)
    return PartOrigin(part.kind, part.name, part.__module__, _read_text(part.kind, part.name), file)


def _read_text(kind: str, name: str) -> str | None:
    """Return the text of the file of a loaded part, or None without a file."""
    try:
        return source_of(kind, name).text
    except PartError:
        return None


def _load_module(origin: PartOrigin) -> None:
    """Load the module of a part. Raise PartError if the part cannot be loaded."""
    if origin.module.startswith(MODULE_PREFIX):
        assert origin.text is not None
        load_text(origin.text, Path(origin.file))
    elif origin.module not in MAIN_MODULES:
        with run_third_party_code(f"{origin.describe()} cannot be imported"):
            import_module(origin.module)
    if (origin.kind, origin.name) not in registry.custom_parts():
        raise PartError(
            f"{origin.describe()} is not loaded in this process: define it in a file of its own, "
            "and load it with load_file, or import it as a module"
        )


def _restore_attribute(origin: PartOrigin, qualified_name: str) -> Any:
    """Return the class of a part that was loaded from a file."""
    origin.load()
    value: Any = sys.modules[registry.find_class(origin.kind, origin.name).__module__]
    for name in qualified_name.split("."):
        value = getattr(value, name)
    return value


def _reduce_class(part: Any) -> Any:
    """Return the name of a class that can be imported, or a function call that loads the class."""
    is_from_file = part.__module__.startswith(MODULE_PREFIX)
    if not is_from_file or not part.name:
        return part.__qualname__
    return _restore_attribute, (_find_origin(part), part.__qualname__)


# `parts` imports this module, so both calls precede all files with parts. The first is for pickles
# of experiments, which contain the origins of parts. The second is for pickles of parts.
registry.set_origin_finder(_find_origin)
copyreg.pickle(PartMeta, _reduce_class)
