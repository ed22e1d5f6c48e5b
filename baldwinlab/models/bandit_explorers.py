"""Model of agents that explore an unknown arm of a bandit, or never pull it.

    baldwinlab reproduce lange-sprekeler-2020

Arm 1 pays 0. Arm 2 pays a normal random number with the mean mu and the standard deviation `noise`.
Each bandit has a different mu, drawn from a normal distribution with the mean -1 and the standard
deviation `uncertainty`. A genome has one gene. Rounded down, the gene is the number n of
exploratory pulls. An agent first pulls arm 2 n times. Then it pulls the arm with the larger
posterior mean (Bayes' rule) until death: arm 2 if the sum of the n payoffs exceeds
noise^2 / uncertainty^2, else arm 1. An agent with n = 0 never pulls arm 2: its choice is innate.

Fitness is 1 plus the mean payoff per pull, over several bandits. An agent that does not learn
explores as well. It ignores the payoffs and then pulls arm 1.

The bandit follows Lange and Sprekeler, from secondary sources. In the paper, the agents are
recurrent networks. The genome, the population and the constants are our choice.

References
----------
R. T. Lange and H. Sprekeler, "Learning not to learn: nature versus nurture in silico", arXiv
2010.04466 (2020).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import cached_property
from typing import Any, Final

import numpy as np

from baldwinlab.core.deferred import xr
from baldwinlab.engine import poison
from baldwinlab.engine.jit import jit_entry_point
from baldwinlab.models import kit
from baldwinlab.parts import (
    LIFE,
    Field,
    LifeResults,
    Measure,
    Model,
    Variable,
    normal_quantile,
    uniforms,
)

# Mean payoff of arm 2 over all bandits.
MEAN_PAYOFF: Final = -1.0


class BanditExplorers(Model, name="bandit-explorers"):
    """Agents that explore the unknown arm of a bandit for a number of pulls, or never pull it."""

    lifetime_pulls: int = Field(100, ge=1, le=10_000, description="Number of pulls in a lifetime.")
    uncertainty: float = Field(
        2.0,
        gt=0,
        le=1000,
        description="Standard deviation of the mean of arm 2 between lifetimes. The mean is -1.",
    )
    noise: float = Field(
        3.0,
        ge=0,
        le=1000,
        description="Standard deviation of the payoff of arm 2 within a lifetime.",
    )
    learning: bool = Field(
        True, description="Whether agents use the explored payoffs. Otherwise they choose arm 1."
    )
    bandits: int = Field(
        100,
        ge=1,
        le=100_000,
        description="Number of bandits of an agent, each for a lifetime. Fitness is the mean.",
    )
    initial_pulls: float = Field(
        10.0,
        ge=0,
        le=10_000,
        description="Largest number of exploratory pulls of the founders. They are uniform.",
    )

    defaults = {
        "population": {"size": 100},
        "evolution": {
            "generations": 101,
            "selection": "tournament",
            "variation": "gaussian",
            "mutation_rate": 0.5,
            "mutation_size": 1.0,
        },
        "record": {"genome_every": 50},
    }
    records = {
        "explored": Variable.integer("pulls", "number of exploratory pulls"),
        "explores": Variable.flag("1 if the agent explores, 0 if its choice is hard-coded"),
        "accepted": Variable.share("share of bandits in which arm 2 is chosen at the end"),
    }
    innate_trait = "explored"
    learned_distance = "explores"
    learning_time = "explored"
    lifetime_steps = "lifetime_pulls"
    settings_without_learning = {"learning": False}
    measures = kit.measure_last_means(
        {"explores": "share of agents that explore", "explored": "number of exploratory pulls"}
    )

    def n_weights(self) -> int:
        return 1

    def founders(self, agents: int, key: Any) -> kit.Genomes:
        draws = kit.draw_founder_numbers(key, agents, 1)
        return (self.initial_pulls * draws).astype(np.float32)

    def count_pulls(self, genomes: kit.Genomes) -> kit.Integers:
        """Return the numbers of exploratory pulls of genomes [..., agent, module, weight]."""
        pulls = np.floor(genomes[..., 0, 0].astype(np.float64))
        return np.clip(pulls, 0, self.lifetime_pulls).astype(np.int64)

    def simulate(
        self, seed: int, runs: Sequence[int], generation: int, genomes: kit.Genomes
    ) -> LifeResults:
        explored = self.count_pulls(genomes)
        payoffs = poison.empty(explored.shape)
        accepted = poison.empty(explored.shape)
        for row, run in enumerate(runs):
            # [agent, bandit, 4]: `pull_arms` uses three of the four random numbers.
            draws = uniforms(seed, run, generation, LIFE, (explored.shape[1], self.bandits))
            pull_arms(
                (self.lifetime_pulls, self.uncertainty, self.noise, self.learning),
                explored[row],
                draws,
                payoffs[row],
                accepted[row],
            )
        records = {"explored": explored, "explores": explored > 0, "accepted": accepted}
        return self.make_results(1 + payoffs / self.lifetime_pulls, records)

    @cached_property
    def expected_payoffs(self) -> kit.Numbers:
        """Expected total payoff of a lifetime with learning, by number of exploratory pulls.

        Entry n is for n pulls, from 0 to `lifetime_pulls`. Mu and the sum of the explored payoffs
        are jointly normal. Therefore, a formula gives the mean of mu over accepted arms.
        """
        payoffs = np.zeros(self.lifetime_pulls + 1)
        variance = self.uncertainty**2
        for n in range(1, self.lifetime_pulls + 1):
            # Standard deviation of the posterior mean. The agent accepts arm 2 if this mean is > 0.
            sd = variance * math.sqrt(n / (variance * n + self.noise**2))
            d = MEAN_PAYOFF / sd
            density = math.exp(-d * d / 2) / math.sqrt(2 * math.pi)
            acceptance = math.erfc(-d / math.sqrt(2)) / 2
            # In parentheses: mean payoff per later pull. A pull of arm 1 counts as 0.
            rest = (self.lifetime_pulls - n) * (MEAN_PAYOFF * acceptance + sd * density)
            payoffs[n] = MEAN_PAYOFF * n + rest
        return payoffs

    def all_measures(self) -> dict[str, Measure]:
        """Return the measures, and two more that compare agents with the expected payoffs."""
        return super().all_measures() | {
            "best-choice": Measure(
                "1 if most agents explore in the last generation exactly if exploration pays",
                self._has_best_choice,
            ),
            "loss": Measure(
                "expected payoff per pull of the best number of exploratory pulls, minus the mean "
                "expected payoff per pull of the agents in the last generation",
                self._loss,
            ),
        }

    def _has_best_choice(self, runs: xr.Dataset) -> xr.DataArray:
        should_explore = self.expected_payoffs.argmax() > 0
        return 1.0 * ((kit.mean_of_last_generation("explores")(runs) > 0.5) == should_explore)

    def _loss(self, runs: xr.Dataset) -> xr.DataArray:
        explored = runs["explored"].isel(generation=-1).astype(int)
        payoffs = explored.copy(data=self.expected_payoffs[explored.values])
        loss: xr.DataArray = self.expected_payoffs.max() - payoffs.mean("agent")
        return loss / self.lifetime_pulls


@jit_entry_point
def pull_arms(bandit: Any, explored: Any, draws: Any, payoffs: Any, accepted: Any) -> None:
    """Simulate the bandits of all agents of a run.

    The sum of several payoffs of an arm is normal, so one random number determines the sum.

    - `bandit`: number of pulls in a lifetime, `uncertainty`, `noise` and `learning`.
    - `explored` (agents,): number of exploratory pulls.
    - `draws` (agents, bandits, 4): uniform random numbers for the mean of arm 2 (entry 0), the
      explored payoffs (1) and the later payoffs (2).
    - `payoffs` (agents,): output: total payoff of a lifetime, mean over bandits.
    - `accepted` (agents,): output: fraction of bandits with arm 2 after the exploration.
    """
    n_pulls, uncertainty, noise, learning = bandit
    n_bandits = draws.shape[1]
    threshold = noise * noise / (uncertainty * uncertainty)
    for agent in range(explored.size):
        n = explored[agent]
        n_left = n_pulls - n
        total = 0.0
        n_accepted = 0
        # An agent that does not explore never pulls arm 2.
        for index in range(n_bandits if n > 0 else 0):
            draw = draws[agent, index]
            mean = -1.0 + uncertainty * normal_quantile(draw[0])
            evidence = n * mean + np.sqrt(n) * noise * normal_quantile(draw[1])
            total += evidence
            if learning and evidence > threshold:
                n_accepted += 1
                total += n_left * mean + np.sqrt(n_left) * noise * normal_quantile(draw[2])
        payoffs[agent] = total / n_bandits
        accepted[agent] = n_accepted / n_bandits
