"""Compare every step of the engine with the naive implementation, under every variant.

Each step starts from the recorded state, so that differences between float32 and float64 do not
add up. Only the weights are computed in float64 from birth to death. A step whose result depends
on rounding (for example, an item on the edge of a sensor) is skipped and counted. The count must
stay small.
"""

from __future__ import annotations

import math
from collections import Counter
from typing import Any

import numpy as np
import pytest
import xarray as xr
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from baldwinlab import papers
from baldwinlab.experiment import Experiment
from baldwinlab.models.miniworld.allocation import make_model
from baldwinlab.papers.presets import load
from baldwinlab.simulation.replay import replay
from baldwinlab.simulation.simulate import simulate
from tests import naive
from tests.models.miniworld.random_experiments import experiments

# In map units. The error of float32 on these maps is 1.5e-5.
MARGIN = 2e-4
# Smaller differences of outputs can be rounding errors of a lifetime of learning in float32.
TIE = 2e-5
OUTPUT_TOLERANCE = 1e-5
WEIGHT_TOLERANCE = 1e-4


def make_naive_state(
    trace: xr.Dataset, experiment: Experiment
) -> tuple[list[naive.Agent], list[naive.Item]]:
    """Return naive agents and items for a recorded lifetime."""
    genomes = trace["weight_birth"].values.tolist()
    agents = [naive.make_agent(genome, 0, 0, experiment) for genome in genomes]
    regions = [region for region in experiment.world.food for _ in range(region.count)]
    return agents, [naive.Item(0, 0, region) for region in regions]


def is_on_an_edge(agent: naive.Agent, item: naive.Item, experiment: Experiment) -> bool:
    """Return whether rounding decides which sensor detects the item."""
    radius = experiment.senses.visual_radius
    distance = math.hypot(*naive.displacement(agent, item, experiment.world))
    if distance > radius + MARGIN:
        return False
    theta = naive.bearing(agent, item, experiment.world)
    angles = [math.radians(theta - edge) for edge in (15, 45, 315, 345)]
    is_near_a_ray = any(
        abs(math.sin(angle)) * distance < MARGIN and math.cos(angle) > 0 for angle in angles
    )
    return distance < MARGIN or distance > radius - MARGIN or is_near_a_ray


