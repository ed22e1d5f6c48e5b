"""One estimate for every question, with its class and the reason for it."""

from __future__ import annotations

import numpy as np
import pytest
import xarray as xr

import baldwinlab as bl
from baldwinlab.analysis.estimands import (
    CANNOT_RISE,
    IMPOSSIBLE,
    MEASURED,
    NOT_MEASURABLE,
    QUESTIONS,
    Estimate,
    estimate,
)
from baldwinlab.analysis.results.verdicts import EQUAL
from baldwinlab.studies.assays.fork import HISTORIES, REGIMES
from tests.analysis.estimands.conftest import Stored


def estimates(data: Stored, **assays: xr.Dataset) -> dict[str, Estimate]:
    rows = estimate(data.runs, assays, data.experiment, 5)
    assert tuple(row.question for row in rows) == QUESTIONS
    return {row.question: row for row in rows}


def fork() -> xr.Dataset:
    """A fork in which history adds 3 and learning removes 1, and 2 more from the control.

    Both effects are absent in the first of two start generations.
    """
    shape = (4, 2, len(HISTORIES), len(REGIMES), 6)
    fitness = np.full(shape, 10.0)
    fitness[:, 1, HISTORIES.index("learner")] += 3
    fitness[:, 1, :, REGIMES.index("on")] -= 1
    fitness[:, 1, HISTORIES.index("control"), REGIMES.index("on")] -= 2
    dims = ("run", "generation", "history", "regime", "agent")
    coords = {
        "run": np.arange(4),
        "generation": [0, 11],
        "history": list(HISTORIES),
        "regime": list(REGIMES),
    }
    return xr.Dataset({"innate_fitness": (dims, fitness), "fitness": (dims, fitness)}, coords)


def test_every_question_has_a_row_although_no_assay_is_stored(stored: dict[str, Stored]) -> None:
    rows = estimates(stored["costly-climbing/rugged"])
    for row in rows.values():
        assert (row.measurability, row.values) == (NOT_MEASURABLE, None)
        assert row.reason.endswith(".")
    assert rows["fork-history"].reason == "The assay fork is not stored."


def test_a_measured_question_has_one_value_per_run_and_a_bound(stored: dict[str, Stored]) -> None:
    data = stored["guessing"]
    rows = estimates(data, innate=data.innate, assimilation=data.assimilation)
    for name in ("selection-by-learning", "assimilation", "savings"):
        row = rows[name]
        assert row.measurability == MEASURED
        assert row.values is not None
        assert row.values.dims == ("run",)
        assert set(row.values.coords) == {"run"}
        assert row.equivalence_bound > 0
        assert row.trait


def test_effects_of_a_fork_are_those_of_the_last_start(stored: dict[str, Stored]) -> None:
    rows = estimates(stored["costly-climbing/rugged"], fork=fork())
    # The history is decided without learning, the regime on the mean of both histories.
    for name, effect in {"fork-history": 3, "fork-regime": -2}.items():
        values = rows[name].values
        assert values is not None
        # Without learning, the genomes of learners have an innate fitness of 13.
        assert values.values.tolist() == pytest.approx([effect / 13] * 4)
        assert rows[name].equivalence_bound == 0.02
    # An effect of history is a share of the better genomes.
    worse = fork()
    worse["innate_fitness"].loc[{"history": "learner"}] = 2.5
    values = estimates(stored["costly-climbing/rugged"], fork=worse)["fork-history"].values
    assert values is not None
    assert values.values.tolist() == pytest.approx([-0.75] * 4)


@pytest.mark.parametrize(("n_above", "is_measured"), [(0, False), (2, False), (3, True)])
def test_a_fork_needs_a_share_of_agents_above_the_floor(
    n_above: int, is_measured: bool, stored: dict[str, Stored]
) -> None:
    data = fork().map(np.ones_like, keep_attrs=True)
    # Without learning, both histories have 48 agents in four runs, of which 3 are more than 5 %.
    data["innate_fitness"][:n_above, 1, HISTORIES.index("learner"), REGIMES.index("off"), 0] = 2
    row = estimates(stored["costly-climbing/rugged"], fork=data)["fork-history"]
    assert (row.measurability == MEASURED) == is_measured
    if not n_above:
        assert row.reason == (
            "0 % of the agents of both groups are above the lowest innate fitness, 1, and 5 % "
            "are needed."
        )


def test_a_learned_step_of_constant_length_cannot_become_innate(
    stored: dict[str, Stored],
) -> None:
    data = stored["stepping/convex"]
    row = estimates(data, innate=data.innate)["assimilation"]
    assert row.measurability == IMPOSSIBLE
    assert row.reason == "Learning adds the same step to x in every life."


def test_inherited_learning_is_innate_by_construction(stored: dict[str, Stored]) -> None:
    data = stored["guessing"]
    lamarckian = data.experiment.replace(evolution={"lamarckian_share": 0.5})
    row = estimates(data._replace(experiment=lamarckian), assimilation=data.assimilation)
    assert row["assimilation"].measurability == IMPOSSIBLE
    assert row["assimilation"].reason == "Children inherit what their parents have learned."


def test_equal_terms_are_a_class_of_their_own(stored: dict[str, Stored]) -> None:
    data = stored["guessing"]
    distance = data.assimilation["distance"]
    equal = data.assimilation.assign(distance=0 * distance + distance.sel(history="learner"))
    row = estimates(data, assimilation=equal)["assimilation"]
    assert (row.measurability, row.values) == (EQUAL, None)
    # Both terms remain, and they are not 0.
    assert float(abs(row.terms["learner"]).min()) > 0


def test_selection_by_ranks_of_innate_fitness_cannot_rise(stored: dict[str, Stored]) -> None:
    data = stored["costly-climbing/rugged"]
    ranked = data.experiment.replace(evolution={"selection": "rank"})
    row = estimates(data._replace(experiment=ranked), innate=data.innate)["selection-by-learning"]
    assert (row.measurability, row.values) == (CANNOT_RISE, None)


def test_questions_without_an_answer_are_not_measurable_or_impossible(
    stored: dict[str, Stored],
) -> None:
    data = stored["guessing"]
    experiment = data.experiment.replace(evolution={"inheritance": "none"})
    rows = estimate(data.runs, {"innate": data.innate}, experiment, 5)
    assert {(row.measurability, row.reason) for row in rows} == {
        (IMPOSSIBLE, "Genomes are not inherited.")
    }
    # Questions on several species are not measurable.
    species = bl.load("invasion:learner-on-needle")
    rows = estimate(data.runs, {"innate": data.innate}, species, 5)
    assert {row.measurability for row in rows} == {NOT_MEASURABLE}
    # A distance that is 0 from the start is not measurable.
    no_distance = data.assimilation.assign(distance=0 * data.assimilation["distance"])
    row = estimates(data, assimilation=no_distance)["assimilation"]
    assert (row.measurability, row.values) == (NOT_MEASURABLE, None)
    # An unknown selection scheme is not measurable.
    experiment = data.experiment.replace(evolution={"selection": "lexicase"})
    row = estimates(data._replace(experiment=experiment), innate=data.innate)[
        "selection-by-learning"
    ]
    assert row.measurability == NOT_MEASURABLE
    assert "lexicase" in row.reason
