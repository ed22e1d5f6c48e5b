"""The number of cases to test."""

from __future__ import annotations

import os


def amount(full: int, sample: int) -> int:
    """Return `full` if the environment variable FAULTS is "all", else `sample`."""
    return full if os.environ.get("FAULTS") == "all" else sample
