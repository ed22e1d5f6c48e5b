"""Tables of settings of experiments in MiniWorld.

The defaults are the standard variant of the paper Le (2019). Each setting has a description and
limits. If a setting chooses a part, the settings of the part are in a table with the part's name.

Settings with a number R1 to R8 are choices that the paper leaves open (docs/explanation/model.md).

Source: Le (2019), section "Simulation setup".
"""

from __future__ import annotations

from typing import Annotated, Final, Literal, Self

from pydantic import Field, model_validator

from baldwinlab.experiment.fields import Fields, refuse_fields
from baldwinlab.experiment.registry import PartChoice
from baldwinlab.experiment.tables import Population, Record

Coordinate = Annotated[float, Field(ge=0, le=1_000_000)]
SenseName = Annotated[str, PartChoice("sense")]
BodyName = Annotated[str, PartChoice("body")]
NetworkName = Annotated[str, PartChoice("network")]
RuleName = Annotated[str, PartChoice("learning rule")]
FeatureName = Annotated[str, PartChoice("world feature")]
MAX_LIFETIME_STEPS: Final = 100_000_000
"""Maximum number of steps of a lifetime."""


class Start(Fields):
    """Birthplaces: uniform in a disc."""

    x: Coordinate = Field(160.0, description="x of the center of the disc, in units of length.")
    y: Coordinate = Field(
        160.0, description="y of the center of the disc, in units of length, downward."
    )
    radius: float = Field(
        40.0, ge=0, le=1_000_000, description="Radius of the disc, in units of length."
    )
    headings: Literal["equal", "random"] = Field(
        "equal",
        description=("Headings of newborns. equal: all along +x; random: one of the 40 headings."),
    )


class FoodRegion(Fields):
    """Rectangle with uniformly placed items. An eaten item reappears in its region at once."""

    x: tuple[Coordinate, Coordinate] = Field(description="Left and right edge, in units of length.")
    y: tuple[Coordinate, Coordinate] = Field(
        description="Upper and lower edge, in units of length."
    )
    count: int = Field(
        50, ge=0, le=1_000_000, description="Number of items in the region at any time."
    )
    energy: float = Field(1.0, ge=0, le=1_000_000, description="Energy of an item.")

    @model_validator(mode="after")
    def _require_ordered_edges(self) -> Self:
        refuse_fields(
            [
                (axis, edges, "must go from a smaller to a larger number")
                for axis, edges in (("x", self.x), ("y", self.y))
                if not edges[0] < edges[1]
            ]
        )
        return self


class World(Fields):
    """The map: a torus with y downward, so headings grow clockwise."""

    width: float = Field(
        640.0, ge=10, le=1_000_000, description="Width of the map, in units of length."
    )
    height: float = Field(
        640.0, ge=10, le=1_000_000, description="Height of the map, in units of length."
    )
    start: Start = Start()
    food: tuple[FoodRegion, ...] = Field((), max_length=64, description="Food regions, at most 64.")
    features: tuple[FeatureName, ...] = Field(
        (), max_length=16, description="World features, for example walls. [] for none."
    )

    @model_validator(mode="after")
    def _require_positions_on_map(self) -> Self:
        faults: list[tuple[str, object, str]] = []
        for axis, side in (("x", "width"), ("y", "height")):
            size = getattr(self, side)
            position = getattr(self.start, axis)
            if position >= size:
                rule = f"must be less than world.{side} = {size:g}"
                faults.append((f"start.{axis}", position, rule))
            for region_index, region in enumerate(self.food):
                edges = getattr(region, axis)
                _, far_edge = edges
                if far_edge > size:
                    rule = f"must be on the map, from 0 to world.{side} = {size:g}"
                    faults.append((f"food.{region_index}.{axis}", edges, rule))
        max_radius = min(self.width, self.height) / 2
        if self.start.radius > max_radius:
            limit = "half of the smaller of world.width and world.height"
            rule = f"must be at most {max_radius:g}, {limit}"
            faults.append(("start.radius", self.start.radius, rule))
        refuse_fields(faults)
        return self


class Senses(Fields):
    kinds: tuple[SenseName, ...] = Field(
        ("food",),
        min_length=1,
        max_length=8,
        description=("Senses, in the order of the inputs. food: three binary sensors for food."),
    )
    visual_radius: float = Field(
        40.0, gt=0, le=100_000, description="Visual range, in units of length (R1)."
    )
    boundaries: Literal["closed", "open"] = Field(
        "closed",
        description=(
            "Items at exactly 15 and 345 degrees. closed: seen by the front sensor; "
            "open: not seen (R8)."
        ),
    )


