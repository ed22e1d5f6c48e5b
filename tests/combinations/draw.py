"""Experiments of parts of the registry: a pairwise covering array of them, and random ones."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from itertools import combinations
from typing import Any, Final

import numpy as np
from covertable import make

from baldwinlab.experiment import assign, registry
from baldwinlab.experiment.fields import ExperimentError
from baldwinlab.experiment.registry import table_name
from baldwinlab.experiment.unused_settings import list_changed_unused_settings
from baldwinlab.papers.presets import load
from tests.worlds import make_small_experiment

# Values by dotted path.
Settings = Mapping[str, Any]
# The name for no part.
NONE: Final = ""
# Settings of models whose lifetimes are long by default.
SHORT_LIFETIMES: Final[Settings] = {
    "cell-foragers": {"environments": 6, "steps_per_environment": 4},
    "cue-learners": {"items": 8},
    "digit-readers": {"trials": 3, "tests_per_digit": 1, "hidden_units": 2},
    "light-switch": {"steps_per_life": 6},
    "neat-poles": {"max_steps": 20},
    "neat-poles-without-velocities": {"max_steps": 20},
    "nk-climbers": {"trials": 5, "bits": 8},
    "t-mazes": {"trips": 4},
}
# Parts for genomes that are graphs.
GRAPH_PARTS: Final = {"neat", "species"}
SETTINGS_OF_FEATURES: Final[Mapping[str, Settings]] = {
    "patches": {"world.patches.patches": [[20, 100, 10, 60, 8, -1]]},
    "walls": {"world.walls.boxes": [[70, 80, 20, 60]]},
    # Agents die and are born often enough in lifetimes of few steps.
    "births-and-deaths": {"world.births_and_deaths.max_age": 3},
}
BREEDING: Final = {
    "evolution.selection": registry.package_parts("selection"),
    "evolution.variation": registry.package_parts("variation"),
    "evolution.inheritance": registry.package_parts("inheritance"),
    "evolution.fitness": registry.package_parts("fitness"),
    "evolution.elite": [0, 2],
    "evolution.lamarckian_share": [0, 0.5],
    "evolution.mutation_gate": ["weight", "child"],
    "evolution.mutation_rate": [0.3, 1],
}
FORAGERS: Final = {
    "senses.kinds": registry.package_parts("sense"),
    "motor.body": registry.package_parts("body"),
    "network.kind": registry.package_parts("network"),
    "learning.rule": registry.package_parts("learning rule"),
    "world.features": [NONE, *registry.package_parts("world feature")],
    "lifetime.update": ["simultaneous", "sequential"],
    "learning.teacher": ["inherited", "shuffled", "fresh"],
    "learning.evolved_rate": [False, True],
    "network.biases": [False, True],
    "population.size": [5, 2, 17],
}
MODELS: Final = {"model": [name for name in registry.package_parts("model") if name != "miniworld"]}
DEFAULTS: Final = {
    "model": "nk-climbers",
    **{path: next(iter(values)) for path, values in {**FORAGERS, **BREEDING}.items()},
}


def make_pairwise_rows() -> list[Settings]:
    """Return rows with all pairs of values of two factors: for foragers, then for models."""
    rows: list[Settings] = []
    for factors in ({**FORAGERS, **BREEDING}, {**MODELS, **BREEDING}):
        covering_array = make({path: list(values) for path, values in factors.items()})
        rows += [{path: row[path] for path in factors} for row in covering_array]
    return rows


def draw_random(count: int, seed: int) -> Iterator[Settings]:
    """Draw rows. A third has a model, and foragers have up to three senses and two features."""
    generator = np.random.default_rng(seed)

    def draw_value(values: Any) -> Any:
        return list(values)[generator.integers(len(values))]

    for _ in range(count):
        factors = {**(MODELS if generator.random() < 1 / 3 else FORAGERS), **BREEDING}
        row = {path: draw_value(values) for path, values in factors.items()}
        for path, max_count in (("senses.kinds", 3), ("world.features", 2)):
            if path in row:
                row[path] = [
                    draw_value(factors[path]) for _ in range(generator.integers(max_count + 1))
                ]
        # A random subset of the settings has the default values.
        for path in generator.permutation(list(row))[: generator.integers(len(row))]:
            if path in DEFAULTS:
                row[path] = DEFAULTS[path]
        yield row


def make_experiment(row: Settings) -> Any:
    """Return the experiment of a row with short lifetimes, without settings that have no effect.

    Raises
    ------
    ExperimentError
        If the experiment is refused.
    """
    if "model" in row:
        name = row["model"]
        fields = {
            **registry.find_class("model", name).check_settings,
            **SHORT_LIFETIMES.get(name, {}),
        }
        table = {table_name(name): fields} if fields else {}
        base = load(name).replace(
            population={"size": 5}, evolution={"generations": 3, "elite": 0}, **table
        )
    else:
        base = make_small_experiment("evo", population={"size": 5}, lifetime={"steps": 7})
    given = {
        path: value
        for path, value in row.items()
        if path != "model" and value != DEFAULTS.get(path)
    }
    experiment = assign(base, [f"{path}={value}" for path, value in _to_assignments(given).items()])
    idle = list_changed_unused_settings(experiment).keys() & row.keys()
    if idle:
        return make_experiment({path: value for path, value in row.items() if path not in idle})
    return experiment


def _to_assignments(row: Settings) -> dict[str, Any]:
    """Return the values of a row for assignments, and settings of features for short lifetimes."""
    assignments: dict[str, Any] = {}
    for path, value in row.items():
        if path in ("senses.kinds", "world.features"):
            names = [value] if isinstance(value, str) else value
            value = list(dict.fromkeys(name for name in names if name))
        assignments[path] = str(value).lower() if isinstance(value, bool) else value
    if "learning.rule" in assignments:
        assignments["learning.rate"] = 0.5
    features = assignments.get("world.features", [])
    return assignments | {
        path: value
        for name, fields in SETTINGS_OF_FEATURES.items()
        if name in features
        for path, value in fields.items()
    }


def add_required_parts(row: Settings) -> Settings:
    """Return a row with the parts that its parts require."""
    row = dict(row)
    breeding = {row["evolution.selection"], row["evolution.variation"]}
    if "model" in row:
        if "one-point-of-units" in breeding:
            row["model"] = "cue-learners"
        elif breeding & GRAPH_PARTS:
            row["model"] = "neat-xor"
        if row["model"].startswith("neat-"):
            row["evolution.variation"] = "neat"
        return row
    if breeding & GRAPH_PARTS:
        row["network.kind"] = "neat"
    if row["network.kind"] == "neat":
        needed = registry.find_class("network", "neat").required_settings
        row |= {path: value for path, value in needed.items() if path != "evolution.selection"}
        row |= {
            "learning.teacher": "inherited",
            "learning.evolved_rate": False,
            "evolution.lamarckian_share": 0,
        }
    return row


def iterate_similar_rows(row: Settings) -> Iterator[Settings]:
    """Yield a row, then rows in which an increasing number of factors have their defaults."""
    yield row
    row = add_required_parts(row)
    for count in range(5):
        for paths in combinations([path for path in row if path in DEFAULTS], count):
            yield {**row, **{path: DEFAULTS[path] for path in paths}}


def find_accepted_experiment(row: Settings) -> tuple[Any, set[str]]:
    """Return the first accepted experiment similar to a row, and the messages of refused ones."""
    refusals: set[str] = set()
    for similar in iterate_similar_rows(row):
        try:
            return make_experiment(similar), refusals
        except ExperimentError as refused:
            refusals.add(str(refused))
    raise AssertionError(f"no experiment similar to {row} is accepted: {refusals}")
