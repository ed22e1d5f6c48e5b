"""Test real-valued senses of the library against geometry and recorded traces."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
import xarray as xr

from baldwinlab.experiment import Experiment, ExperimentError
from baldwinlab.models.miniworld.appearance import describe_appearance
from baldwinlab.models.miniworld.lookup import (
    ActionTable,
    DirectEvaluation,
    DirectTeacher,
    choose_lookup,
)
from baldwinlab.papers.presets import load
from baldwinlab.parts import Sense
from tests.models.miniworld.plain import replay_in_python
from tests.worlds import make_single_agent_experiment, make_small_experiment

pytestmark = pytest.mark.usefixtures("in_plain_python")

# The position of the agent. Its heading is to the right.
AGENT = (100.0, 80.0)
WALL = {"features": ["walls"], "walls": {"boxes": [[108, 112, 70, 90]]}}


def sense_at_birth(
    kind: str, *items: tuple[float, float], agent: tuple[float, float] = AGENT, **changes: Any
) -> list[float]:
    """Return the inputs of a newborn. `items` are positions relative to the agent."""
    experiment = make_single_agent_experiment(
        agent, [((agent[0] + x) % 200, (agent[1] + y) % 160) for x, y in items]
    ).replace(senses={"kinds": [kind]})
    values: list[float] = (
        replay_in_python(experiment.replace(**changes)).sensor.values[0, 0].tolist()
    )
    return values


def make_experiment_with_senses(*kinds: str, condition: str = "evo", **changes: Any) -> Experiment:
    short = {"lifetime": {"steps": 60}, "population": {"size": 4}, "motor": {"noise": 0.4}}
    return make_small_experiment(condition, senses={"kinds": list(kinds)}, **short).replace(
        **changes
    )


def select_inputs(trace: xr.Dataset, *names: str) -> npt.NDArray[np.float32]:
    """Return the inputs with these names, [name, step, agent]."""
    return np.stack([trace.sensor.sel(side=name).values for name in names])


def test_nearest_reports_items_across_the_edge_of_the_map() -> None:
    # The item is at x = 196 on a map of width 200.
    inputs = sense_at_birth("nearest", (-8, 0), agent=(4, 80))
    assert inputs == pytest.approx([0.5, 0.2], abs=1e-6)


# The poison is 20 below the agent.
POISON = {
    "features": ["patches"],
    "patches": {"patches": [[100, 100.001, 100, 100.001, 1, -1]]},
}


@pytest.mark.parametrize(
    ("kind", "inputs"), [("nearest", [0.25, 0.5]), ("rays", [0] * 5), ("smell", [0.193, 0.4])]
)
def test_a_sense_reports_only_the_items_of_its_target_kind(kind: str, inputs: list[float]) -> None:
    senses = {"kinds": [kind], kind: {"target_kind": "patch"}}
    actual = sense_at_birth(kind, (10, 0), world=POISON, senses=senses)
    assert actual == pytest.approx(inputs, abs=1e-3)


@pytest.mark.parametrize(
    ("kind", "settings", "refusal"),
    [
        *(
            (kind, {"target_kind": "patch"}, "'patch' must be one of the kinds of items: food")
            for kind in ("nearest", "rays", "smell")
        ),
        ("smell", {"nostril_distance": 40}, "40 must be less than 40, the visual radius"),
    ],
)
def test_a_setting_without_items_in_reach_is_refused(
    kind: str, settings: dict[str, Any], refusal: str
) -> None:
    (field,) = settings
    with pytest.raises(ExperimentError, match=rf"senses\.{kind}\.{field} = {refusal}"):
        make_experiment_with_senses(kind, senses={"kinds": [kind], kind: settings})


def test_a_wall_hides_food_from_nearest_and_rays_but_not_its_smell() -> None:
    behind = (20.0, 0.0)
    visible = (0.0, 30.0)
    assert sense_at_birth("nearest", behind, visible) == pytest.approx([0, 0.5], abs=1e-6)
    assert sense_at_birth("nearest", behind, visible, world=WALL) == pytest.approx(
        [0.25, 0.75], abs=1e-6
    )
    assert sense_at_birth("rays", behind)[2] == pytest.approx(0.5)
    assert sense_at_birth("rays", behind, world=WALL) == [0] * 5
    assert sense_at_birth("smell", behind, world=WALL) == sense_at_birth("smell", behind)


def test_binary_inputs_are_equal_in_combination_with_real_valued_senses() -> None:
    binary = replay_in_python(make_experiment_with_senses("food", "compass"))
    combined = replay_in_python(make_experiment_with_senses("nearest", "food", "energy", "compass"))
    names = ["left", "front", "right", "heads right", "heads down", "heads left", "heads up"]
    inputs = select_inputs(combined, *names)
    np.testing.assert_array_equal(inputs[:, 0], select_inputs(binary, *names)[:, 0])
    assert set(np.unique(inputs)) == {0, 1}
    quadrants = inputs[3:].argmax(axis=0)
    np.testing.assert_array_equal(quadrants, (combined.heading.values + 45) % 360 // 90)


def test_real_valued_inputs_are_recorded_as_floats_between_0_and_1() -> None:
    assert replay_in_python(make_experiment_with_senses("food")).sensor.dtype == np.int8
    trace = replay_in_python(
        make_experiment_with_senses("food", "nearest", "smell", "rays", "energy"), 3
    )
    assert trace.sensor.dtype == np.float32
    assert trace.sensor.min() >= 0
    assert trace.sensor.max() <= 1
    for name in ("angle", "distance", "smell left", "ray ahead"):
        assert np.unique(select_inputs(trace, name)).size > 5, name


@pytest.mark.parametrize("condition", ["evo", "evo+self-taught"])
def test_the_network_receives_real_valued_inputs(condition: str) -> None:
    trace = replay_in_python(
        make_experiment_with_senses("nearest", "smell", condition=condition), 3
    )
    inputs = trace.sensor.values[0]
    weights = trace.weight_birth.values[:, 0]
    for agent in range(4):
        first = weights[agent, :16].reshape(4, 4)
        second = weights[agent, 16:].reshape(4, 3)
        hidden = 1 / (1 + np.exp(-inputs[agent] @ first))
        outputs = 1 / (1 + np.exp(-hidden @ second))
        np.testing.assert_allclose(trace.output.values[0, agent], outputs, atol=1e-5)


def test_outputs_to_real_valued_inputs_are_not_in_a_table() -> None:
    assert choose_lookup(make_experiment_with_senses("food", "touch")) is ActionTable
    assert choose_lookup(make_experiment_with_senses("nearest")) is DirectEvaluation
    assert (
        choose_lookup(make_experiment_with_senses("food", "energy", condition="evo+self-taught"))
        is DirectTeacher
    )


def test_the_appearance_has_real_valued_inputs_and_their_sectors() -> None:
    appearance = describe_appearance(
        make_experiment_with_senses("food", "nearest", "smell", "energy")
    )
    assert appearance.inputs[3:] == ("angle", "distance", "smell left", "smell right", "own energy")
    assert appearance.is_continuous == (False,) * 3 + (True,) * 5
    has_sector = [sector is not None for sector in appearance.sectors]
    assert has_sector == [True, True, True, False, False, True, True, False]


def test_real_valued_senses_measure_and_binary_ones_do_not() -> None:
    kinds = ("food", "nearest", "neighbours", "smell", "energy", "rays", "touch", "compass")
    for sense in load("evo/A").replace(senses={"kinds": list(kinds)}).parts("senses.kinds"):
        assert (
            type(sense).is_continuous
            == (type(sense).measure is not Sense.measure)
            == (type(sense).sense is Sense.sense)
        )
