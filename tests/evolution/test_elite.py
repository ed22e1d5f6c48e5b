"""The elite: the best of a generation live on unchanged, and everybody else is bred as if they did not."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from scipy.stats import chisquare

from baldwinlab.evolution import GenerationKey, Genome, Parents, breed, draw_genomes
from baldwinlab.experiment import Experiment, ExperimentError, assign, registry
from baldwinlab.experiment.unused_settings import idle_settings
from baldwinlab.papers.presets import load
from baldwinlab.parts import Selection
from baldwinlab.parts.breeding import ITSELF
from baldwinlab.simulation.simulate import simulate
from tests.worlds import make_small_experiment

FITNESS = np.array([3.0, 0.0, 5.0, 1.0, 0.5, 7.5, 2.0, 5.0])
BEST_FIRST = [5, 2, 7, 0]  # agents 2 and 7 are equals
SCHEMES = [each for each in registry.packaged("selection") if each not in ("neutral", "species")]


def experiment_of(elite: int, selection: str = "roulette", **changes: Any) -> Experiment:
    evolution = {"elite": elite, "selection": selection}
    return load("evo+self-taught/A").replace(
        population={"size": FITNESS.size}, evolution=evolution, **changes
    )


def bred(
    elite: int,
    selection: str = "roulette",
    fitness: npt.NDArray[np.float64] = FITNESS,
    generation: int = 1,
    **changes: Any,
) -> tuple[Genome, Genome, Parents]:
    """The genomes of a generation, of the next, and the parents."""
    experiment = experiment_of(elite, selection, **changes)
    genome = draw_genomes(experiment, GenerationKey(1, 0, 0))
    return genome, *breed(experiment, genome, fitness, GenerationKey(1, 0, generation))


@pytest.mark.parametrize("selection", SCHEMES)
def test_the_best_live_on_with_every_weight_and_are_both_of_their_own_parents(
    selection: str,
) -> None:
    genome, children, parents = bred(4, selection)
    living_on = parents[:4, 0].tolist()
    assert (parents[:4, 0] == parents[:4, 1]).all()
    assert sorted(living_on) == sorted(BEST_FIRST) and living_on[0] == 5
    np.testing.assert_array_equal(children[:4], genome[living_on])


@pytest.mark.parametrize("selection", [*SCHEMES, "neutral"])
def test_the_others_are_those_that_there_would_be_without_an_elite(selection: str) -> None:
    _, children, parents = bred(3, selection)
    _, without, parents_without = bred(0, selection)
    np.testing.assert_array_equal(children[3:], without[3:])
    np.testing.assert_array_equal(parents[3:], parents_without[3:])


def test_of_equals_anybody_lives_on() -> None:
    first = [
        bred(1, fitness=np.ones(8), generation=generation)[2][0, 0] for generation in range(1, 401)
    ]
    assert chisquare(np.bincount(first, minlength=8)).pvalue > 0.001


def test_with_parents_at_random_anybody_lives_on_whatever_the_fitness() -> None:
    """So an elitist population has a neutral twin: as many live on there."""
    assert experiment_of(2).neutral_control().evolution.elite == 2
    kept = [bred(2, "neutral", generation=generation)[2][:2, 0] for generation in range(1, 301)]
    assert all(one != other for one, other in kept)
    assert chisquare(np.bincount(np.concatenate(kept), minlength=8)).pvalue > 0.001


def test_a_population_that_is_all_elite_never_changes() -> None:
    genome, children, parents = bred(8)
    assert sorted(parents[:, 0].tolist()) == list(range(8))
    np.testing.assert_array_equal(children, genome[parents[:, 0]])


def test_what_is_said_of_teachers_is_said_of_the_elite_s_too() -> None:
    genome, children, parents = bred(3, learning={"teacher": "fresh"})
    np.testing.assert_array_equal(children[:3, 0], genome[parents[:3, 0], 0])
    assert (children[:3, 1] != genome[parents[:3, 0], 1]).all()


def test_in_a_whole_run_the_best_of_each_generation_is_found_again_in_the_next() -> None:
    run = simulate(make_small_experiment("evo", evolution={"generations": 4, "elite": 1}), seed=3)
    for generation in range(3):
        best = run.parents.values[generation + 1, 0]
        assert (
            best[0] == best[1]
            and run.energy.values[generation, best[0]] == run.energy.values[generation].max()
        )
        np.testing.assert_array_equal(
            run.genome.values[generation + 1, 0], run.genome.values[generation, best[0]]
        )


def test_without_an_elite_a_run_is_what_it_was() -> None:
    assert simulate(make_small_experiment("evo", evolution={"elite": 0}), seed=3).equals(
        simulate(make_small_experiment("evo"), seed=3)
    )


def test_an_elite_larger_than_the_population_is_refused() -> None:
    with pytest.raises(
        ExperimentError, match=r"evolution\.elite = 9: must be at most population\.size = 8"
    ):
        experiment_of(9)


def test_an_elite_of_agents_that_are_drawn_afresh_would_do_nothing() -> None:
    experiment = assign(load("self-taught/A"), ["evolution.elite=1"])
    assert "evolution.elite" in idle_settings(experiment)


@pytest.fixture
def one_lives_on() -> Iterator[str]:
    class OneLivesOn(Selection, name="one-lives-on"):
        """The last agent lives on, as the last child; the first has all the others."""

        @staticmethod
        def select(
            part: Any, fitness: Any, uniforms: Any, shares: Any, order: Any, parents: Any
        ) -> None:
            parents[:] = 0
            parents[-1, 0], parents[-1, 1] = fitness.size - 1, ITSELF

    yield OneLivesOn.name
    registry.remove("selection", OneLivesOn.name)


def test_a_scheme_of_ones_own_may_let_an_agent_live_on(one_lives_on: str) -> None:
    genome, children, parents = bred(1, one_lives_on)
    assert parents.tolist() == [[5, 5]] + [[0, 0]] * 6 + [[7, 7]]
    np.testing.assert_array_equal(children[[0, 7]], genome[[5, 7]])
