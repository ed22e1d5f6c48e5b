"""The control conditions of evolution, compared with cases that have a known result."""

from __future__ import annotations

import numpy as np
import pytest

from baldwinlab import papers
from baldwinlab.evolution import GenerationKey, compute_learning_cost
from baldwinlab.papers.presets import load
from baldwinlab.simulation.replay import replay
from baldwinlab.simulation.simulate import simulate
from tests.evolution.single_runs import draw_genomes
from tests.worlds import make_small_experiment


@pytest.mark.parametrize("share", [0.3, 1.0])
def test_lamarckian_inheritance_without_learning_equals_darwinian_inheritance(share: float) -> None:
    experiment = make_small_experiment("evo+self-taught", learning={"rate": 0})
    darwinian = simulate(experiment.replace(evolution={"lamarckian_share": 0}), seed=2)
    lamarckian = simulate(experiment.replace(evolution={"lamarckian_share": share}), seed=2)
    assert darwinian["energy"].sum() > 0
    for name in ("energy", "genome", "parents"):
        np.testing.assert_array_equal(lamarckian[name], darwinian[name])


def test_lamarckian_children_inherit_the_learned_weights_of_their_parents() -> None:
    experiment = make_small_experiment(
        "evo+self-taught",
        learning={"rate": 0.5},
        evolution={"lamarckian_share": 1, "mutation_rate": 0},
    )
    result = simulate(experiment, seed=2)
    for generation in (1, 2):
        learned = replay(experiment, seed=2, generation=generation - 1)["weight_death"].values[:, 0]
        teachers = result["genome"].values[generation - 1, :, 1]
        parents = result["parents"].values[generation]
        children = result["genome"].values[generation]
        for module, inherited in enumerate((learned, teachers)):
            from_first = children[:, module] == inherited[parents[:, 0]]
            from_second = children[:, module] == inherited[parents[:, 1]]
            assert (from_first | from_second).all()


def test_a_replay_under_lamarckian_inheritance_agrees_with_its_run() -> None:
    experiment = make_small_experiment(
        "evo+self-taught",
        learning={"rate": 0.5},
        evolution={"lamarckian_share": 0.5},
        record={"genome_every": 9},
    )
    run = simulate(experiment, seed=3)
    for generation in range(3):
        trace = replay(experiment, seed=3, generation=generation, energy=run["energy"])
        np.testing.assert_array_equal(trace["eaten"].sum("step"), run["food_eaten"][generation])


def test_each_step_of_learning_costs_energy_and_energy_never_falls_below_zero() -> None:
    free, costly = (
        simulate(make_small_experiment("evo+self-taught", learning={"cost_per_step": cost}), seed=2)
        for cost in (0, 0.05)
    )
    free_energy = free["energy"].isel(generation=0)
    np.testing.assert_array_equal(costly["food_eaten"][0], free["food_eaten"][0])
    np.testing.assert_allclose(costly["energy"][0], np.maximum(0, free_energy - 0.05 * 80))
    learning = {"cost_per_step": 0.05, "steps": 0}
    without_learning = simulate(make_small_experiment("evo+self-taught", learning=learning), seed=2)
    np.testing.assert_array_equal(without_learning["energy"], without_learning["food_eaten"])


def test_learning_costs_energy_in_proportion_to_the_change_of_the_weights() -> None:
    experiment = make_small_experiment(
        "evo+self-taught", learning={"rate": 0.3, "cost_per_change": 0.7}
    )
    run, trace = simulate(experiment, seed=2), replay(experiment, seed=2)
    change = (trace["weight_death"] - trace["weight_birth"]).sel(module="action").astype(float)
    distance = np.sqrt((change**2).sum("weight"))
    assert (distance > 0.1).all()
    np.testing.assert_allclose(
        run["energy"][0], np.maximum(0, run["food_eaten"][0] - 0.7 * distance), atol=1e-6
    )


def test_an_agent_that_does_not_learn_has_no_learning_cost() -> None:
    experiment = make_small_experiment("evo", learning={"cost_per_step": 5, "cost_per_change": 5})
    genome = draw_genomes(experiment, GenerationKey(1, 0, 0))
    assert compute_learning_cost(experiment, genome, None).tolist() == [0] * 6


@pytest.mark.parametrize("control", papers.load().names("controls"))
def test_every_control_differs_from_its_base_and_can_be_simulated(control: str) -> None:
    shrink = {"lifetime": {"steps": 60}, "evolution": {"generations": 2}, "population": {"size": 5}}
    experiment = load(f"{control}/A").replace(**shrink)
    bases = [
        load(f"{base}/A").replace(**shrink, name=experiment.name)
        for base in ("evo", "evo+self-taught")
    ]
    assert experiment not in bases
    assert simulate(experiment, seed=1).sizes["generation"] == 2


def test_agents_with_random_headings_reach_the_food_of_map_b_without_learning() -> None:
    run = simulate(load("evo+random-headings/B").replace(evolution={"generations": 3}), seed=0)
    assert run["food_eaten"].sum() > 0
