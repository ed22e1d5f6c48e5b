"""The help of a command describes its arguments and its output folder, and has an example."""

from __future__ import annotations

import shlex

import pytest
from cyclopts import Argument

from baldwinlab.cli import COMMANDS, GROUPS
from baldwinlab.cli.options import app
from tests.commands import Command


def list_arguments(name: str) -> list[Argument]:
    """Return the arguments and options of a command, with the fields of the shared options."""
    arguments = app[name].assemble_argument_collection(parse_docstring=True)
    return [argument for argument in arguments if not argument.children]


def option_texts(name: str) -> dict[str, str]:
    """Return the help text of each argument and option of a command."""
    return {argument.name: argument.parameter.help or "" for argument in list_arguments(name)}


@pytest.mark.parametrize("name", COMMANDS)
def test_every_argument_and_option_has_a_description(name: str) -> None:
    options = option_texts(name)
    assert [option for option, text in options.items() if not text.endswith(".")] == []


@pytest.mark.parametrize("name", COMMANDS)
def test_every_command_has_an_example_that_can_be_parsed(name: str) -> None:
    lines = [line.strip() for line in (app[name].help or "").splitlines()]
    examples = [line for line in lines if line.startswith(f"baldwinlab {name} ")]
    examples += [line for line in lines if line == f"baldwinlab {name}"]
    assert examples
    for example in examples:
        arguments = shlex.split(example.partition(" > ")[0])[1:]
        app.parse_args(arguments, exit_on_error=False, print_error=False)


@pytest.mark.parametrize("name", COMMANDS)
def test_every_default_is_shown_or_described(name: str) -> None:
    for argument in list_arguments(name):
        text = (argument.parameter.help or "").lower()
        is_shown = argument.field_info.default not in (None, "", ())
        is_flag = argument.hint is bool
        if not argument.required and not is_flag and not is_shown:
            is_list = argument.name in ("--set", "--part", "--author", "--license", "EXPERIMENTS")
            assert "default" in text or is_list, argument.name


@pytest.mark.parametrize("name", [name for name in COMMANDS if name in GROUPS["Run"]])
def test_the_help_of_commands_that_run_names_the_default_folder(name: str) -> None:
    assert "Default:" in option_texts(name)["--out"]


@pytest.mark.parametrize("name", COMMANDS)
def test_the_help_of_force_names_the_check_that_it_disables(name: str) -> None:
    text = option_texts(name).get("--force", "Overwrite")
    assert "Overwrite" in text or "memory or disk" in text


def test_the_help_starts_with_the_first_commands_and_groups_all_commands(command: Command) -> None:
    text = command("--help").out
    start = text.index("Start here:")
    positions = [text.index(f"─ {title} ─") for title in GROUPS]
    assert start < positions[0]
    assert positions == sorted(positions)
    assert all(f" {name} " in text for name in COMMANDS)


def test_without_arguments_four_lines_say_how_to_start(command: Command) -> None:
    result = command()
    assert result.code == 0
    first, *rest = result.out.splitlines()
    assert first.startswith("baldwinlab: ")
    assert [line.partition(":")[0] for line in rest] == ["Start", "Look", "Help"]
