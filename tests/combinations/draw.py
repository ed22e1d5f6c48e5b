"""Experiments of parts of the registry: a pairwise covering array of them, and random ones."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from itertools import combinations
from typing import Any, Final

import numpy as np
from covertable import make

from baldwinlab.experiment import assign, registry
from baldwinlab.experiment.fields import ExperimentError
from baldwinlab.experiment.registry import key_of
from baldwinlab.experiment.unused_settings import idle_settings
from baldwinlab.papers.presets import load
from tests.worlds import make_small_experiment

Settings = Mapping[str, Any]  # by dotted path
NONE: Final = ""  # no part
SHORT: Final[Settings] = {  # models whose lifetimes are long by default
    "cell-foragers": {"environments": 6, "steps_per_environment": 4},
    "cue-learners": {"items": 8},
    "digit-readers": {"trials": 3, "tests_per_digit": 1, "hidden_units": 2},
    "light-switch": {"steps_per_life": 6},
    "neat-poles": {"max_steps": 20},
    "neat-poles-without-velocities": {"max_steps": 20},
    "nk-climbers": {"trials": 5, "bits": 8},
    "t-mazes": {"trips": 4},
}
GRAPHS: Final = {"neat", "species"}  # parts for genomes that are graphs
ON_THE_MAP: Final[Mapping[str, Settings]] = {
    "patches": {"world.patches.patches": [[20, 100, 10, 60, 8, -1]]},
    "walls": {"world.walls.boxes": [[70, 80, 20, 60]]},
}
BREEDING: Final = {
    "evolution.selection": registry.packaged("selection"),
    "evolution.variation": registry.packaged("variation"),
    "evolution.inheritance": registry.packaged("inheritance"),
    "evolution.fitness": registry.packaged("fitness"),
    "evolution.elite": [0, 2],
    "evolution.lamarckian_share": [0, 0.5],
    "evolution.mutation_gate": ["weight", "child"],
    "evolution.mutation_rate": [0.3, 1],
}
FORAGERS: Final = {
    "senses.kinds": registry.packaged("sense"),
    "motor.body": registry.packaged("body"),
    "network.kind": registry.packaged("network"),
    "learning.rule": registry.packaged("learning rule"),
    "world.features": [NONE, *registry.packaged("world feature")],
    "lifetime.update": ["simultaneous", "sequential"],
    "learning.teacher": ["inherited", "shuffled", "fresh"],
    "learning.evolved_rate": [False, True],
    "network.biases": [False, True],
    "population.size": [5, 2, 17],
}
MODELS: Final = {"model": [name for name in registry.packaged("model") if name != "miniworld"]}
DEFAULTS: Final = {
    "model": "nk-climbers",
    **{
        path: values[0]
        for path, values in {**FORAGERS, **BREEDING}.items()
        if isinstance(values, list)
    },
    **{
        path: next(iter(values))
        for path, values in {**FORAGERS, **BREEDING}.items()
        if not isinstance(values, list)
    },
}


def pairwise() -> list[Settings]:
    """Rows in which every two values of two factors stand together: of foragers, then of models."""
    rows: list[Settings] = []
    for factors in ({**FORAGERS, **BREEDING}, {**MODELS, **BREEDING}):
        found = make({path: list(values) for path, values in factors.items()})
        rows += [{path: row[path] for path in factors} for row in found]
    return rows


def random(count: int, seed: int) -> Iterator[Settings]:
    """Draw rows; one of three is of a model, and foragers have up to three senses and two features."""
    generator = np.random.default_rng(seed)

    def any_of(values: Any) -> Any:
        return list(values)[generator.integers(len(values))]

    for _ in range(count):
        factors = {**(MODELS if generator.random() < 1 / 3 else FORAGERS), **BREEDING}
        row = {path: any_of(values) for path, values in factors.items()}
        for path, most in (("senses.kinds", 3), ("world.features", 2)):
            if path in row:
                row[path] = [any_of(factors[path]) for _ in range(generator.integers(most + 1))]
        for path in generator.permutation(list(row))[
            : generator.integers(len(row))
        ]:  # the rest of a row is ordinary
            if path in DEFAULTS:
                row[path] = DEFAULTS[path]
        yield row


def made(row: Settings) -> Any:
    """Return the experiment of a row, with tiny lifetimes, without settings that would do nothing.

    Raises
    ------
    ExperimentError
        If the experiment is refused.
    """
    if "model" in row:
        name = row["model"]
        fields = {**registry.find("model", name).check_settings, **SHORT.get(name, {})}
        table = {key_of(name): fields} if fields else {}
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
    experiment = assign(base, [f"{path}={value}" for path, value in _written(given).items()])
    idle = idle_settings(experiment).keys() & row.keys()
    return (
        made({path: value for path, value in row.items() if path not in idle})
        if idle
        else experiment
    )


def _written(row: Settings) -> dict[str, Any]:
    """Return the values of a row as assignments take them, and the fields of parts that must fit the small map."""
    written: dict[str, Any] = {}
    for path, value in row.items():
        if path in ("senses.kinds", "world.features"):
            value = list(
                dict.fromkeys(
                    name for name in ([value] if isinstance(value, str) else value) if name
                )
            )
        written[path] = str(value).lower() if isinstance(value, bool) else value
    if "learning.rule" in written:
        written["learning.rate"] = 0.5
    features = written.get("world.features", [])
    return written | {
        path: value
        for name, fields in ON_THE_MAP.items()
        if name in features
        for path, value in fields.items()
    }


def fitted(row: Settings) -> Settings:
    """Return a row in which parts that need others have them."""
    row, breeding = dict(row), {row["evolution.selection"], row["evolution.variation"]}
    if "model" in row:
        row["model"] = (
            "cue-learners"
            if "one-point-of-units" in breeding
            else "neat-xor"
            if breeding & GRAPHS
            else row["model"]
        )
        return row | ({"evolution.variation": "neat"} if row["model"].startswith("neat-") else {})
    if breeding & GRAPHS:
        row["network.kind"] = "neat"
    if row["network.kind"] == "neat":
        needed = registry.find("network", "neat").required_settings
        row |= {path: value for path, value in needed.items() if path != "evolution.selection"}
        row |= {
            "learning.teacher": "inherited",
            "learning.evolved_rate": False,
            "evolution.lamarckian_share": 0,
        }
    return row


def near(row: Settings) -> Iterator[Settings]:
    """Yield a row, and rows that differ from it in ever more factors, which are at their defaults."""
    yield row
    row = fitted(row)
    for count in range(5):
        for paths in combinations([path for path in row if path in DEFAULTS], count):
            yield {**row, **{path: DEFAULTS[path] for path in paths}}


def accepted(row: Settings) -> tuple[Any, set[str]]:
    """Return the first experiment near a row that is accepted, and the refusals of those before."""
    refusals: set[str] = set()
    for each in near(row):
        try:
            return made(each), refusals
        except ExperimentError as refused:
            refusals.add(str(refused))
    raise AssertionError(f"nothing near {row} is accepted: {refusals}")
