"""Regions and kinds of the items of an experiment."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Final

from baldwinlab.experiment import Experiment
from baldwinlab.models.miniworld.state import FOOD
from baldwinlab.parts.world_features import ItemRegion

# A color of `baldwinlab.analysis.palette`.
FOOD_COLOR: Final = "green"


def item_regions(experiment: Experiment) -> tuple[ItemRegion, ...]:
    """Return all regions of items: first the food of the world, then the items of features.

    Parameters
    ----------
    experiment : Experiment
        The experiment, as a function of `derived` gets it.

    Returns
    -------
    tuple of ItemRegion
        Kind, edges, number and energy of the items. The index is the region in hooks.
    """
    food = tuple(
        ItemRegion(
            kind=FOOD,
            x=region.x,
            y=region.y,
            count=region.count,
            energy=region.energy,
            color=FOOD_COLOR,
        )
        for region in experiment.world.food
    )
    return food + tuple(
        region for feature in experiment.parts("world.features") for region in feature.items()
    )


def item_kinds(experiment: Experiment) -> tuple[str, ...]:
    """Return the kinds of items by number. Kind 0 is food, even if there is no food.

    Parameters
    ----------
    experiment : Experiment
        The experiment, as a function of `derived` gets it.

    Returns
    -------
    tuple of str
        Names of the kinds. The index is the value in `model.region_kind`.
    """
    return tuple(dict.fromkeys([FOOD, *(region.kind for region in item_regions(experiment))]))


def eaten_energies(experiment: Experiment) -> list[float]:
    """Return the energies of what an agent eats: items by region, then agents by species.

    They are the energies of the rows of `State.eaten_in_life`.
    """
    energies = [region.energy for region in item_regions(experiment)]
    prey_energies = [prey.energy for prey in experiment.eats.prey]
    # Without regions, the arrays have a row for items.
    return [*(energies or [0.0]), *prey_energies] if prey_energies else energies


def kind_number(kind: str) -> Callable[[Any, Experiment], int]:
    """Return a function for `derived` of a part: the number of a kind of items.

    Parameters
    ----------
    kind : str
        Name of the kind, for example "food".

    Returns
    -------
    Callable
        Function of (part, experiment). It returns the number, or -1 without such items.
    """
    return lambda part, experiment: (
        item_kinds(experiment).index(kind) if kind in item_kinds(experiment) else -1
    )
