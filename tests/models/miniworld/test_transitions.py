"""Every step of the engine against the oracle, on random small worlds and under every variant of the paper.

Each step starts from the state that the trace recorded, so that float32 and float64 cannot drift apart; only the weights
are carried along, in float64, from birth to death. A step that no precision of this kind can decide (an item that lies on
the edge of a sensor, say) is skipped and counted, and the count must stay small.
"""

from __future__ import annotations

import math
from collections import Counter
from typing import Any

import numpy as np
import pytest
import xarray as xr
from hypothesis import given, settings
from hypothesis import strategies as st

from baldwinlab import papers
from baldwinlab.experiment import Experiment, validate
from baldwinlab.models.miniworld.allocation import make_model
from baldwinlab.papers.presets import load
from baldwinlab.simulation.replay import replay
from baldwinlab.simulation.simulate import simulate
from tests import naive

MARGIN = 2e-4  # units of length; float32 is good to 1.5e-5 on these maps
TIE = 2e-5  # outputs nearer than this may be ordered either way after a life of float32 learning
OUTPUT_TOLERANCE = 1e-5
WEIGHT_TOLERANCE = 1e-4


@st.composite
def food_regions(draw: st.DrawFn, width: int, height: int) -> dict[str, Any]:
    def edges(size: int) -> list[float]:
        low = draw(st.integers(0, size - 1))
        return [low, draw(st.integers(low + 1, size))]

    energy = draw(st.sampled_from([1, 0, 2.5]))
    count = draw(
        st.integers(0, 6) | st.sampled_from([15, 16, 17, 33])
    )  # the engine looks at sixteen items at a time
    return {"x": edges(width), "y": edges(height), "count": count, "energy": energy}


@st.composite
def experiments(draw: st.DrawFn, update: str) -> Experiment:
    """Small crowded worlds, so that agents see, compete and eat."""
    width, height = draw(st.integers(20, 110)), draw(st.integers(20, 110))
    half = min(width, height) / 2
    x, y, radius = (
        draw(st.integers(0, width - 1)),
        draw(st.integers(0, height - 1)),
        draw(st.integers(0, 20)) * half / 20,
    )
    rule, rate = (
        draw(st.sampled_from(["self-taught", "none"])),
        draw(st.sampled_from([0.01, 0, 0.3, 1])),
    )
    learning = {
        "rule": rule,
        "rate": rate,
        "steps": draw(st.sampled_from([10**8, 10**8, 0, 7])),
        "evolved_rate": rule != "none"
        and rate == 0.01
        and draw(st.booleans()),  # far above 1, float32 and float64 part ways
    }
    if rule == "none":  # whose other settings would do nothing, and are refused
        learning = {"rule": rule}
    start = {
        "x": x,
        "y": y,
        "radius": radius,
        "headings": draw(st.sampled_from(["equal", "random"])),
    }
    food = draw(st.lists(food_regions(width, height), min_size=1, max_size=3))
    made: Experiment = validate(
        {
            "name": "random",
            "world": {"width": width, "height": height, "start": start, "food": food},
            "population": {"size": draw(st.integers(1, 6))},
            "senses": {
                "visual_radius": min(draw(st.sampled_from([40, 4, 10, 20])), half),
                "boundaries": draw(st.sampled_from(["closed", "open"])),
            },
            "contact": {
                "shape": draw(st.sampled_from(["circle", "square"])),
                "reach": min(draw(st.sampled_from([10, 5, 2, 7.5])), half),
            },
            "network": {
                "hidden": draw(st.lists(st.integers(1, 12), max_size=2)),
                "biases": draw(st.booleans()),
            },
            "learning": learning,
            "motor": {"noise": draw(st.sampled_from([0, 0, 0.2]))},
            "evolution": {
                "generations": 2,
                "inheritance": draw(st.sampled_from(["darwinian", "none"])),
            },
            "lifetime": {"steps": draw(st.integers(1, 60)), "update": update},
        }
    )
    return made


def reborn(trace: xr.Dataset, experiment: Experiment) -> tuple[list[naive.Agent], list[naive.Item]]:
    """The oracle's agents and items for a recorded life."""
    agents = [
        naive.born(genome, 0, 0, experiment) for genome in trace["weight_birth"].values.tolist()
    ]
    return agents, [
        naive.Item(0, 0, region) for region in experiment.world.food for _ in range(region.count)
    ]


