"""Old names of commands and options. They work for one release and name the new ones."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Final

# Old command -> the words that replace it, and the words that follow its arguments.
COMMANDS: Final[dict[str, tuple[list[str], list[str]]]] = {
    "papers": (["list", "papers"], []),
    "presets": (["list", "presets"], []),
    "phylogeny": (["export"], ["--format", "phylogeny"]),
    "crate": (["export"], ["--format", "ro-crate"]),
}
_LAST: Final = {"--last": "--last-generations"}
# New command -> old option -> new option.
OPTIONS: Final[dict[str, dict[str, str]]] = {
    "assay": {"--only": "--assays"},
    "bench": {"--rules": "--all-rules", "--json": "--out"},
    "check": {"--only": "--requirements"},
    "claims": _LAST,
    "gallery": _LAST,
    "multiverse": {"--full": "--all-combinations", **_LAST},
    "report": _LAST,
    "reproduce": {"--reading": "--variant", **_LAST},
    "run": {"--reading": "--variant"},
    "show": {"--reading": "--variant"},
    "sweep": _LAST,
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
    if command in COMMANDS:
        head, tail = COMMANDS[command]
        warn(f"`{command}` was renamed; use `baldwinlab {' '.join([*head, *tail])}`")
        return [*head, *words, *tail]
    renamed = OPTIONS.get(command, {})
    return [command, *(_replace_option(word, renamed, warn) for word in words)]


def _replace_option(word: str, renamed: dict[str, str], warn: Callable[[str], None]) -> str:
    """Return `--new` for `--old`, and `--new=value` for `--old=value`."""
    option, equals, value = word.partition("=")
    if option not in renamed:
        return word
    warn(f"`{option}` was renamed; use `{renamed[option]}`")
    return f"{renamed[option]}{equals}{value}"
