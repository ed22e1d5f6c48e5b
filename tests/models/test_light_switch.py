"""Test the robot with a lamp against plain Python, and the decoding of its genes."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

from baldwinlab import papers
from baldwinlab.evolution import GenerationKey
from baldwinlab.models import light_switch
from baldwinlab.models.light_switch import CHANGED_WORLDS, STANDARD_WORLD, LightSwitch
from baldwinlab.models.light_switch_lifetimes import N_INPUTS
from baldwinlab.models.miniworld.learning.hebbian import compute_strength_change
from baldwinlab.parts import LIFE, uniforms
from tests.evolution.single_runs import breed

KINDS: dict[str, dict[str, Any]] = {
    "neurons": {},
    "neurons-target": {"sign": "target"},
    "synapses": {"encoding": "synapses"},
    "strengths": {"encoding": "strengths"},
    "senses": {"encoding": "strengths", "change": "senses"},
    "wheels": {"encoding": "synapses", "change": "wheels"},
    "fixed": {"plasticity": False},
}


def draw_random_genomes(model: LightSwitch, agents: int = 40) -> npt.NDArray[np.float32]:
    """Return random genomes as [run, agent, module, bit]."""
    return (
        np.random.default_rng(3)
        .integers(0, 2, (1, agents, 1, model.n_weights()))
        .astype(np.float32)
    )


class PlainLifetime:
    """Lifetime of one agent in one world, in plain Python."""

    def __init__(
        self, model: LightSwitch, bits: list[int], weights: npt.NDArray[np.float64], world: Any
    ) -> None:
        self.model = model
        self.world = world
        sources = N_INPUTS + model.neurons
        self.neurons = range(model.neurons)
        genes = [bits[first : first + 5] for first in range(0, len(bits) // 5 * 5, 5)]
        self.synapses: list[list[dict[str, Any]]] = []
        for neuron in self.neurons:
            row = []
            for source in range(sources):
                if model.encoding == "neurons":
                    sign, *rest = genes[neuron]
                    if model.sign == "source":
                        sign = (
                            bits[5 * model.neurons + source]
                            if source < N_INPUTS
                            else genes[source - N_INPUTS][0]
                        )
                else:
                    sign, *rest = genes[neuron * sources + source]
                synapse = {
                    "sign": -1 if sign else 1,
                    "rule": 2 * rest[0] + rest[1],
                    "rate": 0.3 * (2 * rest[2] + rest[3]),
                }
                synapse["w"] = float(weights[neuron * sources + source])
                if model.encoding == "strengths":
                    synapse |= {
                        "rate": 0.0,
                        "w": (8 * rest[0] + 4 * rest[1] + 2 * rest[2] + rest[3]) / 15,
                    }
                row.append(synapse)
            self.synapses.append(row)

    def senses(self, position: complex, heading: complex, lit: bool) -> list[float]:
        """Return the inputs. Positions and directions are complex numbers."""
        stripe = complex(*self.world[:2])
        lamp = complex(*self.world[2:4])
        away = lamp - position
        view = away / abs(away) * max(0.0, 1 - abs(away)) / heading if lit else 0j
        light = [
            max(0.0, view.real),
            max(0.0, view.imag),
            max(0.0, -view.real),
            max(0.0, -view.imag),
        ]
        to_stripe = (stripe - position) / heading
        visible = to_stripe.real > abs(to_stripe.imag)
        slope = to_stripe.imag / to_stripe.real if visible else 0.0
        stripes = [
            visible and slope > 1 / 3,
            visible and abs(slope) <= 1 / 3,
            visible and slope < -1 / 3,
        ]

        def wall(direction: complex) -> float:
            along_x = abs(direction.real) * max(
                0.0, 1 - (1 - position.real if direction.real > 0 else position.real) / 0.1
            )
            along_y = abs(direction.imag) * max(
                0.0, 1 - (1 - position.imag if direction.imag > 0 else position.imag) / 0.1
            )
            return max(along_x, along_y)

        inputs = [
            *light,
            *map(float, stripes),
            wall(heading),
            wall(heading * 1j),
            wall(heading * -1j),
        ]
        return [*(value * self.world[4] for value in inputs), 1.0]

    def steps_under_lamp(self, begin: Any) -> int:
        position = complex(0.3 + 0.4 * begin[0], 0.2 + 0.6 * begin[1])
        heading = complex(2 * begin[2] - 1, 2 * begin[3] - 1)
        heading /= abs(heading)
        values = [0.0] * len(self.neurons)
        lit = False
        under = 0
        for _ in range(self.model.steps_per_life):
            lit = lit or abs(position - complex(*self.world[:2])) < 0.2
            under += lit and abs(position - complex(*self.world[2:4])) < 0.2
            before = [*self.senses(position, heading, lit), *values]
            values = []
            for row in self.synapses:
                total = sum(
                    synapse["sign"] * synapse["w"] * x
                    for synapse, x in zip(row, before, strict=True)
                )
                y = 1 / (1 + math.exp(-total))
                values.append(y)
                for synapse, x in zip(row, before, strict=True):
                    if self.model.plasticity:
                        delta = float(
                            compute_strength_change(
                                synapse["rule"],
                                np.float32(synapse["w"]),
                                np.float32(x),
                                np.float32(y),
                            )
                        )
                        synapse["w"] = min(max(synapse["w"] + synapse["rate"] * delta, 0.0), 1.0)
            left = (2 * values[-2] - 1) * self.world[5]
            right = 2 * values[-1] - 1
            heading *= np.exp(2j * math.atan(0.075 * (right - left)))
            moved = position + 0.01 * (left + right) * heading
            position = complex(min(max(moved.real, 0), 1), min(max(moved.imag, 0), 1))
        return under


@pytest.mark.parametrize(
    "kind",
    [
        pytest.param(
            kind, marks=[pytest.mark.nightly] * (kind not in ("neurons", "synapses", "fixed"))
        )
        for kind in KINDS
    ],
)
def test_a_lifetime_agrees_with_plain_python(kind: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Rounding errors grow in chaotic lifetimes, so lifetimes are short and 1 in 20 may differ.

    The stripe is at the start and the lamp near it, because random networks rarely reach them.
    """
    begin = uniforms(7, 5, 3, LIFE, (1, 1))[0, 0]
    x, y = 0.3 + 0.4 * begin[0], 0.2 + 0.6 * begin[1]
    near = {"stripe_x": x, "stripe_y": y, "lamp_x": x + 0.1, "lamp_y": y + 0.1}
    standard = STANDARD_WORLD._replace(**near)
    changed = {
        change: world._replace(**near if change != "places" else {**near, "lamp_x": x - 0.1})
        for change, world in CHANGED_WORLDS.items()
    }
    monkeypatch.setattr(light_switch, "STANDARD_WORLD", standard)
    monkeypatch.setattr(light_switch, "CHANGED_WORLDS", changed)
    model = LightSwitch(**{"neurons": 4, "steps_per_life": 120} | KINDS[kind])
    newborns = draw_random_genomes(model)
    results = model.simulate(7, [5], 3, newborns)
    assert (newborns == draw_random_genomes(model)).all(), "genomes do not change"
    small = 0.1 * uniforms(7, 5, 3, LIFE, (1 + len(newborns[0]), model.synapses))[1:, :, 0]
    for name, world in (("score", standard), ("changed", changed[model.change])):
        lives = [
            PlainLifetime(model, genome.astype(int).tolist(), at_birth, world)
            for genome, at_birth in zip(newborns[0, :, 0], small, strict=True)
        ]
        expected = np.array([life.steps_under_lamp(begin) for life in lives]) / model.steps_per_life
        assert (abs(results.records[name][0] - expected) < 1e-6).mean() >= 0.95
        assert len(np.unique(expected)) > 5
    assert results.energy[0] == pytest.approx(results.records["score"][0])


def test_synapses_with_inherited_strengths_do_not_learn() -> None:
    assert LightSwitch().learns and not LightSwitch(encoding="strengths").learns


def test_an_agent_without_light_has_no_energy() -> None:
    """A robot that does not move never reaches the stripe. An unlit lamp gives no score."""
    model = LightSwitch(encoding="strengths")
    still = np.zeros((1, 3, 1, model.n_weights()), np.float32)
    results = model.simulate(0, [0], 0, still)
    assert (results.energy == 0).all() and (results.records["changed"] == 0).all()


def test_without_crossover_a_child_has_all_bits_of_one_parent() -> None:
    """The children are bit-identical to those of the variation `bit-flips`."""
    paper = papers.load("floreano-urzelai-2000")
    without = paper.experiment("rules-of-neurons", variant="no-crossover")
    genome = (
        np.random.default_rng(2)
        .integers(0, 2, (100, 1, without.model_part.n_weights()))
        .astype(np.float32)
    )
    flipped = [
        breed(experiment, genome, np.arange(100.0), GenerationKey(0, 0, 1))[0]
        for experiment in (without, without.replace(evolution={"variation": "bit-flips"}))
    ]
    assert (flipped[0] == flipped[1]).all()
