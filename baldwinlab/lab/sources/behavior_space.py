"""Behavior space: the fitness of agents without and with learning, in the same lifetime.

Each agent is simulated twice from the same birth, with the same food and the same random numbers.
The fitness with learning off is innate.
"""

from __future__ import annotations

from typing import Any, Final

import numpy as np
import numpy.typing as npt

from baldwinlab.experiment import BaseExperiment
from baldwinlab.experiment.outcome import name_experiment_outcome
from baldwinlab.lab import Lab
from baldwinlab.lab.sources.life_query import Life, find_life_of_any_model
from baldwinlab.lab.sources.limits import MAX_GENERATION_WORK
from baldwinlab.lab.sources.query import Query
from baldwinlab.simulation.reevaluation import reevaluate

# The number of generations whose means are measured.
MAX_GENERATIONS: Final = 21
SIMULATIONS_PER_GENERATION: Final = 2

Energy = npt.NDArray[np.float64]


def load_behavior(lab: Lab, query: Query) -> bytes:
    """Return the fitness without and with learning as JSON: of agents, or of generations."""
    life = find_life_of_any_model(lab, query)
    require_measurable(life.experiment)
    measure = measure_generations if query.get("of") == "generations" else measure_agents

    def make() -> dict[str, Any]:
        return {"outcome": name_experiment_outcome(life.experiment)} | measure(lab, query, life)

    return lab.cache.get_json(("behavior", measure.__name__, life.experiment, life.key), make)


def require_measurable(experiment: BaseExperiment) -> None:
    """Raise ValueError if agents cannot be simulated with and without learning in a request."""
    if not experiment.learns:
        raise ValueError(
            f"the agents of {experiment.name} do not learn; choose a condition that learns"
        )
    if experiment.population.species or experiment.births_in_life:
        raise ValueError(
            f"{experiment.name} has several species or births during life, so its agents cannot be"
            " simulated again one generation at a time"
        )
    if _estimate_work(experiment) > MAX_GENERATION_WORK:
        raise ValueError(f"{experiment.name} is too large; use `baldwinlab assay --assays innate`")


def _estimate_work(experiment: BaseExperiment) -> int:
    return SIMULATIONS_PER_GENERATION * experiment.agent_steps * experiment.weight_count


def measure_agents(lab: Lab, query: Query, life: Life) -> dict[str, Any]:
    """Return the fitness of each agent of a generation without (`innate`) and with learning."""
    innate, learned = _simulate(life)
    return {
        "agents": list(range(len(innate))),
        "innate": innate.tolist(),
        "learned": learned.tolist(),
    }


def measure_generations(lab: Lab, query: Query, life: Life) -> dict[str, Any]:
    """Return the means of equally spaced generations up to that of a lifetime, and their numbers.

    A run that is not stored has the last generation only, because the others are not in memory.
    """
    last_generation = life.key.generation
    limit = min(MAX_GENERATIONS, MAX_GENERATION_WORK // _estimate_work(life.experiment))
    is_stored = "study" in query or "live" in query
    n_generations = min(limit, last_generation + 1) if is_stored else 1
    generations = np.unique(
        np.linspace(last_generation if n_generations == 1 else 0, last_generation, n_generations)
        .round()
        .astype(int)
    ).tolist()
    innate_means = []
    learned_means = []
    for generation in generations:
        query_of_generation = {**query, "generation": str(generation)}
        innate, learned = _simulate(find_life_of_any_model(lab, query_of_generation))
        innate_means.append(float(innate.mean()))
        learned_means.append(float(learned.mean()))
    return {"generations": generations, "innate": innate_means, "learned": learned_means}


def _simulate(life: Life) -> tuple[Energy, Energy]:
    """Return the fitness [agent] without and with learning."""
    seed, run, generation = life.key
    genomes = life.load_start_data().genomes[None]
    # Without a schedule, which could switch learning on again.
    innate_settings = life.experiment.at(generation).without_learning()
    innate, learned = (
        reevaluate(settings, seed, [run], generation, genomes).energy[0]
        for settings in (innate_settings, life.experiment)
    )
    return innate, learned
