"""Old names of commands and options work, and a line on standard error states the new name."""

from __future__ import annotations

from pathlib import Path

import pytest

from baldwinlab.cli import COMMANDS, old_names
from baldwinlab.cli.old_names import replace_old_names
from baldwinlab.cli.options import app
from tests.commands import Command
from tests.small_studies import make_small_study

OPTIONS = [
    (command, old, new)
    for command, options in old_names.NEW_OPTIONS.items()
    for old, new in options.items()
]


@pytest.mark.parametrize("old", ["papers", "presets"])
def test_an_old_list_command_prints_what_list_prints(command: Command, old: str) -> None:
    result = command(old)
    assert result.code == 0
    assert result.err == f"baldwinlab: `{old}` was renamed; use `baldwinlab list {old}`\n"
    assert result.out == command("list", old).out


def test_the_old_commands_phylogeny_and_crate_are_formats_of_export(
    command: Command, tmp_path: Path
) -> None:
    make_small_study(tmp_path / "study", runs=1)
    run = ("--condition", "evo/A", "--run", "0", "--out", "parents.csv")
    result = command("phylogeny", "study", *run)
    assert (result.code, result.out) == (0, "parents.csv: 60 agents\n")
    assert "use `baldwinlab export --format phylogeny`" in result.err
    result = command("crate", "study", "--author", "Ada Lovelace", "--license", "CC-BY-4.0")
    assert result.code == 0
    assert "use `baldwinlab export --format ro-crate`" in result.err
    assert (tmp_path / "study/ro-crate-metadata.json").exists()


@pytest.mark.parametrize(("name", "old", "new"), OPTIONS)
def test_an_old_option_is_replaced_by_the_new_option(name: str, old: str, new: str) -> None:
    messages: list[str] = []
    renamed = replace_old_names([name, old, "3", f"{old}=4"], messages.append)
    assert renamed == [name, new, "3", f"{new}=4"]
    assert messages == [f"`{old}` was renamed; use `{new}`"] * 2
    names = {
        option for argument in app[name].assemble_argument_collection() for option in argument.names
    }
    assert new in names
    assert old not in names


def test_arguments_of_other_commands_do_not_change() -> None:
    arguments = ["export", "papers", "--last", "--full"]
    assert replace_old_names(arguments, pytest.fail) == arguments
    assert replace_old_names([], pytest.fail) == []


def test_the_help_lists_no_old_name(command: Command) -> None:
    text = command("--help").out
    assert all(f" {name} " in text for name in COMMANDS)
    assert not [name for name in old_names.NEW_COMMANDS if f"│ {name} " in text]
