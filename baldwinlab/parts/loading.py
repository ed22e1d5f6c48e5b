"""Load custom parts from files and packages, and identify them by source and SHA-256.

A file is executed only if the user names it by `--part`, imports it, or installs its package. The
source that a study stores is never executed. The name of the loaded module contains the hash, so
compiled code of one version of a part is never used for another.
"""

from __future__ import annotations

import hashlib
import sys
from collections.abc import Iterable
from importlib.machinery import SourceFileLoader
from importlib.metadata import entry_points
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path
from types import ModuleType
from typing import Any, Final, NamedTuple

from baldwinlab.core.errors import PartError
from baldwinlab.core.files import PART_FILE, read_bytes
from baldwinlab.experiment import registry

PREFIX: Final = "baldwinlab_part_"
GROUP: Final = "baldwinlab.parts"


class Source(NamedTuple):
    """Where a foreign part comes from: what a study keeps of it."""

    kind: str
    name: str
    text: str
    file: str  # its name, without folders

    @property
    def sha256(self) -> str:
        return hashlib.sha256(self.text.encode()).hexdigest()


def load_file(path: str | Path) -> ModuleType:
    """Execute a file with parts and register them, in place of parts with the same names.

    Raises
    ------
    PartError
        If the file cannot be read or executed, or has no part.
    """
    place = Path(path)
    try:
        text = read_bytes(place, PART_FILE).decode()
    except UnicodeDecodeError:
        raise PartError(f"cannot read the part {place}: it is not UTF-8 text") from None
    except (OSError, ValueError) as error:
        reason = error.strerror if isinstance(error, OSError) else error
        raise PartError(f"cannot read the part {place}: {reason}") from None
    return load_text(text, place)


def load_text(text: str, place: Path) -> ModuleType:
    """Load a part from the text of its file, as remote workers do. See `load_file`."""
    name = f"{PREFIX}{hashlib.sha256(text.encode()).hexdigest()[:16]}"
    before = registry.custom_parts()
    if name in sys.modules:
        _make_known(sys.modules[name])
        return sys.modules[name]
    spec = spec_from_file_location(
        name, place, loader=SourceFileLoader(name, str(place))
    )  # whatever the file's ending is
    assert spec is not None
    module = module_from_spec(spec)
    module.__dict__["__source__"] = text
    sys.modules[name] = module
    try:
        exec(compile(text, str(place), "exec"), module.__dict__)
        if not _make_known(module):
            raise PartError(
                f"{place} holds no part: a class derived from a kind of part, with a name, is wanted"
            )
    except BaseException as error:
        del sys.modules[name]
        _restore(before)
        if isinstance(error, PartError) or not isinstance(error, Exception):
            raise
        raise PartError(
            f"{place} cannot be loaded: {type(error).__name__}: {' '.join(str(error).split())}"
        ) from None
    return module


def parts_in(module: ModuleType) -> list[Any]:
    """Return the parts that a module defines."""
    from baldwinlab.parts.part import Part

    return [
        each
        for each in vars(module).values()
        if isinstance(each, type)
        and issubclass(each, Part)
        and each.name
        and each.__module__ == module.__name__
    ]


def _make_known(module: ModuleType) -> bool:
    """Register the parts of a module. Return False if it has none."""
    found = parts_in(module)
    for part in found:
        registry.add(part.kind, part.name, part)
    return bool(found)


def _restore(before: dict[tuple[str, str], type]) -> None:
    for kind, name in registry.custom_parts():
        if (kind, name) not in before:
            registry.remove(kind, name)
    for (kind, name), part in before.items():
        registry.add(kind, name, part)


def load_entry_points() -> None:
    """Import the modules of the entry-point group `baldwinlab.parts` of installed packages.

    A part that was loaded from a file is not replaced.

    Raises
    ------
    PartError
        If a module cannot be imported.
    """
    before = registry.custom_parts()
    for entry in entry_points(group=GROUP):
        try:
            entry.load()
        except Exception as error:  # whatever a foreign module raises
            raise PartError(
                f"the part {entry.name!r} ({entry.value}) cannot be loaded: {type(error).__name__}: {error}"
            ) from None
    for (kind, name), part in before.items():
        registry.add(kind, name, part)


def sources_of(experiments: Iterable[Any]) -> tuple[Source, ...]:
    """Return the custom parts that experiments choose, sorted by kind and name."""
    from baldwinlab.experiment.base import custom_choices

    chosen = {each for experiment in experiments for each in custom_choices(experiment)}
    return tuple(source_of(kind, name) for kind, name in sorted(chosen))


def source_of(kind: str, name: str) -> Source:
    """Return the source of a custom part.

    Raises
    ------
    PartError
        If the part is not loaded, or has no source file.
    """
    part = registry.custom_parts().get((kind, name))
    if part is None:
        raise PartError(f"{name!r} is a {kind} that is not here: give it by --part FILE")
    module = sys.modules[part.__module__]
    text = getattr(module, "__source__", None)
    if text is None:
        try:
            text = Path(str(module.__file__)).read_text("utf-8")
        except (OSError, AttributeError, UnicodeDecodeError):
            raise PartError(
                f"the {kind} {name!r} has no file: a part must be in one, so that a study can keep its source"
            ) from None
    return Source(kind, name, text, Path(str(module.__file__)).name)
