"""Names of the parts of each kind, and the module of the class of each part.

The names of the parts of the package are available before the modules are loaded, so that reading
an experiment does not load the engine. A custom part is registered when its class is created.
"""

from __future__ import annotations

import re
import sys
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from functools import cache
from importlib import import_module
from pathlib import Path
from typing import Any, Final, NamedTuple

from pydantic import GetCoreSchemaHandler, GetJsonSchemaHandler
from pydantic_core import CoreSchema, PydanticCustomError, core_schema

from baldwinlab.core.errors import PartError
from baldwinlab.core.names import SPECIES_NAME, describe_pattern, did_you_mean, list_names

_EVOLUTION: Final = "baldwinlab.evolution"
_MODELS: Final = "baldwinlab.models"
_MINIWORLD: Final = "baldwinlab.models.miniworld"

# Kind -> name -> module and class. `LIBRARY` has the other parts of the package. A custom part
# needs a name that is in neither of them.
BUILT_IN: Final[Mapping[str, Mapping[str, str]]] = {
    "model": {"miniworld": "baldwinlab.experiment.miniworld:Experiment"},
    "sense": {"food": f"{_MINIWORLD}.senses.sight:Sight"},
    "body": {"walker": f"{_MINIWORLD}.bodies:Walker"},
    "network": {"feed-forward": f"{_MINIWORLD}.networks.feed_forward:FeedForward"},
    "learning rule": {
        "none": f"{_MINIWORLD}.learning.teachers:NoLearning",
        "self-taught": f"{_MINIWORLD}.learning.teachers:SelfTaught",
    },
    "world feature": {},
    "selection": {
        "roulette": f"{_EVOLUTION}.proportional_selection:Roulette",
        "tournament": f"{_EVOLUTION}.ordinal_selection:Tournament",
        "truncation": f"{_EVOLUTION}.ordinal_selection:Truncation",
        "rank": f"{_EVOLUTION}.ordinal_selection:Rank",
        "neutral": f"{_EVOLUTION}.proportional_selection:Neutral",
    },
    "variation": {"crossover": f"{_EVOLUTION}.variation_operators:Crossover"},
    "inheritance": {
        "darwinian": f"{_EVOLUTION}.inheritance:Darwinian",
        "none": f"{_EVOLUTION}.inheritance:NoInheritance",
    },
    "fitness": {"energy": f"{_EVOLUTION}.fitness:Energy"},
    "stop": {"none": f"{_EVOLUTION}.stop:NoStop"},
}
LIBRARY: Final[Mapping[str, Mapping[str, str]]] = {
    "model": {
        "bandit-explorers": f"{_MODELS}.bandit_explorers:BanditExplorers",
        "cell-foragers": f"{_MODELS}.cell_foragers:CellForagers",
        "cue-learners": f"{_MODELS}.cue_learners:CueLearners",
        "digit-readers": f"{_MODELS}.digit_readers:DigitReaders",
        "egg-layers": f"{_MODELS}.gain_functions:EggLayers",
        "erl-populations": f"{_MODELS}.erl_populations:ErlPopulations",
        "function-climbers": f"{_MODELS}.function_climbers:FunctionClimbers",
        "hinton-nowlan": f"{_MODELS}.hinton_nowlan:HintonNowlan",
        "lattice-walkers": f"{_MODELS}.lattice_walkers:LatticeWalkers",
        "linear-norms": f"{_MODELS}.quantitative_traits:LinearNorms",
        "moving-needle": f"{_MODELS}.hinton_nowlan:MovingNeedle",
        "moving-optimum": f"{_MODELS}.quantitative_traits:MovingOptimum",
        "neat-poles": f"{_MODELS}.neat_poles:NeatPoles",
        "neat-poles-without-velocities": (f"{_MODELS}.neat_poles:UnseenVelocities"),
        "light-switch": f"{_MODELS}.light_switch:LightSwitch",
        "neat-xor": f"{_MODELS}.neat_networks:NeatXor",
        "nk-climbers": f"{_MODELS}.nk_climbers:NKClimbers",
        "slope-climbers": f"{_MODELS}.gain_functions:SlopeClimbers",
        "plastic-elements": f"{_MODELS}.plastic_elements:PlasticElements",
        "plastic-prisoners": f"{_MODELS}.plastic_prisoners:PlasticPrisoners",
        "t-mazes": f"{_MODELS}.t_mazes:TMazes",
        "two-state-forager": f"{_MODELS}.two_state_forager:TwoStateForager",
    },
    "sense": {
        "compass": f"{_MINIWORLD}.senses.binary:Compass",
        "energy": f"{_MINIWORLD}.senses.real_valued:EnergySense",
        "food-rays": f"{_MINIWORLD}.senses.rays:FoodRays",
        "last-action": f"{_MINIWORLD}.senses.binary:LastAction",
        "nearest": f"{_MINIWORLD}.senses.real_valued:Nearest",
        "neighbours": f"{_MINIWORLD}.senses.other_agents:Neighbours",
        "patch": f"{_MINIWORLD}.senses.binary:PatchSight",
        "rays": f"{_MINIWORLD}.senses.rays:Rays",
        "smell": f"{_MINIWORLD}.senses.real_valued:Smell",
        "species-in-sight": f"{_MINIWORLD}.senses.other_agents:SpeciesInSight",
        "species-nearness": f"{_MINIWORLD}.senses.other_agents:SpeciesNearness",
        "touch": f"{_MINIWORLD}.senses.binary:Touch",
    },
    "body": {
        "continuous": f"{_MINIWORLD}.bodies:Continuous",
        "grid": f"{_MINIWORLD}.bodies:Grid",
        "stay": f"{_MINIWORLD}.bodies:Stay",
    },
    "network": {
        "continuous-time": f"{_MINIWORLD}.networks.recurrent:ContinuousTime",
        "neat": f"{_MINIWORLD}.networks.neat:NeatNetwork",
        "simple-recurrent": f"{_MINIWORLD}.networks.recurrent:SimpleRecurrent",
    },
    "learning rule": {
        "abcd": f"{_MINIWORLD}.learning.hebbian:ABCD",
        "covariance": f"{_MINIWORLD}.learning.hebbian:Covariance",
        "crbp": f"{_MINIWORLD}.learning.reward:Complementary",
        "evolved-abcd": f"{_MINIWORLD}.learning.hebbian:EvolvedABCD",
        "evolved-modulated": f"{_MINIWORLD}.learning.hebbian:EvolvedModulated",
        "hebb": f"{_MINIWORLD}.learning.hebbian:Hebb",
        "imitation": f"{_MINIWORLD}.learning.teachers:Imitation",
        "modulated": f"{_MINIWORLD}.learning.hebbian:Modulated",
        "postsynaptic": f"{_MINIWORLD}.learning.hebbian:Postsynaptic",
        "prediction": f"{_MINIWORLD}.learning.prediction:Prediction",
        "presynaptic": f"{_MINIWORLD}.learning.hebbian:Presynaptic",
        "random-prediction": f"{_MINIWORLD}.learning.prediction:RandomPrediction",
        "random-targets": f"{_MINIWORLD}.learning.teachers:RandomTargets",
        "reward": f"{_MINIWORLD}.learning.reward:Reward",
        "supervised": f"{_MINIWORLD}.learning.teachers:Supervised",
    },
    "world feature": {
        "births-and-deaths": f"{_MINIWORLD}.features.births_and_deaths:BirthsAndDeaths",
        "drifting-food": f"{_MINIWORLD}.features.food:DriftingFood",
        "patches": f"{_MINIWORLD}.features.food:Patches",
        "regions-in-turn": f"{_MINIWORLD}.features.food:RegionsInTurn",
        "slow-regrowth": f"{_MINIWORLD}.features.food:SlowRegrowth",
        "walls": f"{_MINIWORLD}.features.walls:Walls",
    },
    "selection": {
        "best-copies": f"{_EVOLUTION}.ordinal_selection:BestCopies",
        "expected-offspring": f"{_EVOLUTION}.proportional_selection:ExpectedOffspring",
        "fitness-sharing": f"{_EVOLUTION}.diversity_selection:FitnessSharing",
        "larger-tournament": f"{_EVOLUTION}.ordinal_selection:LargerTournament",
        "lexicase": f"{_EVOLUTION}.diversity_selection:Lexicase",
        "mu-plus-lambda": f"{_EVOLUTION}.ordinal_selection:MuPlusLambda",
        "mutant-fixation": f"{_MODELS}.lattice_walkers:MutantFixation",
        "outcrossing": f"{_EVOLUTION}.proportional_selection:Outcrossing",
        "species": f"{_EVOLUTION}.neat.operators:SpeciesSelection",
    },
    "variation": {
        "bit-flips": f"{_MODELS}.discrete_variation:BitFlips",
        "copy": f"{_EVOLUTION}.variation_operators:Copy",
        "few-mutations": f"{_MODELS}.cell_foragers:FewMutations",
        "four-bit-weights": f"{_MODELS}.discrete_variation:FourBitWeights",
        "gaussian": f"{_EVOLUTION}.variation_operators:Gaussian",
        "gene-pool": f"{_EVOLUTION}.variation_operators:GenePool",
        "infinitesimal": f"{_EVOLUTION}.variation_operators:Infinitesimal",
        "lattice-steps": f"{_MODELS}.lattice_walkers:LatticeSteps",
        "neat": f"{_EVOLUTION}.neat.operators:Neat",
        "one-point-alleles": f"{_MODELS}.discrete_variation:OnePointOfAlleles",
        "one-point-bits": f"{_MODELS}.discrete_variation:OnePointOfBits",
        "one-point-of-units": f"{_MODELS}.cue_learners:OnePointOfUnits",
        "one-point-crossover": f"{_EVOLUTION}.variation_operators:OnePointCrossover",
        "self-adaptive": f"{_EVOLUTION}.variation_operators:SelfAdaptive",
    },
    "inheritance": {"social-heredity": f"{_EVOLUTION}.inheritance:SocialHeredity"},
    "fitness": {
        "distance": f"{_MINIWORLD}.behavior_fitness:Distance",
        "early-food": f"{_MINIWORLD}.behavior_fitness:EarlyFood",
        "novelty": f"{_MINIWORLD}.behavior_fitness:Novelty",
    },
    "stop": {
        "fixation": f"{_EVOLUTION}.stop:Fixation",
        "stagnation": f"{_EVOLUTION}.stop:Stagnation",
        "target-fitness": f"{_EVOLUTION}.stop:TargetFitness",
    },
}
_CUSTOM_PARTS: dict[str, dict[str, type]] = {kind: {} for kind in BUILT_IN}
EXECUTION_HINT: Final = "which executes the code in the file"
PART_HINT: Final = f"load it with --part FILE, {EXECUTION_HINT}"
# Kind and name of each custom part that was added or removed, in order.
_CHANGES: list[tuple[str, str]] = []
# The parts that were added within `require_unique_parts`. None: outside it.
_unique_parts: dict[tuple[str, str], type] | None = None
# Returns the origin of a custom part, an object with a method `load` that loads the part again. The
# package `parts` sets this function when it is imported. Every custom part needs this package.
_find_origin: Callable[[type], Any]


