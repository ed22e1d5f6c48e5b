"""The model of robots that switch on a lamp: settings, records and measures."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any, ClassVar, Final, Literal

import numpy as np
import numpy.typing as npt
import xarray as xr

from baldwinlab.engine import poison
from baldwinlab.models.light_switch.lifetimes import N_INPUTS, simulate_lifetimes
from baldwinlab.parts import (
    FOUNDER,
    LIFE,
    PER_AGENT_DIMS,
    Field,
    LifeResults,
    Measure,
    Model,
    Variable,
    uniforms,
)

# Number of bits of a gene, which belongs to a neuron or to a synapse.
BITS_PER_GENE: Final = 5
# Upper limit of a weight at birth.
MAX_INITIAL_WEIGHT: Final = 0.1
# Layout of a world: x and y of the stripe, x and y of the lamp, strength of the senses, and speed
# of the left wheel as a share of full speed.
STANDARD_WORLD: Final = (1.0, 0.5, 0.15, 0.5, 1.0, 1.0)
CHANGED_WORLDS: Final = {
    "places": (0.5, 1.0, 0.85, 0.15, 1.0, 1.0),
    "senses": (1.0, 0.5, 0.15, 0.5, 0.5, 1.0),
    "wheels": (1.0, 0.5, 0.15, 0.5, 1.0, 0.6),
}


def _mean_of_last_generations(record: str) -> Callable[[xr.Dataset], xr.DataArray]:
    """Return a function of runs: the mean of a record over the last ten generations."""
    return lambda runs: runs[record].isel(generation=slice(-10, None)).mean(("generation", "agent"))


class LightSwitch(Model, name="light-switch"):
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

    defaults: ClassVar[Mapping[str, Mapping[str, Any]]] = {
        "population": {"size": 100},
        "evolution": {
            "generations": 41,
            "selection": "best-copies",
            "variation": "bit-flips",
            "mutation_rate": 0.05,
        },
        "record": {"genome_every": 10},
    }
    payoff: ClassVar[str] = "share of life under the lit lamp"
    alleles: ClassVar[Mapping[str, float]] = {"0": 0.0, "1": 1.0}
    records: ClassVar[Mapping[str, Variable]] = {
        "score": Variable(PER_AGENT_DIMS, np.float32, "1", "share of steps under the lit lamp"),
        "changed": Variable(
            PER_AGENT_DIMS, np.float32, "1", "share of steps under the lit lamp in a changed world"
        ),
    }
    measures: ClassVar[Mapping[str, Measure]] = {
        "changed": Measure(
            "share of steps under the lit lamp in a changed world, last ten generations",
            _mean_of_last_generations("changed"),
        ),
        "retained": Measure(
            ("share of the score that remains in a changed world, last ten generations"),
            lambda runs: (
                _mean_of_last_generations("changed")(runs)
                / _mean_of_last_generations("score")(runs).where(lambda score: score > 0)
            ),
        ),
    }

    @property
    def learns(self) -> bool:
        return self.encoding != "strengths" and self.plasticity

    @property
    def steps(self) -> int:
        return self.steps_per_life

    def without_learning(self) -> LightSwitch:
        return self.model_copy(update={"plasticity": False})

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
        # Inputs have no genes of their own. If signs belong to sources, each input has a sign bit.
        n_input_signs = N_INPUTS if self._has_input_signs else 0
        return BITS_PER_GENE * self.n_genes + n_input_signs

    def founders(self, agents: int, key: Any) -> npt.NDArray[np.float32]:
        draws = key.uniforms(FOUNDER, (agents, self.n_weights()))[:, None, :, 0]
        drawn: npt.NDArray[np.float32] = (draws < 0.5).astype(np.float32)
        return drawn

    def simulate(
        self, seed: int, runs: Sequence[int], generation: int, genomes: npt.NDArray[np.float32]
    ) -> LifeResults:
        shape = genomes.shape[:2]
        signs, rules, rates, weights = self._decode(
            seed, runs, generation, (genomes[:, :, 0] > 0.5).astype(np.int64)
        )
        initial_draws = np.stack(
            [uniforms(seed, run, generation, LIFE, (1, 1))[0, 0] for run in runs]
        ).astype(np.float32)
        shares = []
        for world in (STANDARD_WORLD, CHANGED_WORLDS[self.change]):
            lit_steps = poison.empty(shape, np.int64)
            values = poison.empty((2, N_INPUTS + self.neurons), np.float32)
            simulate_lifetimes(
                self.steps_per_life,
                np.array(world, np.float32),
                initial_draws,
                signs,
                rules,
                rates,
                weights.copy(),
                values,
                lit_steps,
            )
            shares.append(lit_steps / self.steps_per_life)
        score, changed = shares
        records = {"score": score.astype(np.float32), "changed": changed.astype(np.float32)}
        return LifeResults(score, np.zeros(shape), None, records)

    def _decode(
        self, seed: int, runs: Sequence[int], generation: int, bits: npt.NDArray[np.int64]
    ) -> tuple[Any, ...]:
        """Return signs, rules, rates and weights at birth from the genes `bits` [run, agent, bit].

        Each returned array has the shape [run, agent, neuron, source].
        """
        shape = (*bits.shape[:2], self.neurons, N_INPUTS + self.neurons)
        genes = bits[..., : BITS_PER_GENE * self.n_genes].reshape(*shape[:3], -1, BITS_PER_GENE)
        is_negative = genes[..., 0]
        if self._has_input_signs:
            input_signs = bits[..., BITS_PER_GENE * self.n_genes :]
            source_signs = np.concatenate([input_signs, is_negative[..., 0]], axis=-1)
            # The same signs for all target neurons.
            is_negative = source_signs[:, :, None]
        rates = (0.3 * self.learns * (2 * genes[..., 3] + genes[..., 4])).astype(np.float32)
        properties = (
            (1 - 2 * is_negative).astype(np.float32),
            2 * genes[..., 1] + genes[..., 2],
            rates,
        )
        signs, rules, rates = (np.broadcast_to(values, shape).copy() for values in properties)
        if self.encoding == "strengths":
            strengths = ((genes[..., 1:] * (8, 4, 2, 1)).sum(axis=-1) / 15).astype(np.float32)
            return signs, rules, rates, strengths
        draws = [
            uniforms(seed, run, generation, LIFE, (1 + bits.shape[1], self.synapses))[1:, :, 0]
            for run in runs
        ]
        return (
            signs,
            rules,
            rates,
            (MAX_INITIAL_WEIGHT * np.stack(draws)).astype(np.float32).reshape(shape),
        )
