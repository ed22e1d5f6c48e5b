"""A live laboratory: small, whole, and refused in a sentence where it cannot be."""

from __future__ import annotations

import base64
import json
import platform
import re
import shutil
import subprocess
import zlib
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from baldwinlab.core.extras import installation_command
from baldwinlab.engine import wasm
from baldwinlab.evolution import GenerationKey, find_teachers
from baldwinlab.experiment import assign
from baldwinlab.lab import single_page
from baldwinlab.lab.export import laboratory, live_page
from baldwinlab.models.miniworld.backends.browser_layout import ModuleLayout
from baldwinlab.models.miniworld.backends.wasm_modules import (
    FINGERPRINTS,
    SHIPPED,
    built_in_experiments,
    module_hash,
)
from baldwinlab.papers.presets import load
from baldwinlab.parts import load_file
from baldwinlab.simulation.simulate import simulate
from tests.commands import Command
from tests.small_studies import make_small_study, shorten_preset

EXAMPLES = Path(__file__).parents[2] / "examples" / "parts"
NODE = """
import { readFileSync } from "node:fs";
import { load } from "./engine.js";
import { simulate } from "./simulation.js";
const { plan, experiment, module } = JSON.parse(readFileSync("given.json"));
const arrays = simulate(await load(readFileSync(module), plan), experiment, 5, 1);
console.log(JSON.stringify(Object.fromEntries(Object.entries(arrays).map(([name, array]) => [name, Array.from(array)]))));
"""
ELDERS = """
import { readFileSync } from "node:fs";
import { load } from "./engine.js";
import { Run } from "./simulation.js";
const { plan, experiment, module } = JSON.parse(readFileSync("given.json"));
const run = new Run(await load(readFileSync(module), plan), experiment, 5, 1);
const found = {};
for (let generation = 0; generation < run.generations; generation++) {
  found[generation] = run.teachers && Array.from(run.teachers);
  run.next();
}
console.log(JSON.stringify(found));
"""

NOT_FINITE = """
import { readFileSync } from "node:fs";
import { load } from "./engine.js";
import { Run } from "./simulation.js";
const { plan, experiment, module } = JSON.parse(readFileSync("given.json"));
const run = new Run(await load(readFileSync(module), plan), experiment, 5, 1);
const genome = run.startNext();
run.engine.array("state.genome").fill(NaN); // as a rule that diverges leaves it
let said = "";
try {
  run.finishGeneration(genome);
} catch (error) {
  said = error.message;
}
console.log(JSON.stringify({ said }));
"""


def in_node(folder: Path, experiment: Any, module: Path, script: str = NODE) -> dict[str, Any]:
    """What a script says of a run as the page's own modules have it in Node."""
    node = shutil.which("node")
    if node is None:
        pytest.skip("there is no Node on this machine")
    for name in ("engine.js", "simulation.js"):
        shutil.copy(single_page.STATIC / name, folder)
    (folder / "package.json").write_text('{"type": "module"}')
    (folder / "run.js").write_text(script)
    given = {
        "plan": ModuleLayout(experiment).plan(),
        "experiment": experiment.to_dict(),
        "module": str(module),
    }
    (folder / "given.json").write_text(json.dumps(given))
    done = subprocess.run([node, "run.js"], cwd=folder, capture_output=True, text=True, check=True)
    return dict(json.loads(done.stdout))


@pytest.mark.parametrize(
    ("name", "elite"), [("evo/B", 0), ("evo+self-taught/A", 2), ("evo+drift/A", 0)]
)
def test_in_node_a_run_has_python_s_bits(tmp_path: Path, name: str, elite: int) -> None:
    experiment = shorten_preset(name).replace(evolution={"elite": elite})
    module = SHIPPED / f"{experiment.learning.rule}-simultaneous.wasm"
    here, there = simulate(experiment, seed=5, run=1), in_node(tmp_path, experiment, module)
    for variable in ("food_eaten", "energy", "parents", "genome"):
        values = here[variable].values
        assert np.array(there[variable], values.dtype).tobytes() == values.tobytes(), variable


