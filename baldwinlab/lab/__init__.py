"""The lab: a local server and a web page that show, run, replay and share studies.

The package `server` needs the extra `lab`. The packages `sources` and `pages` work without it.
"""

from __future__ import annotations

from asyncio import Semaphore
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

from baldwinlab.lab.sources.memory import Cache
from baldwinlab.studies.records import StudyError

if TYPE_CHECKING:
    from baldwinlab.lab.sources.live import Live

MAX_QUEUED_RESPONSES = 4


class MissingError(StudyError):
    """Report that a requested study, condition, run or other object does not exist (status 404)."""


@dataclass(frozen=True)
class Lab:
    """The state that all routes of one server share."""

    root: Path  # The served folder, as a resolved path. All served studies are in it.
    live: Live
    # Recordings and other results that take time to compute.
    cache: Cache = field(default_factory=Cache)
    # The finished share of each movie, by the ticket of its page.
    movie_progress: dict[str, float] = field(default_factory=dict)
    # Limits the number of large responses in memory.
    response_slots: Semaphore = field(default_factory=lambda: Semaphore(MAX_QUEUED_RESPONSES))
    # Returns whether the engine is compiled. Until then, pages do not simulate.
    is_engine_ready: Callable[[], bool] = lambda: True
    # The command that started this lab, for messages.
    command: Sequence[str] = ("baldwinlab", "lab")
