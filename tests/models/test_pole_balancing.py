"""Test the mechanics of two poles on a cart, and the evaluation of networks with ordered links."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

from baldwinlab.evolution.neat.genome import activate
from baldwinlab.models.pole_balancing import (
    CART_MASS,
    GRAVITY,
    INPUT_SCALES,
    MAX_FORCE,
    POLE_HALF_LENGTHS,
    POLE_MASSES,
    STATE_SIZE,
    activate_once,
    compute_cosine,
    compute_sine,
    move,
    order_links,
)
from tests.models.evolved_poles import STEEPNESS, evolve_balancers
from tests.oracles import neat as oracle

State = npt.NDArray[np.float64]


def energy(state: State) -> float:
    """Compute the kinetic and potential energy of cart and poles.

    A pole is a rod of uniform thickness with a hinge at its lower end.
    """
    _, speed, *poles = state
    total = CART_MASS * speed**2 / 2
    for (angle, angular_velocity), mass, half in zip(
        (poles[:2], poles[2:]), POLE_MASSES, POLE_HALF_LENGTHS, strict=True
    ):
        kinetic = (
            speed**2
            + 2 * speed * half * angular_velocity * math.cos(angle)
            + 4 / 3 * (half * angular_velocity) ** 2
        )
        total += mass * kinetic / 2 - mass * GRAVITY * half * math.cos(angle)
    return float(total)


def state_after(steps: int, step: float, push: float = 0.0, friction: float = 0.0) -> State:
    """Return the state after a number of steps."""
    state = np.array([0.1, 0.3, 0.2, -0.5, -0.1, 0.8])
    motion = np.empty((7, STATE_SIZE))
    for _ in range(steps):
        move(state, push, step, friction, motion)
    return state


def test_energy_is_constant_without_friction_and_force() -> None:
    begin = energy(state_after(0, 0.01))
    assert energy(state_after(30, 0.01)) == pytest.approx(begin, rel=1e-5)
    assert energy(state_after(30, 0.01, friction=1e-3)) < begin * (1 - 1e-4), (
        "friction reduces energy"
    )
    assert abs(energy(state_after(30, 0.01, push=MAX_FORCE)) - begin) > 1, "a force changes energy"


def test_a_step_is_of_fourth_order() -> None:
    """Half the step gives a sixteenth of the error, compared with a tenth of the step."""
    exact = state_after(400, 0.0005, push=3.0)
    coarse, fine = (
        np.abs(state_after(steps, 0.2 / steps, push=3.0) - exact).max() for steps in (20, 40)
    )
    assert coarse < 1e-3 and 12 < coarse / fine < 20


def test_sine_and_cosine_agree_with_the_math_module() -> None:
    for angle in np.linspace(-1.5, 1.5, 301):
        assert compute_sine(angle) == pytest.approx(math.sin(angle), abs=1e-15)
        assert compute_cosine(angle) == pytest.approx(math.cos(angle), abs=1e-15)


def test_an_upright_pole_stays_and_a_tilted_pole_falls() -> None:
    state = np.zeros(STATE_SIZE)
    motion = np.empty((7, STATE_SIZE))
    for _ in range(100):
        move(state, 0.0, 0.01, 0.0, motion)
    assert (state == 0).all()
    state[2] = 0.01
    for _ in range(20):
        move(state, 0.0, 0.01, 0.0, motion)
    assert state[2] > 0.01 and state[1] < 0, "the pole moves the cart backward"


@pytest.mark.nightly
def test_networks_with_ordered_links_have_the_outputs_of_other_implementations() -> None:
    state = np.array([1.0, -0.3, 0.2, 0.5, -0.4, 1.5])
    steepness = np.float32(STEEPNESS)
    sensed = [
        float(np.float32(value / scale)) for value, scale in zip(state, INPUT_SCALES, strict=True)
    ]
    outputs = set()
    for graph in evolve_balancers("neat-poles"):
        units = np.empty((3, STATE_SIZE + 101), np.float32)
        plan = np.empty((2, 100, 3), np.float32)
        links = order_links(graph, STATE_SIZE, False, plan[0], plan[1], units[0])
        units[1] = 0.5
        output = activate_once(
            plan[1], links, steepness, np.arange(STATE_SIZE), state, units[1], units[1]
        )
        units[2, :STATE_SIZE] = sensed
        activate(graph, STATE_SIZE, 1, steepness, units[2])
        assert output == units[2, -1]
        (expected,) = oracle.activate(graph.tolist(), STEEPNESS, [*sensed, 1])
        assert output == pytest.approx(expected, abs=1e-5)
        outputs.add(float(output))
    assert len(outputs) > 10


def kinds_of_loops(graph: Any) -> set[str]:
    """Return the kinds of loops of a network."""
    links = {
        (source, target)
        for source, target, _, enabled in oracle.read_genes(graph.tolist()).values()
        if enabled
    }
    kinds = {"itself" for source, target in links if source == target}
    return kinds | {"from the output" for source, target in links if source == 4 != target}


def test_recurrent_networks_have_the_outputs_of_plain_python() -> None:
    random = np.random.default_rng(5)
    graphs = evolve_balancers("neat-poles-without-velocities")
    outputs = set[float]()
    for graph in graphs:
        plan = np.empty((2, 100, 3), np.float32)
        units = np.zeros((3, 3 + 100 + 1), np.float32)
        links = order_links(graph, 3, True, plan[0], plan[1], units[2])
        before = dict[float, float]()
        for state in random.normal(size=(6, STATE_SIZE)):
            # Velocities are not sensed.
            entries = np.array([0, 2, 4])
            output = activate_once(
                plan[1], links, np.float32(STEEPNESS), entries, state, units[0], units[1]
            )
            units[0] = units[1]
            sensed = [state[entry] / INPUT_SCALES[entry] for entry in entries]
            before = oracle.step(graph.tolist(), STEEPNESS, [*sensed, 1], before)
            assert output == pytest.approx(before.get(4.0, 0.0), abs=1e-5)
            outputs.add(float(output))
    assert len(outputs) > 50
    assert set().union(*map(kinds_of_loops, graphs)) == {"itself", "from the output"}
