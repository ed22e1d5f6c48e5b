"""The lab in the browser: one page, served on loopback, from which studies are watched, steered, replayed and shared.

It needs the extra `lab`, so what works without it imports no other module of this package than `pages`, `schema` and `export`.
"""

from __future__ import annotations

import time
from asyncio import Semaphore
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

from baldwinlab.lab.cache import Cache
from baldwinlab.studies.records import StudyError

if TYPE_CHECKING:
    from baldwinlab.lab.live import Live


class MissingError(StudyError):
    """Something was asked for by name that is not there: status 404."""


@dataclass(frozen=True)
class Lab:
    """What the routes of one server share."""

    root: Path  # resolved; every study that is served lies in it
    live: Live  # the runs that live now
    answers: Cache = field(default_factory=Cache)  # recordings, and what else takes a while
    drawn: dict[str, float] = field(
        default_factory=dict
    )  # the share of each movie that is made now, by what its page calls it
    turns: Semaphore = field(
        default_factory=lambda: Semaphore(4)
    )  # so many are made at a time: it bounds the memory they take
    ready: Callable[[], bool] = lambda: (
        True
    )  # whether the engine is compiled; until then, pages wait with what lives
    began: float = field(default_factory=time.monotonic)
