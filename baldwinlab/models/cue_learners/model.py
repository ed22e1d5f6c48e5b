"""The model `cue-learners`: settings, records and measures."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from baldwinlab.core.deferred import xr
from baldwinlab.engine import poison
from baldwinlab.experiment.measures import first_generation
from baldwinlab.models import kit
from baldwinlab.models.cue_learners.genes import draw_allele
from baldwinlab.models.cue_learners.lifetimes import (
    CueResults,
    LifetimeSettings,
    Units,
    simulate_lifetimes,
)
from baldwinlab.parts import Field, LifeResults, Measure, Model, Variable


def _restricted_time(condition: xr.DataArray) -> xr.DataArray:
    """Return the first generation in which a condition is true, or the number of generations."""
    return first_generation(condition, condition.sizes["generation"]).astype(np.float64)


def _time_to_midpoint(runs: xr.Dataset) -> xr.DataArray:
    """Return the first generation whose average agent is above the midpoint."""
    return _restricted_time(runs["beyond"].astype(np.float64).mean("agent") > 0)


def _time_to_half(runs: xr.Dataset) -> xr.DataArray:
    """Return the first generation in which half of the agents learn to eat by color."""
    # Agents that eat by color at death but not at birth.
    has_learned = runs["by_colour"] * (1 - runs["born_so"])
    return _restricted_time(has_learned.mean("agent") >= 0.5)


class CueLearners(Model, name="cue-learners"):
    """Agents that learn which color means food, with smell as the teacher."""

    cue_accuracy: float = Field(
        0.75,
        ge=0.5,
        le=1,
        description="Probability that food smells sweet, and that poison smells sour.",
    )
    learning: bool = Field(True, description="Whether Hebbian links change during life.")
    learning_rate: float = Field(0.1, gt=0, le=2, description="Change of a Hebbian link per item.")
    units: int = Field(3, ge=2, le=8, description="Number of units.")
    items: int = Field(100, ge=1, le=100_000, description="Number of items in a lifetime.")

    defaults = {
        "population": {"size": 100},
        "evolution": {"generations": 601, "variation": "one-point-of-units", "mutation_rate": 0.01},
        "record": {"genome_every": 10},
    }
    payoff = "food minus poison eaten, plus half the number of items"
    learning_amount = "learning_rate"
    lifetime_steps = "items"
    assimilation_obstacle = "The meaning of a color changes between lives."
    settings_without_learning = {"learning": False}
    records = {
        "beyond": Variable.quantity(
            "items",
            "food minus poison eaten, above the midpoint between eating by smell and "
            "eating by color",
        ),
        "by_colour": Variable.flag("1 if the agent eats by color at death, independent of smell"),
        "born_so": Variable.flag("1 if the agent eats by color at birth"),
    }
    measures = {
        "time": Measure(
            (
                "generations until the average agent reaches the midpoint between smell "
                "and color; all if never"
            ),
            _time_to_midpoint,
        ),
        "evolved": Measure(
            "1 if the average agent ever reaches the midpoint between smell and color, else 0",
            lambda runs: (_time_to_midpoint(runs) < runs.sizes["generation"]) * 1.0,
        ),
        "time-of-half": Measure(
            "generations until half of the agents learn to eat by color; all if never",
            _time_to_half,
        ),
    }

    def n_weights(self) -> int:
        """Return the number of genes: unit kinds, link strengths and Hebbian flags.

        The links are ordered by their target, then by their source.
        """
        return self.units + 2 * self.units**2

    def founders(self, agents: int, key: Any) -> kit.Genomes:
        draws = kit.draw_founder_numbers(key, agents, self.n_weights())
        genomes = np.empty(draws.shape, np.float32)
        for (agent, module, gene), draw in np.ndenumerate(draws):
            genomes[agent, module, gene] = draw_allele(gene, self.units, draw)
        return genomes

    def simulate(
        self, seed: int, runs: Sequence[int], generation: int, genomes: kit.Genomes
    ) -> LifeResults:
        shape = genomes.shape[:2]
        # [run, agent, gene]: link strengths change in place.
        learned = genomes[:, :, 0].copy()
        settings = LifetimeSettings(
            seed=seed,
            generation=generation,
            items=self.items,
            accuracy=self.cue_accuracy,
            learning=self.learning,
            rate=np.float32(self.learning_rate),
        )
        units = Units(
            kinds=poison.empty(self.units, np.int64), values=poison.empty(self.units, np.float32)
        )
        results = CueResults(
            eaten=poison.empty(shape),
            midpoint=poison.empty(shape),
            by_color=poison.empty(shape, np.int32),
            innate_by_color=poison.empty(shape, np.int32),
        )
        simulate_lifetimes(settings, np.array(runs, np.int64), learned, units, results)
        records = {
            "beyond": results.eaten - results.midpoint,
            "by_colour": results.by_color,
            "born_so": results.innate_by_color,
        }
        return self.make_results(results.eaten + self.items / 2, records, learned=learned)
