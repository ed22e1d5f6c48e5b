"""The model `plastic-prisoners`: settings, records and measures."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Final, Literal

import numpy as np

from baldwinlab.engine import poison
from baldwinlab.models import kit
from baldwinlab.models.plastic_prisoners.matches import compute_mean_payoffs, compute_payoffs
from baldwinlab.models.plastic_prisoners.measures import (
    compare_with_rival,
    fall_of_plasticity,
    is_outstanding_leading,
    share_of_outstanding,
    share_of_plastic_entries,
    value_at_generation,
)
from baldwinlab.models.plastic_prisoners.strategies import (
    N_GENOMES,
    PAIRS,
    STRATEGIES,
    STRATEGY_OF_GENOME,
    moves_at_birth,
)
from baldwinlab.parts import (
    PER_AGENT_DIMS,
    Field,
    LifeResults,
    MatrixView,
    Measure,
    Model,
    Variable,
    View,
)

# Number of most frequent genomes in the view of payoffs.
N_SHOWN_GENOMES: Final = 8


def _view_payoffs(model: Any, key: Any, genomes: kit.Genomes, agent: int) -> MatrixView:
    """Return the payoffs between the most frequent genomes of a generation."""
    counts = np.bincount(kit.read_bits(genomes), minlength=N_GENOMES)
    most_frequent = [
        int(genome)
        for genome in np.argsort(-counts, kind="stable")[:N_SHOWN_GENOMES]
        if counts[genome]
    ]
    names = [
        f"{STRATEGIES[STRATEGY_OF_GENOME[genome]]} born {moves_at_birth(genome)}"
        for genome in most_frequent
    ]
    rows = [
        f"{name}, {counts[genome] / len(genomes):.1%}"
        for name, genome in zip(names, most_frequent, strict=True)
    ]
    payoffs = compute_payoffs(model.rounds, model.noise, model.learning, model.initial_moves)
    return MatrixView(
        rows=rows,
        columns=names,
        values=payoffs[np.ix_(most_frequent, most_frequent)],
        value_label="mean payoff of a round to the row, from the column",
    )


class PlasticPrisoners(Model, name="plastic-prisoners"):
    """Strategies of the iterated prisoner's dilemma with genes that change during a match."""

    rounds: int = Field(50, ge=1, le=1000, description="Number of rounds per match.")
    noise: float = Field(1 / 25, ge=0, le=0.5, description="Probability that a move is inverted.")
    learning: bool = Field(
        True, description="Whether plastic entries learn. Otherwise they do not change."
    )
    initial_moves: Literal["any", "defection", "cooperation"] = Field(
        "any",
        description="Assumed moves before a match: one of four at random, DD or CC.",
    )

    defaults = {
        "population": {"size": 1000},
        "evolution": {"generations": 2001, "variation": "bit-flips", "mutation_rate": 1 / 1500},
        # The assay `innate` simulates these generations, so it need not reproduce any.
        "record": {"genome_every": 21},
    }
    payoff = "mean payoff per round"
    records = {
        "strategy": Variable(
            PER_AGENT_DIMS,
            np.int8,
            "number",
            "strategy: a digit to base 3 for each of DD, DC, CD, CC: 0 D, 1 C, 2 plastic",
        ),
    }
    shares = {
        "plasticity": Measure("share of plastic entries", share_of_plastic_entries),
        "[x00x]": Measure("share of agents with this strategy", share_of_outstanding),
    }
    alleles = kit.BITS
    learned_distance = "plasticity"
    lifetime_steps = "rounds"
    settings_without_learning = {"learning": False}
    views = {
        "payoffs": View(
            "Payoffs between the most frequent genomes.",
            _view_payoffs,
            has_agent_choice=False,
        )
    }
    measures = {
        "least-payoff": Measure(
            "lowest mean payoff of the average agent before generation 150",
            lambda runs: runs["energy"].isel(generation=slice(150)).mean("agent").min("generation"),
        ),
        "payoff-500": Measure(
            "mean payoff of the average agent in generation 500", kit.mean_at("energy", 500)
        ),
        "payoff-2000": Measure(
            "mean payoff of the average agent in generation 2000", kit.mean_at("energy", 2000)
        ),
        "most-plasticity": Measure(
            "largest percentage of plastic entries over the generations",
            lambda runs: 100 * share_of_plastic_entries(runs).max("generation"),
        ),
        "plasticity-falls": Measure(
            "percentage of plastic entries from generation 150 to 500 minus that from 1801 to 2000",
            lambda runs: 100 * fall_of_plasticity(runs),
        ),
        "x00x-leads": Measure(
            "1 if [x00x] is the most frequent strategy in generation 2000, else 0",
            value_at_generation(is_outstanding_leading, 2000),
        ),
        "x00x-ahead": Measure(
            "1 if [x00x] is the most frequent strategy in generation 2000, -1 if its main rival is",
            value_at_generation(compare_with_rival, 2000),
        ),
    }

    def check(self, experiment: Any) -> None:
        if experiment.population.size < 2:
            raise ValueError(
                "population.size = 1 must be at least 2, as a prisoner's payoff is against others"
            )

    def n_weights(self) -> int:
        return 2 * len(PAIRS)

    def founders(self, agents: int, key: Any) -> kit.Genomes:
        return kit.draw_bits(key, agents, self.n_weights())

    def simulate(
        self, seed: int, runs: Sequence[int], generation: int, genomes: kit.Genomes
    ) -> LifeResults:
        # [run, agent].
        genome_numbers = kit.read_bits(genomes)
        payoffs = compute_payoffs(self.rounds, self.noise, self.learning, self.initial_moves)
        fitness_of_genome = np.zeros(N_GENOMES)
        fitness = poison.empty(genome_numbers.shape)
        for row, population in enumerate(genome_numbers):
            counts = np.bincount(population, minlength=N_GENOMES)
            compute_mean_payoffs(payoffs, counts, fitness_of_genome)
            fitness[row] = fitness_of_genome[population]
        return self.make_results(fitness, {"strategy": STRATEGY_OF_GENOME[genome_numbers]})
