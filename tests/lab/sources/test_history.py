"""Tests of the history of a run: fitness, ancestors, and the lineage tree."""

from __future__ import annotations

import shutil
from typing import Any

import numpy as np
import xarray as xr

from baldwinlab.lab.sources.history import MAX_AGENTS_PER_GENERATION, MAX_DEPTH, make_tree
from baldwinlab.papers.presets import load
from baldwinlab.simulation.simulate import simulate
from baldwinlab.studies.store import StudyStore
from tests.lab.client import CLIENT, SMALL, LabServer, get_json, get_response
from tests.small_studies import make_small_study, shorten_preset

CONDITION = "evo+self-taught/A"
RUN = {"study": "small", "condition": CONDITION, "run": 1}


def compute_ancestors(record: xr.Dataset, generation: int, agent: int) -> dict[str, Any]:
    """Return the ancestors of an agent, computed from the last generation to the first."""
    parents = record.parents.values
    eaten = record.food_eaten.values
    fitter_parents = [agent]
    second_parents = list[int]()
    ancestors = [{agent}]
    for child_generation in range(generation, 0, -1):
        fitter, second = parents[child_generation, fitter_parents[0]]
        fitter_parents.insert(0, int(fitter))
        second_parents.insert(0, int(second))
        children = list(ancestors[0])
        ancestors.insert(0, set(parents[child_generation, children].ravel().tolist()))
    return {
        "first": 0,
        "agents": fitter_parents,
        "eaten": [int(eaten[index, parent]) for index, parent in enumerate(fitter_parents)],
        "partners": second_parents,
        "eaten_by_partners": [
            int(eaten[index, parent]) for index, parent in enumerate(second_parents)
        ],
        "ancestors": [len(agents) for agents in ancestors],
        "mean": eaten[: generation + 1].mean(axis=1).tolist(),
    }


def test_the_curve_of_a_run_contains_the_food_of_the_best_and_the_average_agent(
    lab_server: LabServer,
) -> None:
    eaten = StudyStore(lab_server.root / "small").read(CONDITION, 1).food_eaten.values
    response = get_json(lab_server.address, "run", **RUN)
    assert response["measure"] == "food eaten"
    assert np.array_equal(response["best"], eaten.max(axis=1))
    assert np.allclose(response["mean"], eaten.mean(axis=1))


def test_the_ancestors_are_the_fitter_parents_back_to_the_first_generation(
    lab_server: LabServer,
) -> None:
    record = StudyStore(lab_server.root / "small").read(CONDITION, 1)
    for generation, agent in ((2, 3), (2, 19), (1, 0), (0, 5)):
        response = get_json(
            lab_server.address, "ancestors", **SMALL | {"generation": generation}, agent=agent
        )
        assert response == compute_ancestors(record, generation, agent)


def test_a_generation_after_the_end_of_a_stopped_run_is_refused(lab_server: LabServer) -> None:
    stopped = shorten_preset().replace(
        name="stopped", evolution={"stop": "target-fitness", "target_fitness": {"target": 0}}
    )
    study = make_small_study(lab_server.root / "stopped", [stopped], runs=1)
    query = {"study": "stopped", "condition": "stopped", "run": 0, "agent": 0}
    for path in ("ancestors", "lineage"):
        get_json(lab_server.address, path, **query, generation=0)
        response = get_response(lab_server.address, path, **query, generation=1)
        assert (response.status_code, response.json()["error"]) == (
            400,
            "generation = 1: run 0 of stopped has the generations 0 to 0",
        )
    shutil.rmtree(study.directory)


def test_an_agent_without_inheritance_has_no_ancestors(lab_server: LabServer) -> None:
    response = get_json(
        lab_server.address, "ancestors", preset="self-taught/A", run=0, generation=1, agent=4
    )
    assert (response["first"], response["agents"]) == (1, [4])
    assert (response["partners"], response["ancestors"]) == ([], [1])


def test_the_ancestors_in_a_preset_and_in_a_live_run_are_those_of_a_simulated_run(
    lab_server: LabServer,
) -> None:
    run = simulate(load("evo/A").replace(evolution={"generations": 2}), seed=3, run=1)
    assert get_json(
        lab_server.address, "ancestors", preset="evo/A", seed=3, run=1, generation=1, agent=6
    ) == compute_ancestors(run, 1, 6)
    request = {"experiment": shorten_preset().to_dict(), "seed": 3, "runs": 2}
    live = CLIENT.post(f"{lab_server.address}/api/live", json=request).json()["id"]
    query = {"live": live, "run": 1, "generation": 2, "agent": 6}
    reply = CLIENT.get(f"{lab_server.address}/api/ancestors", params=query)
    while reply.status_code == 400:
        assert "is not finished" in reply.json()["error"]
        reply = CLIENT.get(f"{lab_server.address}/api/ancestors", params=query)
    assert reply.json() == compute_ancestors(simulate(shorten_preset(), seed=3, run=1), 2, 6)


def test_a_tree_has_the_ancestors_siblings_and_children_of_an_agent() -> None:
    # Generation 1: agents 0 and 1 have both parents in common, agent 2 shares one.
    parents = np.array(
        [
            [[-1, -1], [-1, -1], [-1, -1], [-1, -1]],
            [[0, 1], [1, 0], [1, 2], [3, 3]],
            [[0, 3], [2, 2], [1, 0], [3, 2]],
        ],
        np.int32,
    )
    eaten = np.arange(12, dtype=np.int32).reshape(3, 4)
    tree = make_tree(1, 0, parents, eaten)
    assert tree["rows"] == [
        {"generation": 0, "agents": [0, 1], "eaten": [0, 1]},
        {"generation": 1, "agents": [0, 1, 2], "eaten": [4, 5, 6]},
        {"generation": 2, "agents": [0, 2], "eaten": [8, 10]},
    ]
    assert sorted(tree["links"]) == [
        *([1, 0, 0], [1, 0, 1], [1, 1, 0], [1, 1, 1], [1, 2, 1]),
        *([2, 0, 0], [2, 2, 0], [2, 2, 1]),
    ]
    assert tree["omitted"] == 0


def test_an_agent_of_generation_0_has_children_only() -> None:
    parents = np.array([[[-1, -1]] * 3, [[0, 1], [2, 2], [0, 0]]], np.int32)
    tree = make_tree(0, 0, parents, np.zeros((2, 3), np.int32))
    assert [row["agents"] for row in tree["rows"]] == [[0], [0, 2]]


def test_a_tree_of_a_large_family_is_limited() -> None:
    parents = np.zeros((9, 100, 2), np.int32)
    parents[0] = -1
    tree = make_tree(7, 5, parents, np.zeros((9, 100), np.int32))
    assert len(tree["rows"]) <= MAX_DEPTH + 2
    assert max(len(row["agents"]) for row in tree["rows"]) == MAX_AGENTS_PER_GENERATION
    # Agent 5 has 99 siblings, and no child, because agent 0 is the parent of all.
    assert tree["omitted"] == 100 - MAX_AGENTS_PER_GENERATION


def test_the_links_are_those_of_the_record(lab_server: LabServer) -> None:
    record = StudyStore(lab_server.root / "small").read(CONDITION, 1)
    tree = get_json(lab_server.address, "lineage", **SMALL, agent=3)
    assert tree["links"]
    for generation, child, parent in tree["links"]:
        assert parent in record.parents.values[generation, child]
