"""Old names of commands and options. They work for one release and print the new name."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Final, NamedTuple


class NewCommand(NamedTuple):
    """The words before and after the arguments of a renamed command."""

    words_before: list[str]
    words_after: list[str]


# The new command, by the old command.
NEW_COMMANDS: Final[dict[str, NewCommand]] = {
    "papers": NewCommand(["list", "papers"], []),
    "presets": NewCommand(["list", "presets"], []),
    "phylogeny": NewCommand(["export"], ["--format", "phylogeny"]),
    "crate": NewCommand(["export"], ["--format", "ro-crate"]),
}
_NEW_LAST: Final = {"--last": "--last-generations"}
# New command -> old option -> new option.
NEW_OPTIONS: Final[dict[str, dict[str, str]]] = {
    "assay": {"--only": "--assays"},
    "bench": {"--rules": "--all-rules", "--json": "--out"},
    "check": {"--only": "--requirements"},
    "claims": _NEW_LAST,
    "gallery": _NEW_LAST,
    "multiverse": {"--full": "--all-combinations", **_NEW_LAST},
    "report": _NEW_LAST,
    "reproduce": {"--reading": "--variant", **_NEW_LAST},
    "run": {"--reading": "--variant"},
    "show": {"--reading": "--variant"},
    "sweep": _NEW_LAST,
}


def replace_old_names(arguments: Sequence[str], warn: Callable[[str], None]) -> list[str]:
    """Return the arguments of the command line with the new names of commands and options.

    Parameters
    ----------
    arguments
        The words after `baldwinlab`.
    warn
        Called with one sentence for each old name.
    """
    if not arguments:
        return []
    command, *words = arguments
    if command in NEW_COMMANDS:
        words_before, words_after = NEW_COMMANDS[command]
        new_command = " ".join([*words_before, *words_after])
        warn(f"`{command}` was renamed; use `baldwinlab {new_command}`")
        return [*words_before, *words, *words_after]
    new_options = NEW_OPTIONS.get(command, {})
    return [command, *(_replace_option(word, new_options, warn) for word in words)]


def _replace_option(word: str, new_options: dict[str, str], warn: Callable[[str], None]) -> str:
    """Return `--new` for `--old`, and `--new=value` for `--old=value`."""
    option, equals, value = word.partition("=")
    if option not in new_options:
        return word
    warn(f"`{option}` was renamed; use `{new_options[option]}`")
    return f"{new_options[option]}{equals}{value}"
