"""Test the effects of the example parts."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from matplotlib.colors import to_hex, to_rgba_array

from baldwinlab.analysis.figures.world import draw_trajectories
from baldwinlab.analysis.palette import GREEN, PURPLE
from baldwinlab.analysis.report.figures.maps import draw_world_maps
from baldwinlab.analysis.report.figures.senses import draw_agent_senses
from baldwinlab.api.checks import check_part
from baldwinlab.engine.rng import SELECTION
from baldwinlab.evolution import GenerationKey
from baldwinlab.experiment import ExperimentError, assign, registry
from baldwinlab.models.miniworld.appearance import describe_appearance
from baldwinlab.papers.presets import load
from baldwinlab.parts import (
    PartError,
    is_on_map,
    load_file,
    place_item_randomly,
    remove_item,
    sources_of,
)
from baldwinlab.parts.learning_rules import Synapse
from baldwinlab.parts.lifetimes import make_lifetimes
from baldwinlab.simulation.replay import replay
from baldwinlab.simulation.simulate import simulate
from tests.evolution.single_runs import fitness, select
from tests.models.miniworld.plain import draw_founders, simulate_steps
from tests.worlds import make_small_experiment

EXAMPLES = Path(__file__).parents[2] / "examples" / "parts"
SENSES_OF_POISON = ['senses.kinds=["food", "poison"]', "evolution.fitness=above-the-worst"]


@pytest.fixture(scope="module", autouse=True)
def _load_examples() -> Iterator[None]:
    before = registry.custom_parts()
    for path in sorted(EXAMPLES.glob("*.py")):
        load_file(path)
    yield
    for kind, name in registry.custom_parts().keys() - before.keys():
        registry.remove(kind, name)


def with_settings(condition: str, *assignments: str, **changes: Any) -> Any:
    return assign(make_small_experiment(condition, **changes), assignments)


HELPER_EXAMPLES = ["hebbian_rule", "logistic_regrowth", "predators"]


def test_every_example_is_short() -> None:
    texts = {path.stem: path.read_text("utf-8") for path in EXAMPLES.glob("*.py")}
    n_lines = {name: len(text.splitlines()) for name, text in texts.items()}
    limits = dict.fromkeys(n_lines, 110) | dict.fromkeys(HELPER_EXAMPLES, 60)
    assert {name: count for name, count in n_lines.items() if count > limits[name]} == {}


# Each part takes ten seconds or more.
@pytest.mark.nightly
@pytest.mark.parametrize("name", HELPER_EXAMPLES)
def test_the_example_of_a_helper_fulfills_the_contract(name: str, in_plain_python: None) -> None:
    requirements = ("fields", "limits", "signature", "bounds", "oracle")
    findings = check_part(EXAMPLES / f"{name}.py", requirements=requirements)
    assert [str(finding) for finding in findings if finding.holds is False] == []


def test_the_rule_of_oja_normalizes_the_weights_of_a_unit(in_plain_python: None) -> None:
    """With constant inputs x and output y, the weights converge to x / y."""
    rule = registry.find_class("learning rule", "oja")
    weight = np.float32(0.1)
    for _ in range(2000):
        synapse = Synapse(0, weight, x=0.4, y=0.8, rate=np.float32(0.1))
        weight += synapse.rate * rule.compute_change(None, None, synapse, 0)
    assert weight == pytest.approx(0.4 / 0.8, abs=1e-4)


def test_the_number_of_items_grows_logistically(in_plain_python: None) -> None:
    """The mean growth per step is rate * n * (1 - n / K) while no agent is near the food."""
    experiment = with_settings(
        "evo",
        'world.features=["logistic-regrowth"]',
        "world.food=[]",
        'world.logistic_regrowth.rows=["##", "##"]',
        "world.logistic_regrowth.side=40",
        "world.logistic_regrowth.rate=0.05",
        lifetime={"steps": 200},
    )
    batch = simulate_steps(experiment, draw_founders(experiment), 1)
    n_items = batch.state.item_x.shape[1]
    assert n_items == 32
    feature = registry.find_class("world feature", "logistic-regrowth")
    growths = []
    for step in range(1, 200):
        present = 8
        for item in range(n_items):
            # Regions have eight items each. Three quarters of the items are absent.
            if item % 4:
                remove_item(batch.model, batch.state, 0, item // 8, item)
            elif not is_on_map(batch.state, 0, item):
                place_item_randomly(batch.model, batch.state, 0, item // 8, item)
        batch.state.touched[:] = -1
        feature.end_step(batch.state.features[0], batch.model, batch.state, 0, step)
        growths.append(sum(is_on_map(batch.state, 0, item) for item in range(n_items)) - present)
    expected = 0.05 * 8 * (1 - 8 / 32)
    assert np.mean(growths) == pytest.approx(expected, abs=4 * np.sqrt(expected / len(growths)))


def test_a_map_of_characters_larger_than_the_world_is_refused() -> None:
    with pytest.raises(ExperimentError, match="the cells must fit on the map of the world"):
        with_settings("evo", 'world.features=["logistic-regrowth"]')


def test_the_example_of_the_rule_of_the_paper_is_bit_identical_to_the_built_in_rule() -> None:
    expected = simulate(make_small_experiment("evo+self-taught"), seed=5)
    actual = simulate(with_settings("evo+self-taught", "learning.rule=self-taught-again"), seed=5)
    assert expected.food_eaten.sum() > 0
    for name in expected.data_vars:
        assert actual[name].values.tobytes() == expected[name].values.tobytes(), name


@pytest.mark.usefixtures("in_plain_python")
def test_agents_with_social_learning_learn_only_from_agents_that_have_eaten() -> None:
    without_teachers = with_settings(
        "evo", "learning.rule=social", "learning.social.least=1000", "learning.rate=0.1"
    )
    trace = replay(without_teachers, seed=2)
    np.testing.assert_array_equal(trace.weight_birth, trace.weight_death)
    learning = replay(with_settings("evo", "learning.rule=social", "learning.rate=0.1"), seed=2)
    assert learning.eaten.sum() > 0
    has_learned = (learning.weight_birth != learning.weight_death).any(("module", "weight"))
    assert has_learned.all()


@pytest.mark.usefixtures("in_plain_python")
def test_poison_and_walls_are_drawn_in_figures() -> None:
    features = 'world.features=["poison", "obstacles"]'
    experiment = assign(load("evo/A"), [features, *SENSES_OF_POISON])
    appearance = describe_appearance(experiment).to_dict()
    axes = draw_world_maps({"A": experiment.world}, 20, {"A": appearance}).axes[0]
    assert {text.get_text() for text in axes.texts} >= {"50 items, 20 of poison", "wall"}
    assert "#555555" in {to_hex(to_rgba_array(patch.get_facecolor())[0]) for patch in axes.patches}
    colors = {
        to_hex(color)
        for collection in axes.collections
        for color in np.asarray(collection.get_facecolor())[:1]
    }
    assert colors >= {GREEN, PURPLE}
    labels = [text.get_text() for text in draw_agent_senses(appearance).axes[0].texts]
    assert "left\npoison left" in labels and labels.count("15°") == 2
    trace = replay(experiment.replace(lifetime={"steps": 5}), seed=1)
    assert "wall" in {text.get_text() for text in draw_trajectories(trace).axes[0].texts}


@pytest.mark.usefixtures("in_plain_python")
def test_poison_costs_energy_and_has_other_inputs_than_food() -> None:
    settings = ["world.poison.x=[20, 100]", "world.poison.y=[10, 90]", "world.poison.cost=2"]
    features = 'world.features=["poison"]'
    experiment = with_settings("evo", features, *SENSES_OF_POISON, *settings)
    assert experiment.inputs[:3] == ("left", "front", "right")
    assert experiment.inputs[3:] == ("poison left", "poison in front", "poison right")
    run = simulate(experiment, seed=3)
    assert run.poison_eaten.sum() > 0
    balance = run.food_eaten - 2 * run.poison_eaten
    np.testing.assert_array_equal(run.energy, balance - balance.min("agent"))
    assert (run.energy >= 0).all()
    inputs = replay(experiment, seed=3).sensor
    assert inputs.sizes["side"] == 6
    assert (inputs.isel(side=slice(3, 6)).values != inputs.isel(side=slice(3)).values).any()


@pytest.mark.usefixtures("in_plain_python")
def test_no_agent_or_item_is_in_a_wall() -> None:
    experiment = with_settings(
        "evo",
        'world.features=["obstacles"]',
        "world.obstacles.x=[50, 60]",
        "world.obstacles.y=[20, 80]",
    )
    trace = replay(experiment, seed=4)
    for x, y in ((trace.x, trace.y), (trace.item_x, trace.item_y)):
        assert not ((x >= 50) & (x <= 60) & (y >= 20) & (y <= 80)).any()


def test_a_wall_hides_items_behind_it(in_plain_python: None) -> None:
    wall = ["world.obstacles.x=[40, 42]", "world.obstacles.y=[0, 100]"]
    world = {
        "start": {"x": 30, "y": 50, "radius": 0},
        "food": [{"x": [50, 51], "y": [49, 51], "count": 3}],
    }
    changes = {"world": world, "lifetime": {"steps": 1}}
    without_wall = make_small_experiment("evo", **changes)
    with_wall = with_settings("evo", 'world.features=["obstacles"]', *wall, **changes)
    assert replay(without_wall, seed=1).sensor.any()
    assert not replay(with_wall, seed=1).sensor.any()


def test_outputs_of_a_network_with_memory_differ_for_equal_inputs(in_plain_python: None) -> None:
    trace = replay(with_settings("evo", "network.kind=elman", world={"food": []}), seed=1)
    assert not trace.sensor.any()
    outputs = trace.output.values[:, 0]
    # Without food, the inputs are equal in every step.
    assert (outputs[0] != outputs[1]).any()
    with pytest.raises(ExperimentError, match=r"needs at least one hidden layer"):
        with_settings("evo", "network.kind=elman", "network.hidden=[]")


def test_a_custom_selection_chooses_the_parents() -> None:
    run = simulate(
        with_settings("evo", "evolution.selection=champion", "evolution.champion.share=1"), seed=3
    )
    for generation in (1, 2):
        best = int(run.energy.values[generation - 1].argmax())
        assert (run.parents[generation] == best).all()


def test_new_places_are_far_from_other_positions_and_from_the_archive() -> None:
    experiment = with_settings(
        "evo", "evolution.fitness=new-places", "evolution.new_places.archive_size=1"
    )
    run_arrays: dict[str, Any] = {}

    def evaluate(*positions: tuple[float, float]) -> Any:
        genomes = np.zeros((len(positions), 1, 1), np.float32)
        lifetimes = make_lifetimes(genomes, position=np.array(positions, np.float32))
        return fitness(experiment, lifetimes, run_arrays).tolist()

    assert evaluate((0, 0), (3, 4)) == [5, 5]
    # The first position of the first call is in the archive.
    assert evaluate((0, 1), (0, 7)) == [1, 6]
    assert evaluate((0, 7), (0, 9)) == [0, 2]


def test_selection_by_region_chooses_only_agents_that_are_best_in_a_region() -> None:
    experiment = with_settings("evo", "evolution.selection=by-region")
    eaten = np.array([[5, 0], [0, 5], [4, 4], [0, 0]], np.int32)
    lifetimes = make_lifetimes(np.zeros((4, 1, 1), np.float32), eaten=eaten)
    key = GenerationKey(1, 0, 1)
    uniforms = key.uniforms(SELECTION, (4, 2))
    parents = select(experiment, np.zeros(4), uniforms, lifetimes, key)
    assert set(parents.ravel().tolist()) == {0, 1}


def test_an_experiment_has_only_the_fields_of_its_parts() -> None:
    assert "social" not in make_small_experiment("evo").to_dict()["learning"]
    experiment = with_settings("evo", "learning.rule=social", "learning.social.least=4")
    assert experiment.to_dict()["learning"]["social"] == {"least": 4}
    assert "social" not in experiment.replace(learning={"rule": "none"}).to_dict()["learning"]
    with pytest.raises(
        ExperimentError,
        match=r"learning\.social\.least = 0: input should be greater than or equal to 1",
    ):
        with_settings("evo", "learning.rule=social", "learning.social.least=0")
    with pytest.raises(ExperimentError, match=r"there is no 'social' here"):
        with_settings("evo", "learning.social.least=4")


def test_a_file_without_a_valid_part_is_refused_in_a_sentence(tmp_path: Path) -> None:
    header = "from baldwinlab.parts import LearningRule\n"
    built_in = "class Mine(LearningRule, name='self-taught'):\n    pass"
    wrong_arguments = (
        "class Mine(LearningRule, name='mine'):\n    @staticmethod\n    def learn(x):\n        x"
    )
    cases = {
        "import nothing_of_the_kind": "cannot be loaded: ModuleNotFoundError",
        "x = 1": "has no part",
        header + built_in: "built-in learning rule",
        header + wrong_arguments: "arguments of its kind",
    }
    for number, (text, sentence) in enumerate(cases.items()):
        path = tmp_path / f"part{number}.py"
        path.write_text(text)
        with pytest.raises(PartError, match=sentence) as refusal:
            load_file(path)
        assert "\n" not in str(refusal.value)
    with pytest.raises(PartError, match="cannot read the part"):
        load_file(tmp_path / "missing.py")
    with pytest.raises(ExperimentError, match=r"there is no such learning rule; .*'none'"):
        with_settings("evo", "learning.rule=mine")


def test_the_source_of_a_part_has_a_hash() -> None:
    (source,) = sources_of([with_settings("evo", "learning.rule=social")])
    assert (source.kind, source.name) == ("learning rule", "social")
    assert source.text == (EXAMPLES / "social.py").read_text("utf-8")
    assert len(source.sha256) == 64
    assert sources_of([make_small_experiment("evo")]) == ()


def test_the_file_of_a_part_may_have_any_name(tmp_path: Path) -> None:
    path = tmp_path / "champion.txt"
    path.write_bytes((EXAMPLES / "champion.py").read_bytes())
    load_file(path)
    assert "champion" in registry.names("selection")


def test_step_sizes_of_the_self_adaptive_example_evolve() -> None:
    run = simulate(with_settings("evo", "evolution.variation=my-self-adaptive"))
    assert (run.gene_step_size.values[0] == np.float32(0.1)).all()
    assert np.unique(run.gene_step_size.values[-1]).size > 1
