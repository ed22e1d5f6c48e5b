"""Tests of exported pages: they are small, complete and bit-identical to Python."""

from __future__ import annotations

import base64
import json
import platform
import re
import shutil
import zlib
from pathlib import Path
from typing import Any

import pytest

import baldwinlab as bl
from baldwinlab.core.errors import RefusedError
from baldwinlab.core.extras import installation_command
from baldwinlab.engine import wasm
from baldwinlab.experiment import assign
from baldwinlab.lab.pages.export import collect_page_data, render_live_page
from baldwinlab.models.miniworld.backends.browser_layout import ModuleLayout
from baldwinlab.models.miniworld.backends.wasm_modules import (
    FINGERPRINTS,
    MODULES_FOLDER,
    module_hash,
    module_name,
    shipped_experiments,
)
from baldwinlab.papers.presets import load
from baldwinlab.parts import load_file
from baldwinlab.simulation.simulate import simulate
from tests.commands import Command
from tests.lab.node import SIMULATE, NodeRun, check_bits, run_in_node
from tests.small_studies import make_small_study, shorten_preset
from tests.worlds import make_predation

EXAMPLES = Path(__file__).parents[3] / "examples" / "parts"
DIVERGE = """(program, experiment) => {
  const run = new Run(program, experiment, 5, 1);
  const genome = run.startNext();
  // A learning rule that diverges has this result.
  run.engine.array("state.genome").fill(NaN);
  try {
    run.finishGeneration(genome);
  } catch (error) {
    return error.message;
  }
}"""


def evaluate_in_node(folder: Path, experiment: Any, module: Path, function: str = SIMULATE) -> Any:
    """Return the result of a function of the program and the experiment of a module."""
    run = NodeRun(experiment, module, ModuleLayout(experiment).plan())
    return run_in_node(folder, {"": run}, function)[""]


@pytest.mark.parametrize(
    ("name", "elite"), [("evo/B", 0), ("evo+self-taught/A", 2), ("evo+drift/A", 0)]
)
def test_a_run_in_node_is_bit_identical_to_python(tmp_path: Path, name: str, elite: int) -> None:
    experiment = shorten_preset(name).replace(evolution={"elite": elite})
    module = MODULES_FOLDER / f"{module_name(experiment)}.wasm"
    actual = evaluate_in_node(tmp_path, experiment, module)
    check_bits(actual, simulate(experiment, seed=5, run=1), name)


def test_a_gene_that_is_not_finite_ends_a_run_in_node_with_a_message(tmp_path: Path) -> None:
    module = MODULES_FOLDER / "self-taught-simultaneous.wasm"
    message = evaluate_in_node(tmp_path, shorten_preset(), module, DIVERGE)
    assert message.startswith(
        "Gene 0 of module 0 of agent 0 in generation 1 is not a finite number: choose a smaller"
        " learning.rate"
    )


def test_the_packaged_modules_are_current() -> None:
    stored = json.loads(FINGERPRINTS.read_text())
    if ".".join(platform.python_version_tuple()[:2]) != stored["python"]:
        pytest.skip(f"the fingerprints are those of Python {stored['python']}")
    fingerprints = {
        name: module_hash(experiment) for name, experiment in shipped_experiments().items()
    }
    assert stored["marks"] == fingerprints, "run `make wasm`: the engine has changed"


def test_a_module_imports_only_its_memory() -> None:
    for path in MODULES_FOLDER.glob("*.wasm"):
        assert path.read_bytes().count(b"\x03env") == 1, path.name
        assert path.stat().st_size < 80_000


def test_a_page_is_small_and_references_no_external_file() -> None:
    page = render_live_page([load("evo+self-taught/A"), load("evo/A")])
    assert len(page) < 2_000_000
    assert not re.findall(r'(?:src|href)="(?!data:)[^"]*"', page.decode())


