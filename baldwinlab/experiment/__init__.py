"""The experiment: everything that decides a result, apart from the seed.

An experiment is frozen and validated when it is made. Field defaults are the standard reading of the paper; every field
carries its meaning and unit, its limits are checked, and an unknown name is refused. TOML and Python show the same tree.

Source: the paper's section "Simulation setup"; the fields that name a reading (R1 to R8) are the choices that the paper
leaves open, see docs/model.md.
"""

from __future__ import annotations

import math
import tomllib
from collections.abc import Sequence
from typing import Annotated, Any, Literal, Self, get_args

from pydantic import BaseModel, ConfigDict, Field, ValidationError, field_validator, model_validator

NAME_PATTERN = r"^[A-Za-z0-9][A-Za-z0-9+_.-]*(/[A-Za-z0-9][A-Za-z0-9+_.-]*)*$"

Coordinate = Annotated[float, Field(ge=0, le=1_000_000)]


class ExperimentError(ValueError):
    """An experiment that cannot be: one line a fault, each with its path, the value and what is allowed."""


class Part(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False, strict=False, validate_default=True)

    @field_validator("*", mode="before")
    @classmethod
    def _no_number_from_truth(cls, value: Any, info: Any) -> Any:
        """`true` is not 1: Python would take it so, and hide a slip."""
        if isinstance(value, bool) and cls.model_fields[info.field_name].annotation is not bool:
            raise ValueError("true and false are not numbers")
        return value


class Start(Part):
    """Where agents are born: uniformly in a disc."""

    x: Coordinate = Field(160.0, description="centre of the disc, units of length")
    y: Coordinate = Field(160.0, description="centre of the disc, units of length; y points down")
    radius: float = Field(40.0, ge=0, le=1_000_000, description="radius of the disc, units of length")
    headings: Literal["equal", "random"] = Field(
        "equal", description="of newborns; equal: all along +x; random: each one of the 40 there are"
    )


class FoodRegion(Part):
    """A rectangle in which items lie uniformly; an eaten item reappears in its own region at once."""

    x: tuple[Coordinate, Coordinate] = Field(description="left and right edge, units of length")
    y: tuple[Coordinate, Coordinate] = Field(description="upper and lower edge, units of length")
    count: int = Field(50, ge=0, le=1_000_000, description="items in the region at any time")
    energy: float = Field(1.0, ge=0, le=1_000_000, description="energy that an item gives to its eater")

    @model_validator(mode="after")
    def _edges_in_order(self) -> Self:
        for axis, (low, high) in (("x", self.x), ("y", self.y)):
            if not low < high:
                raise ValueError(f"{axis} = [{low:g}, {high:g}] must go from a smaller to a larger number")
        return self


class World(Part):
    """The map: a torus, y pointing down, so that headings grow clockwise."""

    width: float = Field(640.0, ge=10, le=1_000_000, description="units of length")
    height: float = Field(640.0, ge=10, le=1_000_000, description="units of length")
    start: Start = Start()
    food: tuple[FoodRegion, ...] = Field((), max_length=64, description="food regions, none to 64")

    @model_validator(mode="after")
    def _everything_on_the_map(self) -> Self:
        if self.start.x >= self.width or self.start.y >= self.height:
            raise ValueError(
                f"start ({self.start.x:g}, {self.start.y:g}) must lie on the map of {self.width:g} x {self.height:g}"
            )
        if self.start.radius > min(self.width, self.height) / 2:
            raise ValueError(
                f"start.radius {self.start.radius:g} must be at most half the map, {min(self.width, self.height) / 2:g}"
            )
        for number, region in enumerate(self.food):
            if region.x[1] > self.width or region.y[1] > self.height:
                raise ValueError(f"food[{number}] must lie on the map of {self.width:g} x {self.height:g}")
        return self


class Population(Part):
    size: int = Field(20, ge=1, le=1_000_000, description="agents in the world, and in every generation (R6)")


class Senses(Part):
    visual_radius: float = Field(40.0, gt=0, le=100_000, description="distance to which an agent sees, units of length (R1)")
    boundaries: Literal["closed", "open"] = Field(
        "closed", description="closed: front takes 15 and 345 degrees; open: neither sensor does (R8)"
    )


class Contact(Part):
    shape: Literal["circle", "square"] = Field(
        "circle", description="circle: Euclidean distance of centres; square: the larger of its two components (R2)"
    )
    reach: float = Field(10.0, gt=0, le=100_000, description="an item nearer than this is touched, units of length (R2)")


