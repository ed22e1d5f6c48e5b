"""Poison: items that cost energy, a sense of their own, and a fitness that copes with values below 0.

    baldwinlab run evo/A --part examples/parts/poison.py --set world.features='["poison"]' senses.kinds='["food", "poison"]' \
        evolution.fitness=above-the-worst
"""

from baldwinlab.models.miniworld.allocation import kind_number
from baldwinlab.models.miniworld.senses.sight import see
from baldwinlab.parts import Field, Fitness, ItemRegion, Sense, WorldFeature


class Poison(WorldFeature, name="poison"):
    """Items that cost energy, in a region of their own."""

    x: tuple[float, float] = Field(
        (400.0, 560.0), description="left and right edge, units of length"
    )
    y: tuple[float, float] = Field(
        (80.0, 240.0), description="upper and lower edge, units of length"
    )
    count: int = Field(20, ge=0, le=1_000_000, description="items in the region at any time")
    cost: float = Field(
        1.0, ge=0, le=1_000_000, description="energy that an item takes from its eater"
    )

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
    """Three binary sensors: whether any poison is at the left, in front, or at the right."""

    inputs = ("poison left", "poison in front", "poison right")
    sectors = ((315, 345), (345, 15), (15, 45))
    item_kind = "poison"
    only_items = True
    derived = {"number": kind_number("poison")}

    @staticmethod
    def sense(part, model, state, world, agent):
        return see(model, state, world, agent, part.number)

    @staticmethod
    def oracle(part, agent, items, naive):
        return naive.seen(agent, [item for item in items if item.kind == "poison"])


class AboveTheWorst(Fitness, name="above-the-worst"):
    """Energy above that of the worst of the generation: windowing, as in Grefenstette's GENESIS (1984)."""

    @staticmethod
    def evaluate(part, energy, cost, fitness):
        worst = energy[0] - cost[0]
        for agent in range(energy.size):
            worst = min(worst, energy[agent] - cost[agent])
        for agent in range(energy.size):
            fitness[agent] = energy[agent] - cost[agent] - worst

    @staticmethod
    def oracle(part, energy, cost):
        balance = [gained - spent for gained, spent in zip(energy, cost, strict=True)]
        return [each - min(balance) for each in balance]
