"""The lab in the browser: one page, served on loopback, from which studies are watched, steered, replayed and shared.

It needs the extra `lab`, so nothing that works without it may import a module of this package but this one.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from baldwinlab.store import StudyError

if TYPE_CHECKING:
    from baldwinlab.lab.live import Live


class MissingError(StudyError):
    """Something was asked for by name that is not there: status 404."""


@dataclass(frozen=True)
class Lab:
    """What the routes of one server share."""

    root: Path  # resolved; every study that is served lies in it
    live: Live  # the runs that live now