def test_a_study_is_exported_with_its_conditions_and_its_seed(
    command: Command, tmp_path: Path
) -> None:
    make_small_study(tmp_path / "study", runs=1)
    outcome = command("export", "study", "--out", "page.html")
    assert outcome.code == 0, outcome.err
    match = re.search(
        r'id="laboratory">(.*?)</script>', (tmp_path / "page.html").read_text(), re.DOTALL
    )
    assert match
    exported = json.loads(match[1])
    assert [preset["name"] for preset in exported["presets"]] == ["evo/A", "evo+self-taught/A"]
    assert exported["seed"] == 5


def test_an_invalid_export_is_rejected_with_a_message(command: Command, tmp_path: Path) -> None:
    assert "there is no map 'Z'" in command("export", "evo/Z", "--out", "page.html").err
    model = ("--part", str(EXAMPLES / "bit_strings.py"))
    outcome = command("export", "bit-strings", *model, "--out", "page.html")
    assert "cannot run in a browser" in outcome.err
    (tmp_path / "mine.html").write_text("a file of the user")
    assert "not written by this command" in command("export", "evo/A", "--out", "mine.html").err


def test_a_page_of_an_experiment_with_a_control_of_learning_is_refused() -> None:
    experiment = load("evo+self-taught/A").replace(learning={"control": "yoked"})
    with pytest.raises(
        RefusedError, match=r"browser: learning\.control = 'yoked' is set, which only"
    ):
        render_live_page([experiment], 0)


def test_a_page_of_a_study_with_species_is_refused(command: Command, tmp_path: Path) -> None:
    experiment = make_predation(evolution={"generations": 1}).replace(name="hunt")
    bl.run(experiment, runs=1, out=tmp_path / "hunt")
    outcome = command("export", "hunt", "--out", "page.html")
    assert "population.species = " in outcome.err
    assert "which only the engine in Python supports" in outcome.err
    assert "live run in `baldwinlab lab`" in outcome.err


def test_a_page_of_an_experiment_with_genes_of_parts_is_refused() -> None:
    experiment = load("evo/A").replace(evolution={"variation": "self-adaptive"})
    with pytest.raises(RefusedError, match="its parts have the genes step_size, which only"):
        render_live_page([experiment], 0)


def test_a_custom_part_without_a_linker_is_rejected_before_compilation(
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
        render_live_page([social])
    options = ("--part", str(EXAMPLES / "social.py"), "--set", "learning.rule=social")
    outcome = command("export", "evo/A", *options, "--out", str(tmp_path / "page.html"))
    assert outcome.code == 2
    assert "compiling" not in outcome.out
    assert installation_command("wasm") in outcome.err


@pytest.mark.parametrize(
    ("rule", "array"), [("imitation", "state.rule.teacher_index"), ("hebb", "")]
)
def test_a_plan_names_the_array_of_teachers(rule: str, array: str) -> None:
    plan = ModuleLayout(load("evo/A").replace(learning={"rule": rule})).plan()
    assert plan["teacher_array"] == array
    assert not array or array.removeprefix("state.") in plan["tuples"]["state"]["leaves"]


# The compilation of a custom module takes a minute.
@pytest.mark.nightly
def test_custom_parts_are_bit_identical_to_python(tmp_path: Path) -> None:
    for path in EXAMPLES.glob("*.py"):
        load_file(path)
    settings = [
        'world.features=["poison", "obstacles"]',
        'senses.kinds=["food", "poison"]',
        "evolution.fitness=above-the-worst",
    ]
    for rule, rule_settings in (
        ("social", ["network.kind=elman", "evolution.selection=champion"]),
        ("self-taught-again", []),
    ):
        experiment = assign(
            shorten_preset("evo/A"),
            [*settings, f"learning.rule={rule}", "learning.rate=0.1", *rule_settings],
        )
        program = collect_page_data([experiment])["programs"][0]
        module = tmp_path / f"{rule}.wasm"
        module.write_bytes(zlib.decompress(base64.b64decode(program["module"]), -zlib.MAX_WBITS))
        expected = simulate(experiment, seed=5, run=1)
        assert expected.food_eaten.sum() > 0
        check_bits(evaluate_in_node(tmp_path, experiment, module), expected, rule)
