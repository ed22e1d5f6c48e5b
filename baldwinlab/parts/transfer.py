"""Copies of custom parts for other processes, in which their files may not be loaded.

A pickle of an experiment, or of a part that was loaded from a file, contains the text of the file.
The process that reads the pickle executes the text, unless the same part is loaded already.
A part of an imported module is imported.
"""

from __future__ import annotations

import copyreg
import sys
from importlib import import_module
from pathlib import Path
from typing import Any, Final, NamedTuple

from baldwinlab.core.errors import PartError
from baldwinlab.experiment import registry
from baldwinlab.parts.loading import MODULE_PREFIX, load_text, source_of
from baldwinlab.parts.part import PartMeta

MAIN_MODULES: Final = ("__main__", "__mp_main__")
"""Names of the module of a script. In a process that it starts, the script has the second name."""


class PartOrigin(NamedTuple):
    """Origin of a custom part."""

    kind: str
    name: str
    module: str
    text: str | None  # Text of its file. None if it has no file, for example in a notebook.
    file: str  # Path of its file, for messages.

    def describe(self) -> str:
        """Return kind, name and file of the part."""
        return f"the {self.kind} {self.name!r} of {self.file}"

    def load(self) -> None:
        """Load the part, unless it is loaded."""
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
        try:
            import_module(origin.module)
        except ImportError as error:
            raise PartError(f"{origin.describe()} cannot be imported: {error}") from None
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
    """Return how to pickle the class of a part: by its name if its module can be imported."""
    is_from_file = part.__module__.startswith(MODULE_PREFIX)
    if not is_from_file or not part.name:
        return part.__qualname__
    return _restore_attribute, (_find_origin(part), part.__qualname__)


# `parts` imports this module, so both registrations precede all files with parts. A pickle of an
# experiment contains the origins of its parts, and a pickle of a part contains its class.
registry.set_origin_finder(_find_origin)
copyreg.pickle(PartMeta, _reduce_class)
