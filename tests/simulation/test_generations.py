"""Evolution without records equals recorded evolution."""

from __future__ import annotations

import numpy as np
import pytest

from baldwinlab.evolution import make_founders, make_run_keys
from baldwinlab.papers import presets
from baldwinlab.simulation.generations import iterate_generations
from baldwinlab.simulation.simulate import evolve_genomes

SMALL = {"population": {"size": 6}, "evolution": {"generations": 4}}
EXPERIMENTS = {
    "climbers": presets.load("mayley-1996:costly-climbing/rugged").replace(**SMALL),
    "lamarckian": presets.load("whitley-1994:lamarckian/rastrigin").replace(**SMALL),
    "foragers": presets.load("le-2019:evo+self-taught/A").replace(**SMALL, lifetime={"steps": 20}),
}


@pytest.mark.parametrize("name", EXPERIMENTS)
def test_generations_equal_those_of_recorded_evolution(name: str) -> None:
    experiment = EXPERIMENTS[name]
    runs = (3, 8)
    founders = make_founders(experiment, make_run_keys(5, runs, 0))
    recorded = evolve_genomes(experiment, 5, runs, range(4), founders)
    generations = [*iterate_generations(experiment, 5, runs, range(4), founders)]
    assert [generation.number for generation in generations] == [0, 1, 2, 3]
    fitness = np.stack([generation.fitness for generation in generations], axis=1)
    assert np.array_equal(fitness, recorded.fitness)
    assert np.array_equal(generations[-1].genomes, recorded.genomes)


def test_a_later_start_continues_an_earlier_evolution() -> None:
    experiment = EXPERIMENTS["climbers"]
    founders = make_founders(experiment, make_run_keys(5, [0], 0))
    *_, last = iterate_generations(experiment, 5, [0], range(4), founders)
    third, _ = iterate_generations(experiment, 5, [0], range(2), founders)
    *_, middle = iterate_generations(experiment, 5, [0], range(3), founders)
    *_, continued = iterate_generations(experiment, 5, [0], range(2, 4), middle.genomes)
    assert third.number == 0
    assert np.array_equal(continued.fitness, last.fitness)
