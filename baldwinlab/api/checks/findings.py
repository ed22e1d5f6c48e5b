"""Findings of a check: one line per requirement."""

from __future__ import annotations

from typing import NamedTuple

from baldwinlab.core.errors import BaldwinLabError


class FailsError(BaldwinLabError):
    """Error of a requirement that does not hold."""


class NotCheckedError(BaldwinLabError):
    """Error of a requirement that cannot be checked."""


class CheckFinding(NamedTuple):
    """The result of a requirement.

    Attributes
    ----------
    requirement : str
        Description of the requirement. For an unverified hook: why no oracle verifies the hook.
    holds : bool or None
        Whether the requirement holds. None if it could not be checked.
    message : str
        Details, or an empty string.
    command : str
        The command that repeats the check.
    is_unverified : bool
        Whether the finding is about a hook without an oracle.
    """

    requirement: str
    holds: bool | None
    message: str
    command: str
    is_unverified: bool = False

    def __str__(self) -> str:
        if self.holds is None:
            verb = "verified" if self.is_unverified else "checked"
            return f"not {verb}: {self.requirement}: {self.message}"
        if self.holds:
            remark = f" ({self.message})" if self.message else ""
            return f"ok: {self.requirement}{remark}"
        return f"does not hold: {self.requirement}: {self.message}; to repeat: {self.command}"
