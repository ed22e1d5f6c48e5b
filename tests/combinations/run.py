"""Check that a combination of parts is refused with an expected message, or is reproducible.

The results must not depend on the previous content of memory. A newborn must not read data of the
replaced agent.
"""

from __future__ import annotations

import re
from importlib import import_module
from typing import Any, Final

import numpy as np
import numpy.typing as npt
import pytest
import xarray as xr

from baldwinlab.core.errors import BaldwinLabError
from baldwinlab.core.records import as_run
from baldwinlab.engine import poison
from baldwinlab.engine.phases import Array
from baldwinlab.evolution import GenerationKey
from baldwinlab.models import make_simulator
from baldwinlab.models.miniworld import birth
from baldwinlab.models.miniworld.allocation import array_holders
from baldwinlab.models.miniworld.birth import replace_agent
from baldwinlab.simulation.history import read_run_arrays
from baldwinlab.simulation.records import make_record
from baldwinlab.simulation.replay import recompute_genomes
from baldwinlab.simulation.simulate import simulate_histories
from tests.combinations.draw import Settings, find_accepted_experiment
from tests.evolution.single_runs import fitness, lifetimes_of_run
from tests.models.miniworld.plain import disable_compilation

SEED: Final = 8
PATTERNS: Final = [
    r"senses\.kinds = \[\]: tuple should have at least 1 item after validation, not 0",
    r"senses\.kinds: 'last-action' has 3 inputs, "
    r"but there are 4 actions of motor\.body = '[a-z-]+'",
    r"network\.kind = 'neat' does not learn: learning\.rule = '[a-z-]+' must be 'none'",
    r"(model|network\.kind) = '[a-z-]+' is bred by evolution\.variation = 'neat', "
    r"and not '[a-z-]+'",
    r"network\.kind = 'neat' starts with \d+ links, but can hold only \d+: "
    r"network\.hidden must be one number.*",
    r"network\.kind = 'neat' has its bias as a node: network\.biases must be false",
    r"learning\.rule = '[a-z-]+' evaluates the network .*: the network must have no memory",
    r"learning\.rule = '[a-z-]+' is for the first sense '[a-z-]+' and the body '[a-z-]+'",
    r"learning\.rule = '[a-z-]+' keeps strengths in \[0, 1\]: "
    r"learning\.rate cannot be a gene \(learning\.evolved_rate\)",
    r"world\.features: [a-z-]+ needs a variation that creates one child at a time; "
    r"evolution\.variation = '[a-z-]+' does not",
    r"world\.features: [a-z-]+ and [a-z-]+ both remove items: use only one of them",
    r"evolution\.(variation|selection) = '[a-z-]+' needs genomes that are graphs: those of .*",
    r"evolution\.variation = 'one-point-of-units' is only for the model 'cue-learners'",
    r"evolution\.(fitness|selection) = '[a-z-]+' reads positions and items, "
    r"and the model [a-z-]+ has no world: .*",
    r"evolution\.selection = '[a-z-]+' breeds groups of agents separately, and .*",
    r"evolution\.selection = 'fitness-sharing' compares genomes gene by gene, and .*",
    r"evolution\.lamarckian_share = [\d.]+ must be 0 or 1 with the model '[a-z-]+': .*",
]
REFUSALS: Final = re.compile("|".join(PATTERNS))


def disable_all_compilation(monkeypatch: pytest.MonkeyPatch) -> None:
    """Run lifetimes and reproduction in plain Python, because compilation takes longer."""
    disable_compilation(monkeypatch)
    for name in ("breeding", "fitness", "inheritance", "selection"):
        # A function of the package has the name of a module, so an attribute is ambiguous.
        module = import_module(f"baldwinlab.evolution.{name}")
        monkeypatch.setattr(module, "cached_jit", lambda function, phases, **_: function)


def poison_newborns(monkeypatch: pytest.MonkeyPatch) -> None:
    """Poison the arrays of an agent that dies, before the birth of the newborn writes them."""

    def replace_poisoned(model: Any, state: Any, world: int, agent: int, number: int) -> None:
        lane = world * model.agents + agent
        for prefix, (holder, arrays) in array_holders(state).items():
            # The calling feature keeps its arrays. The newborn needs `eaten_in_life` of the lane.
            if not prefix.startswith("features"):
                for name, array in arrays.items():
                    if name != "eaten_in_life" and array.fill is None:
                        poison_lane(getattr(holder, name), array, lane)
        replace_agent(model, state, world, agent, number)

    monkeypatch.setattr(birth, "replace_agent", replace_poisoned)


def poison_lane(values: Any, array: Array, lane: int) -> None:
    if array.owner == "agent":
        poison.fill(values[..., lane])
    elif array.owner == "lane":
        poison.fill(values[lane])


def simulate_poisoned(experiment: Any, pattern: int) -> xr.Dataset:
    """Return the record of a run."""
    with poison.use_pattern(pattern), np.errstate(all="ignore"):
        return make_record(simulate_histories(experiment, SEED, [0])[0])


def replay_last_generation(
    experiment: Any, record: xr.Dataset, pattern: int
) -> dict[str, npt.NDArray[Any]]:
    """Return the results of the last generation of a record, simulated again in different memory.

    The record has the arrays of the run from before this generation.
    """
    generation = experiment.evolution.generations - 1
    with poison.use_pattern(pattern), np.errstate(all="ignore"):
        genome = recompute_genomes(experiment, GenerationKey(SEED, 0, generation), record["energy"])
        lives = make_simulator(experiment, SEED, [0]).simulate(generation, genome[None])
        results = {name: values[0] for name, values in lives.records.items()}
        results["genome"] = genome
        lifetimes = lifetimes_of_run(experiment, lives, 0, genome)
        results["energy"] = fitness(experiment, lifetimes, read_run_arrays(record).get(0))
        return results


def check_row(row: Settings) -> str:
    """Check a row and return the fault as a message, or an empty string."""
    experiment, refusals = find_accepted_experiment(row)
    unknown = [refusal for refusal in refusals if not REFUSALS.fullmatch(refusal)]
    if unknown:
        return f"refused with an unexpected message: {unknown[0]}"
    try:
        first, second = (simulate_poisoned(experiment, pattern) for pattern in poison.PATTERNS)
    except BaldwinLabError as refused:
        if REFUSALS.fullmatch(str(refused)):
            return ""
        return f"refused with an unexpected message: {refused}"
    for name in first.variables:
        if first[name].values.tobytes() != second[name].values.tobytes():
            return f"{name} depends on unwritten memory"
    generation = experiment.evolution.generations - 1
    run = as_run(first)
    for name, values in replay_last_generation(experiment, first, 2).items():
        if values.tobytes() != run[name].sel(generation=generation).values.tobytes():
            return f"{name} of generation {generation} differs when that generation is replayed"
    return ""
