"""Errors of the package. The messages of these errors are written for the user."""

from __future__ import annotations

from typing import Final


class BaldwinLabError(Exception):
    """Base class of the errors that the package raises."""


class RefusedError(BaldwinLabError, ValueError):
    """Invalid request: an invalid path, a missing extra, or settings that do not fit."""


class PartError(BaldwinLabError, ValueError):
    """Invalid part: it cannot be loaded or compiled, or differs from the part of a study."""


# Name of an argument -> name of the option on the command line, if the names differ.
OPTION_NAMES: Final = {"last": "last-generations"}


class ArgumentError(RefusedError):
    """Argument out of range.

    Parameters
    ----------
    name : str
        Name of the argument.
    value : object
        The invalid value.
    rule : str
        The rule that the value violates, such as "must be a whole number from 1 to 5".

    Attributes
    ----------
    option : str
        The message for the command line, with the name of the option.
    """

    def __init__(self, name: str, value: object, rule: str) -> None:
        super().__init__(name, value, rule)
        option_name = OPTION_NAMES.get(name, name.replace("_", "-"))
        self.option = f"--{option_name} {value} {rule}"

    def __str__(self) -> str:
        name, value, rule = self.args
        return f"{name} = {value!r} {rule}"


class InterruptedStudyError(BaldwinLabError):
    """Interruption of a study by a failing worker or disk. The same call resumes the study."""
