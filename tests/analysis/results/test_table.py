"""Cells and sentences of comparisons, on small hand-made studies."""

from __future__ import annotations

import re

import pytest

from baldwinlab.analysis.results.contrasts import compare_conditions
from baldwinlab.analysis.results.table import (
    HEADINGS,
    describe_contrast,
    describe_method,
    list_cells,
    summarize_contrasts,
)
from tests.analysis.results.studies import study

HIGH = range(100, 108)
LOW = range(10, 18)
MIXED = [5, 6, 7, 8, 104, 105, 106, 107]


def test_the_cells_have_all_numbers_of_a_comparison() -> None:
    cells = list_cells(compare_conditions(study({"evo/A": LOW, "evo+drift/A": HIGH})))[0]
    assert cells.keys() == HEADINGS.keys() | {"context"}
    assert re.fullmatch(r"\+90\.0 \[8\d\.\d, 9\d\.\d\]", cells["effect"])
    # All 64 pairs are higher. The exact p of two samples of 8 is 2 / 12870, doubled for two tests.
    assert (cells["verdict"], cells["a12"], cells["runs"]) == ("higher", "1.00", "8, 8")
    assert (cells["p"], cells["p_holm"]) == ("1.6e-04", "3.1e-04")
    method = describe_method(compare_conditions(study({"a": LOW, "b": HIGH}), last=4))
    assert "the last 4 generations" in method and "for 2 tests" in method


def test_only_different_references_are_named_in_the_rows() -> None:
    data = {"evo/A": LOW, "drift/A": HIGH, "evo/B": LOW, "drift/B": HIGH}
    one_map = dict(list(data.items())[:2])
    contexts = [
        [cells["context"] for cells in list_cells(compare_conditions(study(conditions)))]
        for conditions in (one_map, data)
    ]
    assert contexts[0] == ["average agent", "best agent"]
    assert contexts[1] == [
        f"{agent}, compared with {reference}"
        for reference in ("evo/A", "evo/B")
        for agent in ("average agent", "best agent")
    ]


@pytest.mark.parametrize(
    ("values", "sentence"),
    [
        (HIGH, "b is higher than a in items eaten by the average agent: +90.0 ["),
        (MIXED, "It is undecided whether b and a differ in items eaten by the average agent: "),
        ([90], "The runs are too few to compare b and a in items eaten by the average agent: "),
    ],
)
def test_a_sentence_states_the_verdict_in_the_outcome(values: list[float], sentence: str) -> None:
    data = study({"a": LOW, "b": values}).assign_attrs(outcome="items eaten")
    contrasts = compare_conditions(data)
    assert describe_contrast(contrasts.rows[0]).startswith(sentence)
    assert summarize_contrasts(contrasts) == [describe_contrast(contrasts.rows[0])]


def test_several_conditions_are_counted_first_and_the_largest_follows() -> None:
    data = study({"a": LOW, "b": MIXED, "c": range(50, 58), "d": HIGH, "e": range(8)})
    count, largest, second, last = summarize_contrasts(compare_conditions(data))
    assert count == (
        "3 of 4 conditions differ from a in fitness of the average agent: 2 higher, 1 lower "
        "(corrected p below 0.05)."
    )
    assert largest.startswith("d is higher than a") and second.startswith("c is higher than a")
    assert last.startswith("e is lower than a")
