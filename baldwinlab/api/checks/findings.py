"""What a check finds, one line a requirement."""

from __future__ import annotations

from typing import NamedTuple

from baldwinlab.core.errors import BaldwinLabError


class FailsError(BaldwinLabError):
    """A requirement that does not hold, in a sentence."""


class NotCheckedError(BaldwinLabError):
    """A requirement that could not be tried, and why."""


class Finding(NamedTuple):
    requirement: str  # in words
    holds: bool | None  # None where it could not be tried
    sentence: str  # what was found, if there is more to say
    again: str  # how to try it again
    is_unverified: bool = False  # of a hook without an oracle; `requirement` holds the reason

    def __str__(self) -> str:
        if self.holds is None:
            verb = "verified" if self.is_unverified else "checked"
            return f"not {verb}: {self.requirement}: {self.sentence}"
        if self.holds:
            return f"ok: {self.requirement}" + (f" ({self.sentence})" if self.sentence else "")
        return f"does not hold: {self.requirement}: {self.sentence}; again: {self.again}"
