"""The examples of parts of one's own, each in the lives that it is for. What every part must keep, `check` asks."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from matplotlib.colors import to_hex, to_rgba_array

from baldwinlab.analysis import figures
from baldwinlab.analysis.palette import GREEN, PURPLE
from baldwinlab.experiment import ExperimentError, assign, registry
from baldwinlab.models.miniworld.appearance import describe_appearance
from baldwinlab.papers.presets import load
from baldwinlab.parts import PartError, load_file, sources_of
from baldwinlab.simulation.replay import replay
from baldwinlab.simulation.simulate import simulate
from tests.worlds import make_small_experiment

EXAMPLES = Path(__file__).parents[2] / "examples" / "parts"


@pytest.fixture(scope="module", autouse=True)
def _parts() -> Iterator[None]:
    before = registry.custom_parts()
    for path in sorted(EXAMPLES.glob("*.py")):
        load_file(path)
    yield
    for kind, name in registry.custom_parts().keys() - before.keys():
        registry.remove(kind, name)


def with_settings(condition: str, *assignments: str, **changes: Any) -> Any:
    return assign(make_small_experiment(condition, **changes), assignments)


def test_every_example_is_short() -> None:
    for path in EXAMPLES.glob("*.py"):
        assert len(path.read_text("utf-8").splitlines()) <= 110, path.name


def test_the_paper_s_rule_written_again_gives_its_very_bits_in_a_whole_run() -> None:
    one = simulate(make_small_experiment("evo+self-taught"), seed=5)
    again = simulate(with_settings("evo+self-taught", "learning.rule=self-taught-again"), seed=5)
    assert one.food_eaten.sum() > 0
    for name in one.data_vars:
        assert one[name].values.tobytes() == again[name].values.tobytes(), name


@pytest.mark.usefixtures("in_plain_python")
def test_who_learns_from_others_moves_towards_the_best_one_s_answers_and_nobody_learns_before_anybody_has_eaten() -> (
    None
):
    never = with_settings(
        "evo", "learning.rule=social", "learning.social.least=1000", "learning.rate=0.1"
    )
    trace = replay(never, seed=2)
    np.testing.assert_array_equal(trace.weight_birth, trace.weight_death)
    learning = replay(with_settings("evo", "learning.rule=social", "learning.rate=0.1"), seed=2)
    assert learning.eaten.sum() > 0
    moved = (learning.weight_birth != learning.weight_death).any(("module", "weight"))
    assert moved.sum() == moved.size


@pytest.mark.usefixtures("in_plain_python")
def test_poison_and_walls_are_in_the_figures_as_they_declare() -> None:
    chosen = [
        'world.features=["poison", "obstacles"]',
        'senses.kinds=["food", "poison"]',
        "evolution.fitness=above-the-worst",
    ]
    experiment = assign(load("evo/A"), chosen)
    seen = describe_appearance(experiment).to_dict()
    axes = figures.draw_world_maps({"A": experiment.world}, 20, {"A": seen}).axes[0]
    assert {text.get_text() for text in axes.texts} >= {"50 items, 20 of poison", "wall"}
    assert "#555555" in {to_hex(to_rgba_array(patch.get_facecolor())[0]) for patch in axes.patches}
    assert {
        to_hex(colour)
        for each in axes.collections
        for colour in np.asarray(each.get_facecolor())[:1]
    } >= {GREEN, PURPLE}
    labels = [text.get_text() for text in figures.draw_agent_senses(seen).axes[0].texts]
    assert "left\npoison left" in labels and labels.count("15°") == 2
    trace = replay(experiment.replace(lifetime={"steps": 5}), seed=1)
    assert "wall" in {text.get_text() for text in figures.draw_trajectories(trace).axes[0].texts}


@pytest.mark.usefixtures("in_plain_python")
def test_poison_costs_energy_and_is_told_from_food() -> None:
    settings = [
        'world.features=["poison"]',
        'senses.kinds=["food", "poison"]',
        "evolution.fitness=above-the-worst",
    ]
    settings += ["world.poison.x=[20, 100]", "world.poison.y=[10, 90]", "world.poison.cost=2"]
    experiment = with_settings("evo", *settings)
    assert experiment.inputs == (
        "left",
        "front",
        "right",
        "poison left",
        "poison in front",
        "poison right",
    )
    run = simulate(experiment, seed=3)
    assert run.poison_eaten.sum() > 0
    balance = run.food_eaten - 2 * run.poison_eaten
    np.testing.assert_array_equal(run.energy, balance - balance.min("agent"))
    assert (run.energy >= 0).all()
    sensed = replay(experiment, seed=3).sensor
    assert sensed.sizes["side"] == 6
    assert (sensed.isel(side=slice(3, 6)).values != sensed.isel(side=slice(3)).values).any()


@pytest.mark.usefixtures("in_plain_python")
def test_nobody_is_born_or_walks_in_a_wall_and_nothing_grows_there() -> None:
    experiment = with_settings(
        "evo",
        'world.features=["obstacles"]',
        "world.obstacles.x=[50, 60]",
        "world.obstacles.y=[20, 80]",
    )
    trace = replay(experiment, seed=4)
    for x, y in ((trace.x, trace.y), (trace.item_x, trace.item_y)):
        assert not ((x >= 50) & (x <= 60) & (y >= 20) & (y <= 80)).any()


def test_a_wall_hides_what_is_behind_it(in_plain_python: None) -> None:
    wall = ["world.obstacles.x=[40, 42]", "world.obstacles.y=[0, 100]"]
    world = {
        "start": {"x": 30, "y": 50, "radius": 0},
        "food": [{"x": [50, 51], "y": [49, 51], "count": 3}],
    }
    clear = replay(make_small_experiment("evo", world=world, lifetime={"steps": 1}), seed=1)
    walled = replay(
        with_settings(
            "evo", 'world.features=["obstacles"]', *wall, world=world, lifetime={"steps": 1}
        ),
        seed=1,
    )
    assert clear.sensor.any()
    assert not walled.sensor.any()


def test_a_network_with_memory_answers_otherwise_to_the_same_inputs(in_plain_python: None) -> None:
    trace = replay(with_settings("evo", "network.kind=elman", world={"food": []}), seed=1)
    assert not trace.sensor.any()
    outputs = trace.output.values[:, 0]
    assert (outputs[0] != outputs[1]).any()  # without food the inputs are the same in every step
    with pytest.raises(ExperimentError, match=r"needs at least one hidden layer"):
        with_settings("evo", "network.kind=elman", "network.hidden=[]")


def test_a_scheme_of_one_s_own_chooses_the_parents() -> None:
    run = simulate(
        with_settings("evo", "evolution.selection=champion", "evolution.champion.share=1"), seed=3
    )
    for generation in (1, 2):
        best = int(run.energy.values[generation - 1].argmax())
        assert (run.parents[generation] == best).all()


def test_the_fields_of_a_part_are_there_only_while_it_is_chosen() -> None:
    assert "social" not in make_small_experiment("evo").to_dict()["learning"]
    chosen = with_settings("evo", "learning.rule=social", "learning.social.least=4")
    assert chosen.to_dict()["learning"]["social"] == {"least": 4}
    assert "social" not in chosen.replace(learning={"rule": "none"}).to_dict()["learning"]
    with pytest.raises(
        ExperimentError,
        match=r"learning\.social\.least = 0: input should be greater than or equal to 1",
    ):
        with_settings("evo", "learning.rule=social", "learning.social.least=0")
    with pytest.raises(ExperimentError, match=r"there is no 'social' here"):
        with_settings("evo", "learning.social.least=4")


def test_a_file_that_is_no_part_is_refused_in_a_sentence_and_leaves_nothing(tmp_path: Path) -> None:
    kind = "from baldwinlab.parts import LearningRule\n"
    cases = {
        "import nothing_of_the_kind": "cannot be loaded: ModuleNotFoundError",
        "x = 1": "has no part",
        f"{kind}class Mine(LearningRule, name='self-taught'):\n    pass": "built-in learning rule",
        f"{kind}class Mine(LearningRule, name='mine'):\n    @staticmethod\n    def learn(x):\n        x": "arguments of its kind",
    }
    for number, (text, sentence) in enumerate(cases.items()):
        path = tmp_path / f"part{number}.py"
        path.write_text(text)
        with pytest.raises(PartError, match=sentence) as refusal:
            load_file(path)
        assert "\n" not in str(refusal.value)
    with pytest.raises(PartError, match="cannot read the part"):
        load_file(tmp_path / "missing.py")
    with pytest.raises(ExperimentError, match="'none', 'self-taught'"):
        with_settings("evo", "learning.rule=mine")


def test_the_source_of_a_part_is_known_by_its_hash() -> None:
    (source,) = sources_of([with_settings("evo", "learning.rule=social")])
    assert (source.kind, source.name) == ("learning rule", "social")
    assert source.text == (EXAMPLES / "social.py").read_text("utf-8")
    assert len(source.sha256) == 64
    assert sources_of([make_small_experiment("evo")]) == ()


def test_a_part_s_file_may_have_any_name(tmp_path: Path) -> None:
    given = tmp_path / "champion.txt"
    given.write_bytes((EXAMPLES / "champion.py").read_bytes())
    load_file(given)
    assert "champion" in registry.names("selection")
