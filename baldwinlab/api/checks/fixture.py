"""Groups of parts, small worlds for the checks of a group, and arguments of hooks.

The world of a group is map A of the paper. The agents start near each other and near the food, so
that the parts are used. The cases of a group are experiments with different numbers of agents,
updates, modules of genomes, and items.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from itertools import zip_longest
from typing import Any, Final, NamedTuple

import numpy as np

from baldwinlab.core.numbers import format_count
from baldwinlab.engine.rng import SELECTION_STREAM, Stream
from baldwinlab.evolution import GenerationKey
from baldwinlab.experiment import BaseExperiment, Experiment, ExperimentError, assign, validate
from baldwinlab.experiment.class_builder import choosing_fields
from baldwinlab.experiment.registry import table_name
from baldwinlab.models.miniworld.allocation import list_parts, make_state
from baldwinlab.models.miniworld.backends.cpu import code_key
from baldwinlab.parts.breeding import breeding_part
from baldwinlab.parts.lifetimes import make_lifetimes, record_types
from baldwinlab.parts.model_part import Model
from baldwinlab.parts.part import BREEDING_KINDS, Part
from baldwinlab.parts.selection import Generation
from baldwinlab.parts.variation import Brood, Mating

CHOICE_PATHS: Final = {kind: path for path, kind, _ in choosing_fields(Experiment)} | {
    "model": "model"
}
"""The setting that chooses the part, by kind of part: "learning rule" -> "learning.rule"."""
LISTED_KINDS: Final = ("sense", "world feature")
"""Kinds of part. An experiment can have several parts of one such kind."""
WORLD_SETTINGS: Final[Mapping[str, Any]] = {
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
"""Settings of the experiments that use the model MiniWorld."""
COMMON_SETTINGS: Final[Mapping[str, Any]] = {
    "population": {"size": 5},
    "evolution": {"generations": 2},
}
"""Settings of the experiments that use any model."""
SEED: Final = 11
"""Default seed of the random worlds."""
N_WEIGHTS: Final = 8
"""Default number of weights of a module in the arguments of hooks of reproduction."""
LEARNING_RATE: Final = 0.5
"""High learning rate. With a low rate, rounding errors could hide a wrong rule."""
ITEM_FEATURE: Final = "patches"
"""A world feature that adds items."""
RULE_OF_MODULES: Final = {1: "none", 2: "self-taught"}
"""Learning rules, by the number of modules in the genome of a learner."""
POPULATION_SIZES: Final = (1, 2, 17, 20)
"""Numbers of agents for models other than MiniWorld."""


class PartGroup(NamedTuple):
    """Parts that are checked in the same experiment."""

    parts: tuple[type[Part], ...]
    experiment: Any
    seed: int = SEED  # Seed of the random worlds.
    # Hashes of simulations in plain Python, by the description of the case. Empty if plain Python
    # was not checked.
    plain_bits: Mapping[str, Sequence[str]] = {}

    @property
    def label(self) -> str:
        """Return the labels of the parts, for messages."""
        return " and ".join(map(part_label, self.parts))


def part_label(part: type[Part]) -> str:
    """Return the kind and the name of a part, such as "learning rule 'self-taught'"."""
    return f"{part.kind} {part.name!r}"


def group_parts(parts: Iterable[type[Part]], seed: int = SEED) -> Iterator[PartGroup]:
    """Yield the parts in groups that fit in one experiment, each with as few parts as possible."""
    parts_of_kind: dict[str, list[type[Part]]] = {}
    for part in parts:
        parts_of_kind.setdefault(part.kind, []).append(part)
    for model in parts_of_kind.pop("model", []):
        if issubclass(model, Model):
            yield _group_model(model, parts_of_kind, seed)
    listed = tuple(part for kind in LISTED_KINDS for part in parts_of_kind.pop(kind, []))
    # A row has at most one part of each kind.
    rows: Iterable[tuple[type[Part] | None, ...]] = zip_longest(*parts_of_kind.values())
    if listed and not parts_of_kind:
        # `zip_longest` without lists yields no row, but the listed parts need one.
        rows = [()]
    for row in rows:
        members = (*listed, *(part for part in row if part))
        yield PartGroup(members, _make_experiment(members), seed)


def _group_model(
    model: type[Model], parts_of_kind: dict[str, list[type[Part]]], seed: int
) -> PartGroup:
    """Return the group of a model and the parts of reproduction. Remove these from the dict."""
    breeding = [part for kind in BREEDING_KINDS for part in parts_of_kind.pop(kind, [])]
    settings: dict[str, Any] = {"model": model.name, **COMMON_SETTINGS}
    settings["evolution"] = {"generations": 2} | {part.kind: part.name for part in breeding}
    if model.check_settings:
        settings[table_name(model.name)] = dict(model.check_settings)
    return PartGroup((model, *breeding), validate(settings), seed)


def _make_experiment(parts: tuple[type[Part], ...]) -> Any:
    kinds = {part.kind: part.name for part in parts}
    # Networks and inheritances have hooks for agents that learn.
    default_rule = "self-taught" if kinds.keys() & {"network", "inheritance"} else "none"
    learning = {"rule": kinds.get("learning rule", default_rule), "rate": LEARNING_RATE}
    experiment = validate({**WORLD_SETTINGS, **COMMON_SETTINGS, "learning": learning})
    if "inheritance" in kinds:
        experiment = experiment.replace(evolution={"lamarckian_share": 0.5})
    listed = {kind: [part.name for part in parts if part.kind == kind] for kind in LISTED_KINDS}
    senses = list(dict.fromkeys(["food", *listed["sense"]]))
    settings = [f"senses.kinds={senses}", f"world.features={listed['world feature']}"]
    for part in parts:
        settings += [f"{path}={value}" for path, value in part.required_settings.items()]
    settings += [
        f"{CHOICE_PATHS[part.kind]}={part.name}" for part in parts if part.kind not in LISTED_KINDS
    ]
    return assign(experiment, settings)


def is_of_miniworld(experiment: BaseExperiment) -> bool:
    """Return whether an experiment has the settings of MiniWorld."""
    return isinstance(experiment, Experiment)


def part_values(experiment: Any, part: type[Part], state: Any = None) -> Any:
    """Return the argument `part` of hooks. `state`: None for a new state of one world."""
    if part.kind in BREEDING_KINDS and state is None:
        return breeding_part(experiment, part.kind)[0]
    state = make_state(experiment, 1) if state is None else state
    return next(values for _, values in list_parts(state) if type(values).part is part)


def breeding_arguments(
    random: np.random.Generator, experiment: BaseExperiment, weights: int = N_WEIGHTS
) -> dict[str, Any]:
    """Return random arguments of the hooks of reproduction, by name."""
    agents = 5
    modules = len(experiment.modules)
    # Genomes [module, weight] of both parents, the child, and the agent with offspring.
    genome = random.normal(size=(4, modules, weights)).astype(np.float32)
    fitter, second, child, innate = genome
    genomes = random.normal(size=(agents, modules, weights)).astype(np.float32)
    fitness = np.round(random.uniform(0, 4, agents))
    uniforms = random.random((agents, 2, 4))
    # Breeding stores the numbers of successive genes side by side, as vectorized code needs them.
    draws = np.asfortranarray(random.random((modules * weights, 4)))
    lifetimes = draw_lifetimes(random, experiment, genomes)
    parents = np.full((agents, 2), -1, np.int32)
    return {
        "fitness": fitness,
        "genome": genome,
        "lifetimes": lifetimes,
        "generation": Generation(
            stream=Stream(0, 0, 1, SELECTION_STREAM),
            lifetimes=lifetimes,
            fitness=fitness,
            uniforms=uniforms,
            shares=np.zeros(agents),
            order=np.zeros(agents, np.int64),
            parents=parents,
        ),
        "mating": Mating(fitter, second, draws, float(random.random()), child),
        "brood": Brood(GenerationKey(0, 0, 1), genome, fitness, parents, draws, genome.copy()),
        "count": 1,
        "innate": innate[0],
        "learned": random.normal(size=weights).astype(np.float32),
        "innate_genome": innate,
        "inherited_genome": innate.copy(),
        "taught": innate[-1].copy(),
    }


def draw_lifetimes(random: np.random.Generator, experiment: BaseExperiment, genome: Any) -> Any:
    """Return random results of the lifetimes of genomes [agent, module, weight]."""
    n_agents = len(genome)
    return make_lifetimes(
        genome,
        random.uniform(-2, 8, n_agents),
        random.random(n_agents),
        eaten=random.integers(0, 9, (n_agents, 2)).astype(np.int32),
        position=random.uniform(0, 400, (n_agents, 2)).astype(np.float32),
        records={
            name: random.uniform(0, 9, n_agents).astype(dtype)
            for name, dtype in record_types(experiment).items()
        },
    )


class CaseSettings(NamedTuple):
    """Settings of a case for MiniWorld: its size, and its differences from the group."""

    agents: int
    update: str
    changes_modules: bool
    adds_items: bool
    steps: int


CASE_SETTINGS: Final = (
    CaseSettings(1, "sequential", changes_modules=False, adds_items=False, steps=30),
    CaseSettings(2, "simultaneous", changes_modules=True, adds_items=True, steps=12),
    CaseSettings(17, "sequential", changes_modules=True, adds_items=True, steps=8),
    CaseSettings(20, "simultaneous", changes_modules=False, adds_items=True, steps=6),
    CaseSettings(2, "sequential", changes_modules=False, adds_items=False, steps=20),
    CaseSettings(1, "simultaneous", changes_modules=True, adds_items=True, steps=12),
    CaseSettings(17, "simultaneous", changes_modules=False, adds_items=False, steps=6),
    CaseSettings(20, "sequential", changes_modules=True, adds_items=False, steps=8),
)
"""Cases in which all pairs of values occur, except of `steps`. Plain Python takes seconds."""


class Case(NamedTuple):
    """A small world in which a group of parts is checked."""

    description: str  # The settings of the case, for messages.
    experiment: Any
    has_items: bool = False  # Whether a feature adds items to the experiment of the group.
    # Whether the case needs the same compiled code as the experiment of the group.
    is_same_code: bool = True


def make_cases(group: PartGroup) -> Iterator[Case]:
    """Yield the cases of a group, without the combinations that its parts refuse."""
    if not is_of_miniworld(group.experiment):
        for agents in POPULATION_SIZES:
            with suppress(ExperimentError):
                experiment = group.experiment.replace(population={"size": agents})
                yield Case(format_count(agents, "agent"), experiment)
        return
    for settings in CASE_SETTINGS:
        with suppress(ExperimentError):
            yield _make_miniworld_case(group, settings)


def _make_miniworld_case(group: PartGroup, settings: CaseSettings) -> Case:
    lifetime = {"update": settings.update, "steps": settings.steps}
    base = group.experiment.replace(population={"size": settings.agents}, lifetime=lifetime)
    experiment = _change_modules(group, base) if settings.changes_modules else base
    if settings.adds_items:
        features = dict.fromkeys([*experiment.world.features, ITEM_FEATURE])
        experiment = assign(experiment, [f"world.features={list(features)}"])
    return Case(
        description=_describe(experiment, settings.adds_items),
        experiment=experiment,
        has_items=settings.adds_items,
        is_same_code=code_key(experiment) == code_key(base),
    )


def _change_modules(group: PartGroup, experiment: Any) -> Any:
    """Return the experiment with two modules instead of one, or one instead of two.

    The learning rule defines the number of modules. If the group has only learning rules, the
    experiment does not change.
    """
    if all(part.kind == "learning rule" for part in group.parts):
        return experiment
    n_modules = 2 if len(experiment.modules) == 1 else 1
    rule = RULE_OF_MODULES[n_modules]
    return assign(experiment, [f"learning.rule={rule}"])


def _describe(experiment: Any, has_items: bool) -> str:
    modules = format_count(len(experiment.modules), "module")
    items = ", items of a world feature" if has_items else ""
    agents = format_count(experiment.population.size, "agent")
    return f"{agents}, {experiment.lifetime.update} update, genomes of {modules}{items}"
