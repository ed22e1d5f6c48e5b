"""Model of a robot that must switch on a lamp and then stay near the lamp.

    baldwinlab reproduce floreano-urzelai-2000

The arena is a square with a side of 1. A stripe on a wall marks the switch. The lamp is lit from
the first step in which the robot is within 0.2 of the stripe. Fitness is the fraction of the steps
of a lifetime that the robot spends within 0.2 of the lit lamp. Sensors of the lit lamp point ahead,
left, back and right. Sensors of the stripe point half left, ahead and half right. Sensors of walls
point ahead, left and right. All neurons are logistic. Each neuron receives all inputs and the
previous values of all neurons. The last two neurons drive the wheels.

`encoding` is the genetic encoding. A gene has five bits.

- `neurons` and `synapses`: each neuron or each synapse has a gene with a sign (1 bit), one of four
  learning rules (2 bits) and a rate (2 bits). The weights are small and random at birth, and change
  in each step, within [0, 1]. The rule and the rate of a neuron apply to all incoming synapses. The
  sign of a neuron applies to all outgoing synapses (`sign = "source"`) or to all incoming synapses
  (`sign = "target"`).
- `strengths`: each synapse has a gene with a sign (1 bit) and a strength (4 bits). The weights do
  not change.

In each generation, each agent has an additional lifetime in a changed world. The additional
lifetime does not affect fitness.

The changes follow Urzelai and Floreano 2001. The constants of the paper are from memory. The
geometry, the senses, the number of neurons and the sizes of the changes are our choice.

The module `light_switch_lifetimes` has the arena and the neurons.

References
----------
D. Floreano and J. Urzelai, "Evolutionary robots with on-line self-organization and behavioral
fitness", Neural Networks 13 (2000).
J. Urzelai and D. Floreano, "Evolution of adaptive synapses", Evolutionary Computation 9 (2001).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final, Literal

import numpy as np

from baldwinlab.core.deferred import xr
from baldwinlab.engine import poison
from baldwinlab.models import kit
from baldwinlab.models.light_switch_lifetimes import N_INPUTS, Arena, Synapses, simulate_lifetimes
from baldwinlab.parts import LIFE, Field, LifeResults, Measure, Variable, uniforms

# Number of bits of the gene of a neuron or of a synapse.
BITS_PER_GENE: Final = 5
# Upper limit of a weight at birth.
MAX_INITIAL_WEIGHT: Final = 0.1
# Difference between two successive learning rates. Two bits give the rates 0, 0.3, 0.6 and 0.9.
RATE_STEP: Final = 0.3
# Values of the four bits of a strength, and the sum of these values.
STRENGTH_BIT_VALUES: Final = (8, 4, 2, 1)
MAX_STRENGTH_LEVEL: Final = 15
# Number of last generations over which measures are averaged.
N_LAST_GENERATIONS: Final = 10
STANDARD_WORLD: Final = Arena(
    stripe_x=1.0, stripe_y=0.5, lamp_x=0.15, lamp_y=0.5, sense_strength=1.0, left_wheel_speed=1.0
)
CHANGED_WORLDS: Final = {
    "places": STANDARD_WORLD._replace(stripe_x=0.5, stripe_y=1.0, lamp_x=0.85, lamp_y=0.15),
    "senses": STANDARD_WORLD._replace(sense_strength=0.5),
    "wheels": STANDARD_WORLD._replace(left_wheel_speed=0.6),
}


def _share_of_retained_score(runs: xr.Dataset) -> xr.DataArray:
    """Return the score in the changed world divided by the score, or NaN if the score is 0."""
    score, changed = (
        kit.mean_of_last_generations(record, N_LAST_GENERATIONS)(runs)
        for record in ("score", "changed")
    )
    return changed / score.where(score > 0)


class LightSwitch(kit.BitModel, name="light-switch"):
    """Robots that switch on a lamp and stay below it."""

    encoding: Literal["neurons", "synapses", "strengths"] = Field(
        "neurons",
        description=(
            "Content of the genes: sign, rule and rate per neuron or per synapse, or "
            "sign and strength per synapse."
        ),
    )
    sign: Literal["source", "target"] = Field(
        "source",
        description=(
            "Neuron whose gene sets the sign of a synapse, for genes per neuron: source or target."
        ),
    )
    plasticity: bool = Field(
        True, description="Whether weights change during life, if genes are rules."
    )
    neurons: int = Field(
        6, ge=2, le=100, description="Number of neurons. The last two drive the wheels."
    )
    steps_per_life: int = Field(500, ge=1, le=100_000, description="Number of steps of a lifetime.")
    change: Literal["places", "senses", "wheels"] = Field(
        "places",
        description=(
            "Change in the additional test lifetime: other positions, senses of half "
            "strength, or a slower left wheel."
        ),
    )

    defaults = {
        "population": {"size": 100},
        "evolution": {
            "generations": 41,
            "selection": "best-copies",
            "variation": "bit-flips",
            "mutation_rate": 0.05,
        },
        "record": {"genome_every": 10},
    }
    payoff = "share of life under the lit lamp"
    lifetime_steps = "steps_per_life"
    settings_without_learning = {"plasticity": False}
    assimilation_obstacle = "The weights of a learner at birth are random in each life."
    records = {
        "score": Variable.share("share of steps under the lit lamp"),
        "changed": Variable.share("share of steps under the lit lamp in a changed world"),
    }
    measures = {
        "changed": Measure(
            "share of steps under the lit lamp in a changed world, last ten generations",
            kit.mean_of_last_generations("changed", N_LAST_GENERATIONS),
        ),
        "retained": Measure(
            "share of the score that remains in a changed world, last ten generations",
            _share_of_retained_score,
        ),
    }

    @property
    def learns(self) -> bool:
        return self.encoding != "strengths" and self.plasticity

    @property
    def synapses(self) -> int:
        return self.neurons * (N_INPUTS + self.neurons)

    @property
    def n_genes(self) -> int:
        """Return the number of genes: of neurons or of synapses."""
        return self.neurons if self.encoding == "neurons" else self.synapses

    @property
    def _has_input_signs(self) -> bool:
        return self.encoding == "neurons" and self.sign == "source"

    def n_weights(self) -> int:
        # Inputs are sources without genes. If the sign belongs to sources, each has a sign bit.
        n_input_signs = N_INPUTS if self._has_input_signs else 0
        return BITS_PER_GENE * self.n_genes + n_input_signs

    def simulate(
        self, seed: int, runs: Sequence[int], generation: int, genomes: kit.Genomes
    ) -> LifeResults:
        shape = genomes.shape[:2]
        bits = (genomes[:, :, 0] > 0.5).astype(np.int64)
        synapses = self._decode_synapses(seed, runs, generation, bits)
        # [run, 4]: random numbers for the initial position and heading, equal for all agents.
        initial_draws = np.stack(
            [uniforms(seed, run, generation, LIFE, (1, 1))[0, 0] for run in runs]
        ).astype(np.float32)
        shares = []
        for world in (STANDARD_WORLD, CHANGED_WORLDS[self.change]):
            lit_steps = poison.empty(shape, np.int64)
            values = poison.empty((2, N_INPUTS + self.neurons), np.float32)
            simulate_lifetimes(
                self.steps_per_life,
                Arena(*np.array(world, np.float32)),
                initial_draws,
                # Learning changes the weights, so each lifetime gets a copy of those at birth.
                synapses._replace(weights=synapses.weights.copy()),
                values,
                lit_steps,
            )
            shares.append(lit_steps / self.steps_per_life)
        score, changed_score = shares
        return self.make_results(score, {"score": score, "changed": changed_score})

    def _decode_synapses(
        self, seed: int, runs: Sequence[int], generation: int, bits: kit.Integers
    ) -> Synapses:
        """Return the synapses at birth from the genes `bits` [run, agent, bit]."""
        n_runs, n_agents = bits.shape[:2]
        shape = (n_runs, n_agents, self.neurons, N_INPUTS + self.neurons)
        n_gene_bits = BITS_PER_GENE * self.n_genes
        # [run, agent, neuron, source, bit]. If genes belong to neurons, there is one source, which
        # is later broadcast to all sources.
        genes = bits[..., :n_gene_bits].reshape(n_runs, n_agents, self.neurons, -1, BITS_PER_GENE)
        sign_bits = genes[..., 0]
        if self._has_input_signs:
            input_signs = bits[..., n_gene_bits:]
            source_signs = np.concatenate([input_signs, sign_bits[..., 0]], axis=-1)
            # A source has the same sign for all target neurons: [run, agent, 1, source].
            sign_bits = source_signs[:, :, None]
        signs = (1 - 2 * sign_bits).astype(np.float32)
        # Bits 1 and 2 are the rule, bits 3 and 4 the rate.
        rules = 2 * genes[..., 1] + genes[..., 2]
        rate_levels = 2 * genes[..., 3] + genes[..., 4]
        rate_step = RATE_STEP if self.learns else 0.0
        rates = (rate_step * rate_levels).astype(np.float32)
        if self.encoding == "strengths":
            strength_levels = (genes[..., 1:] * STRENGTH_BIT_VALUES).sum(axis=-1)
            weights = (strength_levels / MAX_STRENGTH_LEVEL).astype(np.float32)
        else:
            # Row 0 is the random numbers of the initial position and heading, see `simulate`.
            draws = kit.draw_lifetimes(seed, runs, generation, (1 + n_agents, self.synapses))
            weights = (MAX_INITIAL_WEIGHT * draws[:, 1:]).astype(np.float32).reshape(shape)
        return Synapses(
            signs=np.broadcast_to(signs, shape).copy(),
            rules=np.broadcast_to(rules, shape).copy(),
            rates=np.broadcast_to(rates, shape).copy(),
            weights=weights,
        )
