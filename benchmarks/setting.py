"""The task of a contender: the numbers of the model as plain Python, without dependencies."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any, Protocol

if TYPE_CHECKING:
    from baldwinlab.experiment import Experiment

Genomes = list[list[list[list[float]]]]
"""[world][agent][module][weight], in the order of `baldwinlab.core.variables.WEIGHT_ORDER`."""

Simulate = Callable[[int], Any]
"""Simulate the lifetimes with a seed; return the items eaten, [world][agent], or None."""


class Contender(Protocol):
    """The functions of a module in `contenders`."""

    def agent_steps(self, setting: Setting) -> int:
        """Return the agent-steps of one call of the function that `prepare` returns."""
        ...

    def prepare(self, setting: Setting, genomes: Genomes) -> Simulate:
        """Return a function that simulates lifetimes; the worlds use `genomes` in turn."""
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
    def center(self) -> tuple[float, float]:
        """The center of the food."""
        return sum(self.food_x) / 2, sum(self.food_y) / 2

    def span(self, margin: float) -> tuple[float, float]:
        """Return the largest x and y distances from the center with an item within `margin`."""
        width = self.food_x[1] - self.food_x[0]
        height = self.food_y[1] - self.food_y[0]
        return width / 2 + margin, height / 2 + margin


def from_dict(values: Mapping[str, Any]) -> Setting:
    fields: dict[str, Any] = {
        name: tuple(value) if isinstance(value, list) else value for name, value in values.items()
    }
    return Setting(**fields)


def from_experiment(experiment: Experiment) -> Setting:
    """Return the setting of an experiment; raise ValueError if the contenders do not model it."""
    world = experiment.world
    start = world.start
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
            f"{experiment.name}: the contenders model only the standard variant "
            "with one food region and one hidden layer"
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
