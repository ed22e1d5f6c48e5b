"""The model of robots that switch on a lamp: settings, records and measures."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any, ClassVar, Final, Literal

import numpy as np
import numpy.typing as npt
import xarray as xr

from baldwinlab.engine import poison
from baldwinlab.models.light_switch.lifetimes import N_INPUTS, drive
from baldwinlab.parts import (
    FOUNDER,
    LIFE,
    OF_AGENT,
    Field,
    LifeResults,
    Measure,
    Model,
    Variable,
    uniforms,
)

# Bits per neuron or per synapse.
BITS_PER_GENE: Final = 5
# Largest weight at birth.
MAX_INITIAL_WEIGHT: Final = 0.1
# Positions of the stripe and of the lamp (x and y each), strength of the senses, and speed of the
# left wheel as a share of full speed.
STANDARD_WORLD: Final = (1.0, 0.5, 0.15, 0.5, 1.0, 1.0)
CHANGED_WORLDS: Final = {
    "places": (0.5, 1.0, 0.85, 0.15, 1.0, 1.0),
    "senses": (1.0, 0.5, 0.15, 0.5, 0.5, 1.0),
    "wheels": (1.0, 0.5, 0.15, 0.5, 1.0, 0.6),
}


def _last(name: str) -> Callable[[xr.Dataset], xr.DataArray]:
    """Return the mean of a record over the last ten generations."""
    return lambda runs: runs[name].isel(generation=slice(-10, None)).mean(("generation", "agent"))


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
        "score": Variable(OF_AGENT, np.float32, "1", "share of steps under the lit lamp"),
        "changed": Variable(
            OF_AGENT, np.float32, "1", "share of steps under the lit lamp in a changed world"
        ),
    }
    measures: ClassVar[Mapping[str, Measure]] = {
        "changed": Measure(
            "share of steps under the lit lamp in a changed world, last ten generations",
            _last("changed"),
        ),
        "retained": Measure(
            ("share of the score that remains in a changed world, last ten generations"),
            lambda runs: (
                _last("changed")(runs) / _last("score")(runs).where(lambda score: score > 0)
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
    def coded(self) -> int:
        """Return the number of units with five bits each: neurons or synapses."""
        return self.neurons if self.encoding == "neurons" else self.synapses

    def weights(self) -> int:
        return BITS_PER_GENE * self.coded + (
            N_INPUTS if self.encoding == "neurons" and self.sign == "source" else 0
        )

    def founders(self, agents: int, key: Any) -> npt.NDArray[np.float32]:
        draws = key.uniforms(FOUNDER, (agents, self.weights()))[:, None, :, 0]
        drawn: npt.NDArray[np.float32] = (draws < 0.5).astype(np.float32)
        return drawn

    def simulate(
        self, seed: int, runs: Sequence[int], generation: int, genomes: npt.NDArray[np.float32]
    ) -> LifeResults:
        shape = genomes.shape[:2]
        signs, rules, rates, weights = self._decode(
            seed, runs, generation, (genomes[:, :, 0] > 0.5).astype(np.int64)
        )
        begin = np.stack(
            [uniforms(seed, run, generation, LIFE, (1, 1))[0, 0] for run in runs]
        ).astype(np.float32)
        shares = []
        for world in (STANDARD_WORLD, CHANGED_WORLDS[self.change]):
            lit = poison.empty(shape, np.int64)
            values = poison.empty((2, N_INPUTS + self.neurons), np.float32)
            drive(
                self.steps_per_life,
                np.array(world, np.float32),
                begin,
                signs,
                rules,
                rates,
                weights.copy(),
                values,
                lit,
            )
            shares.append(lit / self.steps_per_life)
        score, changed = shares
        records = {"score": score.astype(np.float32), "changed": changed.astype(np.float32)}
        return LifeResults(score, np.zeros(shape), None, records)

    def _decode(
        self, seed: int, runs: Sequence[int], generation: int, bits: npt.NDArray[np.int64]
    ) -> tuple[Any, ...]:
        """Return signs, rules, rates and weights at birth from the genes `bits` [run, agent, bit].

        Each returned array has the shape [run, agent, neuron, source].
        """
        synapses = (*bits.shape[:2], self.neurons, N_INPUTS + self.neurons)
        genes = bits[..., : BITS_PER_GENE * self.coded].reshape(*synapses[:3], -1, BITS_PER_GENE)
        negative = genes[..., 0]
        if self.encoding == "neurons" and self.sign == "source":
            negative = np.concatenate(
                [bits[..., BITS_PER_GENE * self.coded :], negative[..., 0]], axis=-1
            )[:, :, None]
        rates = (0.3 * self.learns * (2 * genes[..., 3] + genes[..., 4])).astype(np.float32)
        of_synapses = (
            (1 - 2 * negative).astype(np.float32),
            2 * genes[..., 1] + genes[..., 2],
            rates,
        )
        signs, rules, rates = (np.broadcast_to(values, synapses).copy() for values in of_synapses)
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
            (MAX_INITIAL_WEIGHT * np.stack(draws)).astype(np.float32).reshape(synapses),
        )