def test_in_node_a_gene_that_is_not_finite_ends_the_run_with_a_sentence(tmp_path: Path) -> None:
    said = in_node(
        tmp_path, shorten_preset(), SHIPPED / "self-taught-simultaneous.wasm", NOT_FINITE
    )["said"]
    assert said.startswith(
        "Gene 0 of module 0 of agent 0 in generation 1 is not a finite number: choose a smaller learning.rate"
    )


@pytest.mark.parametrize("teacher", ["inherited", "shuffled", "fresh"])
def test_in_node_teachers_come_from_whom_they_do_in_python(tmp_path: Path, teacher: str) -> None:
    heirs = shorten_preset().replace(
        learning={"teacher": teacher}, evolution={"inheritance": "social-heredity"}
    )
    there = in_node(
        tmp_path,
        shorten_preset().replace(learning={"teacher": teacher}),
        SHIPPED / "self-taught-simultaneous.wasm",
        ELDERS,
    )
    run = simulate(shorten_preset().replace(learning={"teacher": teacher}), seed=5, run=1)
    assert len(there) == 3 and set(there["0"]) == {-1}
    for generation in (1, 2):
        elders = find_teachers(
            heirs, GenerationKey(5, 1, generation), run.parents.values[generation]
        )
        found = there[str(generation)]
        assert found is None if elders is None else found == elders.ravel().tolist()
        assert teacher != "shuffled" or found != run.parents.values[generation].ravel().tolist()


def test_what_ships_was_made_of_these_very_functions() -> None:
    kept = json.loads(FINGERPRINTS.read_text())
    if ".".join(platform.python_version_tuple()[:2]) != kept["python"]:
        pytest.skip(f"the marks are those of Python {kept['python']}")
    marks = {name: module_hash(experiment) for name, experiment in built_in_experiments().items()}
    assert kept["marks"] == marks, "run `make wasm`: what compiled code does has changed"


def test_a_module_imports_nothing_but_its_memory() -> None:
    for path in SHIPPED.glob("*.wasm"):
        assert path.read_bytes().count(b"\x03env") == 1, path.name
        assert path.stat().st_size < 80_000


def test_a_page_is_small_and_names_no_address_but_of_what_is_in_it() -> None:
    page = live_page([load("evo+self-taught/A"), load("evo/A")])
    assert len(page) < 2_000_000
    assert not re.findall(r'(?:src|href)="(?!data:)[^"]*"', page.decode())


def test_every_module_that_a_page_imports_is_in_it() -> None:
    found = single_page.collect_modules("live_page.js")
    for name, code in found.items():
        assert set(re.findall(r'^import [^;]*?"([^"]+)";', code, re.MULTILINE)) <= set(found), name


def test_a_study_is_exported_with_its_conditions_and_its_seed(
    command: Command, tmp_path: Path
) -> None:
    make_small_study(tmp_path / "study", runs=1)
    outcome = command("export", "study", "--out", "page.html")
    assert outcome.code == 0, outcome.err
    told = re.search(
        r'id="laboratory">(.*?)</script>', (tmp_path / "page.html").read_text(), re.DOTALL
    )
    assert told
    found = json.loads(told[1])
    assert ([preset["name"] for preset in found["presets"]], found["seed"]) == (
        ["evo/A", "evo+self-taught/A"],
        5,
    )


def test_what_cannot_be_exported_is_refused_in_a_sentence(command: Command, tmp_path: Path) -> None:
    assert "there is no map 'Z'" in command("export", "evo/Z", "--out", "page.html").err
    model = ("--part", str(EXAMPLES / "bit_strings.py"))
    assert (
        "cannot run in a browser"
        in command("export", "bit-strings", *model, "--out", "page.html").err
    )
    (tmp_path / "mine.html").write_text("my own")
    assert "not written by this command" in command("export", "evo/A", "--out", "mine.html").err


