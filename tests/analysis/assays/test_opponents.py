"""Comparisons of generations of two species, for artificial assays with a known result."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

from baldwinlab.analysis.assays.opponents import (
    compare_generations,
    compose_sentences,
    draw_matrices,
    list_matrices,
    make_section,
)
from baldwinlab.analysis.results.numbers import format_number
from baldwinlab.analysis.results.verdicts import HIGHER, LOWER, UNDECIDED
from baldwinlab.core.variables import make_dataset
from baldwinlab.studies.assays.catalog import get_assay

GENERATIONS = (0, 10, 20)
RUNS = 12


def make_opponents(
    predators: float, prey: float, generations: tuple[int, ...] = GENERATIONS
) -> xr.Dataset:
    """Return an assay in which a generation of a species adds an amount to its own fitness.

    A generation of prey subtracts 0.5 from the fitness of predators.
    """
    noise = np.random.default_rng(1).normal(scale=0.01, size=(RUNS, *[len(generations)] * 2, 2))
    steps = np.arange(len(generations))
    energy = 5 + noise
    energy[..., 0] += predators * steps[:, None] - 0.5 * steps
    energy[..., 1] += prey * steps
    data = make_dataset(get_assay("opponents").variables, {"energy": energy}, {})
    return data.assign_coords(
        run=np.arange(RUNS),
        first_generation=list(generations),
        second_generation=list(generations),
        species=["predators", "prey"],
    )


def find_differences(data: xr.Dataset) -> list[str]:
    return [test.difference for test in compare_generations({"both": data})]


def test_a_species_that_evolves_is_better_than_its_founders_against_the_same_opponents() -> None:
    against_first, against_last, last_against_both, *of_prey = find_differences(
        make_opponents(1, 0)
    )
    assert (against_first, against_last) == (HIGHER, HIGHER)
    assert last_against_both == LOWER
    assert of_prey == [UNDECIDED] * 3
    assert compare_generations({"single": make_opponents(1, 1, (0,))}) == []
    few = {"few": make_opponents(1, 0).isel(run=[0, 1])}
    assert {test.difference for test in compare_generations(few)} == {"too few runs"}


def test_each_species_is_compared_by_its_own_generation() -> None:
    predators, prey = list_matrices(make_opponents(1, 2))
    assert (predators.opponents, prey.opponents) == ("prey", "predators")
    gains = prey.fitness.sel(own=20) - prey.fitness.sel(own=0)
    np.testing.assert_allclose(gains, 4, atol=0.1)
    losses = predators.fitness.sel(opponent=20) - predators.fitness.sel(opponent=0)
    np.testing.assert_allclose(losses, -1, atol=0.1)


def test_the_comparisons_of_all_conditions_are_one_family() -> None:
    data = make_opponents(1, 0.004)
    (first_test, *_) = (test for test in compare_generations({"a": data}) if test.pairs.p < 1e-3)
    among_others = compare_generations(dict.fromkeys("abcdefgh", data))[0]
    assert among_others.pairs == first_test.pairs
    assert among_others.test.p_holm > first_test.test.p_holm


def test_sentences_name_the_conditions_of_each_answer() -> None:
    stored = {"learns": make_opponents(1, 0), "frozen": make_opponents(0, 0)}
    sentences = compose_sentences(compare_generations(stored))
    assert len(sentences) == 6
    assert sentences[0] == (
        "Fitness of predators of generation 20 compared with generation 0, against prey of "
        "generation 0: higher in learns; undecided in frozen."
    )
    assert sentences[3].endswith("against predators of generation 0: undecided in all conditions.")


def test_the_figure_has_the_median_of_each_meeting() -> None:
    data = make_opponents(1, 2)
    predators, prey = draw_matrices({"both": data}).axes
    assert predators.get_title(loc="left") == "both: predators"
    assert prey.get_xlabel() == "generation of predators"
    (last_prey_against_founders,) = (
        text.get_text() for text in prey.texts if text.get_position() == (0, 2)
    )
    meeting = data.energy.sel(species="prey", first_generation=0, second_generation=20)
    assert last_prey_against_founders == format_number(float(meeting.median()))


@pytest.mark.parametrize("generations", [GENERATIONS, (0,)])
def test_the_section_has_the_answers_and_the_figure(
    tmp_path: Path, generations: tuple[int, ...]
) -> None:
    instruction = "To add runs: baldwinlab run mine --runs {runs}"
    section = make_section({"both": make_opponents(1, 0, generations)}, tmp_path, instruction)
    assert "To add runs" not in section.body
    has_tests = len(generations) > 1
    assert ("predators of generation 20 compared with" in section.body) == has_tests
    assert ("higher in both" in section.summary) == has_tests
    assert {path.suffix for path in tmp_path.iterdir()} == {".svg", ".pdf", ".png", ".csv"}


def test_the_section_says_how_to_add_runs_if_they_are_too_few(tmp_path: Path) -> None:
    few = {"few": make_opponents(1, 0).isel(run=[0, 1])}
    section = make_section(few, tmp_path, "To add runs: baldwinlab run mine --runs {runs}")
    assert re.search(r"(\d+) runs are needed\. To add runs: .* mine --runs \1<", section.body)
