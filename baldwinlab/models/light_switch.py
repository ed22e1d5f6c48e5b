"""A robot that is to switch a lamp on and then to stay under it, by a network whose genes are rules for learning, or weights.

    baldwinlab reproduce floreano-urzelai-2000

In a square arena with a side of 1, a stripe on a wall marks where the lamp is switched on: within
0.2 of it. From then on the lamp is lit. Fitness is the share of a life's steps spent within 0.2 of
the lamp while it is lit. A robot senses the lamp, where it is lit, to its front, left, back and
right; the stripe, half left, ahead and half right; and walls ahead, left and right. All neurons are
logistic, sense all inputs and, as they were, each other, and the last two drive the wheels.

`encoding` is the genetic encoding: of each neuron, or of each synapse, a sign, one of four rules
and a rate (5 bits: 1, 2, 2), and weights are small and random at birth, and change in every step,
in [0, 1]; or of each synapse a sign and a strength (5 bits: 1, 4), which stay. A neuron's rule and
rate are those of the synapses that lead to it, its sign that of those that it sends. In every
generation each agent has another life, which does not count, in a world that is changed.

Sources: D. Floreano and J. Urzelai, "Evolutionary robots with on-line self-organization and
behavioral fitness", Neural Networks 13 (2000); J. Urzelai and D. Floreano, "Evolution of adaptive
synapses", Evolutionary Computation 9 (2001), for the changes. Their numbers here are from memory;
the geometry, the senses, the number of neurons and the changes' sizes are readings of ours.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any, ClassVar, Final, Literal

import numpy as np
import numpy.typing as npt
import xarray as xr

from baldwinlab.engine import poison
from baldwinlab.engine.arithmetic import sigmoid
from baldwinlab.engine.jit import compiled, jit_entry_point
from baldwinlab.engine.simd import square_root
from baldwinlab.evolution.variation import Draws, OneGenome
from baldwinlab.evolution.variation_operators import (
    cross_at_point,
    draw_cut,
    flatten,
    is_from_fitter,
    split_modules,
)
from baldwinlab.models.miniworld.learning.hebbian import change
from baldwinlab.parts import (
    FOUNDER,
    LIFE,
    OF_AGENT,
    Field,
    LifeResults,
    Measure,
    Model,
    Variable,
    Variation,
    uniforms,
)

INPUTS: Final = (
    11  # four of the lamp, three of the stripe, three of walls, and a bias that is always 1
)
GENES: Final = 5  # of a neuron, or of a synapse: bits
SMALL: Final = 0.1  # the greatest weight at birth
SPEED, TURN = (
    np.float32(0.02),
    np.float32(0.15),
)  # sides a step, and half the tangent of half the angle, at full speed
REACH, NEAR = (
    np.float32(0.2),
    np.float32(0.1),
)  # of the lamp and the stripe; from where a wall is felt
ZERO, ONE, TWO, THREE = (np.float32(number) for number in range(4))
# Where the stripe and the lamp are (x, y each), how much of a sense arrives, and how much of the
# left wheel's speed.
WORLD: Final = (1.0, 0.5, 0.15, 0.5, 1.0, 1.0)
CHANGED: Final = {
    "places": (0.5, 1.0, 0.85, 0.15, 1.0, 1.0),
    "senses": (1.0, 0.5, 0.15, 0.5, 0.5, 1.0),
    "wheels": (1.0, 0.5, 0.15, 0.5, 1.0, 0.6),
}


def _last(name: str) -> Callable[[xr.Dataset], xr.DataArray]:
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
        "kept": Measure(
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
        return self.neurons * (INPUTS + self.neurons)

    @property
    def coded(self) -> int:
        """What has five genes each."""
        return self.neurons if self.encoding == "neurons" else self.synapses

    def weights(self) -> int:
        return GENES * self.coded + (
            INPUTS if self.encoding == "neurons" and self.sign == "source" else 0
        )

    def founders(self, agents: int, key: Any) -> npt.NDArray[np.float32]:
        draws = key.uniforms(FOUNDER, (agents, self.weights()))[:, None, :, 0]
        drawn: npt.NDArray[np.float32] = (draws < 0.5).astype(np.float32)
        return drawn

    def simulate(
        self, seed: int, runs: Sequence[int], generation: int, genomes: npt.NDArray[np.float32]
    ) -> LifeResults:
        shape = genomes.shape[:2]
        signs, rules, rates, born = self._read(
            seed, runs, generation, (genomes[:, :, 0] > 0.5).astype(np.int64)
        )
        begin = np.stack(
            [uniforms(seed, run, generation, LIFE, (1, 1))[0, 0] for run in runs]
        ).astype(np.float32)
        found = []
        for world in (WORLD, CHANGED[self.change]):
            lit = poison.empty(shape, np.int64)
            values = poison.empty((2, INPUTS + self.neurons), np.float32)
            drive(
                self.steps_per_life,
                np.array(world, np.float32),
                begin,
                signs,
                rules,
                rates,
                born.copy(),
                values,
                lit,
            )
            found.append(lit / self.steps_per_life)
        score, changed = found
        records = {"score": score.astype(np.float32), "changed": changed.astype(np.float32)}
        return LifeResults(score, np.zeros(shape), None, records)

    def _read(
        self, seed: int, runs: Sequence[int], generation: int, bits: npt.NDArray[np.int64]
    ) -> tuple[Any, ...]:
        """Signs, rules, rates and weights at birth, [run, agent, neuron, source] each, by the genes `bits` [run, agent, bit]."""
        synapses = (*bits.shape[:2], self.neurons, INPUTS + self.neurons)
        genes = bits[..., : GENES * self.coded].reshape(*synapses[:3], -1, GENES)
        negative = genes[..., 0]
        if self.encoding == "neurons" and self.sign == "source":
            negative = np.concatenate([bits[..., GENES * self.coded :], negative[..., 0]], axis=-1)[
                :, :, None
            ]
        rates = (0.3 * self.learns * (2 * genes[..., 3] + genes[..., 4])).astype(np.float32)
        of_synapses = (
            (1 - 2 * negative).astype(np.float32),
            2 * genes[..., 1] + genes[..., 2],
            rates,
        )
        signs, rules, rates = (np.broadcast_to(each, synapses).copy() for each in of_synapses)
        if self.encoding == "strengths":
            return (
                signs,
                rules,
                rates,
                ((genes[..., 1:] * (8, 4, 2, 1)).sum(axis=-1) / 15).astype(np.float32),
            )
        draws = [
            uniforms(seed, run, generation, LIFE, (1 + bits.shape[1], self.synapses))[1:, :, 0]
            for run in runs
        ]
        return signs, rules, rates, (SMALL * np.stack(draws)).astype(np.float32).reshape(synapses)


@jit_entry_point
def drive(
    moves: int,
    world: Any,
    begin: Any,
    signs: Any,
    rules: Any,
    rates: Any,
    weights: Any,
    values: Any,
    lit: Any,
) -> None:
    """Fill `lit` [run, agent] with the steps under the lit lamp; `weights` [run, agent, neuron, source] change as agents learn.

    `begin` [run, 4] are uniform numbers, of place and heading; `values` [2, input and neuron] is
    scratch.
    """
    for run in range(lit.shape[0]):
        for agent in range(lit.shape[1]):
            lit[run, agent] = _life(
                moves,
                world,
                begin[run],
                signs[run, agent],
                rules[run, agent],
                rates[run, agent],
                weights[run, agent],
                values,
            )


@compiled
def _life(
    moves: Any,
    world: Any,
    begin: Any,
    signs: Any,
    rules: Any,
    rates: Any,
    weights: Any,
    values: Any,
) -> int:
    now, before = values[0], values[1]
    now[:] = ZERO
    x, y = (
        np.float32(0.3) + np.float32(0.4) * begin[0],
        np.float32(0.2) + np.float32(0.6) * begin[1],
    )
    along, across = TWO * begin[2] - ONE, TWO * begin[3] - ONE
    length = square_root(along * along + across * across)
    along, across = (along / length, across / length) if length > ZERO else (ONE, ZERO)
    is_lit, under = False, 0
    for _ in range(moves):
        is_lit = is_lit or _within(x - world[0], y - world[1])
        under += 1 if is_lit and _within(x - world[2], y - world[3]) else 0
        for k in range(now.size):
            before[k] = now[k]
        _sense(world, is_lit, x, y, along, across, before)
        _think(signs, rules, rates, weights, before, now)
        left, right = TWO * now[now.size - 2] - ONE, TWO * now[now.size - 1] - ONE
        left = left * world[5]
        turn = (
            TURN * (right - left) / TWO
        )  # of half the angle the tangent, so that no sine is needed
        square = turn * turn
        cosine, sine = (ONE - square) / (ONE + square), TWO * turn / (ONE + square)
        along, across = along * cosine - across * sine, across * cosine + along * sine
        ahead = SPEED * (left + right) / TWO
        x, y = min(max(x + ahead * along, ZERO), ONE), min(max(y + ahead * across, ZERO), ONE)
    return under


@compiled
def _within(dx: Any, dy: Any) -> bool:
    return bool(dx * dx + dy * dy < REACH * REACH)


@compiled
def _sense(world: Any, is_lit: Any, x: Any, y: Any, along: Any, across: Any, values: Any) -> None:
    """Fill the inputs, in [0, 1]: the lamp's light falls off with distance and angle; walls are felt from near."""
    dx, dy = world[2] - x, world[3] - y
    distance = square_root(dx * dx + dy * dy)
    light = max(ZERO, ONE - distance) / distance if is_lit and distance > ZERO else ZERO
    ahead, left = light * (dx * along + dy * across), light * (dy * along - dx * across)
    values[0], values[1], values[2], values[3] = (
        max(ZERO, ahead),
        max(ZERO, left),
        max(ZERO, -ahead),
        max(ZERO, -left),
    )
    dx, dy = world[0] - x, world[1] - y
    ahead, left = dx * along + dy * across, dy * along - dx * across
    seen = ahead > abs(left)  # within an eighth of a turn
    values[4] = ONE if seen and THREE * left > ahead else ZERO
    values[5] = ONE if seen and THREE * abs(left) <= ahead else ZERO
    values[6] = ONE if seen and THREE * left < -ahead else ZERO
    values[7], values[8], values[9] = (
        _wall(x, y, along, across),
        _wall(x, y, -across, along),
        _wall(x, y, across, -along),
    )
    for i in range(INPUTS - 1):
        values[i] *= world[4]
    values[INPUTS - 1] = ONE


