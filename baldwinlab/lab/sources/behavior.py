"""The map of behavior: the fitness of agents without and with learning.

Each agent is simulated twice from birth, with the same food and the same random numbers. The
fitness without learning is called innate.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Final

import numpy as np
import numpy.typing as npt

from baldwinlab.analysis.results.numbers import format_numbers, format_percentage
from baldwinlab.experiment import BaseExperiment
from baldwinlab.experiment.outcome import name_experiment_outcome
from baldwinlab.lab import Lab, Query
from baldwinlab.lab.sources.life_query import Life, find_life_of_any_model
from baldwinlab.lab.sources.limits import MAX_GENERATION_WORK
from baldwinlab.simulation.reevaluation import reevaluate

# A request measures the means of at most this number of generations.
MAX_GENERATIONS: Final = 21
# One simulation without learning, and one with learning.
SIMULATIONS_PER_GENERATION: Final = 2

# The fitness of each agent, [agent].
Energy = npt.NDArray[np.float64]


def load_behavior(lab: Lab, query: Query) -> bytes:
    """Return the fitness without and with learning as JSON: of agents, or means of generations."""
    life = find_life_of_any_model(lab, query)
    require_measurable(life.experiment)
    measure = measure_generations if query.get("of") == "generations" else measure_agents

    def make() -> dict[str, Any]:
        outcome = name_experiment_outcome(life.experiment)
        means = measure(lab, query, life)
        answer = answer_innate(outcome, life.key.run, means) if "generations" in means else ""
        return {"outcome": outcome, "answer": answer} | means

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
    """Return the fitness of each agent of a generation: `agents`, `innate` and `learned`."""
    innate, learned = _simulate(life)
    return {
        "agents": list(range(len(innate))),
        "innate": innate.tolist(),
        "learned": learned.tolist(),
    }


def measure_generations(lab: Lab, query: Query, life: Life) -> dict[str, Any]:
    """Return the mean fitness of some generations: `generations`, `innate` and `learned`.

    The generations are equally spaced, up to the generation of `life`. A run that is neither stored
    nor live has this generation only, because the earlier generations are not in memory.
    """
    last_generation = life.key.generation
    limit = min(MAX_GENERATIONS, MAX_GENERATION_WORK // _estimate_work(life.experiment))
    is_stored = "study" in query or "live" in query
    n_generations = min(limit, last_generation + 1) if is_stored else 1
    # Several generations can round to the same one.
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


def answer_innate(outcome: str, run: int, means: Mapping[str, Any]) -> str:
    """Return how much of the fitness of the last generation is innate, as a sentence.

    `means`: the result of `measure_generations`.
    """
    generations, innate, learned = means["generations"], means["innate"][-1], means["learned"][-1]
    if 0 <= innate < learned:
        answer = (
            f"learning is not needed for {format_percentage(innate / learned)} of the {outcome}"
        )
    elif innate < learned:
        answer = f"learning adds to the {outcome}"
    else:
        answer = f"learning does not add to the {outcome}"
    sentence = f"In generation {generations[-1]} of run {run}, {answer}: {_name_means(means, -1)}"
    if len(generations) > 1:
        sentence += f"; in generation {generations[0]}: {_name_means(means, 0)}"
    return f"{sentence}."


def _name_means(means: Mapping[str, Any], index: int) -> str:
    innate, learned = format_numbers([means[name][index] for name in ("innate", "learned")])
    return f"{innate} without and {learned} with learning"


def _simulate(life: Life) -> tuple[Energy, Energy]:
    """Return the fitness [agent] without and with learning."""
    seed, run, generation = life.key
    genomes = life.load_start_data().genomes[None]
    # `at` removes the schedule, because a change of the schedule could switch learning on again.
    innate_settings = life.experiment.at(generation).without_learning()
    innate, learned = (
        reevaluate(settings, seed, [run], generation, genomes).energy[0]
        for settings in (innate_settings, life.experiment)
    )
    return innate, learned