def on_the_edge(agent: naive.Agent, item: naive.Item, experiment: Experiment) -> bool:
    """Whether float32 may see the item otherwise: it lies on the edge of a sensor."""
    radius, distance = (
        experiment.senses.visual_radius,
        math.hypot(*naive.way(agent, item, experiment.world)),
    )
    if distance > radius + MARGIN:
        return False
    theta = naive.bearing(agent, item, experiment.world)
    along = [math.radians(theta - edge) for edge in (15, 45, 315, 345)]
    near_a_ray = any(
        abs(math.sin(angle)) * distance < MARGIN and math.cos(angle) > 0 for angle in along
    )
    return distance < MARGIN or distance > radius - MARGIN or near_a_ray


class Follower:
    """Lives a recorded life again with the oracle, step by step, and compares."""

    def __init__(self, experiment: Experiment, trace: xr.Dataset) -> None:
        self.experiment = experiment
        self.recorded = {name: trace[name].values for name in trace.variables}
        self.agents, self.items = reborn(trace, experiment)
        self.tally = Counter[str]()

    def follow(self) -> Counter[str]:
        for time in range(self.experiment.lifetime.steps):
            self._take_recorded_state(time)
            doubts = self._step(time)
            self.tally += Counter(
                steps=1, skipped=int(doubts), eaten=int(self.recorded["eaten"][time].sum())
            )
            if not doubts:
                self._compare_with_what_followed(time)
            self._compare_outputs(time)
        self._compare_weights()
        return self.tally

    def _take_recorded_state(self, time: int) -> None:
        for number, agent in enumerate(self.agents):
            agent.x, agent.y, agent.heading = (
                float(self.recorded[name][time, number]) for name in ("x", "y", "heading")
            )
            agent.eaten = 0
        for number, item in enumerate(self.items):
            item.x, item.y = self._place(time, number)

    def _place(self, time: int, item: int) -> tuple[float, float]:
        return float(self.recorded["item_x"][time, item]), float(
            self.recorded["item_y"][time, item]
        )

    def _items_at(self, time: int) -> list[naive.Item]:
        return [
            naive.Item(*self._place(time, number), item.region)
            for number, item in enumerate(self.items)
        ]

    def _step(self, time: int) -> bool:
        """Live one step; True if it cannot be decided, and then what the agents sensed is taken from the record."""
        recorded, last, doubts = self.recorded, self.experiment.lifetime.steps - 1, []
        weights = [naive.weights_of(agent.action_module) for agent in self.agents]
        self.reappeared: list[int] = []

        def reappear(item: naive.Item) -> None:
            number = self.items.index(item)
            self.reappeared.append(number)
            if time < last:
                item.x, item.y = self._place(time + 1, number)
            elif self.experiment.lifetime.update == "sequential":
                doubts.append(True)  # nobody wrote down where others saw it

        def act_noisily(agent: naive.Agent) -> None:
            if self.experiment.motor.noise:
                agent.action = int(
                    recorded["action"][time, self.agents.index(agent)]
                )  # only the engine knows what it drew

        doubts.append(self._is_close_call_of_sight(time))
        naive.step(time, self.agents, self.items, self.experiment, reappear, act_noisily)
        doubts.append(self._is_close_call_of_action_or_contact(time))
        if any(doubts):
            biases = self.experiment.network.biases
            for number, agent in enumerate(self.agents):
                agent.action_module = naive.layers_of(
                    weights[number], self.experiment.layer_sizes, biases
                )
                agent.inputs = recorded["sensor"][time, number].tolist()
                agent.outputs = naive.think(agent.action_module, agent.inputs, biases)[-1]
                naive.self_teach(time, agent, self.experiment)
        return any(doubts)

    def _is_close_call_of_sight(self, time: int) -> bool:
        places = self._items_at(time) + self._items_at(
            min(time + 1, self.experiment.lifetime.steps - 1)
        )
        return any(
            on_the_edge(agent, item, self.experiment) for agent in self.agents for item in places
        )

    def _is_close_call_of_action_or_contact(self, time: int) -> bool:
        """To be asked when the agents have moved."""
        places, reach = self._items_at(time), self.experiment.contact.reach
        gaps = [
            naive.distance_of_bodies(agent, item, self.experiment) - reach
            for agent in self.agents
            for item in places
        ]
        best_two = [sorted(agent.outputs)[-2:] for agent in self.agents]
        return any(abs(gap) < MARGIN for gap in gaps) or any(
            0 < best - second < TIE for second, best in best_two
        )

    def _compare_with_what_followed(self, time: int) -> None:
        recorded, world = self.recorded, self.experiment.world
        assert recorded["sensor"][time].tolist() == [agent.inputs for agent in self.agents]
        assert recorded["action"][time].tolist() == [agent.action for agent in self.agents]
        assert recorded["eaten"][time].tolist() == [agent.eaten for agent in self.agents]
        if time == self.experiment.lifetime.steps - 1:
            return
        for number, agent in enumerate(self.agents):
            assert recorded["heading"][time + 1, number] == agent.heading
            assert (
                abs(naive.shortest(agent.x, float(recorded["x"][time + 1, number]), world.width))
                < MARGIN
            )
            assert (
                abs(naive.shortest(agent.y, float(recorded["y"][time + 1, number]), world.height))
                < MARGIN
            )
        moved = [
            number
            for number in range(len(self.items))
            if self._place(time, number) != self._place(time + 1, number)
        ]
        assert moved == sorted(self.reappeared)

    def _compare_outputs(self, time: int) -> None:
        outputs = self.recorded["output"][time]
        np.testing.assert_allclose(
            outputs, [agent.outputs for agent in self.agents], rtol=0, atol=OUTPUT_TOLERANCE
        )
        if not self.experiment.motor.noise:
            assert self.recorded["action"][time].tolist() == [
                naive.choose(output) for output in outputs.tolist()
            ]

    def _compare_weights(self) -> None:
        birth, death = self.recorded["weight_birth"], self.recorded["weight_death"]
        learned = [naive.weights_of(agent.action_module) for agent in self.agents]
        np.testing.assert_allclose(
            death[:, 0, : len(learned[0])], learned, rtol=0, atol=WEIGHT_TOLERANCE
        )
        np.testing.assert_array_equal(death[:, 1:], birth[:, 1:])
        if not self.experiment.learns:
            np.testing.assert_array_equal(death, birth)