def test_without_a_linker_a_part_of_one_s_own_is_refused_before_anything_is_compiled(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, command: Command
) -> None:
    monkeypatch.setattr(shutil, "which", lambda name: None)
    monkeypatch.setattr(wasm, "find_spec", lambda name: None)
    monkeypatch.setattr(
        "baldwinlab.models.miniworld.backends.wasm_modules.cache.cache_root", lambda: tmp_path
    )
    load_file(EXAMPLES / "social.py")
    social = assign(load("evo/A"), ["learning.rule=social"])
    with pytest.raises(ValueError, match=re.escape(installation_command("wasm"))):
        live_page([social])
    given = ("--part", str(EXAMPLES / "social.py"), "--set", "learning.rule=social")
    done = command("export", "evo/A", *given, "--out", str(tmp_path / "page.html"))
    assert (
        done.code == 2 and "compiling" not in done.out and installation_command("wasm") in done.err
    )


def test_what_a_foreign_part_made_of_fields_cannot_be_changed_on_the_page(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr("baldwinlab.lab.export.load_module", lambda experiment: b"")
    for name in ("poison", "elman", "social"):
        load_file(EXAMPLES / f"{name}.py")
    chosen = [
        'world.features=["poison"]',
        'senses.kinds=["food", "poison"]',
        "evolution.fitness=above-the-worst",
    ]
    experiment = assign(load("evo/A"), [*chosen, "network.kind=elman", "learning.rule=social"])
    tables = laboratory([experiment])["schemas"][0]["$defs"]
    assert "const" in tables["Network"]["properties"]["hidden"]
    poison = next(table for name, table in tables.items() if name.startswith("Poison"))[
        "properties"
    ]
    assert all("const" in poison[name] for name in ("x", "y", "count", "cost"))
    social = next(table for name, table in tables.items() if name.startswith("Social"))[
        "properties"
    ]
    assert "const" not in social["least"]


def test_the_room_of_a_growing_network_cannot_be_changed_on_the_page(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr("baldwinlab.lab.export.load_module", lambda experiment: b"")
    tables = laboratory([load("worlds-and-minds:evo/A", "neat")])["schemas"][0]["$defs"]
    assert (
        "const"
        in next(table for name, table in tables.items() if name.startswith("Network"))[
            "properties"
        ]["hidden"]
    )


@pytest.mark.parametrize(
    ("rule", "place"), [("imitation", "state.rule.teacher_index"), ("hebb", "")]
)
def test_a_plan_says_where_it_stands_from_whom_each_learns(rule: str, place: str) -> None:
    plan = ModuleLayout(load("evo/A").replace(learning={"rule": rule})).plan()
    assert plan["learns from"] == place
    assert not place or place.removeprefix("state.") in plan["tuples"]["state"]["leaves"]


@pytest.mark.nightly  # a module of one's own takes a minute to be compiled
def test_parts_of_one_s_own_have_python_s_bits(tmp_path: Path) -> None:
    for path in EXAMPLES.glob("*.py"):
        load_file(path)
    chosen = [
        'world.features=["poison", "obstacles"]',
        'senses.kinds=["food", "poison"]',
        "evolution.fitness=above-the-worst",
    ]
    for rule, own in (
        ("social", ["network.kind=elman", "evolution.selection=champion"]),
        ("self-taught-again", []),
    ):
        experiment = assign(
            shorten_preset("evo/A"), [*chosen, f"learning.rule={rule}", "learning.rate=0.1", *own]
        )
        program = laboratory([experiment])["programs"][0]
        module = tmp_path / f"{rule}.wasm"
        module.write_bytes(zlib.decompress(base64.b64decode(program["module"]), -zlib.MAX_WBITS))
        there, here = in_node(tmp_path, experiment, module), simulate(experiment, seed=5, run=1)
        assert here.food_eaten.sum() > 0
        for variable in ("food_eaten", "energy", "parents", "genome"):
            values = here[variable].values
            assert np.array(there[variable], values.dtype).tobytes() == values.tobytes(), (
                rule,
                variable,
            )
