"""Test the sense `food-rays`, whose number of inputs is a setting."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import baldwinlab as bl
from baldwinlab.analysis.report.figures.senses import draw_agent_senses
from baldwinlab.experiment import Experiment, ExperimentError
from baldwinlab.models.miniworld.appearance import describe_appearance
from baldwinlab.parts import Sense
from tests.models.miniworld.plain import replay_in_python
from tests.worlds import make_single_agent_experiment, make_small_experiment

pytestmark = pytest.mark.usefixtures("in_plain_python")

AGENT = (100.0, 80.0)


def make_experiment(*kinds: str, **rays: Any) -> Experiment:
    senses = {"kinds": list(kinds or ["food-rays"]), "food_rays": rays}
    return make_small_experiment("evo", senses=senses, lifetime={"steps": 40})


def sense_at_birth(*items: tuple[float, float], **rays: Any) -> list[float]:
    """Return the inputs of a newborn that heads right. `items` are relative positions."""
    experiment = make_single_agent_experiment(
        AGENT, [(AGENT[0] + x, AGENT[1] + y) for x, y in items]
    ).replace(senses={"kinds": ["food-rays"], "food_rays": rays})
    values: list[float] = replay_in_python(experiment).sensor.values[0, 0].tolist()
    return values


@pytest.mark.parametrize("rays", [1, 3, 9])
def test_the_number_of_rays_is_the_number_of_inputs(rays: int) -> None:
    experiment = make_experiment("food-rays", "last-action", rays=rays)
    assert experiment.inputs[: rays + 1] == (
        *(f"ray {number}" for number in range(1, rays + 1)),
        "did the first action",
    )
    assert experiment.weight_count == (rays + 3) * 4 + 4 * 3
    trace = replay_in_python(experiment)
    assert trace.sizes["side"] == rays + 3
    actions = trace.sensor.values[1:, :, rays:]
    np.testing.assert_array_equal(actions.argmax(-1), trace.action.values[:-1])


def test_a_single_ray_points_ahead() -> None:
    assert sense_at_birth((10, 0), rays=1) == pytest.approx([0.75])
    assert sense_at_birth((0, 10), rays=1) == [0]


def test_the_sectors_of_the_rays_are_drawn() -> None:
    appearance = describe_appearance(make_experiment(rays=3, angle=90))
    edges = [(sector.from_degrees, sector.to_degrees) for sector in appearance.sectors if sector]
    assert edges == [(313, 317), (358, 2), (43, 47)]
    assert draw_agent_senses(appearance.to_dict()).axes


@pytest.mark.parametrize(("field", "value"), [("rays", 0), ("rays", 65), ("angle", 360)])
def test_a_ray_setting_outside_its_limits_is_refused(field: str, value: float) -> None:
    with pytest.raises(ExperimentError, match=f"senses.food_rays.{field}"):
        make_experiment(**{field: value})


def test_a_sweep_over_the_number_of_rays_simulates_each_number(tmp_path: Path) -> None:
    settings = {
        "experiment": "evo/A",
        "runs": 1,
        "set": {
            "senses.kinds": ["food-rays"],
            "lifetime.steps": 20,
            "evolution.generations": 2,
            "population.size": 4,
        },
        "fields": {"senses.food_rays.rays": [3, 5, 9]},
    }
    sweep = bl.sweep(settings, out=tmp_path / "sweep", workers=1)
    data = sweep.data()
    assert data.sizes["senses.food_rays.rays"] == 3
    for rays in (3, 5, 9):
        point = bl.load(data.sel({"senses.food_rays.rays": rays}))
        assert isinstance(point, Experiment)
        assert len(point.inputs) == rays
        network = sweep.network(0, 1, 0, condition=f"point-000{(3, 5, 9).index(rays)}")
        assert len(network.inputs) == rays
    assert sweep.report().exists()


class BinaryRays(Sense, name="binary-rays-of-a-test"):
    """Binary inputs, as many as a setting."""

    count: int = 2

    @property
    def inputs(self) -> tuple[str, ...]:  # type: ignore[override]
        return tuple(f"bit {number}" for number in range(self.count))

    @property
    def sectors(self) -> tuple[None, ...]:  # type: ignore[override]
        return (None,) * self.count

    @staticmethod
    def sense(part: Any, model: Any, state: Any, world: int, agent: int) -> int:
        return int(1 << (part.n_inputs - 1))


@pytest.mark.parametrize("count", [2, 3])
@pytest.mark.parametrize("further", ["last-action", "nearest"])
def test_binary_inputs_of_any_number_precede_those_of_the_next_sense(
    count: int, further: str
) -> None:
    name = "binary-rays-of-a-test"
    settings = {"kinds": [name, further], "binary_rays_of_a_test": {"count": count}}
    experiment = make_small_experiment("evo", senses=settings, lifetime={"steps": 3})
    inputs = replay_in_python(experiment).sensor.values
    assert inputs.shape[-1] == count + (3 if further == "last-action" else 2)
    assert (inputs[..., : count - 1] == 0).all()
    assert (inputs[..., count - 1] == 1).all()
