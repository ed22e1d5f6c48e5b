"""Losses and sensitivities are those of plain loops, and known for artificial mutants."""

from __future__ import annotations

import numpy as np
import pytest
import xarray as xr

from baldwinlab.analysis.assays.analysis import evaluate_assays
from baldwinlab.analysis.assays.canalization import (
    BUFFERING,
    DECLINE,
    EFFECTS,
    TABLE,
    compute_effects,
)
from baldwinlab.analysis.assays.section import tabulate_effects
from tests.analysis.assays.artificial_assays import canalization

A = "evo+self-taught/A"


def random_data() -> xr.Dataset:
    """Return an assay of two runs with random fitness."""
    data = canalization(A, (4, 2, 1), runs=2)
    rng = np.random.default_rng(1)
    return data.map(lambda values: values.copy(data=rng.normal(size=values.shape)))


def test_effects_are_those_of_plain_loops() -> None:
    data = random_data()
    effects = compute_effects(data)
    energy, mutants = data["energy"].values, data["mutant_energy"].values
    for run in range(2):
        variances = [np.var(energy[run, generation, life, 0]) for generation in range(3)
                     for life in range(2)]  # fmt: skip
        unit = np.mean(variances) ** 0.5
        for generation in range(3):
            for life in range(2):
                agents, new_world = energy[run, generation, life]
                losses = [
                    (agents[agent] - mutants[run, generation, life, mutant, agent]) / unit
                    for mutant in range(3)
                    for agent in range(4)
                ]
                shifts = [(agents[agent] - new_world[agent]) / unit for agent in range(4)]
                expected = [
                    np.mean(losses),
                    np.mean(np.square(losses)) ** 0.5,
                    np.mean(shifts),
                    np.mean(np.square(shifts)) ** 0.5,
                ]
                row = effects.isel(run=run, generation=generation, life=life)
                assert [float(row[name]) for name in EFFECTS] == pytest.approx(expected)


def test_effects_do_not_depend_on_the_unit_of_fitness_or_on_missing_mutations() -> None:
    data = random_data()
    xr.testing.assert_allclose(compute_effects(1000 + 7 * data), compute_effects(data))
    # Mutants without a mutation are left out.
    data = canalization(A, (4, 2, 1))
    data["mutant_energy"] = data["mutant_energy"].where(data["mutant"] > 0)
    xr.testing.assert_allclose(compute_effects(data), compute_effects(canalization(A, (4, 2, 1))))
    # Constant fitness has no effects.
    data = canalization(A, (4, 2, 1)) * 0 + 3
    assert compute_effects(data).to_array().isnull().all()


def test_buffering_and_decline_are_shares_of_the_sensitivity() -> None:
    analysis = evaluate_assays({"canalization": {A: canalization(A, (4, 2, 1), buffering=0.25)}})
    buffering = analysis.find_number(A, BUFFERING, "mutation, generation 39")
    decline = analysis.find_number(A, DECLINE, "mutation, innate fitness")
    assert buffering is not None and buffering.median == pytest.approx(0.25)
    assert decline is not None and decline.median == pytest.approx(1 - 1 / 4)


def test_a_condition_without_learning_has_rows_of_innate_fitness_only() -> None:
    data = canalization("evo/A", (4, 2, 1))
    data = data.where(data["life"] == "off")
    rows = tabulate_effects(evaluate_assays({"canalization": {"evo/A": data}}), TABLE)
    assert [row["measure"] for row in rows] == ["innate fitness"] * 3
    # The standard deviation of fitness is 2.
    assert [row["numbers"][0].median for row in rows] == pytest.approx([2, 1, 0.5])
