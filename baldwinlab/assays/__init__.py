"""Assays: what is measured on a stored study by living its genomes again; docs/explanation/assays.md.

`run` measures them, a file for each; `stored` reads them back; `analysis` asks whether it is the Baldwin effect.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from baldwinlab.assays.run import (
        ASSAYS,
        agent_steps,
        is_stored,
        misfits,
        missing_assays,
        open_assay,
        run_assays,
    )

__all__ = [
    "ASSAYS",
    "agent_steps",
    "is_stored",
    "misfits",
    "missing_assays",
    "open_assay",
    "run_assays",
]


def __getattr__(name: str) -> Any:
    """Loaded when it is asked for: whoever reads what is stored needs no engine."""
    if name in __all__:
        return getattr(import_module("baldwinlab.assays.run"), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