class Comparison:
    """Comparison of a recorded lifetime with the naive implementation, step by step."""

    def __init__(self, experiment: Experiment, trace: xr.Dataset) -> None:
        self.experiment = experiment
        self.last_step = experiment.lifetime.steps - 1
        self.recorded = {name: trace[name].values for name in trace.variables}
        self.agents, self.items = make_naive_state(trace, experiment)
        self.reappeared: list[int] = []
        self.counts = Counter[str]()

    def compare(self) -> Counter[str]:
        """Return the numbers of steps, skipped steps and eaten items."""
        for time in range(self.experiment.lifetime.steps):
            self._load_recorded_state(time)
            is_skipped = self._step(time)
            eaten = int(self.recorded["eaten"][time].sum())
            self.counts += Counter(steps=1, skipped=int(is_skipped), eaten=eaten)
            if not is_skipped:
                self._compare_step(time)
            self._compare_outputs(time)
        self._compare_weights()
        return self.counts

    def compare_energies(self, seed: int, generation: int) -> None:
        """Compare the energies at the end, unless a skipped step made them differ."""
        if not self.counts["skipped"]:
            energy = simulate(self.experiment, seed=seed)["energy"].values[generation]
            assert energy.tolist() == [agent.energy for agent in self.agents]

    def _load_recorded_state(self, time: int) -> None:
        for number, agent in enumerate(self.agents):
            agent.x = float(self.recorded["x"][time, number])
            agent.y = float(self.recorded["y"][time, number])
            agent.heading = float(self.recorded["heading"][time, number])
            agent.eaten = 0
        for number, item in enumerate(self.items):
            item.x, item.y = self._item_position(time, number)

    def _item_position(self, time: int, item: int) -> tuple[float, float]:
        x = float(self.recorded["item_x"][time, item])
        y = float(self.recorded["item_y"][time, item])
        return x, y

    def _items_at(self, time: int) -> list[naive.Item]:
        return [
            naive.Item(*self._item_position(time, number), item.region)
            for number, item in enumerate(self.items)
        ]

    def _step(self, time: int) -> bool:
        """Simulate a step, and return whether its result depends on rounding.

        In this case, the agents learn from their recorded inputs.
        """
        weights = [naive.list_weights(agent.action_module) for agent in self.agents]
        self.reappeared = []

        def reappear(item: naive.Item) -> None:
            number = self.items.index(item)
            self.reappeared.append(number)
            if time < self.last_step:
                item.x, item.y = self._item_position(time + 1, number)

        def act_noisily(agent: naive.Agent) -> None:
            # Only the engine has the random numbers of the noise.
            if self.experiment.motor.noise:
                agent.action = int(self.recorded["action"][time, self.agents.index(agent)])

        is_skipped = self._depends_on_rounding_of_sight(time)
        naive.step(time, self.agents, self.items, self.experiment, reappear, act_noisily)
        is_skipped |= self._depends_on_rounding_of_action(time)
        is_sequential = self.experiment.lifetime.update == "sequential"
        # The trace has no positions after the last step, where later agents can see new items.
        is_skipped |= is_sequential and time == self.last_step and bool(self.reappeared)
        if is_skipped:
            self._learn_from_recorded_inputs(time, weights)
        return is_skipped

    def _learn_from_recorded_inputs(self, time: int, weights: list[list[float]]) -> None:
        biases = self.experiment.network.biases
        sizes = self.experiment.layer_sizes
        for number, agent in enumerate(self.agents):
            agent.action_module = naive.make_layers(weights[number], sizes, biases)
            agent.inputs = self.recorded["sensor"][time, number].tolist()
            agent.outputs = naive.activate(agent.action_module, agent.inputs, biases)[-1]
            naive.self_teach(time, agent, self.experiment)

    def _depends_on_rounding_of_sight(self, time: int) -> bool:
        items = self._items_at(time) + self._items_at(min(time + 1, self.last_step))
        return any(
            is_on_an_edge(agent, item, self.experiment) for agent in self.agents for item in items
        )

    def _depends_on_rounding_of_action(self, time: int) -> bool:
        """Return whether rounding decides an action or a contact, after the agents have moved."""
        reach = self.experiment.contact.reach
        gaps = [
            naive.contact_distance(agent, item, self.experiment) - reach
            for agent in self.agents
            for item in self._items_at(time)
        ]
        best_two = [sorted(agent.outputs)[-2:] for agent in self.agents]
        is_near_a_tie = any(0 < best - second < TIE for second, best in best_two)
        return is_near_a_tie or any(abs(gap) < MARGIN for gap in gaps)

    def _compare_step(self, time: int) -> None:
        recorded = self.recorded
        world = self.experiment.world
        assert recorded["sensor"][time].tolist() == [agent.inputs for agent in self.agents]
        assert recorded["action"][time].tolist() == [agent.action for agent in self.agents]
        assert recorded["eaten"][time].tolist() == [agent.eaten for agent in self.agents]
        if time == self.last_step:
            return
        for number, agent in enumerate(self.agents):
            x = float(recorded["x"][time + 1, number])
            y = float(recorded["y"][time + 1, number])
            assert recorded["heading"][time + 1, number] == agent.heading
            assert abs(naive.circular_difference(agent.x, x, world.width)) < MARGIN
            assert abs(naive.circular_difference(agent.y, y, world.height)) < MARGIN
        moved = [
            number
            for number in range(len(self.items))
            if self._item_position(time, number) != self._item_position(time + 1, number)
        ]
        assert moved == sorted(self.reappeared)

    def _compare_outputs(self, time: int) -> None:
        outputs = self.recorded["output"][time]
        np.testing.assert_allclose(
            outputs, [agent.outputs for agent in self.agents], rtol=0, atol=OUTPUT_TOLERANCE
        )
        if not self.experiment.motor.noise:
            actions = [naive.choose(output) for output in outputs.tolist()]
            assert self.recorded["action"][time].tolist() == actions

    def _compare_weights(self) -> None:
        birth = self.recorded["weight_birth"]
        death = self.recorded["weight_death"]
        learned = [naive.list_weights(agent.action_module) for agent in self.agents]
        np.testing.assert_allclose(
            death[:, 0, : len(learned[0])], learned, rtol=0, atol=WEIGHT_TOLERANCE
        )
        np.testing.assert_array_equal(death[:, 1:], birth[:, 1:])
        if not self.experiment.learns:
            np.testing.assert_array_equal(death, birth)


def compare_lifetime(experiment: Experiment, seed: int, generation: int) -> Counter[str]:
    """Compare a lifetime, and return the numbers of steps, skipped steps and eaten items."""
    comparison = Comparison(experiment, replay(experiment, seed=seed, generation=generation))
    counts = comparison.compare()
    comparison.compare_energies(seed, generation)
    return counts


