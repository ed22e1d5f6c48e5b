"""What every contender is told: the model's numbers, as plain Python that any of them can read without installing anything."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any, Protocol

if TYPE_CHECKING:
    from baldwinlab.experiment import Experiment

Genomes = list[list[list[list[float]]]]
"""[world][agent][module][weight], weights in the order of `baldwinlab.core.variables.WEIGHT_ORDER`."""

Live = Callable[[int], Any]
"""Live the lives once, with random numbers of this seed. Returns the items eaten, [world][agent], where there are any."""


class Contender(Protocol):
    """What a module in `contenders` offers."""

    def agent_steps(self, setting: Setting) -> int:
        """Agent-steps in one call of what `lives` returns."""
        ...

    def lives(self, setting: Setting, genomes: Genomes) -> Live:
        """Make all ready; `genomes` are given to the worlds in turn."""
        ...


@dataclass(frozen=True)
class Setting:
    """The standard variant with one food region and one hidden layer.

    Units are those of `baldwinlab.experiment`; the model is in docs/explanation/model.md.
    """

    name: str  # of the experiment
    width: float
    height: float
    start: tuple[float, float, float]  # x, y, radius
    food_x: tuple[float, float]
    food_y: tuple[float, float]
    items: int
    agents: int
    visual_radius: float
    reach: float
    hidden: int
    learns: bool
    rate: float
    steps: int

    def to_dict(self) -> dict[str, Any]:
        return asdict(self)

    @property
    def centre(self) -> tuple[float, float]:
        """The middle of the food."""
        return sum(self.food_x) / 2, sum(self.food_y) / 2

    def span(self, margin: float) -> tuple[float, float]:
        """How far from the middle of the food, along x and y, something may lie within `margin` of an item."""
        return (self.food_x[1] - self.food_x[0]) / 2 + margin, (
            self.food_y[1] - self.food_y[0]
        ) / 2 + margin


def from_dict(values: Mapping[str, Any]) -> Setting:
    fields: dict[str, Any] = {
        name: tuple(value) if isinstance(value, list) else value for name, value in values.items()
    }
    return Setting(**fields)


def from_experiment(experiment: Experiment) -> Setting:
    """Raises ValueError for an experiment that the contenders do not model."""
    world, start = experiment.world, experiment.world.start
    standard = (
        experiment.senses.boundaries,
        experiment.contact.shape,
        experiment.lifetime.update,
        experiment.network.biases,
    )
    if (
        standard != ("closed", "circle", "simultaneous", False)
        or len(world.food) != 1
        or len(experiment.network.hidden) != 1
    ):
        raise ValueError(
            f"{experiment.name}: the contenders know the standard variant, one food region and one hidden layer"
        )
    (food,) = world.food
    return Setting(
        name=experiment.name,
        width=world.width,
        height=world.height,
        start=(start.x, start.y, start.radius),
        food_x=food.x,
        food_y=food.y,
        items=food.count,
        agents=experiment.population.size,
        visual_radius=experiment.senses.visual_radius,
        reach=experiment.contact.reach,
        hidden=experiment.network.hidden[0],
        learns=experiment.learns,
        rate=experiment.learning.rate,
        steps=experiment.lifetime.steps,
    )
