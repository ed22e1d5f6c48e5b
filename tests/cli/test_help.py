"""The help of every command describes each of its arguments and options."""

from __future__ import annotations

import pytest

from baldwinlab.cli import COMMANDS
from baldwinlab.cli.options import app


@pytest.mark.parametrize("name", COMMANDS)
def test_every_argument_and_option_is_described(name: str) -> None:
    arguments = app[name].assemble_argument_collection()
    assert [argument.name for argument in arguments if not argument.parameter.help] == []


def test_the_help_of_run_says_where_it_writes_and_how_fields_are_changed() -> None:
    described = {
        argument.name: argument.parameter.help or ""
        for argument in app["run"].assemble_argument_collection()
    }
    assert "results/NAME" in described["--out"]
    assert (
        "--set learning.rate=0.05 population.size=30" in described["--set"]
        and "show" in described["--set"]
    )


def test_the_help_of_replay_says_where_numbers_begin() -> None:
    described = {
        argument.name: argument.parameter.help or ""
        for argument in app["replay"].assemble_argument_collection()
    }
    assert all("from 0" in described[name] for name in ("--run", "--generation"))