class Contact(Fields):
    shape: Literal["circle", "square"] = Field(
        "circle",
        description=(
            "Distance for contact. circle: Euclidean; square: the larger of |dx| and |dy| (R2)."
        ),
    )
    reach: float = Field(
        10.0,
        gt=0,
        le=100_000,
        description=("Distance below which an agent touches an item, in units of length (R2)."),
    )


class Prey(Fields):
    """A species whose agents are eaten."""

    species: str = Field(description="Name of the species.")
    energy: float = Field(1.0, ge=-1_000_000, le=1_000_000, description="Energy of an eaten agent.")


class Eats(Fields):
    """Items and species that agents eat."""

    items: tuple[str, ...] | None = Field(
        None,
        max_length=64,
        description=(
            'Kinds of items that agents eat, for example ["food"]. Not set: all kinds. Other items '
            "stay where they are."
        ),
    )
    prey: tuple[Prey, ...] = Field(
        (), max_length=16, description="Species that agents eat. [] for none."
    )


class Motor(Fields):
    body: BodyName = Field(
        "walker",
        description=(
            "Body. walker: turns left or right by 9 degrees, or goes straight at double speed."
        ),
    )
    noise: float = Field(
        0.0,
        ge=0,
        le=1,
        description="Probability per step that a random action replaces the chosen one.",
    )


class NetworkSettings(Fields):
    """Topology of the action module and of the reinforcement module."""

    kind: NetworkName = Field(
        "feed-forward",
        description="Network. feed-forward: layers of logistic units, without memory.",
    )
    hidden: tuple[Annotated[int, Field(ge=1, le=1000)], ...] = Field(
        (10,), max_length=8, description="Number of units in each hidden layer. [] for none."
    )
    biases: bool = Field(
        False,
        description=(
            "Whether hidden and output units have biases, which evolve and learn like weights (R3)."
        ),
    )


class Learning(Fields):
    """Learning during life, and its controls."""

    rule: RuleName = Field(
        "none",
        description="Learning rule. self-taught: backpropagation toward the reinforcement module.",
    )
    rate: float = Field(0.01, ge=0, le=10, description="Learning rate, per step.")
    evolved_rate: bool = Field(
        False,
        description="Whether agents inherit a gene g and learn at rate * 10^g, at most 10.",
    )
    steps: int | None = Field(
        None,
        ge=0,
        le=MAX_LIFETIME_STEPS,
        description=(
            "Number of steps after birth in which an agent learns. Not set: it learns for life."
        ),
    )
    control: Literal["none", "drift", "yoked"] = Field(
        "none",
        description=(
            "Control of the rule. drift: weight changes of the same size in random directions; "
            "yoked: the weight changes of another agent."
        ),
    )
    teacher: Literal["inherited", "shuffled", "fresh"] = Field(
        "inherited",
        description=(
            "Reinforcement modules of the children. inherited: from the parents; "
            "shuffled: permuted among the children; fresh: drawn from N(0, 1)."
        ),
    )
    cost_per_step: float = Field(
        0.0, ge=0, le=1_000_000, description="Cost of a step of learning, in energy."
    )
    cost_per_change: float = Field(
        0.0,
        ge=0,
        le=1_000_000,
        description=(
            "Cost per unit of distance between the weights at birth and at death, in energy."
        ),
    )


class Lifetime(Fields):
    steps: int = Field(
        5000, ge=1, le=MAX_LIFETIME_STEPS, description="Number of steps of a lifetime."
    )
    repeats: int = Field(
        1,
        ge=1,
        le=1000,
        description=(
            "Number of lifetimes of each agent, each in another world. Fitness is their mean."
        ),
    )
    update: Literal["simultaneous", "sequential"] = Field(
        "simultaneous",
        description=(
            "Order of the agents in a step. simultaneous: all agents together; "
            "sequential: one agent after another (R7)."
        ),
    )


class WorldPopulation(Population):
    """Agents, and their distribution over worlds."""

    worlds: int = Field(
        1,
        ge=1,
        le=1_000_000,
        description=(
            "Number of worlds with equal shares of the agents. population.size: each agent alone."
        ),
    )

    @model_validator(mode="after")
    def _require_equal_worlds(self) -> Self:
        if self.size % self.worlds:
            rule = f"must divide population.size = {self.size}"
            refuse_fields([("worlds", self.worlds, rule)])
        return self


class WorldRecord(Record):
    """Stored genomes and time series."""

    every: int | None = Field(
        None,
        ge=1,
        le=MAX_LIFETIME_STEPS,
        description=(
            "Length of the windows of time series within a lifetime, in steps. Not set: none."
        ),
    )
