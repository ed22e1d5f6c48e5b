"""The model of foragers with two resources, one of which is better: innate preference or learning.

The better resource is the state. It persists from step to step with the probability w, and from
the first step of a parent's life to that of its child with the probability b. A genome has two
alleles. The second is the innate preference, with which each agent begins. The first is 1 in
agents that learn: after the first step, they take the resource that was better in the last step
(win-stay, lose-shift). Other agents keep their innate preference.

The payoff of an agent is the share of steps in which it takes the better resource. Learning has a
cost. Fitness is 1 + payoff - cost.

By default, each agent has its own states. The preference is then relative to the first state of
the parent's life: 1 is the same resource, which makes an innate tracker. With `shared`, all agents
of a generation have the same states, and a preference is one of the two resources.

References
----------
D. W. Stephens, "Change, regularity, and value in the evolution of animal learning", Behavioral
Ecology 2 (1991).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from baldwinlab.models import kit
from baldwinlab.parts import LIFE, Field, LifeResults, Measure, Model, Variable, uniforms


class TwoStateForager(Model, name="two-state-forager"):
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
    alleles = kit.BITS
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

    def founders(self, agents: int, key: Any) -> kit.Genomes:
        return kit.draw_bits(key, agents, self.n_weights())

    def simulate(
        self, seed: int, runs: Sequence[int], generation: int, genomes: kit.Genomes
    ) -> LifeResults:
        can_learn = (genomes[:, :, 0, 0] > 0.5) & self.learning
        preference = (genomes[:, :, 0, 1] > 0.5).astype(np.int64)
        n_agents = genomes.shape[1]
        # [run, agent, step]; a single agent if the states are shared.
        states = np.stack([self.states(seed, run, generation, n_agents) for run in runs])
        innate_matches = states == preference[:, :, None]
        # A learner is correct after the first step if the state has not changed.
        matches = innate_matches.copy()
        persists = np.broadcast_to(states[:, :, 1:] == states[:, :, :-1], matches[:, :, 1:].shape)
        matches[can_learn, 1:] = persists[can_learn]
        records = {
            "learns": can_learn,
            "innate_match": innate_matches[:, :, 0],
            "innate_error": 1 - innate_matches.mean(axis=-1, dtype=np.float32),
        }
        # A learner takes the last state in the next step.
        learned_preference = np.where(can_learn, states[:, :, -1], preference)
        learned = genomes[:, :, 0].copy()
        learned[:, :, 1] = learned_preference
        cost = np.where(can_learn, self.cost, 0.0)
        return self.make_results(1 + matches.mean(axis=-1), records, cost=cost, learned=learned)

    def states(self, seed: int, run: int, generation: int, n_agents: int) -> kit.Integers:
        """Return the states of a generation [agent, step], 0 or 1, of one agent if shared.

        If they are not shared, 1 is the first state of the parent's life.
        """
        shape = (1 if self.shared else n_agents, self.life_steps)
        # The first of four numbers per step.
        draws = uniforms(seed, run, generation, LIFE, shape)[:, :, 0]
        changes = draws >= self.within_persistence
        if self.shared:
            changes[:, 0] = self.first_state(seed, run, generation) == 0
        else:
            changes[:, 0] = draws[:, 0] >= self.between_persistence
        states: kit.Integers = (1 + changes.cumsum(axis=1)) % 2
        return states

    def first_state(self, seed: int, run: int, generation: int) -> int:
        """Return the shared first state of a generation; it is 1 in generation 0."""
        draws = kit.draw_environment(seed, run, (1, generation + 1))[0, 1:, 0]
        n_changes = int((draws >= self.between_persistence).sum())
        return (1 + n_changes) % 2
