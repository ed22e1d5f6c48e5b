"""Controls of learning for any model: changes of the same size that carry no information.

Learners evolve from the same founders beside the control. An agent of the control begins its
lifetime with changes that have the size of those of a learner, and does not learn. Offspring
inherit the genome at birth.

- `drift`: random changes. A string flips as many bits as the learner of the same index, at random
  loci. A weight moves as far as that of this learner, in a random direction.
- `yoked`: the changes of the next learner. The last agent has those of the first learner.

An agent pays the cost of these changes. The learners are not the agents of the control themselves,
because the size of an agent's own changes has information: on a landscape with one peak, the string
opposite to the peak flips all bits, so that random loci would lead it to the peak.

MiniWorld has controls in its step, see `models/miniworld/learning/control.py`. They use the changes
that the agents themselves would make, in the course of their lifetime.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final, Literal

import numpy as np
import numpy.typing as npt

from baldwinlab.engine.rng import DRIFT, uniforms
from baldwinlab.evolution import Genome, make_founders, make_run_keys
from baldwinlab.experiment import BaseExperiment
from baldwinlab.models import make_simulator
from baldwinlab.parts.model_part import LifeResults
from baldwinlab.simulation.generations import iterate_generations

Kind = Literal["drift", "yoked"]
Weights = npt.NDArray[np.float32]
BITS: Final = {0.0, 1.0}
"""Values of the alleles of strings of bits."""


class NoiseControl:
    """Simulator of consecutive generations whose agents change as much as learners."""

    def __init__(
        self, experiment: BaseExperiment, seed: int, runs: Sequence[int], kind: Kind
    ) -> None:
        """`experiment`: the learner. Its model returns the weights at death."""
        self._seed = seed
        self._runs = runs
        self._kind = kind
        self._has_bits = {*experiment.model_part.alleles.values()} == BITS
        founders = make_founders(experiment, make_run_keys(seed, runs, 0))
        generations = range(experiment.evolution.generations)
        self._learners = iterate_generations(experiment, seed, runs, generations, founders)
        self._controls = make_simulator(experiment.without_learning(), seed, runs)

    def simulate(self, generation: int, genomes: Genome, *sizes: int) -> LifeResults:
        """Return the results of the next generation, with the changes of the control."""
        learners = next(self._learners)
        if learners.number != generation:
            raise ValueError(
                f"generation = {generation} must be the next one, {learners.number}: the learners "
                "evolve beside the control"
            )
        death = learners.results.learned
        if death is None:
            raise ValueError("the model returns no weights at death, which this control needs")
        n_weights = death.shape[-1]
        changes = death - learners.genomes[:, :, 0, :n_weights]
        cost = learners.results.cost
        if self._kind == "yoked":
            changes, cost = (np.roll(values, -1, axis=1) for values in (changes, cost))
        else:
            changes = self._shuffle(changes, generation)
        changed = genomes.copy()
        changed[:, :, 0, :n_weights] = self._apply(genomes[:, :, 0, :n_weights], changes)
        return self._controls.simulate(generation, changed)._replace(cost=cost)

    def _shuffle(self, changes: Weights, generation: int) -> Weights:
        """Return changes [run, agent, weight] of the same size at random loci, or with signs."""
        n_agents, n_weights = changes.shape[1:]
        draws = np.stack(
            [
                uniforms(self._seed, run, generation, DRIFT, (n_agents, n_weights))[:, :, 0]
                for run in self._runs
            ]
        )
        if self._has_bits:
            # Sorting the draws of an agent gives a random order of its loci.
            return np.take_along_axis(changes, draws.argsort(axis=-1), axis=-1)
        return changes * np.where(draws < 0.5, np.float32(1), np.float32(-1))

    def _apply(self, birth: Weights, changes: Weights) -> Weights:
        """Return the weights after the changes. A changed bit flips, whatever its value."""
        changed: Weights = (
            np.where(changes != 0, 1 - birth, birth) if self._has_bits else birth + changes
        )
        return changed
