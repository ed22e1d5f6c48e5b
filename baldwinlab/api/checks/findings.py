"""Findings of a check: one line per requirement."""

from __future__ import annotations

from typing import NamedTuple

from baldwinlab.core.errors import BaldwinLabError


class FailsError(BaldwinLabError):
    """A requirement does not hold."""


class NotCheckedError(BaldwinLabError):
    """A requirement could not be checked."""


class Finding(NamedTuple):
    """The result of a requirement.

    Attributes
    ----------
    requirement : str
        The requirement in words, or why no oracle verifies a hook.
    holds : bool or None
        Whether it holds, or None if it could not be checked.
    sentence : str
        Details, or an empty string.
    again : str
        The command that repeats the check.
    is_unverified : bool
        Whether the finding is about a hook without an oracle.
    """

    requirement: str
    holds: bool | None
    sentence: str
    again: str
    is_unverified: bool = False

    def __str__(self) -> str:
        if self.holds is None:
            verb = "verified" if self.is_unverified else "checked"
            return f"not {verb}: {self.requirement}: {self.sentence}"
        if self.holds:
            return f"ok: {self.requirement}" + (f" ({self.sentence})" if self.sentence else "")
        return f"does not hold: {self.requirement}: {self.sentence}; again: {self.again}"
