"""Artificial assays, for which the correct results are known."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import cache
from pathlib import Path
from types import MappingProxyType
from typing import Any, NamedTuple

import numpy as np
import xarray as xr

from baldwinlab.core.variables import make_dataset
from baldwinlab.experiment import Experiment
from baldwinlab.experiment.conditions import Factors
from baldwinlab.experiment.toml import to_toml
from baldwinlab.papers.presets import factors, load
from baldwinlab.studies.assays import LIFE_KINDS
from baldwinlab.studies.assays.canalization import WORLDS
from baldwinlab.studies.assays.catalog import load_assays
from baldwinlab.studies.assays.neutral import NEWBORNS as NEWBORNS_COMPARED
from baldwinlab.studies.assays.reaction_norms import LEARNING_FACTORS
from baldwinlab.studies.store import StudyStore

RUNS = 12
GENERATIONS = 40
AGENTS = 4
STEPS = 600
LAYERS = ("sensors to hidden", "hidden to actions")
NEWBORNS = ("random genome", "generation 0", "generation 20", "generation 39")
MODULES = (
    "both evolved",
    "evolved reinforcement, random action",
    "random reinforcement, evolved action",
    "both random",
)
SETTINGS = (
    ("as evolved", ""),
    ("map", "A"),
    ("map", "B"),
    ("world.food.0.count", "10"),
    ("world.food.0.count", "100"),
    ("senses.visual_radius", "10"),
    ("senses.visual_radius", "80"),
    ("learning.rate", "0.001"),
    ("learning.rate", "0.1"),
)

# A value by progress of evolution, from 0 (the first generation) to 1 (the last generation).
Course = Callable[[float], float]


def constant(value: float) -> Course:
    return lambda progress: value


def rising(first: float, last: float) -> Course:
    return lambda progress: first + (last - first) * progress


def experiment(condition: str) -> Experiment:
    """Return the experiment of a condition with assays."""
    return load(condition).replace(
        evolution={"generations": GENERATIONS},
        lifetime={"steps": STEPS},
        population={"size": AGENTS},
    )


@cache
def experiment_text(condition: str) -> str:
    return to_toml(experiment(condition))


class Assayed(NamedTuple):
    """The study of the assays."""

    directory: Path
    factors: Mapping[str, Factors] = MappingProxyType({})
    seed: int = 1

    @property
    def experiments(self) -> dict[str, Experiment]:
        return {
            name: experiment(name) for name in ("evo/A", "evo+self-taught/A", "evo+self-taught/B")
        }

    def runs(self, condition: str) -> list[int]:
        return list(range(RUNS))


def _make_dataset(
    assay: str, condition: str, arrays: dict[str, Any], coords: dict[str, Any]
) -> xr.Dataset:
    runs = next(iter(arrays.values())).shape[0]
    provenance = {
        "experiment": experiment_text(condition),
        "seed": 1,
        **factors()[condition]._asdict(),
    }
    return make_dataset(load_assays()[assay].variables, arrays, provenance).assign_coords(
        coords | {"run": np.arange(runs)}
    )


def spread(runs: int, *shape: int) -> np.ndarray:
    """Return factors [run, *shape] near 1, which differ only between runs."""
    return np.broadcast_to(
        1 + 0.01 * np.arange(runs).reshape(-1, *(1 for _ in shape)), (runs, *shape)
    )


def innate(
    condition: str, distance: Course | None = None, runs: int = RUNS, **lives: Course
) -> xr.Dataset:
    """Make the innate assay. `lives`: energy by kind of life. Other kinds of life are NaN."""
    progress = np.linspace(0, 1, GENERATIONS)
    distance = distance or constant(1)
    energy = np.full((runs, GENERATIONS, len(LIFE_KINDS), AGENTS), np.nan)
    for life, course in lives.items():
        values = np.array([course(progress_value) for progress_value in progress])
        energy[:, :, LIFE_KINDS.index(life), :] = values[:, None] * spread(
            runs, GENERATIONS, AGENTS
        )
    moved = np.array([distance(progress_value) for progress_value in progress])[
        :, None, None
    ] * spread(runs, GENERATIONS, len(LAYERS), AGENTS)
    coords = {"generation": np.arange(GENERATIONS), "life": list(LIFE_KINDS), "layer": list(LAYERS)}
    arrays = {"energy": energy} | ({"distance": moved} if "on" in lives else {})
    return _make_dataset("innate", condition, arrays, coords)


def neutral(
    condition: str, evolved: Sequence[float], control: Sequence[float], runs: int = RUNS
) -> xr.Dataset:
    """Make the neutral assay from the energy of evolved newborns and of the neutral control.

    `evolved` and `control` have two values: without learning, and with learning.
    """
    energy = np.array([evolved, control], float)[:, :, None] * spread(
        runs, 10, len(NEWBORNS_COMPARED), 2, AGENTS
    )
    coords = {
        "generation": np.arange(GENERATIONS - 10, GENERATIONS),
        "newborns": list(NEWBORNS_COMPARED),
        "life": list(LIFE_KINDS[:2]),
    }
    return _make_dataset("neutral", condition, {"energy": energy}, coords)


def within_life(
    condition: str, blank: float, evolved: float, windows: int = 6, runs: int = RUNS
) -> xr.Dataset:
    """Make the assay within life. Eaten items rise from `blank` (random genomes) to `evolved`."""
    amounts = np.linspace(blank, evolved, len(NEWBORNS))
    eaten = np.round(
        amounts[:, None, None] * 10 * spread(runs, len(NEWBORNS), windows, AGENTS)
    ).astype(int)
    meals = np.where(amounts > 0, STEPS / (1 + amounts), np.nan)
    coords = {"newborns": list(NEWBORNS), "window": np.arange(windows) * (STEPS // windows)}
    first = meals[:, None] * spread(runs, len(NEWBORNS), AGENTS)
    return _make_dataset(
        "within-life", condition, {"eaten_in_window": eaten, "first_meal": first}, coords
    )


def modules(condition: str, food: Sequence[float], runs: int = RUNS) -> xr.Dataset:
    energy = np.array(food, float)[:, None] * spread(runs, len(MODULES), AGENTS)
    return _make_dataset("modules", condition, {"energy": energy}, {"modules": list(MODULES)})


def reaction(condition: str, food: float, runs: int = RUNS) -> xr.Dataset:
    energy = (
        food * np.linspace(0, 1, len(SETTINGS))[::-1, None] * spread(runs, len(SETTINGS), AGENTS)
    )
    fields, values = zip(*SETTINGS, strict=True)
    coords = {"field": ("setting", list(fields)), "value": ("setting", list(values))}
    return _make_dataset("reaction", condition, {"energy": energy}, coords)


def reaction_norms(
    condition: str, intercepts: Sequence[float], slopes: Sequence[float], runs: int = RUNS
) -> xr.Dataset:
    """Make linear reaction norms, from the values of four generations."""
    factors_of_learning = np.array(LEARNING_FACTORS)
    energy = np.array(intercepts)[:, None] + np.outer(slopes, factors_of_learning)
    agents = np.linspace(-1, 1, AGENTS)
    shape = (runs, *energy.shape, AGENTS)
    coords = {"generation": [0, 13, 26, 39], "factor": factors_of_learning}
    values = {"energy": energy[None, :, :, None] * spread(runs, *shape[1:]) + agents}
    return _make_dataset("reaction-norms", condition, values, coords)


def canalization(
    condition: str, losses: Sequence[float], buffering: float = 0.5, runs: int = RUNS
) -> xr.Dataset:
    """Make the canalization assay, from the effect of each mutation in three generations.

    With learning, the effect is smaller by the fraction `buffering`. Worlds have no effect.
    """
    # Fitness has the mean 5 and the standard deviation 2 in each generation and kind of life.
    agents = 5 + 2 * np.array([-1.0, 1.0] * (AGENTS // 2))
    energy = np.broadcast_to(agents, (runs, 3, 2, len(WORLDS), AGENTS))
    effects = np.outer(losses, [1, 1 - buffering])[None, :, :, None, None]
    coords = {
        "generation": [0, 20, 39],
        "life": list(LIFE_KINDS[:2]),
        "world": list(WORLDS),
        "mutant": np.arange(3),
    }
    mutants = np.broadcast_to(agents - effects, (runs, 3, 2, 3, AGENTS))
    return _make_dataset(
        "canalization", condition, {"energy": energy, "mutant_energy": mutants}, coords
    )


def descent(condition: str, runs: int = RUNS) -> xr.Dataset:
    age = np.where(np.arange(GENERATIONS) < 5, np.nan, np.arange(GENERATIONS) - 3.0) * spread(
        runs, GENERATIONS
    )
    ancestors = AGENTS / (1 + 0.1 * np.arange(GENERATIONS)) * spread(runs, GENERATIONS)
    return _make_dataset(
        "descent", condition, {"common_ancestor_age": age, "effective_ancestors": ancestors},
        {"generation": np.arange(GENERATIONS)},
    )  # fmt: skip


def make_all_assays(runs: int = RUNS) -> dict[str, dict[str, xr.Dataset]]:
    """Make all assays.

    On map A, learned behavior becomes innate. On map B, no agent eats without learning.
    """
    a = "evo+self-taught/A"
    b = "evo+self-taught/B"
    evo = "evo/A"
    on = rising(50, 100)
    drift = constant(20)
    return {
        "innate": {
            a: innate(
                a,
                rising(2, 1),
                runs,
                off=rising(10, 90),
                on=on,
                frozen=rising(55, 110),
                drift=drift,
            ),
            b: innate(
                b, rising(1, 2), runs, off=constant(0), on=on, frozen=constant(0), drift=drift
            ),
            evo: innate(evo, runs=runs, off=rising(10, 60)),
        },
        "neutral": {
            a: neutral(a, (90, 100), (10, 50), runs),
            b: neutral(b, (0, 100), (0, 50), runs),
            evo: neutral(evo, (60, np.nan), (10, np.nan), runs),
        },
        "within-life": {a: within_life(a, 1, 9, runs=runs), b: within_life(b, 0, 5, runs=runs)},
        "modules": {a: modules(a, (100, 40, 90, 20), runs), b: modules(b, (100, 90, 0, 0), runs)},
        "reaction": {
            a: reaction(a, 100, runs),
            b: reaction(b, 50, runs),
            evo: reaction(evo, 60, runs),
        },
        "descent": {name: descent(name, runs) for name in (a, b, evo)},
        "reaction-norms": {
            a: reaction_norms(a, (1, 4, 7, 10), (8, 6, 4, 2), runs),
            b: reaction_norms(b, (0, 0, 0, 0), (1, 2, 3, 4), runs),
        },
        "canalization": {a: canalization(a, (4, 2, 1), runs=runs)},
    }


def assign_to_study(assay: xr.Dataset, study: StudyStore, condition: str) -> xr.Dataset:
    """Return an artificial assay with the attributes and the runs of a stored condition."""
    attributes = {
        "experiment": to_toml(study.experiments[condition]),
        "seed": study.seed,
        "condition": condition,
    }
    return assay.isel(run=slice(len(study.runs(condition)))).assign_attrs(attributes)
