"""Report section that compares generations of two species against the same opponents.

The value of a run is the mean fitness of the agents of a species. All comparisons are within runs.
The p-values of all comparisons are one family, corrected by Holm's method.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import chain
from pathlib import Path
from typing import Any, Final, NamedTuple

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from baldwinlab.analysis import statistics
from baldwinlab.analysis.assays.evaluation import AssayEvaluation
from baldwinlab.analysis.figures.charts import WHITE_TO_BLUE, draw_cells, label_cells
from baldwinlab.analysis.figures.style import FIGURE_WIDTH, styled
from baldwinlab.analysis.report.sections import ReportFigure, Section, render, save_and_inline
from baldwinlab.analysis.report.tables import (
    Table,
    add_detail,
    badge,
    columns_of_comparisons,
    describe_medians,
    number_cells,
)
from baldwinlab.analysis.results.numbers import format_number
from baldwinlab.analysis.results.table import NUMBER_HEADINGS
from baldwinlab.analysis.results.verdicts import (
    HIGHER,
    LOWER,
    TOO_FEW_RUNS,
    UNDECIDED,
    Difference,
    FamilyTest,
    correct_family,
)
from baldwinlab.analysis.statistics.intervals import interval_of_median, tabulate_interval
from baldwinlab.analysis.statistics.significance import describe_too_few, plan_paired_test

OPPONENTS: Final = "opponents"
DIFFERENCES: Final = (HIGHER, LOWER, UNDECIDED, TOO_FEW_RUNS)
GENERATION_DIMS: Final = ("first_generation", "second_generation")
"""Dimensions of the generations of the first and of the second species."""
TITLE: Final = "Opponents of earlier generations"
CAPTION: Final = (
    "Fitness of the average agent of a species, by its generation (row) and by the generation of "
    "its opponents (column). Numbers are medians over runs. Darker cells are closer to the "
    "largest value of the species in all conditions."
)
PANEL_HEIGHT: Final = 2.1
"""Height of the panels of a condition, in inches."""


class SpeciesMatrix(NamedTuple):
    """Fitness of a species, by its generation and by the generation of its opponents."""

    species: str
    opponents: str
    # Mean fitness of the agents (run, own generation `own`, opponents' generation `opponent`).
    fitness: xr.DataArray


@dataclass(frozen=True)
class GenerationTest:
    """A comparison of two cells of a matrix, run by run."""

    condition: str
    # Text that names the species, the compared generations, and the opponents.
    question: str
    pairs: statistics.Pairs
    # Test with a p-value that is corrected for all comparisons of the study.
    test: FamilyTest

    @property
    def difference(self) -> Difference:
        """The direction of a significant difference."""
        return self.test.name_difference(self.pairs)


def list_matrices(data: xr.Dataset) -> list[SpeciesMatrix]:
    """Return the matrix of each species, in the order of the species."""
    names = [str(name) for name in data["species"].values]
    matrices = []
    # For the second species, the dimensions and the names change places.
    for own_dim, opponent_dim, species, opponents in (
        (*GENERATION_DIMS, *names),
        (*GENERATION_DIMS[::-1], *names[::-1]),
    ):
        fitness = data["energy"].sel(species=species, drop=True)
        renamed = fitness.rename({own_dim: "own", opponent_dim: "opponent"})
        matrices.append(
            SpeciesMatrix(species, opponents, renamed.transpose("run", "own", "opponent"))
        )
    return matrices


def compare_generations(stored: Mapping[str, xr.Dataset]) -> list[GenerationTest]:
    """Compare the first with the last generation: of each species, and of the opponents.

    Returns three tests per species and condition, or none if only one generation met.
    """
    comparisons = {
        (condition, question): pairs
        for condition, data in stored.items()
        for matrix in list_matrices(data)
        for question, pairs in _compare_matrix(matrix)
    }
    family = correct_family(
        {key: (plan_paired_test(pairs.n), pairs.p) for key, pairs in comparisons.items()}
    )
    return [GenerationTest(*key, comparisons[key], test) for key, test in family.items()]


def _compare_matrix(matrix: SpeciesMatrix) -> Iterator[tuple[str, statistics.Pairs]]:
    """Yield three comparisons of two corner cells of a matrix, each after a description."""
    species, opponents, fitness = matrix
    generations = fitness["own"].values.tolist()
    first, last = generations[0], generations[-1]
    if first == last:
        return

    for opponent in (first, last):
        question = (
            f"{species} of generation {last} compared with generation {first}, "
            f"against {opponents} of generation {opponent}"
        )
        against_opponent = fitness.sel(opponent=opponent)
        yield question, _compare_cells(against_opponent.sel(own=[last, first]))
    question = (
        f"{species} of generation {last}, against {opponents} of generation {last} "
        f"compared with generation {first}"
    )
    yield question, _compare_cells(fitness.sel(own=last, opponent=[last, first]))


def _compare_cells(fitness: xr.DataArray) -> statistics.Pairs:
    """Compare the first with the second of two cells. The other dimension is `run`."""
    return statistics.compare_pairs(*fitness.transpose(..., "run").values)  # [cell, run]


def group_by_question(tests: Sequence[GenerationTest]) -> dict[str, list[GenerationTest]]:
    """Return the tests of all conditions by question, in the order of the tests."""
    groups: dict[str, list[GenerationTest]] = {}
    for test in tests:
        groups.setdefault(test.question, []).append(test)
    return groups


def compose_sentences(tests: Sequence[GenerationTest]) -> list[str]:
    """Return a sentence for each question, with the conditions of each answer."""
    return [
        f"Fitness of {question}: {'; '.join(_list_answers(group))}."
        for question, group in group_by_question(tests).items()
    ]


def _list_answers(group: Sequence[GenerationTest]) -> Iterator[str]:
    """Yield each answer with the conditions, for example "higher in evo/A, evo/B"."""
    for difference in DIFFERENCES:
        conditions = [test.condition for test in group if test.difference == difference]
        is_unanimous = len(conditions) == len(group) > 1
        if conditions:
            names = "all conditions" if is_unanimous else ", ".join(conditions)
            yield f"{difference} in {names}"


def make_section(stored: Mapping[str, xr.Dataset], folder: Path, instruction: str) -> Section:
    """Make the section of a report on the assay `opponents`, and save its figure."""
    tests = compare_generations(stored)
    sentences = compose_sentences(tests)
    too_few = describe_too_few([test.test.planned for test in tests], instruction=instruction)
    figure = ReportFigure(
        name=OPPONENTS,
        title=TITLE,
        caption=CAPTION,
        alternative=f"{TITLE}. {' '.join(sentences)}",
        figure=draw_matrices(stored),
        table=_tabulate_matrices(stored),
        commands=(f"baldwinlab assay . --assays {OPPONENTS}",),
    )
    body = render(
        "assays/opponents.html",
        sentences=sentences,
        too_few=too_few,
        figure=save_and_inline(figure, folder),
        tests=_tabulate_tests(tests) if tests else None,
    )
    return Section(anchor=OPPONENTS, title=TITLE, body=body, summary=" ".join(sentences))


def _tabulate_tests(tests: Sequence[GenerationTest]) -> Table:
    headings = {"condition": "Comparison", "verdict": "Fitness", **NUMBER_HEADINGS}
    groups = [
        (question, [_test_cells(test) for test in group])
        for question, group in group_by_question(tests).items()
    ]
    label = "Differences between generations"
    return Table(label, columns_of_comparisons(headings), groups, "claims")


def _test_cells(test: GenerationTest) -> list[Any]:
    pairs = test.pairs
    verdict = add_detail(badge(test.difference), test.condition)
    return [verdict, *number_cells(pairs, test.test.p_holm, describe_medians(pairs))]


@styled
def draw_matrices(stored: Mapping[str, xr.Dataset]) -> Figure:
    """Draw the fitness of species by own and opponents' generation: a row per condition."""
    matrices = {condition: list_matrices(data) for condition, data in stored.items()}
    figure = Figure((FIGURE_WIDTH, PANEL_HEIGHT * len(stored)))
    grid = figure.subplots(len(stored), 2, squeeze=False)  # [condition, species]
    # The largest median of each species in all conditions.
    largest: dict[str, float] = {}
    for matrix in chain.from_iterable(matrices.values()):
        value = float(matrix.fitness.median("run").max())
        largest[matrix.species] = max(value, largest.get(matrix.species, value))
    for row, (condition, pair) in zip(grid, matrices.items(), strict=True):
        for axes, matrix in zip(row, pair, strict=True):
            _draw_matrix(axes, matrix, largest[matrix.species])
            axes.set_title(f"{condition}: {matrix.species}")
    return figure


def _draw_matrix(axes: Axes, matrix: SpeciesMatrix, largest: float) -> None:
    medians = matrix.fitness.median("run").values
    texts = np.vectorize(format_number)(medians)
    # The range of the colors must not be empty.
    draw_cells(axes, medians, texts, WHITE_TO_BLUE, (0, largest if largest > 0 else 1.0))
    generations = matrix.fitness["own"].values.tolist()
    label_cells(axes, generations, generations)
    axes.set(xlabel=f"generation of {matrix.opponents}", ylabel=f"generation of {matrix.species}")


def _tabulate_matrices(stored: Mapping[str, xr.Dataset]) -> list[dict[str, Any]]:
    """Return the data of the figure: medians over runs with their intervals."""
    return [
        {"condition": condition, **row}
        for condition, data in stored.items()
        for row in tabulate_interval(interval_of_median(data["energy"]))
    ]


EVALUATION: Final = AssayEvaluation(assay=OPPONENTS, order=110, make_section=make_section)