class Motor(Part):
    noise: float = Field(
        0.0, ge=0, le=1, description="probability, in every step, that the action is drawn at random instead of chosen"
    )


class Network(Part):
    """Topology of the action module, and of the reinforcement module."""

    hidden: tuple[Annotated[int, Field(ge=1, le=1000)], ...] = Field(
        (10,), max_length=8, description="units in each hidden layer; [] for none"
    )
    biases: bool = Field(False, description="biases on hidden and output units, N(0, 1), evolved and learned like weights (R3)")


class Learning(Part):
    """What changes weights in life, and what controls for it."""

    rule: Literal["none", "self-taught", "drift"] = Field(
        "none",
        description="self-taught: backpropagation towards the reinforcement module; drift: each weight moves as far as "
        "self-teaching would have moved it, in a direction drawn at birth",
    )
    rate: float = Field(0.01, ge=0, le=10, description="learning rate, per step")
    evolved_rate: bool = Field(
        False, description="every agent inherits a gene g, like a weight, and learns at rate * 10^g, but at most at 10"
    )
    steps: int = Field(100_000_000, ge=0, le=100_000_000, description="steps of a life after which learning stops")
    teacher: Literal["inherited", "shuffled", "fresh"] = Field(
        "inherited",
        description="reinforcement modules of the children; shuffled: dealt anew among them; fresh: drawn from N(0, 1)",
    )
    cost_per_step: float = Field(0.0, ge=0, le=1_000_000, description="energy that a step of learning costs")
    cost_per_change: float = Field(
        0.0,
        ge=0,
        le=1_000_000,
        description="energy per unit of distance between an agent's weights at birth and at death",
    )


class Evolution(Part):
    generations: int = Field(100, ge=1, le=1_000_000, description="generations in a run")
    inheritance: Literal["darwinian", "none"] = Field(
        "darwinian", description="darwinian: what was born is inherited; none: all weights are drawn afresh every generation"
    )
    lamarckian_share: float = Field(
        0.0, ge=0, le=1, description="of what was learned in life that is inherited: 0 is Darwinian, 1 is Lamarckian"
    )
    selection: Literal["roulette", "tournament", "truncation", "rank"] = Field(
        "roulette", description="roulette wheel; tournament of 2; uniform from the upper half; linear rank (R4)"
    )
    mutation_gate: Literal["weight", "child"] = Field(
        "weight", description="one draw for every weight, or one for the child and then every weight (R5)"
    )
    mutation_rate: float = Field(0.05, ge=0, le=1, description="probability that the gate opens")
    mutation_size: float = Field(0.05, ge=0, le=1000, description="a mutation adds U(-size, size)")


class Lifetime(Part):
    steps: int = Field(5000, ge=1, le=100_000_000, description="time steps in a life")
    update: Literal["simultaneous", "sequential"] = Field(
        "simultaneous", description="sequential: agent after agent, each finds what the last one left (R7)"
    )


class Record(Part):
    genome_every: int = Field(
        1, ge=1, le=1_000_000, description="genomes are kept of every so-many-th generation, and of the last"
    )


class Experiment(Part):
    """One experimental condition, whole: same experiment and seed, same bits.

    >>> import baldwinlab as bl
    >>> bl.load("evo/A").replace(lifetime={"steps": 100}).lifetime.steps
    100
    """

    name: str = Field(
        "experiment", pattern=NAME_PATTERN, max_length=200, description="the condition's name, in results and figures"
    )
    world: World = World()
    population: Population = Population()
    senses: Senses = Senses()
    contact: Contact = Contact()
    motor: Motor = Motor()
    network: Network = Network()
    learning: Learning = Learning()
    evolution: Evolution = Evolution()
    lifetime: Lifetime = Lifetime()
    record: Record = Record()

    @model_validator(mode="after")
    def _reach_within_the_map(self) -> Self:
        half = min(self.world.width, self.world.height) / 2
        for path, value in (("senses.visual_radius", self.senses.visual_radius), ("contact.reach", self.contact.reach)):
            if value > half:
                raise ValueError(f"{path} {value:g} must be at most half the map, {half:g}, or a thing would be seen twice")
        return self

    @property
    def learns(self) -> bool:
        return self.learning.rule != "none"

    @property
    def modules(self) -> tuple[str, ...]:
        """The networks in a genome."""
        return ("action", "reinforcement") if self.learning.rule in ("self-taught", "drift") else ("action",)

    @property
    def layer_sizes(self) -> tuple[int, ...]:
        """Units from the three sensors (left, front, right) to the three actions (left, forward, right)."""
        return (3, *self.network.hidden, 3)

    @property
    def weight_count(self) -> int:
        """Weights in one module."""
        bias = int(self.network.biases)
        return sum((inputs + bias) * outputs for inputs, outputs in zip(self.layer_sizes, self.layer_sizes[1:], strict=False))

    @property
    def genome_length(self) -> int:
        """Entries for each module: its weights, and the gene of the learning rate if that evolves (used in the action module)."""
        return self.weight_count + int(self.learning.evolved_rate)

    def replace(self, **changes: Any) -> Experiment:
        """A changed copy. A part may be given whole, or as a dict of the fields to change.

        Raises ExperimentError when the copy would not be valid.
        """
        return validate(merge(self.to_dict(), _plain(changes)))

    def to_dict(self) -> dict[str, Any]:
        return self.model_dump(mode="json")


