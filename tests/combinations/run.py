"""Run one combination of parts: it is refused in a known sentence, or gives the same bits whatever memory held before."""

from __future__ import annotations

import re
from importlib import import_module
from typing import Any, Final

import numpy as np
import numpy.typing as npt
import pytest
import xarray as xr

from baldwinlab.core.errors import BaldwinLabError
from baldwinlab.engine import poison
from baldwinlab.evolution import GenerationKey, fitness
from baldwinlab.models import make_simulator
from baldwinlab.simulation.replay import recompute_genomes
from baldwinlab.simulation.simulate import simulate_batch
from tests.combinations.draw import Settings, accepted
from tests.models.miniworld.plain import disable_compilation

SEED: Final = 8
REFUSALS: Final = re.compile("|".join([
    r"senses\.kinds = \[\]: tuple should have at least 1 item after validation, not 0",
    r"senses\.kinds: 'last-action' has 3 inputs, but there are 4 actions of motor\.body = '[a-z-]+'",
    r"network\.kind = 'neat' does not learn: learning\.rule = '[a-z-]+' must be 'none'",
    r"(model|network\.kind) = '[a-z-]+' is bred by evolution\.variation = 'neat', and not '[a-z-]+'",
    r"network\.kind = 'neat' starts with \d+ links, but can hold only \d+: network\.hidden must be one number.*",
    r"network\.kind = 'neat' has its bias as a node: network\.biases must be false",
    r"learning\.rule = '[a-z-]+' evaluates the network .*: the network must have no memory",
    r"learning\.rule = '[a-z-]+' is for the first sense '[a-z-]+' and the body '[a-z-]+'",
    r"learning\.rule = '[a-z-]+' keeps strengths in \[0, 1\]: learning\.rate cannot be a gene \(learning\.evolved_rate\)",
    r"world\.features: births-and-deaths needs a variation that creates one child at a time; evolution\.variation = '[a-z-]+' does not",
    r"world\.features: [a-z-]+ and [a-z-]+ both remove items: use only one of them",
    r"evolution\.(variation|selection) = '[a-z-]+' needs genomes that are graphs: those of .*",
    r"evolution\.variation = 'one-point-of-units' is only for the model 'cue-learners'",
]))  # fmt: skip


def interpret(monkeypatch: pytest.MonkeyPatch) -> None:
    """Run lifetimes and reproduction as the Python that they are, which is compiled for no combination of parts."""
    disable_compilation(monkeypatch)
    for name in ("breeding", "fitness", "inheritance", "selection"):
        module = import_module(
            f"baldwinlab.evolution.{name}"
        )  # a function of the package hides one of these
        monkeypatch.setattr(module, "cached_jit", lambda function, phases, **_: function)


def simulate_poisoned(experiment: Any, pattern: int) -> xr.Dataset:
    with poison.use_pattern(pattern), np.errstate(all="ignore"):
        return simulate_batch(experiment, SEED, [0])[0]


def live_again(
    experiment: Any, record: xr.Dataset, generation: int, pattern: int
) -> dict[str, npt.NDArray[Any]]:
    """Return what one generation of a record comes to, in memory that no generation has used before."""
    with poison.use_pattern(pattern), np.errstate(all="ignore"):
        genome = recompute_genomes(experiment, GenerationKey(SEED, 0, generation), record["energy"])
        lives = make_simulator(experiment, SEED, [0]).simulate(generation, genome[None])
        found = {name: values[0] for name, values in lives.records.items()}
        return found | {
            "genome": genome,
            "energy": fitness(experiment, lives.energy[0], lives.cost[0]),
        }


def check(row: Settings) -> str:
    """Check a row, and return what is wrong with it in words; nothing if all is well."""
    experiment, refusals = accepted(row)
    unknown = [refusal for refusal in refusals if not REFUSALS.fullmatch(refusal)]
    if unknown:
        return f"refused in an unknown sentence: {unknown[0]}"
    try:
        one, other = (simulate_poisoned(experiment, pattern) for pattern in poison.PATTERNS)
    except BaldwinLabError as refused:
        return (
            "" if REFUSALS.fullmatch(str(refused)) else f"refused in an unknown sentence: {refused}"
        )
    for name in one.variables:
        if one[name].values.tobytes() != other[name].values.tobytes():
            return f"{name} depends on unwritten memory"
    generation = experiment.evolution.generations - 1
    for name, values in live_again(experiment, one, generation, 2).items():
        if values.tobytes() != one[name].sel(generation=generation).values.tobytes():
            return f"{name} of generation {generation} is another when that generation is replayed"
    return ""
