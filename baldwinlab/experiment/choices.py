"""Which parts there are, by kind and name: what a choosing field of an experiment may say.

A built-in part is known by name before its module is loaded, so that to read an experiment loads no engine. So is one of the
library, which is written as a user's own would be and comes with the package. A foreign part is known as soon as its class
exists. Nothing here knows what a part does.
"""

from __future__ import annotations

from collections.abc import Mapping
from importlib import import_module
from typing import Any, Final, NamedTuple

from pydantic import GetCoreSchemaHandler, GetJsonSchemaHandler
from pydantic_core import CoreSchema, PydanticCustomError, core_schema

from baldwinlab.suggestions import did_you_mean, list_names

_MINIWORLD, _EVOLUTION, _LIBRARY = (
    "baldwinlab.models.miniworld",
    "baldwinlab.evolution",
    "baldwinlab.library",
)

# Kind -> name -> where its class is. These names, and those of the library, can never be taken.
BUILT_IN: Final[Mapping[str, Mapping[str, str]]] = {
    "model": {"miniworld": "baldwinlab.experiment.miniworld:Experiment"},
    "sense": {"food": f"{_MINIWORLD}.senses:Sight"},
    "body": {"walker": f"{_MINIWORLD}.bodies:Walker"},
    "network": {"feed-forward": f"{_MINIWORLD}.networks:FeedForward"},
    "learning rule": {
        "none": f"{_MINIWORLD}.learning:NoLearning",
        "self-taught": f"{_MINIWORLD}.learning:SelfTaught",
        "drift": f"{_MINIWORLD}.learning:Drift",
    },
    "world feature": {},
    "selection": {
        "roulette": f"{_EVOLUTION}.selection:Roulette",
        "tournament": f"{_EVOLUTION}.selection:Tournament",
        "truncation": f"{_EVOLUTION}.selection:Truncation",
        "rank": f"{_EVOLUTION}.selection:Rank",
        "neutral": f"{_EVOLUTION}.selection:Neutral",
    },
    "variation": {"crossover": f"{_EVOLUTION}.variation:Crossover"},
    "inheritance": {
        "darwinian": f"{_EVOLUTION}.inheritance:Darwinian",
        "none": f"{_EVOLUTION}.inheritance:NoInheritance",
    },
    "fitness": {"energy": f"{_EVOLUTION}.fitness:Energy"},
}
LIBRARY: Final[Mapping[str, Mapping[str, str]]] = {
    "model": {
        "cell-foragers": f"{_LIBRARY}.models.cells:CellForagers",
        "cue-learners": f"{_LIBRARY}.models.cues:CueLearners",
        "digit-readers": f"{_LIBRARY}.models.digits:DigitReaders",
        "erl-populations": f"{_LIBRARY}.models.erl.model:ErlPopulations",
        "hinton-nowlan": f"{_LIBRARY}.models.needle:HintonNowlan",
        "moving-needle": f"{_LIBRARY}.models.moving:MovingNeedle",
        "neat-poles": f"{_LIBRARY}.neat.poles:NeatPoles",
        "neat-poles-without-velocities": f"{_LIBRARY}.neat.unseen_velocities:UnseenVelocities",
        "light-switch": f"{_LIBRARY}.models.lightswitch:LightSwitch",
        "neat-xor": f"{_LIBRARY}.neat.xor:NeatXor",
        "nk-climbers": f"{_LIBRARY}.models.landscapes:NKClimbers",
        "slope-climbers": f"{_LIBRARY}.models.gain:SlopeClimbers",
        "plastic-prisoners": f"{_LIBRARY}.models.prisoners:PlasticPrisoners",
        "t-mazes": f"{_LIBRARY}.models.mazes:TMazes",
    },
    "sense": {
        "compass": f"{_LIBRARY}.senses:Compass",
        "energy": f"{_LIBRARY}.measures:Energy",
        "last-action": f"{_LIBRARY}.senses:LastAction",
        "nearest": f"{_LIBRARY}.measures:Nearest",
        "neighbours": f"{_LIBRARY}.senses:Neighbours",
        "patch": f"{_LIBRARY}.senses:PatchSight",
        "rays": f"{_LIBRARY}.measures:Rays",
        "smell": f"{_LIBRARY}.measures:Smell",
        "touch": f"{_LIBRARY}.senses:Touch",
    },
    "body": {
        "continuous": f"{_LIBRARY}.bodies:Continuous",
        "grid": f"{_LIBRARY}.bodies:Grid",
        "stay": f"{_LIBRARY}.bodies:Stay",
    },
    "network": {
        "continuous-time": f"{_LIBRARY}.recurrent:ContinuousTime",
        "growing": f"{_LIBRARY}.neat.network:Growing",
        "simple-recurrent": f"{_LIBRARY}.recurrent:SimpleRecurrent",
    },
    "learning rule": {
        "abcd": f"{_LIBRARY}.abcd:ABCD",
        "covariance": f"{_LIBRARY}.plasticity:Covariance",
        "crbp": f"{_LIBRARY}.rewards:Complementary",
        "evolved-abcd": f"{_LIBRARY}.abcd:EvolvedABCD",
        "evolved-modulated": f"{_LIBRARY}.abcd:EvolvedModulated",
        "hebb": f"{_LIBRARY}.plasticity:Hebb",
        "imitation": f"{_LIBRARY}.teachers:Imitation",
        "modulated": f"{_LIBRARY}.abcd:Modulated",
        "postsynaptic": f"{_LIBRARY}.plasticity:Postsynaptic",
        "prediction": f"{_LIBRARY}.prediction:Prediction",
        "presynaptic": f"{_LIBRARY}.plasticity:Presynaptic",
        "random-prediction": f"{_LIBRARY}.prediction:RandomPrediction",
        "random-targets": f"{_LIBRARY}.teachers:RandomTargets",
        "reward": f"{_LIBRARY}.rewards:Reward",
        "supervised": f"{_LIBRARY}.teachers:Supervised",
    },
    "world feature": {
        "births-and-deaths": f"{_LIBRARY}.turnover:BirthsAndDeaths",
        "drifting-food": f"{_LIBRARY}.worlds:DriftingFood",
        "patches": f"{_LIBRARY}.worlds:Patches",
        "regions-in-turn": f"{_LIBRARY}.worlds:RegionsInTurn",
        "slow-regrowth": f"{_LIBRARY}.worlds:SlowRegrowth",
        "walls": f"{_LIBRARY}.worlds:Walls",
    },
    "selection": {
        "best-copies": f"{_LIBRARY}.breeding:BestCopies",
        "expected-offspring": f"{_LIBRARY}.breeding:ExpectedOffspring",
        "larger-tournament": f"{_LIBRARY}.breeding:LargerTournament",
        "outcrossing": f"{_LIBRARY}.breeding:Outcrossing",
        "species": f"{_LIBRARY}.neat.parts:Species",
    },
    "variation": {
        "bit-flips": f"{_LIBRARY}.models.landscapes:BitFlips",
        "copy": f"{_LIBRARY}.breeding:Copy",
        "few-mutations": f"{_LIBRARY}.models.cells:FewMutations",
        "four-bit-weights": f"{_LIBRARY}.models.digits:FourBitWeights",
        "gaussian": f"{_LIBRARY}.breeding:Gaussian",
        "gene-pool": f"{_LIBRARY}.breeding:GenePool",
        "neat": f"{_LIBRARY}.neat.parts:Neat",
        "one-point-alleles": f"{_LIBRARY}.models.needle:OnePointOfAlleles",
        "one-point-bits": f"{_LIBRARY}.models.lightswitch:OnePointOfBits",
        "one-point-of-units": f"{_LIBRARY}.models.cues:OnePointOfUnits",
        "one-point-crossover": f"{_LIBRARY}.breeding:OnePointCrossover",
    },
    "inheritance": {"social-heredity": f"{_LIBRARY}.heredity:SocialHeredity"},
    "fitness": {},
}
_FOREIGN: dict[str, dict[str, type]] = {kind: {} for kind in BUILT_IN}


