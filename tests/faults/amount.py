"""How much is tried."""

from __future__ import annotations

import os


def amount(whole: int, sample: int) -> int:
    """`whole` with FAULTS=all in the environment, else a sample."""
    return whole if os.environ.get("FAULTS") == "all" else sample
