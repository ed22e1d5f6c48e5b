"""Test that the reference of parts describes every hook, field, helper and the order of calls."""

from __future__ import annotations

import inspect
import json
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

from baldwinlab import parts
from baldwinlab.api.checks import oracle_data
from baldwinlab.api.checks.reference import Naive
from baldwinlab.experiment import registry
from baldwinlab.models.miniworld import state
from baldwinlab.parts.part import hook_names
from scripts import part_reference
from scripts.described import described_attributes, entries, parse_docstring
from scripts.hook_calls import CALLS, STAGES

ROOT = Path(__file__).parent.parent
KINDS = part_reference.kinds()
HOOKS = [
    pytest.param(kind, name, id=f"{kind.__name__}.{name}")
    for kind in KINDS
    for name in hook_names(kind)
]
# A generation with every hook of the table. It prints the hooks in the order of their first calls.
SIMULATION = """
import json
from functools import wraps
import baldwinlab as bl
from baldwinlab.experiment.class_builder import choosing_fields
from baldwinlab.parts.part import hook_names
from scripts import part_reference

calls = []

def recorded(kind, name, function):
    @wraps(function)
    def call(*arguments):
        calls.append(f"{kind.__name__}.{name}")
        return function(*arguments)
    return staticmethod(call)

experiment = bl.load("evo+self-taught/A").replace(
    population={"size": 2},
    lifetime={"steps": 2},
    evolution={
        "generations": 2,
        "elite": 1,
        "lamarckian_share": 0.5,
        "stop": "target-fitness",
        "target_fitness": {"target": 1000},
    },
    senses={"kinds": ["food", "nearest"], "visual_radius": 300},
    world={"features": ["walls"]},
)
def classes(kind):
    yield kind
    for part in kind.__subclasses__():
        yield from classes(part)

# A part is loaded when an experiment uses it.
for path, _, _ in choosing_fields(type(experiment)):
    experiment.parts(path)
def end_step(part, model, state, world, step):
    pass

# The engine calls this hook of fitness and selection if a part defines it.
for path in ("evolution.fitness", "evolution.selection"):
    type(experiment.part(path)).end_step = staticmethod(end_step)
for kind in part_reference.kinds():
    for part in classes(kind):
        for name in hook_names(kind):
            if name in vars(part):
                setattr(part, name, recorded(kind, name, getattr(part, name)))
bl.simulate(experiment, seed=1)
print(json.dumps(list(dict.fromkeys(calls))))
"""


@pytest.fixture(scope="module")
def first_calls() -> list[str]:
    """Return the hooks of a simulated generation, in the order of their first calls."""
    environment = {**os.environ, "NUMBA_DISABLE_JIT": "1", "PYTHONPATH": str(ROOT)}
    command = [sys.executable, "-W", "ignore", "-c", SIMULATION]
    result = subprocess.run(command, capture_output=True, text=True, env=environment, cwd=ROOT)
    assert result.returncode == 0, result.stderr
    calls: list[str] = json.loads(result.stdout.splitlines()[-1])
    return calls


def test_the_table_of_calls_has_the_order_of_the_engine(first_calls: list[str]) -> None:
    """Ignore the order of `blocks_sight`, which a sense can call at any time."""
    documented = list(dict.fromkeys(f"{call.kind}.{call.hook}" for call in CALLS if call.kind))
    sight = "WorldFeature.blocks_sight"
    assert sorted(first_calls) == sorted(documented)
    assert [name for name in first_calls if name != sight] == [
        name for name in documented if name != sight
    ]


@pytest.mark.parametrize(("kind", "name"), HOOKS)
def test_every_hook_is_in_the_table_of_calls(kind: type[parts.Part], name: str) -> None:
    calls = [call for call in CALLS if (call.kind, call.hook) == (kind.__name__, name)]
    assert calls or name == "links"
    assert all(call.stage in STAGES and call.scope in part_reference.SCOPES for call in calls)


