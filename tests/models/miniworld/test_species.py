"""Test species that share a world, against one population and against plain Python."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

from baldwinlab.evolution import GenerationKey, draw_genomes
from baldwinlab.experiment import Experiment
from baldwinlab.models.miniworld.lifetimes import MiniWorldSimulator
from baldwinlab.models.miniworld.species import SpeciesSimulator
from baldwinlab.papers.presets import load
from baldwinlab.parts.model_part import LifeResults

SEED = 3
RUNS = (0, 4)


def split_population(experiment: Experiment, *sizes: int, **changes: Any) -> Experiment:
    """Return an experiment with species of equal settings, except for the changes of the last."""
    species: list[dict[str, Any]] = [
        {"name": f"species-{number}", "size": size} for number, size in enumerate(sizes)
    ]
    species[-1] |= changes
    return experiment.replace(population={"size": sum(sizes), "species": species})


def draw_all_genomes(experiment: Experiment) -> npt.NDArray[np.float32]:
    """Return random genomes [run, agent, module, weight]."""
    return np.stack([draw_genomes(experiment, GenerationKey(SEED, run, 0)) for run in RUNS])


def simulate_species(
    experiment: Experiment, genomes: npt.NDArray[np.float32], *sizes_of_runs: list[int]
) -> LifeResults:
    simulator = SpeciesSimulator(experiment, SEED, RUNS)
    return simulator.simulate(2, genomes, np.array(sizes_of_runs))


@pytest.mark.parametrize("condition", ["evo", "evo+self-taught"])
def test_two_equal_species_have_the_results_of_one_population(condition: str) -> None:
    experiment = load(f"{condition}/A").replace(
        lifetime={"steps": 400}, motor={"noise": 0.1}, learning={"cost_per_change": 0.1}
    )
    genomes = draw_all_genomes(experiment)
    expected = MiniWorldSimulator(experiment, SEED, RUNS).simulate(2, genomes)
    assert expected.energy.sum() > 0
    species = split_population(experiment, 12, 8)
    for sizes in ([[12, 8], [12, 8]], [[3, 17], [20, 0]]):
        actual = simulate_species(species, genomes, *sizes)
        np.testing.assert_array_equal(actual.energy, expected.energy)
        np.testing.assert_array_equal(actual.cost, expected.cost)
        np.testing.assert_array_equal(actual.records["food_eaten"], expected.records["food_eaten"])
        if condition != "evo":
            np.testing.assert_array_equal(actual.learned, expected.learned)
