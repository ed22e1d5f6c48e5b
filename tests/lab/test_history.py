"""What is asked of a run's record: how its best and its average agent did, and from whom an agent descends."""

from __future__ import annotations

from typing import Any

import numpy as np
import xarray as xr

from baldwinlab.papers.presets import load
from baldwinlab.simulation.simulate import simulate
from baldwinlab.studies.store import StudyStore
from tests.lab.client import CLIENT, SMALL, LabServer, get_error, get_json
from tests.small_studies import shorten_preset

CONDITION = "evo+self-taught/A"
RUN = {"study": "small", "condition": CONDITION, "run": 1}


def line_in(record: xr.Dataset, generation: int, agent: int) -> dict[str, Any]:
    """The same by hand, generation by generation backwards."""
    parents, eaten = record.parents.values, record.food_eaten.values
    line, others, everybody = [agent], list[int](), [{agent}]
    for child_generation in range(generation, 0, -1):
        fitter, other = parents[child_generation, line[0]]
        line, others = [int(fitter), *line], [int(other), *others]
        everybody = [
            {int(one) for child in everybody[0] for one in parents[child_generation, child]},
            *everybody,
        ]
    return {
        "first": 0,
        "agents": line,
        "eaten": [int(eaten[number, one]) for number, one in enumerate(line)],
        "partners": others,
        "eaten_by_partners": [int(eaten[number, one]) for number, one in enumerate(others)],
        "ancestors": [len(some) for some in everybody],
        "mean": eaten[: generation + 1].mean(axis=1).tolist(),
    }


def test_the_curve_of_a_run_is_what_its_best_and_its_average_agent_ate(
    lab_server: LabServer,
) -> None:
    eaten = StudyStore(lab_server.root / "small").read(CONDITION, 1).food_eaten.values
    found = get_json(lab_server.address, "run", **RUN)
    assert found["measure"] == "food eaten"
    assert np.array_equal(found["best"], eaten.max(axis=1)) and np.allclose(
        found["mean"], eaten.mean(axis=1)
    )


def test_a_run_that_is_not_there_has_no_curve(lab_server: LabServer) -> None:
    assert "has no condition 'evo'" in get_error(
        lab_server.address, "run", 404, **RUN | {"condition": "evo"}
    )
    assert "has no run 7" in get_error(lab_server.address, "run", 404, **RUN | {"run": 7})
    assert (
        get_error(lab_server.address, "run", 400, study="small")
        == "condition is missing from the request"
    )


def test_the_ancestor_line_goes_back_to_the_first_generation_by_the_fitter_parents(
    lab_server: LabServer,
) -> None:
    record = StudyStore(lab_server.root / "small").read(CONDITION, 1)
    for generation, agent in ((2, 3), (2, 19), (1, 0), (0, 5)):
        found = get_json(
            lab_server.address, "ancestors", **SMALL | {"generation": generation}, agent=agent
        )
        assert found == line_in(record, generation, agent)


def test_who_inherits_nothing_has_no_ancestors(lab_server: LabServer) -> None:
    found = get_json(
        lab_server.address, "ancestors", preset="self-taught/A", run=0, generation=1, agent=4
    )
    assert (found["first"], found["agents"], found["partners"], found["ancestors"]) == (
        1,
        [4],
        [],
        [1],
    )


def test_of_a_preset_and_of_a_live_run_it_is_that_of_the_run_that_would_be_stored(
    lab_server: LabServer,
) -> None:
    two = simulate(load("evo/A").replace(evolution={"generations": 2}), seed=3, run=1)
    assert get_json(
        lab_server.address, "ancestors", preset="evo/A", seed=3, run=1, generation=1, agent=6
    ) == line_in(two, 1, 6)
    order = {"experiment": shorten_preset().to_dict(), "seed": 3, "runs": 2}
    live = CLIENT.post(f"{lab_server.address}/api/live", json=order).json()["id"]
    asked = {"live": live, "run": 1, "generation": 2, "agent": 6}
    until_lived = CLIENT.get(f"{lab_server.address}/api/ancestors", params=asked)
    while until_lived.status_code == 400:
        assert "is not finished" in until_lived.json()["error"]
        until_lived = CLIENT.get(f"{lab_server.address}/api/ancestors", params=asked)
    assert until_lived.json() == line_in(simulate(shorten_preset(), seed=3, run=1), 2, 6)


def test_an_agent_that_is_not_there_has_none(lab_server: LabServer) -> None:
    sentence = get_error(lab_server.address, "ancestors", 404, **SMALL, agent=20)
    assert sentence == f"{CONDITION} has no agent 20: its agents are 0 to 19"
