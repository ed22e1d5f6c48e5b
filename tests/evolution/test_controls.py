"""The controls of evolution, each against a case whose answer is known."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import kstest

from baldwinlab import papers
from baldwinlab.evolution import (
    GenerationKey,
    apply_inheritance,
    breed,
    compute_learning_cost,
    draw_genomes,
)
from baldwinlab.experiment import Experiment
from baldwinlab.papers.presets import load
from baldwinlab.simulation.replay import replay
from baldwinlab.simulation.simulate import simulate
from tests.worlds import make_small_experiment


def learned_in(
    experiment: Experiment, generation: int, seed: int
) -> np.ndarray[tuple[int, ...], np.dtype[np.float32]]:
    """The action modules of a generation at death, [agent, weight]."""
    trace = replay(experiment, seed=seed, generation=generation)
    weights: np.ndarray[tuple[int, ...], np.dtype[np.float32]] = trace["weight_death"].values[:, 0]
    return weights


def test_the_rate_0_control_is_bit_identical_to_evolution_without_learning() -> None:
    """Every weight mutates independently, so an unused module takes no mutation from the first."""
    evo, control = (
        simulate(make_small_experiment(name, learning=given), seed=2)
        for name, given in (("evo", {}), ("evo+self-taught", {"rate": 0}))
    )
    assert evo["food_eaten"].sum() > 0
    for name in ("food_eaten", "energy", "parents"):
        np.testing.assert_array_equal(control[name], evo[name])
    np.testing.assert_array_equal(control["genome"][:, :, 0], evo["genome"][:, :, 0])


@pytest.mark.parametrize("share", [0.3, 1.0])
def test_lamarck_without_learning_is_darwin(share: float) -> None:
    still = make_small_experiment("evo+self-taught", learning={"rate": 0})
    darwin, lamarck = (
        simulate(still.replace(evolution={"lamarckian_share": each}), seed=2) for each in (0, share)
    )
    assert darwin["energy"].sum() > 0
    for name in ("energy", "genome", "parents"):
        np.testing.assert_array_equal(lamarck[name], darwin[name])


def test_lamarckian_children_are_born_with_what_their_parents_learned() -> None:
    experiment = make_small_experiment(
        "evo+self-taught",
        learning={"rate": 0.5},
        evolution={"lamarckian_share": 1, "mutation_rate": 0},
    )
    result = simulate(experiment, seed=2)
    for generation in (1, 2):
        learned, parents = (
            learned_in(experiment, generation - 1, 2),
            result["parents"].values[generation],
        )
        children = result["genome"].values[generation]
        assert (
            (children[:, 0] == learned[parents[:, 0]]) | (children[:, 0] == learned[parents[:, 1]])
        ).all()
        teachers = result["genome"].values[generation - 1, :, 1]
        assert (
            (children[:, 1] == teachers[parents[:, 0]])
            | (children[:, 1] == teachers[parents[:, 1]])
        ).all()


def test_a_share_of_what_was_learned_is_inherited() -> None:
    experiment = load("evo+self-taught/A").replace(
        evolution={"lamarckian_share": 0.25}, population={"size": 3}
    )
    born = draw_genomes(experiment, GenerationKey(1, 0, 0))
    learned = born[:, 0] + 4
    inherited = apply_inheritance(experiment, born, learned)
    np.testing.assert_allclose(inherited[:, 0], born[:, 0] + 1, atol=1e-6)
    np.testing.assert_array_equal(inherited[:, 1], born[:, 1])


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


def test_learning_costs_energy_for_its_steps_and_never_more_than_there_is() -> None:
    free, dear = (
        make_small_experiment("evo+self-taught", learning={"cost_per_step": cost})
        for cost in (0, 0.05)
    )
    before, after = (
        simulate(free, seed=2).isel(generation=0),
        simulate(dear, seed=2).isel(generation=0),
    )
    np.testing.assert_array_equal(after["food_eaten"], before["food_eaten"])
    np.testing.assert_allclose(after["energy"], np.maximum(0, before["energy"] - 0.05 * 80))
    short = simulate(
        make_small_experiment("evo+self-taught", learning={"cost_per_step": 0.05, "steps": 0}),
        seed=2,
    )
    np.testing.assert_array_equal(short["energy"], short["food_eaten"])


def test_learning_costs_energy_for_the_distance_that_weights_moved() -> None:
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


def test_who_does_not_learn_pays_nothing() -> None:
    experiment = make_small_experiment("evo", learning={"cost_per_step": 5, "cost_per_change": 5})
    assert (
        compute_learning_cost(
            experiment, draw_genomes(experiment, GenerationKey(1, 0, 0)), None
        ).tolist()
        == [0] * 6
    )


def children_with(
    teacher: str,
) -> tuple[Experiment, np.ndarray[tuple[int, ...], np.dtype[np.float32]]]:
    experiment = load("evo+self-taught/A").replace(
        learning={"teacher": teacher}, population={"size": 200}
    )
    genome = draw_genomes(experiment, GenerationKey(1, 0, 0))
    return experiment, breed(experiment, genome, np.arange(200.0), GenerationKey(1, 0, 1))[0]


def test_shuffled_teachers_are_those_of_the_generation_dealt_anew() -> None:
    (_, inherited), (_, shuffled) = children_with("inherited"), children_with("shuffled")
    np.testing.assert_array_equal(shuffled[:, 0], inherited[:, 0])
    assert sorted(map(tuple, shuffled[:, 1])) == sorted(map(tuple, inherited[:, 1]))
    assert (shuffled[:, 1, 0] == inherited[:, 1, 0]).mean() < 0.05


def test_fresh_teachers_are_normal_and_have_nothing_of_the_parents() -> None:
    (_, inherited), (experiment, fresh) = children_with("inherited"), children_with("fresh")
    np.testing.assert_array_equal(fresh[:, 0], inherited[:, 0])
    assert kstest(fresh[:, 1].ravel(), "norm").pvalue > 0.001
    assert np.intersect1d(fresh[:, 1], inherited[:, 1]).size < 5
    assert (
        np.intersect1d(fresh[:, 1], draw_genomes(experiment, GenerationKey(1, 0, 0))[:, 1]).size < 5
    )


def test_the_gene_of_the_learning_rate_is_inherited_like_a_weight() -> None:
    experiment = make_small_experiment(
        "evo+self-taught", learning={"evolved_rate": True}, evolution={"mutation_rate": 0}
    )
    run = simulate(experiment, seed=2)
    genes, parents = run["genome"].values[:, :, 0, -1], run["parents"].values
    assert run.sizes["weight"] == experiment.weight_count + 1
    for generation in (1, 2):
        pair = genes[generation - 1][parents[generation]]
        assert (genes[generation][:, None] == pair).any(axis=1).all()


def test_weights_are_drawn_the_same_with_and_without_a_gene_of_the_learning_rate() -> None:
    with_gene, without = (
        load("evo+self-taught/A").replace(learning={"evolved_rate": evolved})
        for evolved in (True, False)
    )
    one, other = (
        draw_genomes(experiment, GenerationKey(1, 0, 0)) for experiment in (with_gene, without)
    )
    np.testing.assert_array_equal(one[..., :-1], other)


@pytest.mark.parametrize("control", papers.load().names("controls"))
def test_every_control_differs_from_its_base_and_lives(control: str) -> None:
    shrink = {"lifetime": {"steps": 60}, "evolution": {"generations": 2}, "population": {"size": 5}}
    experiment = load(f"{control}/A").replace(**shrink)
    bases = [
        load(f"{base}/A").replace(**shrink, name=experiment.name)
        for base in ("evo", "evo+self-taught")
    ]
    assert experiment not in bases
    assert simulate(experiment, seed=1).sizes["generation"] == 2


def test_random_headings_take_some_agents_without_learning_to_the_food_of_map_b() -> None:
    run = simulate(load("evo+random-headings/B").replace(evolution={"generations": 3}), seed=0)
    assert run["food_eaten"].sum() > 0