def test_the_table_of_calls_names_only_existing_hooks() -> None:
    hooks = {(kind.__name__, name) for kind in KINDS for name in hook_names(kind)}
    assert {(call.kind, call.hook) for call in CALLS if call.kind} <= hooks


@pytest.mark.parametrize(("kind", "name"), HOOKS)
def test_every_hook_and_argument_has_a_description(kind: type[parts.Part], name: str) -> None:
    hook = getattr(kind, name)
    text, sections = parse_docstring(hook.__doc__)
    described = {
        argument
        for entry in entries(sections["Parameters"])
        for argument in entry.names
        if entry.text
    }
    assert text
    assert [name for name in inspect.signature(hook).parameters if name not in described] == []


@pytest.mark.parametrize("kind", [parts.Part, *KINDS], ids=lambda kind: kind.__name__)
def test_every_declaration_of_a_kind_has_a_description(kind: type[parts.Part]) -> None:
    attributes = described_attributes(kind)
    assert [name for name in part_reference.declared_names(kind) if name not in attributes] == []
    assert all(entry.text for entry in attributes.values())


@pytest.mark.parametrize("described", [state.MiniWorldModel, state.State])
def test_every_field_of_model_and_state_has_a_description(described: type) -> None:
    attributes = described_attributes(described)
    assert list(attributes) == list(described._fields)  # type: ignore[attr-defined]
    assert all(entry.text for entry in attributes.values())


@pytest.mark.parametrize("described", [oracle_data.Agent, oracle_data.Item, Naive])
def test_every_field_of_an_oracle_has_a_description(described: type) -> None:
    attributes = described_attributes(described)
    assert list(attributes) == list(described.__annotations__)
    assert all(entry.text for entry in attributes.values())


def test_every_function_of_naive_has_a_description() -> None:
    functions = {name: value for name, value in vars(Naive).items() if callable(value)}
    public = {name: value for name, value in functions.items() if not name.startswith("_")}
    assert public
    assert all(value.__doc__ for value in public.values())


@pytest.mark.parametrize("name", part_reference.helper_names())
def test_every_helper_has_a_description(name: str) -> None:
    value = getattr(parts, name)
    assert name in part_reference.constant_descriptions() or parse_docstring(value.__doc__).text


def test_every_random_stream_has_a_description() -> None:
    streams = list(part_reference.streams())
    assert {"LIFE", "FOUNDER"} <= {name for name, _, _ in streams}
    assert all(text for _, _, text in streams)
    numbers = [number for _, number, _ in streams]
    assert len(set(numbers)) == len(numbers)


ALL_PARTS = [(kind, name) for kind in registry.BUILT_IN for name in registry.package_parts(kind)]
# Names in docstrings of parts that are no setting of the part and no part.
OTHER_NAMES = ("mutation_size",)
SETTINGS_OF_PARTS = [
    pytest.param(kind, name, id=f"{kind}: {name}")
    for kind, name in ALL_PARTS
    if name != "miniworld"
]


@pytest.mark.parametrize(("kind", "name"), SETTINGS_OF_PARTS)
def test_the_docstring_of_a_part_names_only_existing_settings(kind: str, name: str) -> None:
    """A name in code type is a setting of the part, of the experiment, or another part."""
    part = registry.find_class(kind, name)
    text, _ = parse_docstring(part.__doc__)
    part_names = {part_name for _, part_name in ALL_PARTS}
    existing = {*part.model_fields, *OTHER_NAMES, *part_names}
    names = re.findall(r"`([a-z_]+)`", text)
    assert [word for word in names if word not in existing] == []


@pytest.mark.parametrize(("kind", "name"), SETTINGS_OF_PARTS)
def test_a_setting_of_a_part_is_described_by_a_sentence(kind: str, name: str) -> None:
    for field in registry.find_class(kind, name).model_fields.values():
        assert re.fullmatch(r"[A-Zxy].*[.]", field.description or ""), field.description