@compiled
def _wall(x: Any, y: Any, dx: Any, dy: Any) -> Any:
    """How near the nearest wall is in a direction, the more the straighter: in [0, 1]."""
    of_x = abs(dx) * max(ZERO, ONE - (ONE - x if dx > ZERO else x) / NEAR)
    of_y = abs(dy) * max(ZERO, ONE - (ONE - y if dy > ZERO else y) / NEAR)
    return max(of_x, of_y)


@compiled
def _think(signs: Any, rules: Any, rates: Any, weights: Any, before: Any, now: Any) -> None:
    """Fill the neurons of `now` from inputs and neurons `before`, and let synapses change by what they were between."""
    for neuron in range(rules.shape[0]):
        total = ZERO
        for source in range(before.size):
            total += signs[neuron, source] * weights[neuron, source] * before[source]
        y = sigmoid(total)
        now[INPUTS + neuron] = y
        for source in range(before.size):
            w, rate = weights[neuron, source], rates[neuron, source]
            if rate > ZERO:
                w += rate * change(rules[neuron, source], w, before[source], y)
                weights[neuron, source] = min(max(w, ZERO), ONE)


class OnePointOfBits(Variation, name="one-point-bits"):
    """One-point crossover of bits; then each bit can flip.

    References
    ----------
    Floreano and Urzelai 2000.
    """

    settings: ClassVar[tuple[str, ...]] = ("mutation_rate",)
    derived: ClassVar[Mapping[str, Any]] = {
        "rate": lambda part, experiment: float(experiment.evolution.mutation_rate)
    }

    @staticmethod
    def vary(
        part: Any, fitter: OneGenome, other: OneGenome, draws: Draws, gate: float, child: OneGenome
    ) -> None:
        cut = draw_cut(gate, child.size)  # of the modules in a row
        for module in range(child.shape[0]):
            for bit in range(child.shape[1]):
                draw = module * child.shape[1] + bit
                of_fitter = is_from_fitter(draw, cut, draws[0, 0])
                inherited = fitter[module, bit] if of_fitter else other[module, bit]
                child[module, bit] = ONE - inherited if draws[draw, 1] < part.rate else inherited

    @staticmethod
    def oracle(part: Any, fitter: Any, other: Any, draws: Any, gate: float) -> Any:
        inherited = cross_at_point(flatten(fitter), flatten(other), gate, draws[0][0])
        child = [
            1 - bit if draw[1] < part.rate else bit
            for bit, draw in zip(inherited, draws, strict=True)
        ]
        return split_modules(child, len(fitter[0]))
