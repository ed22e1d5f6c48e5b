"""Registration of the environments in Gymnasium, without an import of Gymnasium.

Gymnasium has no plug-ins: a package registers its environments when it is imported. Its import
takes as long as everything else that `import baldwinlab` does, so the registration waits until a
program imports it.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from importlib.machinery import ModuleSpec
from importlib.util import find_spec
from types import ModuleType
from typing import Any, Final

GYMNASIUM: Final = "gymnasium"
ENVIRONMENT: Final = "baldwinlab/Forager-v0"
_FUNCTIONS_MODULE: Final = "baldwinlab.api.integrations.gymnasium"


def register_environments() -> None:
    """Register the environments now if Gymnasium is imported, or else after its import."""
    gymnasium = sys.modules.get(GYMNASIUM)
    if gymnasium is None:
        sys.meta_path.insert(0, _ImportWatcher())
    else:
        _register(gymnasium)


def _register(gymnasium: Any) -> None:
    # A lifetime has a fixed length and needs no time limit. The environment checks the order of
    # calls itself.
    gymnasium.register(
        ENVIRONMENT,
        entry_point=f"{_FUNCTIONS_MODULE}:make_forager",
        vector_entry_point=f"{_FUNCTIONS_MODULE}:make_foragers",
        order_enforce=False,
    )


class _ImportWatcher:
    """Finder of modules that lets the import of Gymnasium register the environments."""

    def find_spec(
        self, name: str, path: Sequence[str] | None = None, target: ModuleType | None = None
    ) -> ModuleSpec | None:
        if name != GYMNASIUM:
            return None
        sys.meta_path.remove(self)
        spec = find_spec(name)
        if spec is not None and spec.loader is not None:
            execute_module = spec.loader.exec_module

            def execute_and_register(module: ModuleType) -> None:
                execute_module(module)
                _register(module)

            spec.loader.exec_module = execute_and_register  # type: ignore[method-assign]
        return spec
