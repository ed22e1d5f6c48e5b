"""xarray and pandas, imported when an attribute of them is read.

Their import takes as long as a short run, and most commands use neither.
"""

from __future__ import annotations

from importlib import import_module
from types import ModuleType
from typing import TYPE_CHECKING, Any

__all__ = ["pd", "xr"]


class _DeferredModule(ModuleType):
    """A module that is imported when an attribute of it is read.

    The import system has a lock for each module, so several threads can read the first attribute.
    """

    def __getattr__(self, name: str) -> Any:
        return getattr(import_module(self.__name__), name)


if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr
else:
    pd = _DeferredModule("pandas")
    xr = _DeferredModule("xarray")
