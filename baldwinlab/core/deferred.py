"""Deferred imports of libraries, because loading a library can take as long as a short run.

- xarray, pandas and scipy.stats are imported when an attribute of the module is read.
- The environments of baldwinlab are registered in Gymnasium when a program imports Gymnasium,
  because Gymnasium has no plug-ins.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from functools import cache
from importlib import import_module
from importlib.machinery import ModuleSpec
from importlib.util import find_spec
from threading import RLock
from types import ModuleType
from typing import TYPE_CHECKING, Any, Final

__all__ = ["import_netcdf_reader", "pd", "register_environments", "stats", "xr"]

GYMNASIUM: Final = "gymnasium"
ENVIRONMENT: Final = "baldwinlab/Forager-v0"
_FUNCTIONS_MODULE: Final = "baldwinlab.api.integrations.gymnasium"


# One thread imports at a time. The libraries import each other, and two threads that wait for each
# other's module get one that is not complete, which raises ImportError.
_LOCK: Final = RLock()


class _DeferredModule(ModuleType):
    """A module that is imported when an attribute of it is read. Several threads may read."""

    def __getattr__(self, name: str) -> Any:
        with _LOCK:
            return getattr(import_module(self.__name__), name)


if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr
    from scipy import stats
else:
    pd = _DeferredModule("pandas")
    stats = _DeferredModule("scipy.stats")
    xr = _DeferredModule("xarray")


def import_netcdf_reader() -> None:
    """Import what xarray imports when it reads a netCDF file: the reader, and Dask if installed."""
    with _LOCK:
        import_module("scipy.io")
        if _has_dask():
            import_module("dask.base")


@cache
def _has_dask() -> bool:
    """Return whether Dask is installed. A search in each read of a file would take time."""
    return find_spec("dask") is not None


def register_environments() -> None:
    """Register the environments now if Gymnasium is imported, or else after its import."""
    gymnasium = sys.modules.get(GYMNASIUM)
    if gymnasium is None:
        sys.meta_path.insert(0, _ImportWatcher())
    else:
        _register(gymnasium)


def _register(gymnasium: Any) -> None:
    # No time limit is registered, because a lifetime has a fixed length. `order_enforce` is False,
    # because the environment itself checks the order of calls.
    gymnasium.register(
        ENVIRONMENT,
        entry_point=f"{_FUNCTIONS_MODULE}:make_forager",
        vector_entry_point=f"{_FUNCTIONS_MODULE}:make_foragers",
        order_enforce=False,
    )


class _ImportWatcher:
    """Finder of modules that registers the environments at the import of Gymnasium."""

    def find_spec(
        self, name: str, path: Sequence[str] | None = None, target: ModuleType | None = None
    ) -> ModuleSpec | None:
        if name != GYMNASIUM:
            return None
        # Otherwise `find_spec` would call this method again.
        sys.meta_path.remove(self)
        spec = find_spec(name)
        if spec is not None and spec.loader is not None:
            execute_module = spec.loader.exec_module

            def execute_and_register(module: ModuleType) -> None:
                execute_module(module)
                _register(module)

            spec.loader.exec_module = execute_and_register  # type: ignore[method-assign]
        return spec