@pytest.mark.hypothesis
@pytest.mark.parametrize("lifetimes", [30, pytest.param(300, marks=pytest.mark.nightly)])
@pytest.mark.parametrize("update", ["simultaneous", "sequential"])
def test_every_step_of_a_random_lifetime_agrees_with_the_paper(update: str, lifetimes: int) -> None:
    counts = Counter[str]()

    @settings(max_examples=lifetimes)
    @given(experiments(update), st.integers(0, 2**31 - 1), st.integers(0, 1))
    def check(experiment: Experiment, seed: int, generation: int) -> None:
        comparison = Comparison(experiment, replay(experiment, seed=seed, generation=generation))
        # A gene can set a rate far above 1, where results in float32 and float64 differ too much.
        assume(all(agent.rate <= 1 for agent in comparison.agents))
        counts.update(comparison.compare())
        comparison.compare_energies(seed, generation)

    check()
    # With random examples, agents ate at least 800 items in 60 lifetimes, and up to 2.6 % of the
    # steps were skipped.
    assert counts["eaten"] > lifetimes, "the agents eat too little for a comparison"
    assert counts["skipped"] < 0.1 * counts["steps"]


def start_in_food(condition: str, variant: str) -> Experiment:
    """Return the experiment of the paper with newborns in the food."""
    food = [{"x": [100, 220], "y": [100, 220], "count": 30}]
    return load(f"{condition}/A", variant).replace(
        world={"food": food}, lifetime={"steps": 40}, evolution={"generations": 2}
    )


# These variants change only how the genomes of the next generation are made.
VARIANTS_OF_BREEDING = ("tournament", "truncation", "rank", "mutation-per-child")


@pytest.mark.parametrize(
    "variant",
    [
        pytest.param(name, marks=[pytest.mark.nightly] * (name in VARIANTS_OF_BREEDING))
        for name in papers.load().names("variants")
    ],
)
@pytest.mark.parametrize(
    "condition",
    [
        pytest.param(name, marks=[pytest.mark.nightly] * (name != "evo+self-taught"))
        for name in papers.load().names("conditions")
    ],
)
def test_every_step_under_a_variant_agrees_with_the_paper(condition: str, variant: str) -> None:
    counts = compare_lifetime(start_in_food(condition, variant), seed=7, generation=1)
    assert counts["eaten"] > 5
    assert counts["skipped"] < 0.1 * counts["steps"]


@pytest.mark.parametrize("update", ["simultaneous", "sequential"])
@pytest.mark.parametrize(
    "region",
    [
        pytest.param({"x": [0, 400], "y": [0, 400]}, id="map", marks=pytest.mark.nightly),
        pytest.param({"x": [150, 400], "y": [0, 300]}, id="region"),
    ],
)
def test_every_step_with_many_items_in_cells_agrees_with_the_paper(
    region: dict[str, Any], update: str
) -> None:
    few = {"x": [0, 30], "y": [380, 400], "count": 5}
    world = {
        "width": 400,
        "height": 400,
        "start": {"x": 390, "y": 5, "radius": 150},
        "food": [{**region, "count": 400}, few],
    }
    changes = {
        "world": world,
        "senses": {"visual_radius": 18},
        "population": {"size": 12},
        "evolution": {"generations": 2},
    }
    experiment = load("evo+self-taught/A").replace(
        **changes, lifetime={"steps": 80, "update": update}
    )
    assert make_model(experiment, 1).grid.prod(axis=1).tolist()[0] > 10
    counts = compare_lifetime(experiment, seed=11, generation=1)
    assert counts["eaten"] > 25
    assert counts["skipped"] < 0.1 * counts["steps"]


@settings(max_examples=100)
@given(experiments("simultaneous"), st.integers(0, 2**31 - 1))
def test_agents_stay_on_the_map_and_items_in_their_regions(
    experiment: Experiment, seed: int
) -> None:
    trace = replay(experiment, seed=seed)
    world = experiment.world
    assert ((trace["x"] >= 0) & (trace["x"] < world.width)).all()
    assert ((trace["y"] >= 0) & (trace["y"] < world.height)).all()
    first = 0
    for region in world.food:
        items = trace.isel(item=slice(first, first + region.count))
        assert ((items["item_x"] >= region.x[0]) & (items["item_x"] <= region.x[1])).all()
        assert ((items["item_y"] >= region.y[0]) & (items["item_y"] <= region.y[1])).all()
        first += region.count
    assert first == trace.sizes["item"]
