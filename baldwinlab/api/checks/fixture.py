"""The small world in which parts are checked: the paper's map A, with everybody near everything, so that a part is used."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from itertools import zip_longest
from typing import Any, Final, NamedTuple

import numpy as np

from baldwinlab.evolution import GenerationKey
from baldwinlab.experiment import BaseExperiment, Experiment, assign, validate
from baldwinlab.experiment.class_builder import choosing_fields
from baldwinlab.experiment.registry import key_of
from baldwinlab.models.miniworld.allocation import make_state
from baldwinlab.parts.breeding import breeding_part
from baldwinlab.parts.model_part import Model
from baldwinlab.parts.part import Part

PATHS: Final = {kind: path for path, kind, _ in choosing_fields(Experiment)} | {"model": "model"}
MANY: Final = ("sense", "world feature")  # kinds of which an experiment has several parts
BREEDS: Final = ("selection", "variation", "inheritance", "fitness")
WORLD: Final[Mapping[str, Any]] = {
    "name": "check",
    "world": {
        "start": {"x": 370, "y": 160, "radius": 60, "headings": "random"},
        "food": [
            {"x": [400, 560], "y": [80, 240], "count": 20},
            {"x": [300, 400], "y": [100, 220], "count": 10, "energy": 2},
        ],
    },
    "network": {"hidden": [4]},
    "lifetime": {"steps": 40},
}
OF_ALL: Final[Mapping[str, Any]] = {"population": {"size": 5}, "evolution": {"generations": 2}}
SEED: Final = 11  # of the random worlds, unless another is given
RATE: Final = 0.5  # of learning: so high that a wrong rule cannot hide in rounding


class Subject(NamedTuple):
    """Parts that are checked together, the experiment that chooses them, and the seed of its worlds."""

    parts: tuple[type[Part], ...]
    experiment: Any
    seed: int = SEED
    plain_bits: Mapping[
        str, Sequence[str]
    ] = {}  # of lives in plain Python, by the words of their case, where known

    @property
    def label(self) -> str:
        return " and ".join(map(label, self.parts))


def label(part: type[Part]) -> str:
    """The part in messages: its kind and name."""
    return f"{part.kind} {part.name!r}"


def subjects(parts: Iterable[type[Part]], seed: int = SEED) -> Iterator[Subject]:
    """The parts of a file, as few at a time as can be together in an experiment."""
    of_kind: dict[str, list[type[Part]]] = {}
    for part in parts:
        of_kind.setdefault(part.kind, []).append(part)
    models = [part for part in of_kind.pop("model", []) if issubclass(part, Model)]
    for model in models:  # what breeds beside a model is made for its genomes
        bred = [each for kind in BREEDS for each in of_kind.pop(kind, [])]
        evolution = {"generations": 2} | {part.kind: part.name for part in bred}
        fields = {key_of(model.name): dict(model.check_settings)} if model.check_settings else {}
        yield Subject(
            (model, *bred),
            validate({"model": model.name, **OF_ALL, "evolution": evolution, **fields}),
            seed,
        )
    always = tuple(part for kind in MANY for part in of_kind.pop(kind, []))
    for group in zip_longest(*of_kind.values()) if of_kind else [()] if always else []:
        chosen = (*always, *(part for part in group if part))
        yield Subject(chosen, _experiment(chosen), seed)


def _experiment(parts: tuple[type[Part], ...]) -> Any:
    kinds = {part.kind: part.name for part in parts}
    rule = kinds.get(
        "learning rule", "self-taught" if kinds.keys() & {"network", "inheritance"} else "none"
    )
    experiment = validate({**WORLD, **OF_ALL, "learning": {"rule": rule, "rate": RATE}})
    if "inheritance" in kinds:
        experiment = experiment.replace(evolution={"lamarckian_share": 0.5})
    many = {kind: [part.name for part in parts if part.kind == kind] for kind in MANY}
    senses = list(dict.fromkeys(["food", *many["sense"]]))
    chosen = [f"senses.kinds={senses}", f"world.features={many['world feature']}"]
    chosen += [
        f"{path}={setting}" for part in parts for path, setting in part.required_settings.items()
    ]
    return assign(
        experiment,
        chosen + [f"{PATHS[part.kind]}={part.name}" for part in parts if part.kind not in MANY],
    )


def is_of_miniworld(experiment: BaseExperiment) -> bool:
    return isinstance(experiment, Experiment)


def values_of(experiment: Any, part: type[Part], state: Any = None) -> Any:
    """What the hooks of a part get as `part`, in a state if one is given."""
    if part.kind in BREEDS:
        return breeding_part(experiment, part.kind)[0]
    state = make_state(experiment, 1) if state is None else state
    parts = (state.network, state.rule, state.body, *state.senses, *state.features)
    return next(each for each in parts if type(each).part is part)


def breeding_arguments(random: np.random.Generator, modules: int) -> dict[str, Any]:
    """What breeding hooks get, by name."""
    agents, weights = 5, 8
    genome = random.normal(size=(4, modules, weights)).astype(np.float32)
    return {
        "fitness": np.round(random.uniform(0, 4, agents)), "uniforms": random.random((agents, 2, 4)), "shares": np.zeros(agents),
        "order": np.zeros(agents, np.int64), "parents": np.full((agents, 2), -1, np.int32),
        "energy": random.uniform(-2, 8, agents), "cost": random.random(agents),
        "fitter": genome[0], "second": genome[1], "child": genome[2], "draws": random.random((modules * weights, 4)),
        "genome": genome, "children": genome.copy(), "key": GenerationKey(0, 0, 1), "count": 1,
        "gate": float(random.random()), "innate": genome[3, 0],
        "learned": random.normal(size=weights).astype(np.float32), "inherited": np.zeros(weights, np.float32),
        "taught": genome[3, -1].copy(),
    }  # fmt: skip
