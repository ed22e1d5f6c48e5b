"""Every variant of the paper, as one study; docs/explanation/multiverse.md."""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from baldwinlab.multiverse.design import Variant, experiments

__all__ = ["Variant", "experiments"]


def __getattr__(name: str) -> Any:
    """Loaded when it is asked for: whoever reads what is stored needs no engine."""
    if name in __all__:
        return getattr(import_module("baldwinlab.multiverse.design"), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
