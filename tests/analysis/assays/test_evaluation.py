"""The evaluations in the package belong to assays, and read the names that the assays store."""

from __future__ import annotations

from baldwinlab.analysis.assays import fork as fork_evaluation
from baldwinlab.analysis.assays.criteria import load_criteria
from baldwinlab.analysis.assays.evaluation import compute_quantities, load_evaluations
from baldwinlab.analysis.assays.reaction_panels import UNCHANGED_SETTING
from baldwinlab.analysis.assays.values import RANDOM_NEWBORNS
from baldwinlab.studies.assays import fork, reaction, within_life
from baldwinlab.studies.assays.catalog import load_assays
from tests.analysis.assays.artificial_assays import make_all_assays

A = "evo+self-taught/A"


def test_each_evaluation_and_each_criterion_is_of_an_assay() -> None:
    assert load_evaluations().keys() <= load_assays().keys()
    assert {criterion.assay for criterion in load_criteria()} <= load_assays().keys()


def test_figures_tables_and_names_are_of_measures_of_their_assay() -> None:
    assays = make_all_assays()
    for assay, evaluation in load_evaluations().items():
        if not evaluation.compute_quantities or assay not in assays:
            continue
        stored = {assay: assays[assay]}
        measures = {measure for measure, _ in compute_quantities(stored, A, 10)}
        shown = [name for figure in evaluation.figures for name in figure.measures]
        shown += evaluation.measure_names
        if evaluation.table:
            shown += [name for names in evaluation.table.measures.values() for name in names]
        assert set(shown) <= measures, assay


def test_evaluations_read_the_names_that_the_assays_store() -> None:
    assert (fork_evaluation.HISTORIES, fork_evaluation.REGIMES) == (fork.HISTORIES, fork.REGIMES)
    assert UNCHANGED_SETTING == reaction.UNCHANGED_SETTING
    assert RANDOM_NEWBORNS == within_life.RANDOM_NEWBORNS
