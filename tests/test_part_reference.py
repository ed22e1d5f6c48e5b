"""Test that the page about parts, and the docstrings of parts, agree with the code."""

from __future__ import annotations

import inspect
import json
import os
import re
import subprocess
import sys
from pathlib import Path

from numpydoc.docscrape import ClassDoc

from baldwinlab import parts
from baldwinlab.api.checks.reference import Agent, Item, Naive
from baldwinlab.engine import rng
from baldwinlab.experiment import registry
from baldwinlab.models.miniworld import state
from baldwinlab.parts.model_helpers import MODEL_HELPERS
from baldwinlab.parts.part import Part, hook_names

ROOT = Path(__file__).parent.parent
PAGE = (ROOT / "docs" / "reference" / "parts.md").read_text("utf-8")
KINDS = [
    kind
    for kind in map(vars(parts).get, parts.__all__)
    if isinstance(kind, type) and Part in kind.__bases__
]
HOOKS = {f"{kind.__name__}.{name}" for kind in KINDS for name in hook_names(kind)}
BUILT_IN_PARTS = [
    (kind, name)
    for kind in registry.BUILT_IN
    for name in registry.package_parts(kind)
    if name != "miniworld"
]
# Names in docstrings of parts that are no setting of the part and no part.
OTHER_NAMES = {"mutation_size", "miniworld"}
# A generation with every hook of the table. It prints the hooks in the order of their first calls.
SIMULATION = """
import json
from functools import wraps
import baldwinlab as bl
from baldwinlab.experiment.class_builder import choosing_fields
from baldwinlab.parts.part import hook_names
from tests.test_part_reference import KINDS

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
for kind in KINDS:
    for part in classes(kind):
        for name in hook_names(kind):
            if name in vars(part):
                setattr(part, name, recorded(kind, name, getattr(part, name)))
bl.simulate(experiment, seed=1)
print(json.dumps(list(dict.fromkeys(calls))))
"""


def list_first_calls() -> list[str]:
    """Return the hooks of a simulated generation, in the order of their first calls."""
    environment = {**os.environ, "NUMBA_DISABLE_JIT": "1", "PYTHONPATH": str(ROOT)}
    command = [sys.executable, "-W", "ignore", "-c", SIMULATION]
    result = subprocess.run(command, capture_output=True, text=True, env=environment, cwd=ROOT)
    assert result.returncode == 0, result.stderr
    calls: list[str] = json.loads(result.stdout.splitlines()[-1])
    return calls


def test_the_page_has_the_order_in_which_the_engine_calls_hooks() -> None:
    """Ignore the order of `blocks_sight`, which a sense can call at any time."""
    documented = list(dict.fromkeys(re.findall(r"^\| \d+ \| `(\w+\.\w+)` \|", PAGE, re.MULTILINE)))
    first_calls = list_first_calls()
    sight = "WorldFeature.blocks_sight"
    assert sorted(first_calls) == sorted(documented)
    assert [name for name in first_calls if name != sight] == [
        name for name in documented if name != sight
    ]
    assert HOOKS - set(documented) == {"Network.links"}


def test_the_page_has_every_kind_with_its_hooks() -> None:
    for kind in KINDS:
        (row,) = re.findall(rf"^\| `{kind.__name__}` \|.*$", PAGE, re.MULTILINE)
        assert [name for name in hook_names(kind) if f"`{name}`" not in row] == []


def test_the_page_has_every_helper_for_foragers() -> None:
    """Sphinx finds only names in `dir(parts)`, and a helper is imported at its first use."""
    assert [name for name in MODEL_HELPERS if name not in PAGE] == []


def test_every_attribute_of_a_class_for_parts_has_a_description() -> None:
    classes = [Part, *KINDS, state.MiniWorldModel, state.State, Agent, Item, Naive]
    for described in classes:
        entries = {entry.name for entry in ClassDoc(described)["Attributes"]}
        described_names = {name for entry in entries for name in entry.split(", ")}
        names = {name for name in inspect.get_annotations(described) if not name.startswith("_")}
        names -= (
            {"kind", "name", "Compiled", *hook_names(described)} if is_kind(described) else set()
        )
        assert names - described_names == set(), described
    public = [value for name, value in vars(Naive).items() if name[0] != "_" and callable(value)]
    assert public and all(value.__doc__ for value in public)


def is_kind(described: type) -> bool:
    return described in KINDS or described is Part


def test_the_docstring_of_a_part_names_only_existing_settings() -> None:
    """A name in code type is a setting of the part, of the experiment, or another part."""
    part_names = {name for _, name in BUILT_IN_PARTS}
    for kind, name in BUILT_IN_PARTS:
        part = registry.find_class(kind, name)
        text = re.split(r"(?m)^\w[\w ]*\n-{3,}$", inspect.getdoc(part) or "")[0]
        words = set(re.findall(r"`([a-z_]+)`", text))
        assert words - {*part.model_fields, *part_names} - OTHER_NAMES == set(), (kind, name)


def test_a_setting_of_a_part_is_described_by_a_sentence() -> None:
    for kind, name in BUILT_IN_PARTS:
        for field in registry.find_class(kind, name).model_fields.values():
            assert re.fullmatch(r"[A-Zxy].*[.]", field.description or ""), (kind, name, field)


def test_purposes_of_random_numbers_differ() -> None:
    limits = ("FIRST_CUSTOM", "FIRST_NAMED", "END_NAMED")
    purposes = [
        value
        for name, value in vars(rng).items()
        if name.isupper() and isinstance(value, int) and name not in limits
    ]
    assert len(purposes) > 15
    assert len(set(purposes)) == len(purposes)
