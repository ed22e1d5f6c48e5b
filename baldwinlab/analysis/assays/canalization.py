"""Evaluation of the assay `canalization`: effects of single mutations and of a new world.

An effect is the fitness of an agent minus the fitness with one mutation, or in the new world. The
mutant has the same random numbers as the agent. The new world has other random numbers.

References
----------
.. [1] C. H. Waddington, "Canalization of development and the inheritance of acquired characters",
   Nature 150 (1942).
.. [2] G. P. Wagner, G. Booth and H. Bagheri-Chaichian, "A population genetic theory of
   canalization", Evolution 51 (1997).
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

import xarray as xr

from baldwinlab.analysis.assays.evaluation import AssayEvaluation, EffectTable, QuantityValues

QUANTITY_PREFIX: Final = "canalization: "
CHANGES: Final = ("mutation", "new world")
STATISTICS: Final = ("loss", "sensitivity")
EFFECTS: Final = tuple(f"{name} to {change}" for change in CHANGES for name in STATISTICS)
FITNESS_BY_LIFE: Final = {"off": "innate fitness", "on": "fitness with learning"}
BUFFERING: Final = f"{QUANTITY_PREFIX}buffering by learning"
DECLINE: Final = f"{QUANTITY_PREFIX}decline of sensitivity"


def compute_effects(data: xr.Dataset) -> xr.Dataset:
    """Return the loss and the sensitivity of each generation.

    The loss is the mean effect, and the sensitivity is the root mean square effect. The unit is the
    standard deviation of fitness among the agents: the root of the mean variance over generations
    and kinds of life. One unit of a run makes generations and kinds of life comparable. Loss and
    sensitivity do not depend on the unit of fitness, or on a constant that is added to fitness.

    Returns the variables `EFFECTS` (run, generation, life). All are NaN if fitness does not vary.
    See Waddington 1942; Wagner, Booth and Bagheri-Chaichian 1997.
    """
    fitness = data["energy"].sel(world="stored", drop=True)
    # (run, generation, life, mutant, agent). The new world counts as a single mutant.
    changed = {
        "mutation": data["mutant_energy"],
        "new world": data["energy"].sel(world="new", drop=True).expand_dims("mutant"),
    }
    variance = fitness.var("agent").mean(("generation", "life"))
    unit = variance.where(variance > 0) ** 0.5
    effects = {}
    for change, changed_fitness in changed.items():
        effect = fitness - changed_fitness
        effects[f"loss to {change}"] = effect.mean(("mutant", "agent")) / unit
        squares = (effect**2).mean(("mutant", "agent"))
        effects[f"sensitivity to {change}"] = squares**0.5 / unit
    return xr.Dataset(effects)


def compute_quantities(data: xr.Dataset, last: int) -> Iterator[QuantityValues]:
    """Yield the values (run) of all effects, and two comparisons of the sensitivity.

    - Buffering by learning: 1 - on / off, the sensitivities with and without learning. The value is
      above 0 if learning reduces the effects of a change on fitness.
    - Decline: 1 - end / start, the sensitivities of the last and of the first generation. The value
      is above 0 if evolution has reduced the effects.
    """
    effects = compute_effects(data)
    for life, measure in FITNESS_BY_LIFE.items():
        for effect in EFFECTS:
            values = effects[effect].sel(life=life)
            for generation in values["generation"].values.tolist():
                name = name_quantity(effect, measure)
                yield (name, f"generation {generation}"), values.sel(generation=generation)
    for change in CHANGES:
        sensitivity = effects[f"sensitivity to {change}"]
        off, on = (sensitivity.sel(life=life, drop=True) for life in ("off", "on"))
        buffering = 1 - on / off.where(off > 0)
        for generation in buffering["generation"].values.tolist():
            when = f"{change}, generation {generation}"
            yield (BUFFERING, when), buffering.sel(generation=generation)
        for life, measure in FITNESS_BY_LIFE.items():
            of_life = sensitivity.sel(life=life, drop=True)
            start, end = (of_life.isel(generation=index, drop=True) for index in (0, -1))
            yield (DECLINE, f"{change}, {measure}"), 1 - end / start.where(start > 0)


def name_quantity(effect: str, measure: str) -> str:
    """Return the name of an effect on a kind of fitness in the tables of a report.

    >>> name_quantity("loss", "innate")
    'canalization: loss, innate'
    """
    return f"{QUANTITY_PREFIX}{effect}, {measure}"


TABLE: Final = EffectTable(
    title="Effects of single mutations and of a new world",
    explanation=(
        "An effect is the fitness of an agent minus its fitness with one mutation, or in a new "
        "world. The loss is the mean effect, and the sensitivity is the root mean square effect. "
        "The unit is the standard deviation of fitness among the agents, over all generations and "
        "kinds of life. Canalization lowers the sensitivity."
    ),
    time="Time",
    columns=EFFECTS,
    measures={
        name: [name_quantity(effect, name) for effect in EFFECTS]
        for name in FITNESS_BY_LIFE.values()
    },
)
EVALUATION: Final = AssayEvaluation(
    assay="canalization",
    order=80,
    compute_quantities=compute_quantities,
    table=TABLE,
)