def _plain(value: Any) -> Any:
    if isinstance(value, BaseModel):
        return value.model_dump(mode="json")
    if isinstance(value, dict):
        return {key: _plain(entry) for key, entry in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(entry) for entry in value]
    return value


def merge(base: dict[str, Any], changes: dict[str, Any]) -> dict[str, Any]:
    """`base` with `changes` laid over it, table by table; lists are replaced whole."""
    merged = dict(base)
    for key, value in changes.items():
        below = merged.get(key)
        merged[key] = merge(below, value) if isinstance(below, dict) and isinstance(value, dict) else value
    return merged


def assign(experiment: Experiment, assignments: Sequence[str]) -> Experiment:
    """A copy changed by assignments such as `lifetime.steps=1000` or `world.food.0.count=10`.

    A value is TOML; what is not TOML is a plain string. Raises ExperimentError.
    """
    tree = experiment.to_dict()
    for assignment in assignments:
        path, equals, text = assignment.partition("=")
        if not equals:
            raise ExperimentError(f"{assignment}: must be path=value, such as lifetime.steps=1000")
        table: Any = tree
        *steps, last = path.strip().split(".")
        for step in steps:
            table = table[_key(table, step, path)]
        table[_key(table, last, path)] = _value(text.strip())
    return validate(tree)


def _key(table: Any, step: str, path: str) -> str | int:
    if isinstance(table, list) and step.isdecimal() and int(step) < len(table):
        return int(step)
    if isinstance(table, dict) and step in table:
        return step
    names = list(table) if isinstance(table, dict) else range(len(table)) if isinstance(table, list) else ()
    raise ExperimentError(f"{path}: there is no {step!r} here; there are: {', '.join(map(str, names)) or 'none'}")


def _value(text: str) -> Any:
    try:
        return tomllib.loads(f"value = {text}")["value"]
    except tomllib.TOMLDecodeError:
        return text


def validate(tree: dict[str, Any]) -> Experiment:
    """The experiment that `tree` describes. Raises ExperimentError with a line for every fault."""
    try:
        return Experiment.model_validate(tree)
    except ValidationError as error:
        raise ExperimentError("\n".join(_sentence(fault) for fault in error.errors())) from None


def _sentence(fault: Any) -> str:
    path = ".".join(str(step) for step in fault["loc"])
    message = str(fault["msg"]).removeprefix("Value error, ")
    if fault["type"] == "extra_forbidden":
        return f"{path}: there is no such field; there are: {', '.join(_names_beside(fault['loc']))}"
    if fault["type"] == "missing":
        return f"{path}: is missing"
    if not path:
        return message
    value = fault["input"]
    shown = repr(value) if not isinstance(value, dict) else "this table"
    if isinstance(value, float) and not math.isfinite(value):
        shown = str(value)
    return f"{path} = {shown}: {message[0].lower()}{message[1:]}"


def _names_beside(location: tuple[str | int, ...]) -> list[str]:
    """The fields there are where an unknown one was given."""
    part: Any = Experiment
    for step in location[:-1]:
        if isinstance(step, str):
            annotation = part.model_fields[step].annotation
            part = get_args(annotation)[0] if get_args(annotation) else annotation
    return list(part.model_fields)
