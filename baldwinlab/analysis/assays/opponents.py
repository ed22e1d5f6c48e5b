"""Comparisons of generations of two species against the same opponents, from `opponents`.

The value of a run is the mean fitness of the agents of a species. All comparisons are within runs,
and their p-values are one family, corrected by Holm's method.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Final, Literal, NamedTuple

import xarray as xr

from baldwinlab.analysis import statistics
from baldwinlab.analysis.statistics.rules import SIGNIFICANCE_LEVEL

Difference = Literal["higher", "lower", "undecided"]
HIGHER: Final[Difference] = "higher"
LOWER: Final[Difference] = "lower"
UNDECIDED: Final[Difference] = "undecided"
DIFFERENCES: Final = (HIGHER, LOWER, UNDECIDED)
GENERATION_DIMS: Final = ("first_generation", "second_generation")
"""Dimensions of the generations of the first and of the second species."""


class SpeciesMatrix(NamedTuple):
    """Fitness of a species, by its generation and by the generation of its opponents."""

    species: str
    opponents: str
    fitness: xr.DataArray  # Mean fitness of the agents (run, own, opponent).


@dataclass(frozen=True)
class GenerationTest:
    """A comparison of two cells of a matrix, run by run."""

    condition: str
    # The species, the compared generations, and their opponents.
    question: str
    pairs: statistics.Pairs
    # p-value, corrected for all comparisons of the study.
    p_holm: float

    @property
    def difference(self) -> Difference:
        """The direction of a significant difference."""
        majority = self.pairs.above - self.pairs.below
        # False for a p-value of NaN.
        is_significant = self.p_holm < SIGNIFICANCE_LEVEL
        has_one_direction = majority * self.pairs.effect > 0
        if not is_significant or not has_one_direction:
            return UNDECIDED
        return HIGHER if majority > 0 else LOWER


def list_matrices(data: xr.Dataset) -> list[SpeciesMatrix]:
    """Return the matrix of each species.

    Returns two matrices, in the order of the species.
    """
    names = [str(name) for name in data["species"].values]
    matrices = []
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
    """Compare the first and the last generation of each species, and those of its opponents.

    Returns three tests for each species of each condition; none if only one generation met.
    """
    comparisons = []
    for condition, data in stored.items():
        for matrix in list_matrices(data):
            for question, pairs in _compare_matrix(matrix):
                comparisons.append((condition, question, pairs))
    p_values = statistics.holm([pairs.p for *_, pairs in comparisons]).tolist()
    return [
        GenerationTest(*comparison, p_holm=p)
        for comparison, p in zip(comparisons, p_values, strict=True)
    ]


def _compare_matrix(matrix: SpeciesMatrix) -> Iterator[tuple[str, statistics.Pairs]]:
    """Yield a description and the comparison of two cells at the corners of a matrix."""
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
    """Compare the first with the second of two cells (run, cell)."""
    return statistics.compare_pairs(*fitness.transpose(..., "run").values)


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
    """Yield each answer to a question with its conditions."""
    for difference in DIFFERENCES:
        conditions = [test.condition for test in group if test.difference == difference]
        is_unanimous = len(conditions) == len(group) > 1
        if conditions:
            names = "all conditions" if is_unanimous else ", ".join(conditions)
            yield f"{difference} in {names}"
