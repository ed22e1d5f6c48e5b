"""A robot and a lamp: against a life in plain Python, the geometry by hand, and what genes say."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from scipy.stats import chisquare

from baldwinlab import papers
from baldwinlab.api.checks import check_part
from baldwinlab.evolution import GenerationKey, breed
from baldwinlab.models.light_switch import CHANGED, INPUTS, WORLD, LightSwitch, OnePointOfBits
from baldwinlab.models.miniworld.learning.hebbian import change
from baldwinlab.parts import LIFE, uniforms

KINDS: dict[str, dict[str, Any]] = {
    "neurons": {},
    "neurons-target": {"sign": "target"},
    "synapses": {"encoding": "synapses"},
    "strengths": {"encoding": "strengths"},
    "senses": {"encoding": "strengths", "change": "senses"},
    "wheels": {"encoding": "synapses", "change": "wheels"},
}


def genomes(of: LightSwitch, agents: int = 40) -> npt.NDArray[np.float32]:
    """Return random genomes as [run, agent, module, bit]."""
    return np.random.default_rng(3).integers(0, 2, (1, agents, 1, of.weights())).astype(np.float32)


class Life:
    """One agent's life in one world, in plain Python."""

    def __init__(
        self, of: LightSwitch, bits: list[int], born: npt.NDArray[np.float64], world: Any
    ) -> None:
        self.of, self.world = of, world
        sources, self.neurons = INPUTS + of.neurons, range(of.neurons)
        genes = [bits[place : place + 5] for place in range(0, len(bits) // 5 * 5, 5)]
        self.synapses: list[list[dict[str, Any]]] = []
        for neuron in self.neurons:
            row = []
            for source in range(sources):
                if of.encoding == "neurons":
                    sign, *rest = genes[neuron]
                    if of.sign == "source":
                        sign = (
                            bits[5 * of.neurons + source]
                            if source < INPUTS
                            else genes[source - INPUTS][0]
                        )
                else:
                    sign, *rest = genes[neuron * sources + source]
                synapse = {
                    "sign": -1 if sign else 1,
                    "rule": 2 * rest[0] + rest[1],
                    "rate": 0.3 * (2 * rest[2] + rest[3]),
                }
                synapse["w"] = float(born[neuron * sources + source])
                if of.encoding == "strengths":
                    synapse |= {
                        "rate": 0.0,
                        "w": (8 * rest[0] + 4 * rest[1] + 2 * rest[2] + rest[3]) / 15,
                    }
                row.append(synapse)
            self.synapses.append(row)

    def senses(self, place: complex, heading: complex, lit: bool) -> list[float]:
        """Points and directions are complex numbers."""
        stripe, lamp = complex(*self.world[:2]), complex(*self.world[2:4])
        away = lamp - place
        seen = away / abs(away) * max(0.0, 1 - abs(away)) / heading if lit else 0j
        light = [
            max(0.0, seen.real),
            max(0.0, seen.imag),
            max(0.0, -seen.real),
            max(0.0, -seen.imag),
        ]
        to_stripe = (stripe - place) / heading
        visible = to_stripe.real > abs(to_stripe.imag)
        slope = to_stripe.imag / to_stripe.real if visible else 0.0
        stripes = [
            visible and slope > 1 / 3,
            visible and abs(slope) <= 1 / 3,
            visible and slope < -1 / 3,
        ]

        def wall(direction: complex) -> float:
            along_x = abs(direction.real) * max(
                0.0, 1 - (1 - place.real if direction.real > 0 else place.real) / 0.1
            )
            along_y = abs(direction.imag) * max(
                0.0, 1 - (1 - place.imag if direction.imag > 0 else place.imag) / 0.1
            )
            return max(along_x, along_y)

        felt = [
            *light,
            *map(float, stripes),
            wall(heading),
            wall(heading * 1j),
            wall(heading * -1j),
        ]
        return [*(each * self.world[4] for each in felt), 1.0]

    def lived(self, begin: Any) -> int:
        place = complex(0.3 + 0.4 * begin[0], 0.2 + 0.6 * begin[1])
        heading = complex(2 * begin[2] - 1, 2 * begin[3] - 1)
        heading /= abs(heading)
        values, lit, under = [0.0] * len(self.neurons), False, 0
        for _ in range(self.of.steps_per_life):
            lit = lit or abs(place - complex(*self.world[:2])) < 0.2
            under += lit and abs(place - complex(*self.world[2:4])) < 0.2
            before = [*self.senses(place, heading, lit), *values]
            values = []
            for row in self.synapses:
                total = sum(one["sign"] * one["w"] * x for one, x in zip(row, before, strict=True))
                y = 1 / (1 + math.exp(-total))
                values.append(y)
                for one, x in zip(row, before, strict=True):
                    if self.of.plasticity:
                        faster = float(
                            change(one["rule"], np.float32(one["w"]), np.float32(x), np.float32(y))
                        )
                        one["w"] = min(max(one["w"] + one["rate"] * faster, 0.0), 1.0)
            left, right = (2 * values[-2] - 1) * self.world[5], 2 * values[-1] - 1
            heading *= np.exp(2j * math.atan(0.075 * (right - left)))
            moved = place + 0.01 * (left + right) * heading
            place = complex(min(max(moved.real, 0), 1), min(max(moved.imag, 0), 1))
        return under


@pytest.mark.parametrize("kind", KINDS)
def test_a_life_is_as_in_plain_python(kind: str) -> None:
    """Where it is chaotic, float32 and float64 part: so of short lives, and of all but one in twenty."""
    of = LightSwitch(**{"neurons": 4, "steps_per_life": 120} | KINDS[kind])
    born = genomes(of)
    found = of.simulate(7, [5], 3, born)
    assert (born == genomes(of)).all(), "what is inherited is left as it was"
    begin = uniforms(7, 5, 3, LIFE, (1, 1))[0, 0]
    small = 0.1 * uniforms(7, 5, 3, LIFE, (1 + len(born[0]), of.synapses))[1:, :, 0]
    for name, world in (("score", WORLD), ("changed", CHANGED[of.change])):
        lives = [
            Life(of, genome.astype(int).tolist(), at_birth, world)
            for genome, at_birth in zip(born[0, :, 0], small, strict=True)
        ]
        expected = np.array([life.lived(begin) for life in lives]) / of.steps_per_life
        assert (abs(found.records[name][0] - expected) < 1e-6).mean() >= 0.95
    assert found.energy[0] == pytest.approx(found.records["score"][0])


def test_weights_learn_in_no_life_without_plasticity_and_with_strengths_there_is_none() -> None:
    of = LightSwitch(neurons=3, steps_per_life=50)
    assert (
        of.learns
        and not of.without_learning().learns
        and not LightSwitch(encoding="strengths").learns
    )
    bits = genomes(of)[:, :, 0].astype(int)
    assert (
        of._read(0, [0], 0, bits)[2].any()
        and not of.without_learning()._read(0, [0], 0, bits)[2].any()
    )


def test_weights_at_birth_are_small_and_no_two_agents_alike() -> None:
    of = LightSwitch()
    born = of._read(0, [0], 0, genomes(of)[:, :, 0].astype(int))[3]
    assert born.min() >= 0 and born.max() <= 0.1 and born.mean() == pytest.approx(0.05, abs=0.002)
    assert len(np.unique(born.reshape(40, -1), axis=0)) == 40


def test_a_life_in_the_dark_is_worth_nothing() -> None:
    """Whose wheels stand still never comes to the stripe, and under a lamp that is not lit is no score."""
    of = LightSwitch(encoding="strengths")
    still = np.zeros((1, 3, 1, of.weights()), np.float32)
    found = of.simulate(0, [0], 0, still)
    assert (found.energy == 0).all() and (found.records["changed"] == 0).all()


def test_a_run_has_the_same_bits_beside_others() -> None:
    of = LightSwitch(encoding="synapses", steps_per_life=200)
    born = np.repeat(genomes(of), 2, axis=0)
    both, alone = of.simulate(7, [0, 5], 3, born), of.simulate(7, [5], 3, born[1:])
    for name in ("score", "changed"):
        assert both.records[name][1].tolist() == alone.records[name][0].tolist()
    assert both.energy[0].tolist() != both.energy[1].tolist()


def test_a_fifth_of_the_children_have_bits_of_two_parents_to_either_side_of_one_cut() -> None:
    """Founders each all 0 or all 1: without mutation, a child changes once along its genome if its parents differ, else never."""
    paper = papers.load("floreano-urzelai-2000").experiment("rules-of-neurons")
    experiment = paper.replace(population={"size": 4000}, evolution={"mutation_rate": 0})
    bits = experiment.of_model.weights()
    genome = np.repeat(np.arange(4000) % 2, bits).reshape(4000, 1, bits).astype(np.float32)
    children, parents = breed(experiment, genome, np.arange(4000.0), GenerationKey(0, 0, 1))
    changes = (np.diff(children[:, 0]) != 0).sum(axis=1)
    assert (changes == (parents[:, 0] % 2 != parents[:, 1] % 2)).all()
    assert abs(changes.mean() - 0.2 / 2) < 4 * np.sqrt(0.1 * 0.9 / 4000)
    cuts = np.flatnonzero(np.diff(children[changes == 1, 0])) % (bits - 1)
    assert chisquare(np.bincount(cuts, minlength=bits - 1)).pvalue > 0.001, (
        "anywhere along the genome"
    )


def test_without_crossover_a_child_has_all_bits_of_one_parent() -> None:
    """As before there was any: to the bit what the variation `bit-flips` makes."""
    paper = papers.load("floreano-urzelai-2000")
    without = paper.experiment("rules-of-neurons", variant="no-crossover")
    genome = (
        np.random.default_rng(2)
        .integers(0, 2, (100, 1, without.of_model.weights()))
        .astype(np.float32)
    )
    flipped = [
        breed(one, genome, np.arange(100.0), GenerationKey(0, 0, 1))[0]
        for one in (without, without.replace(evolution={"variation": "bit-flips"}))
    ]
    assert (flipped[0] == flipped[1]).all()


def test_the_parts_are_as_parts_should_be() -> None:
    found = [
        *check_part(LightSwitch),
        *check_part(OnePointOfBits, requirements=["fields", "limits", "arithmetic", "oracle"]),
    ]
    assert [one for one in found if one.holds is False] == []