class PartChoice(NamedTuple):
    """Mark of a setting that chooses parts of a kind: `Annotated[str, PartChoice("selection")]`."""

    kind: str

    def __get_pydantic_core_schema__(
        self, source: Any, handler: GetCoreSchemaHandler
    ) -> CoreSchema:
        return core_schema.with_info_after_validator_function(self._check, handler(source))

    def __get_pydantic_json_schema__(
        self, schema: CoreSchema, handler: GetJsonSchemaHandler
    ) -> dict[str, Any]:
        return handler(schema) | {"x-chooses": self.kind}

    def _check(self, name: str, info: Any) -> str:
        if name not in names(self.kind) and not (info.context or {}).get("lenient"):
            raise PydanticCustomError(
                "unknown_part", "{message}", {"message": unknown_part_message(self.kind, name)}
            )
        return name


def package_parts(kind: str) -> dict[str, str]:
    """Return the location "module:Class" of each part of the package, by name."""
    return {**BUILT_IN[kind], **LIBRARY.get(kind, {})}


def names(kind: str) -> list[str]:
    """Return the names of all parts of a kind."""
    return [*package_parts(kind), *_CUSTOM_PARTS[kind]]


def is_available(kind: str, name: str) -> bool:
    """Return whether a part exists."""
    return any(name in parts[kind] for parts in (BUILT_IN, LIBRARY, _CUSTOM_PARTS))


