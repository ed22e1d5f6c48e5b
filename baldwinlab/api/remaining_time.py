"""Estimate of the time left for a sequence of studies."""

from __future__ import annotations

import time
from collections.abc import Sequence

from baldwinlab.core import console


class RemainingTime:
    """Estimate of the time left for all studies, from the speed of the studies that are done.

    `unit`: unit of the work.
    """

    def __init__(self, amounts: Sequence[int], unit: str = "agent-steps") -> None:
        self._amounts = amounts
        self._unit = unit
        self._n_begun = 0
        self._start = time.monotonic()

    def announce(self, title: str) -> None:
        """Print the title of the next study, and the time left for it and all later studies."""
        done = sum(self._amounts[: self._n_begun])
        left = sum(self._amounts[self._n_begun :])
        self._n_begun += 1
        seconds = time.monotonic() - self._start
        note = f"{left:,} {self._unit} left in all studies"
        if done and left:
            note += f", about {max(1, round(seconds * left / done / 60))} min"
        console.info(f"{title}: study {self._n_begun} of {len(self._amounts)}; {note}")
