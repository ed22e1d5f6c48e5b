"""Poison: a world feature with items that cost energy, a sense for them, and a fitness.

    baldwinlab run evo/A --part examples/parts/poison.py --set world.features='["poison"]' \
        senses.kinds='["food", "poison"]' evolution.fitness=above-the-worst
"""

import numpy as np

from baldwinlab.parts import (
    Field,
    Fitness,
    ItemRegion,
    Sense,
    WorldFeature,
    kind_number,
    sense_items,
)


class Poison(WorldFeature, name="poison"):
    """A region with items that cost energy."""

    x: tuple[float, float] = Field(
        (400.0, 560.0), description="Left and right edge, in units of length."
    )
    y: tuple[float, float] = Field(
        (80.0, 240.0), description="Upper and lower edge, in units of length."
    )
    count: int = Field(20, ge=0, le=1_000_000, description="Number of items in the region.")
    cost: float = Field(1.0, ge=0, le=1_000_000, description="Energy that an item costs.")

    def items(self):
        return (
            ItemRegion(
                kind="poison",
                x=self.x,
                y=self.y,
                count=self.count,
                energy=-self.cost,
                color="#CC79A7",
            ),
        )


class TastesPoison(Sense, name="poison"):
    """Three binary inputs: poison in the left, front and right sector."""

    inputs = ("poison left", "poison in front", "poison right")
    sectors = ((315, 345), (345, 15), (15, 45))
    item_kind = "poison"
    only_items = True
    derived = {"number": kind_number("poison")}

    @staticmethod
    def sense(part, model, state, world, agent):
        return sense_items(model, state, world, agent, part.number)

    @staticmethod
    def oracle(part, agent, items, naive):
        return naive.visible_sectors(agent, [item for item in items if item.kind == "poison"])


class AboveTheWorst(Fitness, name="above-the-worst"):
    """Energy minus the lowest energy of the generation (windowing).

    Source: J. J. Grefenstette, GENESIS (1984).
    """

    @staticmethod
    def evaluate(part, lifetimes, fitness):
        worst = np.inf
        for agent in range(fitness.size):
            fitness[agent] = lifetimes.energy[agent] - lifetimes.cost[agent]
            worst = min(worst, fitness[agent])
        for agent in range(fitness.size):
            fitness[agent] -= worst

    @staticmethod
    def oracle(part, lifetimes):
        pairs = zip(lifetimes.energy, lifetimes.cost, strict=True)
        balance = [gained - spent for gained, spent in pairs]
        return [value - min(balance) for value in balance]
