"""The elite: the best agents survive unchanged, and the remaining children do not depend on it."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from scipy.stats import chisquare

from baldwinlab.evolution import GenerationKey, Genome, Parents
from baldwinlab.experiment import Experiment, ExperimentError, assign, registry
from baldwinlab.experiment.unused_settings import list_changed_unused_settings
from baldwinlab.papers.presets import load
from baldwinlab.parts import Generation, Selection
from baldwinlab.parts.breeding import ITSELF
from tests.evolution.single_runs import breed, draw_genomes

FITNESS = np.array([3.0, 0.0, 5.0, 1.0, 0.5, 7.5, 2.0, 5.0])
# The four fittest agents. Agents 2 and 7 have the same fitness.
BEST_FIRST = [5, 2, 7, 0]
# Schemes that breed groups separately refuse an elite, or replace it.
SCHEMES = [
    name
    for name in registry.package_parts("selection")
    if name not in ("neutral", "species", "mutant-fixation")
]


@cache
def experiment_of(
    elite: int, selection: str = "roulette", teacher: str = "inherited"
) -> Experiment:
    evolution = {"elite": elite, "selection": selection}
    return load("evo+self-taught/A").replace(
        population={"size": FITNESS.size}, evolution=evolution, learning={"teacher": teacher}
    )


def bred(
    elite: int,
    selection: str = "roulette",
    fitness: npt.NDArray[np.float64] = FITNESS,
    generation: int = 1,
    teacher: str = "inherited",
) -> tuple[Genome, Genome, Parents]:
    """Return the genomes of a generation, the genomes of its children, and the parents."""
    experiment = experiment_of(elite, selection, teacher)
    genome = draw_genomes(experiment, GenerationKey(1, 0, 0))
    return genome, *breed(experiment, genome, fitness, GenerationKey(1, 0, generation))


@pytest.mark.parametrize("selection", SCHEMES)
def test_the_best_agents_survive_with_all_weights_and_are_both_of_their_parents(
    selection: str,
) -> None:
    # An elite of 8 is the entire population.
    for elite in (4, 8):
        genome, children, parents = bred(elite, selection)
        survivors = parents[:elite, 0].tolist()
        assert (parents[:elite, 0] == parents[:elite, 1]).all()
        assert sorted(survivors[:4]) == sorted(BEST_FIRST) and survivors[0] == 5
        assert len(set(survivors)) == elite
        np.testing.assert_array_equal(children[:elite], genome[survivors])


@pytest.mark.parametrize("selection", [*SCHEMES, "neutral"])
def test_the_children_after_the_elite_are_the_same_without_an_elite(selection: str) -> None:
    _, children, parents = bred(3, selection)
    _, children_without, parents_without = bred(0, selection)
    np.testing.assert_array_equal(children[3:], children_without[3:])
    np.testing.assert_array_equal(parents[3:], parents_without[3:])


def test_agents_of_equal_fitness_survive_with_equal_probability() -> None:
    first = [
        bred(1, fitness=np.ones(8), generation=generation)[2][0, 0] for generation in range(1, 401)
    ]
    assert chisquare(np.bincount(first, minlength=8)).pvalue > 0.001


def test_neutral_selection_chooses_survivors_at_random() -> None:
    """The neutral control of an experiment with an elite has the same number of survivors."""
    assert experiment_of(2).neutral_control().evolution.elite == 2
    survivors = [
        bred(2, "neutral", generation=generation)[2][:2, 0] for generation in range(1, 301)
    ]
    assert all(first != second for first, second in survivors)
    assert chisquare(np.bincount(np.concatenate(survivors), minlength=8)).pvalue > 0.001


def test_the_teacher_control_also_applies_to_the_elite() -> None:
    genome, children, parents = bred(3, teacher="fresh")
    np.testing.assert_array_equal(children[:3, 0], genome[parents[:3, 0], 0])
    assert (children[:3, 1] != genome[parents[:3, 0], 1]).all()


def test_an_elite_larger_than_the_population_is_refused() -> None:
    with pytest.raises(
        ExperimentError, match=r"evolution\.elite = 9: must be at most population\.size = 8"
    ):
        experiment_of(9)


def test_an_elite_is_an_unused_setting_if_genomes_are_not_inherited() -> None:
    experiment = assign(load("self-taught/A"), ["evolution.elite=1"])
    assert "evolution.elite" in list_changed_unused_settings(experiment)


def test_a_custom_selection_can_let_an_agent_survive() -> None:
    class LastAgentSurvives(Selection, name="last-agent-survives"):
        """Let the last agent survive as the last child. The first agent has all other children."""

        @staticmethod
        def select(part: Any, generation: Generation) -> None:
            parents = generation.parents
            parents[:] = 0
            parents[-1, 0], parents[-1, 1] = generation.fitness.size - 1, ITSELF

    genome, children, parents = bred(1, LastAgentSurvives.name)
    assert parents.tolist() == [[5, 5]] + [[0, 0]] * 6 + [[7, 7]]
    np.testing.assert_array_equal(children[[0, 7]], genome[[5, 7]])