def follow(experiment: Experiment, seed: int, generation: int) -> Counter[str]:
    follower = Follower(experiment, replay(experiment, seed=seed, generation=generation))
    tally = follower.follow()
    if not tally["skipped"]:
        energy = simulate(experiment, seed=seed)["energy"].values[generation]
        assert energy.tolist() == [agent.energy for agent in follower.agents]
    return tally


@pytest.mark.parametrize("lives", [60, pytest.param(300, marks=pytest.mark.nightly)])
@pytest.mark.parametrize("update", ["simultaneous", "sequential"])
def test_every_step_of_a_random_life_is_the_step_of_the_paper(update: str, lives: int) -> None:
    tally = Counter[str]()

    @settings(deadline=None, derandomize=True, max_examples=lives, database=None)
    @given(experiments(update), st.integers(0, 2**31 - 1), st.integers(0, 1))
    def check(experiment: Experiment, seed: int, generation: int) -> None:
        tally.update(follow(experiment, seed, generation))

    check()
    assert tally["eaten"] > 5 * lives / 3, (
        "too little happens in these worlds for the test to mean much"
    )
    assert tally["skipped"] < 0.02 * tally["steps"]


def crowded(condition: str, variant: str) -> Experiment:
    """The paper's experiment with the newborn in the middle of the food."""
    food = [{"x": [100, 220], "y": [100, 220], "count": 30}]
    return load(f"{condition}/A", variant).replace(
        world={"food": food}, lifetime={"steps": 40}, evolution={"generations": 2}
    )


@pytest.mark.parametrize("variant", papers.load().names("variants"))
@pytest.mark.parametrize("condition", papers.load().names("conditions"))
def test_every_step_under_a_named_variant_is_the_step_of_the_paper(
    condition: str, variant: str
) -> None:
    tally = follow(crowded(condition, variant), seed=7, generation=1)
    assert tally["eaten"] > 5
    assert tally["skipped"] < 0.1 * tally["steps"]


@pytest.mark.parametrize("update", ["simultaneous", "sequential"])
@pytest.mark.parametrize(
    "region",
    [{"x": [0, 400], "y": [0, 400]}, {"x": [150, 400], "y": [0, 300]}],
    ids=["whole map", "part"],
)
def test_every_step_among_many_items_sorted_by_cells_is_the_step_of_the_paper(
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
    tally = follow(experiment, seed=11, generation=1)
    assert tally["eaten"] > 25
    assert tally["skipped"] < 0.1 * tally["steps"]


@settings(deadline=None, derandomize=True, max_examples=100, database=None)
@given(experiments("simultaneous"), st.integers(0, 2**31 - 1))
def test_everything_stays_on_the_map_and_every_item_in_its_own_region(
    experiment: Experiment, seed: int
) -> None:
    trace, world = replay(experiment, seed=seed), experiment.world
    assert ((trace["x"] >= 0) & (trace["x"] < world.width)).all()
    assert ((trace["y"] >= 0) & (trace["y"] < world.height)).all()
    first = 0
    for region in world.food:
        own = trace.isel(item=slice(first, first + region.count))
        assert ((own["item_x"] >= region.x[0]) & (own["item_x"] <= region.x[1])).all()
        assert ((own["item_y"] >= region.y[0]) & (own["item_y"] <= region.y[1])).all()
        first += region.count
    assert first == trace.sizes["item"]
