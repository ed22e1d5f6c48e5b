"""Libraries that only the exchange with other tools needs."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from baldwinlab.core.extras import missing_extra


@contextmanager
def needed_for(what: str) -> Iterator[None]:
    """Import libraries of the extra `exchange` in here. Raises RefusedError, with a sentence, where one is not installed."""
    try:
        yield
    except ImportError:
        raise missing_extra("exchange", what) from None
