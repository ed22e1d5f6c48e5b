"""Food that regrows logistically, in the cells of a map of characters.

    baldwinlab check examples/parts/logistic_regrowth.py

With n of K items, an absent item reappears with the probability rate * n / K.
"""

import numpy as np

from baldwinlab.parts import (
    Field,
    ItemRegion,
    WorldFeature,
    draw_unit,
    is_on_map,
    place_item_randomly,
    purpose,
    remove_item,
    was_eaten,
)

REGROWTH = purpose("logistic-regrowth: item")


class LogisticRegrowth(WorldFeature, name="logistic-regrowth"):
    """Food in the cells `#` of a map. The number of items grows by rate * n * (1 - n / K)."""

    rows: tuple[str, ...] = Field(("....##", "...###"), min_length=1, description="Rows of # and .")
    side: float = Field(80.0, gt=0, le=1e6, description="Side of a cell, in units of length.")
    rate: float = Field(0.01, ge=0, le=1, description="Growth rate of few items, per step.")

    def check(self, experiment):
        is_too_wide = self.side * max(map(len, self.rows)) > experiment.world.width
        if is_too_wide or self.side * len(self.rows) > experiment.world.height:
            raise ValueError("world.logistic_regrowth: the cells must fit on the map of the world")

    def items(self):
        side = self.side
        food = {"kind": "food", "count": 8, "energy": 1.0, "color": "green"}
        return tuple(
            ItemRegion(x=(x * side, (x + 1) * side), y=(y * side, (y + 1) * side), **food)
            for y, row in enumerate(self.rows)
            for x, mark in enumerate(row)
            if mark == "#"
        )

    @staticmethod
    def end_step(part, model, state, world, step):
        present = 0
        for item in range(state.item_x.shape[1]):
            present += is_on_map(state, world, item) and not was_eaten(state, world, item, step)
        share = np.float32(present) / np.float32(state.item_x.shape[1])
        for region in range(model.regions.shape[0]):
            for item in range(model.region_items[region], model.region_items[region + 1]):
                if was_eaten(state, world, item, step):
                    remove_item(model, state, world, region, item)
                elif not is_on_map(state, world, item) and (
                    draw_unit(state, world, REGROWTH, item, step) < part.rate * share
                ):
                    place_item_randomly(model, state, world, region, item)
