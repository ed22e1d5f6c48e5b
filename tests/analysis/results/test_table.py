"""Cells and sentences of comparisons, on small hand-made studies."""

from __future__ import annotations

import re

import pytest

from baldwinlab.analysis.results.table import (
    HEADINGS,
    TEST_HEADINGS,
    describe_contrast,
    describe_method,
    list_cells,
)
from tests.analysis.results.studies import compare_conditions, study

HIGH = range(100, 108)
LOW = range(10, 18)
MIXED = [5, 6, 7, 8, 104, 105, 106, 107]


def test_the_cells_have_all_numbers_of_a_comparison() -> None:
    cells = list_cells(compare_conditions(study({"evo/A": LOW, "evo+drift/A": HIGH})))[0]
    assert cells.keys() == HEADINGS.keys() | TEST_HEADINGS.keys() | {"context"}
    assert not {"p", "p_holm", "a12"} & HEADINGS.keys()
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
def test_a_sentence_about_a_row_states_the_verdict_in_the_outcome(
    values: list[float], sentence: str
) -> None:
    data = study({"a": LOW, "b": values}).assign_attrs(outcome="items eaten")
    assert describe_contrast(compare_conditions(data).rows[0]).startswith(sentence)
