"""Import optional libraries: the libraries of the extra `exchange`."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from baldwinlab.core.extras import missing_extra_error


@contextmanager
def require_extra(feature: str) -> Iterator[None]:
    """Import libraries of the extra `exchange` inside this context."""
    try:
        yield
    except ImportError:
        raise missing_extra_error("exchange", feature) from None
