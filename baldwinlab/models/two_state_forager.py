"""Model of foragers that choose one of two resources, by an innate preference or by learning.

The state of the environment is the better resource, 0 or 1. A step has the state of the previous
step with the probability w (`within_persistence`). A lifetime begins in the first state of the
parent's lifetime with the probability b (`between_persistence`). A genome has two alleles. Allele 1
is the innate preference for a resource. Allele 0 is 1 in agents that learn. All agents take the
preferred resource in the first step. Later, agents that learn take the resource that was better in
the previous step (win-stay, lose-shift). Other agents always take the preferred resource.

The payoff of an agent is the fraction of steps in which it takes the better resource. Learning has
a cost. Fitness is 1 + payoff - cost.

By default, each agent has its own states. The state 1 is then the first state of the parent's
lifetime, so the preference 1 is for the resource that was better for the parent at first. With
`shared`, all agents of a generation have the same states, and states are the two resources.

References
----------
D. W. Stephens, "Change, regularity, and value in the evolution of animal learning", Behavioral
Ecology 2 (1991).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from baldwinlab.models import kit
from baldwinlab.parts import LIFE, Field, LifeResults, Measure, Variable, uniforms


class TwoStateForager(kit.BitModel, name="two-state-forager"):
    """Foragers that prefer one of two resources from birth, or learn which is better."""

    between_persistence: kit.Share = Field(
        0.9, description="Probability that a life begins in the first state of the parent's life."
    )
    within_persistence: kit.Share = Field(
        0.95, description="Probability that a step has the state of the step before."
    )
    life_steps: int = Field(10, ge=1, le=10_000, description="Number of steps in a lifetime.")
    learning: bool = Field(
        True, description="Whether agents with the learning allele learn. Otherwise no agent does."
    )
    cost: kit.Share = Field(0.1, description="Cost of learning in a lifetime, in fitness.")
    shared: bool = Field(
        False, description="Whether all agents of a generation have the same states."
    )

    defaults = {
        "population": {"size": 1000},
        "evolution": {"generations": 301, "variation": "bit-flips", "mutation_rate": 0.001},
    }
    records = {
        "learns": Variable.flag("1 if the agent can learn, else 0"),
        "innate_match": Variable.flag("1 if the innate preference is correct at birth, else 0"),
        "innate_error": Variable.share("share of steps with a wrong innate preference"),
    }
    innate_trait = "innate_match"
    learned_distance = "innate_error"
    lifetime_steps = "life_steps"
    settings_without_learning = {"learning": False}
    measures = {
        "learners": Measure(
            "share of agents that can learn in the last generation",
            kit.mean_of_last_generation("learns"),
        ),
        **kit.measure_second_halves(
            {"innate_match": "share of agents with a correct innate preference"}
        ),
    }

    @property
    def assimilation_obstacle(self) -> str:  # type: ignore[override]
        if self.between_persistence == 0.5:
            return "The first state of a life does not depend on that of the parent's life."
        return ""

    def n_weights(self) -> int:
        return 2

    def simulate(
        self, seed: int, runs: Sequence[int], generation: int, genomes: kit.Genomes
    ) -> LifeResults:
        can_learn = (genomes[:, :, 0, 0] > 0.5) & self.learning
        preference = (genomes[:, :, 0, 1] > 0.5).astype(np.int64)
        n_agents = genomes.shape[1]
        # [run, agent, step]. The size of the agent axis is 1 if the states are shared.
        states = np.stack([self.states(seed, run, generation, n_agents) for run in runs])
        innate_matches = states == preference[:, :, None]
        # After the first step, an agent that learns is correct if the state has not changed.
        matches = innate_matches.copy()
        persists = np.broadcast_to(states[:, :, 1:] == states[:, :, :-1], matches[:, :, 1:].shape)
        matches[can_learn, 1:] = persists[can_learn]
        records = {
            "learns": can_learn,
            "innate_match": innate_matches[:, :, 0],
            "innate_error": 1 - innate_matches.mean(axis=-1, dtype=np.float32),
        }
        # At death, an agent that learns prefers the state of the last step.
        learned_preference = np.where(can_learn, states[:, :, -1], preference)
        learned = genomes[:, :, 0].copy()
        learned[:, :, 1] = learned_preference
        cost = np.where(can_learn, self.cost, 0.0)
        return self.make_results(1 + matches.mean(axis=-1), records, cost=cost, learned=learned)

    def states(self, seed: int, run: int, generation: int, n_agents: int) -> kit.Integers:
        """Return the states of a generation [agent, step], 0 or 1, or [1, step] if shared.

        If the states are not shared, 1 is the first state of the parent's lifetime.
        """
        shape = (1 if self.shared else n_agents, self.life_steps)
        draws = uniforms(seed, run, generation, LIFE, shape)[:, :, 0]
        changes = draws >= self.within_persistence
        if self.shared:
            changes[:, 0] = self.first_state(seed, run, generation) == 0
        else:
            changes[:, 0] = draws[:, 0] >= self.between_persistence
        # The state is 1 before the first step, and each change inverts the state.
        states: kit.Integers = (1 + changes.cumsum(axis=1)) % 2
        return states

    def first_state(self, seed: int, run: int, generation: int) -> int:
        """Return the shared first state of a generation. The first state of generation 0 is 1."""
        # The first draw is not used. Draw i decides whether the state changes before generation i.
        draws = kit.draw_environment(seed, run, (1, generation + 1))[0, 1:, 0]
        n_changes = int((draws >= self.between_persistence).sum())
        return (1 + n_changes) % 2
