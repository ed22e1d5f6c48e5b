"""What the package refuses to do. Every fault of a user's is one clear sentence, and one of these."""

from __future__ import annotations


class BaldwinLabError(Exception):
    """What cannot be done, in a sentence for the user. All errors that the package raises on purpose derive from it."""


class RefusedError(BaldwinLabError, ValueError):
    """What was asked for cannot be: a place that cannot be reached, an extra that is missing, settings that do not fit."""


class PartError(BaldwinLabError, ValueError):
    """A part that cannot be loaded or compiled, or that is not the one a study was made with."""


class ArgumentError(RefusedError):
    """An argument beyond its limits, such as ("runs", 0, "must be at least 1"); the command line says it of its option."""

    def __init__(self, name: str, value: object, rule: str) -> None:
        super().__init__(name, value, rule)
        self.option = f"--{name} {value} {rule}"

    def __str__(self) -> str:
        name, value, rule = self.args
        return f"{name} = {value!r} {rule}"


def require_positive(name: str, value: int | None) -> None:
    """Raises ArgumentError where a number is given that is less than 1."""
    if value is not None and value < 1:
        raise ArgumentError(name, value, "must be at least 1")


class InterruptedStudyError(BaldwinLabError):
    """A study that did not come to its end, because a place failed; what is stored stays, and the same call carries on."""
