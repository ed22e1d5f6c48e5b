"""The shared options are equal in the functions of `bl`, in the commands and in their help."""

from __future__ import annotations

import inspect
from collections.abc import Callable
from dataclasses import fields
from pathlib import Path
from typing import Any

import pytest

import baldwinlab as bl
from baldwinlab.api.run_options import AssayArguments, AssayOptions, RunArguments, RunOptions
from baldwinlab.cli.options import app
from tests.commands import Command

FUNCTIONS: list[tuple[Callable[..., Any], type[AssayOptions]]] = [
    (bl.run, RunOptions),
    (bl.sweep, RunOptions),
    (bl.reproduce, RunOptions),
    (bl.Study.extend, RunOptions),
    (bl.Study.assay, AssayOptions),
]
COMMANDS: list[tuple[str, type[AssayOptions]]] = [
    *((command, RunOptions) for command in ("run", "sweep", "reproduce", "multiverse")),
    ("assay", AssayOptions),
]


@pytest.mark.parametrize(
    ("arguments", "options"), [(AssayArguments, AssayOptions), (RunArguments, RunOptions)]
)
def test_type_checkers_know_the_type_of_each_option(arguments: Any, options: Any) -> None:
    types = {field.name: field.type for field in fields(options)}
    assert {name: kind.__forward_arg__ for name, kind in arguments.__annotations__.items()} == types


@pytest.mark.parametrize(("function", "options"), FUNCTIONS)
def test_a_function_lists_and_documents_each_option(function: Any, options: Any) -> None:
    parameters = inspect.signature(function).parameters
    assert "options" not in parameters
    documentation = inspect.getdoc(function) or ""
    for field in fields(options):
        assert parameters[field.name].default == field.default
        assert f"\n{field.name} : " in documentation


@pytest.mark.parametrize(("command", "options"), COMMANDS)
def test_a_command_has_each_option_with_its_default(command: str, options: Any) -> None:
    arguments = app[command].assemble_argument_collection(parse_docstring=True)
    for field in fields(options):
        argument = arguments[f"--{field.name}"]
        assert argument.field_info.default == field.default
        assert (argument.parameter.help or "").endswith(".")


def test_an_unknown_option_is_refused_in_a_sentence() -> None:
    run: Any = bl.run
    with pytest.raises(TypeError, match=r"run\(\) has no argument 'worker' \(did you mean"):
        run("evo/A", worker=2)
    assay: Any = bl.Study.assay
    with pytest.raises(TypeError, match=r"assay\(\) has no argument 'backend'; there are "):
        assay(None, "innate", backend="cpu")


def test_a_function_and_a_command_use_the_checkpoint(tmp_path: Path, command: Command) -> None:
    with pytest.raises(bl.ArgumentError, match="checkpoint = 'never' must be"):
        bl.sweep(
            {"experiment": "evo/A", "fields": {"motor.noise": [0.1]}},
            out=tmp_path,
            checkpoint="never",
        )
    assert "--checkpoint never must be" in command("reproduce", "--checkpoint", "never").err