class Choice(NamedTuple):
    """Marks the field that chooses parts of a kind, `Annotated[str, Choice("selection")]`: one, or (in a tuple) any number."""

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
                "unknown_part", "{refusal}", {"refusal": refusal(self.kind, name)}
            )
        return name


def packaged(kind: str) -> dict[str, str]:
    """What comes with the package, the built-in parts first: where each class is, by name."""
    return {**BUILT_IN[kind], **LIBRARY.get(kind, {})}


def names(kind: str) -> list[str]:
    """What may be chosen, the built-in ones first."""
    return [*packaged(kind), *_FOREIGN[kind]]


def is_here(kind: str, name: str) -> bool:
    """Whether there is a part of that name."""
    return any(name in known[kind] for known in (BUILT_IN, LIBRARY, _FOREIGN))


def foreign() -> dict[tuple[str, str], type]:
    """The classes of all foreign parts that have been loaded, by kind and name."""
    return {(kind, name): part for kind, parts in _FOREIGN.items() for name, part in parts.items()}


def find(kind: str, name: str) -> Any:
    """The class of a part. Raises KeyError for one that is not here."""
    if name in _FOREIGN[kind]:
        return _FOREIGN[kind][name]
    module, _, attribute = (BUILT_IN[kind].get(name) or LIBRARY[kind][name]).partition(":")
    return getattr(import_module(module), attribute)


def is_built_in(kind: str, name: str, module: str) -> bool:
    """Whether the class of that name in that module comes with the package. Raises ValueError where it takes a name of those."""
    there = packaged(kind).get(name)
    if there is None:
        return False
    if there.partition(":")[0] != module:
        raise ValueError(f"{name!r} is a built-in {kind}; a part of one's own needs another name")
    return True


def add(kind: str, name: str, part: type) -> None:
    """Make a foreign part known, in the place of one of the same name that was loaded before."""
    _FOREIGN[kind][name] = part


def forget(kind: str, name: str) -> None:
    _FOREIGN[kind].pop(name, None)


def refusal(kind: str, name: str) -> str:
    """What is said of a name that is not known."""
    quoted = list_names(repr(name), map(repr, names(kind)))
    hint = did_you_mean(name, names(kind))
    return f"there is no such {kind}{hint}; {quoted}; --part FILE loads a custom {kind}"


def own_fields(kind: str, name: str) -> Any:
    """The class of a part that has fields of its own; None for any other, also for every built-in one."""
    part: Any = find(kind, name) if name in LIBRARY.get(kind, {}) else _FOREIGN[kind].get(name)
    return part if part is not None and part.model_fields else None


def key_of(name: str) -> str:
    """The table of a part: its name, with underscores for hyphens."""
    return name.replace("-", "_")