def custom_parts() -> dict[tuple[str, str], type]:
    """Return the classes of the loaded custom parts, by kind and name."""
    return {
        (kind, name): part for kind, parts in _CUSTOM_PARTS.items() for name, part in parts.items()
    }


def find_class(kind: str, name: str) -> Any:
    """Return the class of a part. Raises KeyError if there is no such part."""
    if name in _CUSTOM_PARTS[kind]:
        return _CUSTOM_PARTS[kind][name]
    return _import_class(BUILT_IN[kind].get(name) or LIBRARY[kind][name])


@cache
def _import_class(location: str) -> Any:
    """Return the class at a location such as "module:Class"."""
    module, _, class_name = location.partition(":")
    return getattr(import_module(module), class_name)


def is_built_in(kind: str, name: str, module: str) -> bool:
    """Return whether a class is a part of the package.

    Raise ValueError if a class of another module has the name of a part of the package.
    """
    location = package_parts(kind).get(name)
    if location is None:
        return False
    if location.partition(":")[0] != module:
        raise ValueError(f"{name!r} is a built-in {kind}; a custom part needs another name")
    return True


def add(kind: str, name: str, part: type) -> None:
    """Register a custom part. It replaces a custom part of the same name.

    Raise PartError within `require_unique_parts` if it would replace a part that was added there.
    """
    # Tables, files and commands contain the name.
    if not isinstance(name, str) or not re.fullmatch(SPECIES_NAME, name):
        raise ValueError(f"the {kind} {name!r}: its name {describe_pattern(SPECIES_NAME)}")
    if _unique_parts is not None:
        other_part = _unique_parts.setdefault((kind, name), part)
        if other_part is not part:
            raise PartError(
                f"{_name_source(other_part)} and {_name_source(part)} both define the {kind} "
                f"{name!r}: load one of them, or change the name in one of them"
            )
    _CUSTOM_PARTS[kind][name] = part
    _CHANGES.append((kind, name))


