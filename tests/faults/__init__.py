"""Tests with killed processes, damaged files, invalid inputs and floods of requests.

See docs/explanation/reproducibility.md. `make faults` runs all of them, `make test` a sample.
"""

from __future__ import annotations

import os


def amount(full: int, sample: int) -> int:
    """Return `full` if the environment variable FAULTS is "all", else `sample`."""
    return full if os.environ.get("FAULTS") == "all" else sample
