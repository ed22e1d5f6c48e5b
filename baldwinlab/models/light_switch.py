"""A robot that must switch on a lamp and then stay near it, with genes for rules or for weights.

    baldwinlab reproduce floreano-urzelai-2000

The arena is a square with a side of 1. A stripe on a wall marks the switch. The lamp is lit when
the robot has come within 0.2 of the stripe. Fitness is the share of the steps of a lifetime that
the robot spends within 0.2 of the lit lamp. The robot senses the lit lamp in front, left, behind
and right, the stripe half left, ahead and half right, and walls ahead, left and right. All neurons
are logistic. Each neuron receives all inputs and the previous values of all neurons. The last two
neurons drive the wheels.

`encoding` is the genetic encoding. With rules, a gene of five bits has a sign (1 bit), one of four
learning rules (2 bits) and a rate (2 bits), for each neuron or for each synapse. The weights are
small and random at birth and change in each step, within [0, 1]. With strengths, a gene of five
bits has a sign (1 bit) and a strength (4 bits) for each synapse, and the weights do not change. The
rule and the rate of a neuron apply to its incoming synapses. The sign of a neuron applies to its
outgoing synapses. In each generation, each agent has an additional lifetime in a changed world,
which does not affect its fitness.

The changes follow Urzelai and Floreano 2001. Their numbers are from memory. The geometry, the
senses, the number of neurons and the sizes of the changes are our choice.

References
----------
D. Floreano and J. Urzelai, "Evolutionary robots with on-line self-organization and behavioral
fitness", Neural Networks 13 (2000).
J. Urzelai and D. Floreano, "Evolution of adaptive synapses", Evolutionary Computation 9 (2001).
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
from baldwinlab.models.miniworld.learning.hebbian import strength_change
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

# Four for the lamp, three for the stripe, three for walls, and a bias that is always 1.
INPUTS: Final = 11
# Bits per neuron or per synapse.
GENES: Final = 5
# Largest weight at birth.
SMALL: Final = 0.1
# Distance per step at full speed, in sides of the arena.
SPEED = np.float32(0.02)
# Half the tangent of half the turning angle at full speed.
TURN = np.float32(0.15)
# Radius of the lamp and of the stripe, in sides of the arena.
REACH = np.float32(0.2)
# Distance from which a wall is sensed, in sides of the arena.
NEAR = np.float32(0.1)
ZERO, ONE, TWO, THREE = (np.float32(number) for number in range(4))
# Positions of the stripe and of the lamp (x and y each), strength of the senses, and speed of the
# left wheel as a share of full speed.
WORLD: Final = (1.0, 0.5, 0.15, 0.5, 1.0, 1.0)
CHANGED: Final = {
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
        return self.neurons * (INPUTS + self.neurons)

    @property
    def coded(self) -> int:
        """Return the number of units with five bits each: neurons or synapses."""
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
        signs, rules, rates, weights = self._decode(
            seed, runs, generation, (genomes[:, :, 0] > 0.5).astype(np.int64)
        )
        begin = np.stack(
            [uniforms(seed, run, generation, LIFE, (1, 1))[0, 0] for run in runs]
        ).astype(np.float32)
        shares = []
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
        signs, rules, rates = (np.broadcast_to(values, synapses).copy() for values in of_synapses)
        if self.encoding == "strengths":
            strengths = ((genes[..., 1:] * (8, 4, 2, 1)).sum(axis=-1) / 15).astype(np.float32)
            return signs, rules, rates, strengths
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
    """Simulate lifetimes and count the steps under the lit lamp.

    Parameters
    ----------
    moves : int
        Number of steps of a lifetime.
    world : array of shape (6,)
        Layout of the arena, as `WORLD`.
    begin : array of shape (runs, 4)
        Uniform numbers for the initial position and heading.
    signs, rules, rates : arrays of shape (runs, agents, neurons, sources)
        Signs, learning rules and learning rates of the synapses.
    weights : array of shape (runs, agents, neurons, sources)
        Weights. They change in place as agents learn.
    values : array of shape (2, inputs + neurons)
        Scratch.
    lit : array of shape (runs, agents)
        Output: the number of steps under the lit lamp.
    """
    for run in range(lit.shape[0]):
        for agent in range(lit.shape[1]):
            lit[run, agent] = _simulate_lifetime(
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
def _simulate_lifetime(
    moves: Any,
    world: Any,
    begin: Any,
    signs: Any,
    rules: Any,
    rates: Any,
    weights: Any,
    values: Any,
) -> int:
    """Simulate one lifetime and return the number of steps under the lit lamp."""
    now = values[0]
    before = values[1]
    now[:] = ZERO
    x = np.float32(0.3) + np.float32(0.4) * begin[0]
    y = np.float32(0.2) + np.float32(0.6) * begin[1]
    along = TWO * begin[2] - ONE
    across = TWO * begin[3] - ONE
    length = square_root(along * along + across * across)
    along, across = (along / length, across / length) if length > ZERO else (ONE, ZERO)
    is_lit = False
    steps_under = 0
    for _ in range(moves):
        is_lit = is_lit or _is_within_reach(x - world[0], y - world[1])
        steps_under += 1 if is_lit and _is_within_reach(x - world[2], y - world[3]) else 0
        for k in range(now.size):
            before[k] = now[k]
        _sense(world, is_lit, x, y, along, across, before)
        _update_neurons(signs, rules, rates, weights, before, now)
        left = TWO * now[now.size - 2] - ONE
        right = TWO * now[now.size - 1] - ONE
        left = left * world[5]
        # The tangent of half the turning angle. Sine and cosine follow from it by division.
        turn = TURN * (right - left) / TWO
        square = turn * turn
        cosine = (ONE - square) / (ONE + square)
        sine = TWO * turn / (ONE + square)
        along, across = along * cosine - across * sine, across * cosine + along * sine
        ahead = SPEED * (left + right) / TWO
        x = min(max(x + ahead * along, ZERO), ONE)
        y = min(max(y + ahead * across, ZERO), ONE)
    return steps_under


@compiled
def _is_within_reach(dx: Any, dy: Any) -> bool:
    return bool(dx * dx + dy * dy < REACH * REACH)


@compiled
def _sense(world: Any, is_lit: Any, x: Any, y: Any, along: Any, across: Any, values: Any) -> None:
    """Fill the inputs, in [0, 1].

    The light of the lamp decreases with distance and angle. Walls are sensed from a short distance.
    """
    dx = world[2] - x
    dy = world[3] - y
    distance = square_root(dx * dx + dy * dy)
    light = max(ZERO, ONE - distance) / distance if is_lit and distance > ZERO else ZERO
    ahead = light * (dx * along + dy * across)
    left = light * (dy * along - dx * across)
    values[0] = max(ZERO, ahead)
    values[1] = max(ZERO, left)
    values[2] = max(ZERO, -ahead)
    values[3] = max(ZERO, -left)
    dx = world[0] - x
    dy = world[1] - y
    ahead = dx * along + dy * across
    left = dy * along - dx * across
    # The stripe is visible within an eighth of a turn.
    is_visible = ahead > abs(left)
    values[4] = ONE if is_visible and THREE * left > ahead else ZERO
    values[5] = ONE if is_visible and THREE * abs(left) <= ahead else ZERO
    values[6] = ONE if is_visible and THREE * left < -ahead else ZERO
    values[7] = _sense_wall(x, y, along, across)
    values[8] = _sense_wall(x, y, -across, along)
    values[9] = _sense_wall(x, y, across, -along)
    for i in range(INPUTS - 1):
        values[i] *= world[4]
    values[INPUTS - 1] = ONE


@compiled
def _sense_wall(x: Any, y: Any, dx: Any, dy: Any) -> Any:
    """Return the nearness of the nearest wall in a direction, in [0, 1].

    The value is larger if the direction is closer to perpendicular.
    """
    of_x = abs(dx) * max(ZERO, ONE - (ONE - x if dx > ZERO else x) / NEAR)
    of_y = abs(dy) * max(ZERO, ONE - (ONE - y if dy > ZERO else y) / NEAR)
    return max(of_x, of_y)


@compiled
def _update_neurons(
    signs: Any, rules: Any, rates: Any, weights: Any, before: Any, now: Any
) -> None:
    """Fill the neurons of `now` from the inputs and neurons of `before`, and update the weights."""
    for neuron in range(rules.shape[0]):
        total = ZERO
        for source in range(before.size):
            total += signs[neuron, source] * weights[neuron, source] * before[source]
        y = sigmoid(total)
        now[INPUTS + neuron] = y
        for source in range(before.size):
            w = weights[neuron, source]
            rate = rates[neuron, source]
            if rate > ZERO:
                w += rate * strength_change(rules[neuron, source], w, before[source], y)
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
        part: Any, fitter: OneGenome, second: OneGenome, draws: Draws, gate: float, child: OneGenome
    ) -> None:
        # The cut is in the row of the genes of all modules.
        cut = draw_cut(gate, child.size)
        for module in range(child.shape[0]):
            for bit in range(child.shape[1]):
                draw = module * child.shape[1] + bit
                of_fitter = is_from_fitter(draw, cut, draws[0, 0])
                inherited = fitter[module, bit] if of_fitter else second[module, bit]
                child[module, bit] = ONE - inherited if draws[draw, 1] < part.rate else inherited

    @staticmethod
    def oracle(part: Any, fitter: Any, second: Any, draws: Any, gate: float) -> Any:
        inherited = cross_at_point(flatten(fitter), flatten(second), gate, draws[0][0])
        child = [
            1 - bit if draw[1] < part.rate else bit
            for bit, draw in zip(inherited, draws, strict=True)
        ]
        return split_modules(child, len(fitter[0]))