@contextmanager
def require_unique_parts() -> Iterator[None]:
    """Refuse two parts with one kind and name that are added within this context."""
    global _unique_parts
    previous_parts = _unique_parts
    # Each file is a context within the context of all files of a command.
    _unique_parts = {} if previous_parts is None else previous_parts
    try:
        yield
    finally:
        _unique_parts = previous_parts


def _name_source(part: type) -> str:
    file = getattr(sys.modules.get(part.__module__), "__file__", None)
    return f"{part.__qualname__} of {file or part.__module__}"


def remove(kind: str, name: str) -> None:
    """Remove a custom part."""
    _CUSTOM_PARTS[kind].pop(name, None)
    _CHANGES.append((kind, name))


def count_changes() -> int:
    """Return the number of added and removed custom parts, as a part of the keys of caches."""
    return len(_CHANGES)


def set_origin_finder(finder: Callable[[type], Any]) -> None:
    """Set the function that returns the origin of a custom part, see `_find_origin`."""
    global _find_origin
    _find_origin = finder


def find_origins(choices: Iterable[tuple[str, str]]) -> tuple[Any, ...]:
    """Return the origins of the loaded custom parts with these kinds and names, sorted."""
    loaded_parts = custom_parts()
    return tuple(
        _find_origin(loaded_parts[choice])
        for choice in sorted({*choices})
        if choice in loaded_parts
    )


def label_files(choices: Iterable[tuple[str, str]] | None = None) -> dict[str, str]:
    """Return the start of an error message by name of the file of each custom part.

    `choices`: kinds and names of the parts. Default: all loaded custom parts.
    """
    origins = find_origins(custom_parts() if choices is None else choices)
    return {Path(origin.file).name: f"{origin.describe()} fails" for origin in origins}


def unknown_part_message(kind: str, name: str) -> str:
    """Return the message about an unknown name of a part."""
    quoted = list_names(repr(name), map(repr, names(kind)))
    hint = did_you_mean(name, names(kind))
    return f"there is no such {kind}{hint}; {quoted}; --part FILE loads a custom {kind}"


def settings_class(kind: str, name: str) -> Any:
    """Return the class of an added part with settings, or None for any other part."""
    part: Any = (
        find_class(kind, name) if name in LIBRARY.get(kind, {}) else _CUSTOM_PARTS[kind].get(name)
    )
    return part if part is not None and part.model_fields else None


def table_name(name: str) -> str:
    """Return the name of a part's table: "larger_tournament" for "larger-tournament"."""
    return name.replace("-", "_")
