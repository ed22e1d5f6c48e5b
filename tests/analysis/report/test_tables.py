"""Tables of pages: the HTML of the macro, and the columns of comparisons."""

from __future__ import annotations

import re
from dataclasses import replace
from math import nan

from markupsafe import Markup

from baldwinlab.analysis.claims import evaluate_claims
from baldwinlab.analysis.report import sections
from baldwinlab.analysis.report.content import describe_verdicts
from baldwinlab.analysis.report.tables import (
    Table,
    add_detail,
    badge,
    tabulate,
    tabulate_claims,
    tabulate_contrasts,
    tabulate_findings,
    tabulate_tests,
)
from baldwinlab.analysis.results.table import NUMBER_HEADINGS, format_comparison
from baldwinlab.analysis.statistics.comparisons import compare, compare_paired, compare_pairs
from tests.analysis.results.studies import AS_THE_PAPER, compare_conditions, study


def write(table: Table) -> str:
    """Return the HTML of a table, without space between elements."""
    source = '{% from "report/macros.html" import table %}{{ table(entry) }}'
    html = sections._make_environment().from_string(source).render(entry=table)
    return re.sub(r">\s+<", "><", html.strip())


def test_a_table_has_a_name_scopes_and_numbers_at_the_right() -> None:
    html = write(tabulate("All <runs>", ["Name"], ["n"], [["a & b", 3], ["c", ""]]))
    assert html == (
        '<div class="scroll" tabindex="0" role="region" aria-label="All &lt;runs&gt;">'
        '<table class="numbers"><thead><tr><th scope="col">Name</th>'
        '<th scope="col" class="right">n</th></tr></thead>'
        '<tbody><tr><th scope="row">a &amp; b</th><td class="right">3</td></tr></tbody>'
        '<tbody><tr><th scope="row">c</th><td class="right"></td></tr></tbody></table></div>'
    )


def test_a_group_of_rows_has_one_heading_and_claims_have_labels_for_phones() -> None:
    groups = [("C1", [[badge("holds")], [Markup("<b>no</b>")]])]
    html = write(Table("Claims", {"Claim": "", "Verdict": "plain"}, groups, "claims", "All claims"))
    assert "<caption>All claims</caption>" in html
    assert html.count('<th scope="rowgroup" rowspan="2">C1</th>') == html.count("<tbody>") == 1
    assert '<td class="plain" data-label="Verdict"><span class="verdict holds">' in html
    assert '<td class="plain" data-label="Verdict"><b>no</b></td>' in html


def test_a_detail_without_text_is_left_out() -> None:
    assert add_detail("a", "", "b<") == Markup("a <small>b&lt;</small>")
    assert add_detail("a<", "") == Markup("a&lt;")


def test_the_first_tables_have_effects_and_the_folded_ones_all_numbers() -> None:
    data = study(AS_THE_PAPER)
    results = evaluate_claims(data)
    contrasts = compare_conditions(data)
    for first in (tabulate_contrasts(contrasts), tabulate_claims(results)):
        shown = set(NUMBER_HEADINGS.values()) & set(first.columns)
        assert shown == {NUMBER_HEADINGS["effect"], NUMBER_HEADINGS["runs"]}
    first, tests = tabulate_contrasts(contrasts), tabulate_tests(contrasts)
    assert set(NUMBER_HEADINGS.values()) <= {*first.columns, *tests.columns}
    assert set(NUMBER_HEADINGS.values()) <= set(tabulate_findings(results).columns)
    for table in (first, tests, tabulate_claims(results), tabulate_findings(results)):
        for _, rows in table.groups:
            assert {len(cells) for cells in rows} == {len(table.columns) - 1}


def test_verdicts_on_exploratory_claims_are_shown_and_not_counted() -> None:
    results = evaluate_claims(study(AS_THE_PAPER, generations=24))
    assert describe_verdicts(results) == "9 claims of the paper: 9 hold"
    restated = [
        replace(result, claim=result.claim.model_copy(update={"kind": "exploratory"}))
        for result in results[:2]
    ]
    assert describe_verdicts([*restated, *results[2:]]) == (
        "7 claims of the paper: 7 hold; 2 exploratory claims: not counted"
    )
    assert str(badge("holds")) in str(tabulate_claims(restated).groups)


def test_pairs_have_the_numbers_of_the_paired_comparison() -> None:
    a, b = [3.0, 4.0, 5.0, 5.0], [1.0, 5.0, 2.0, 5.0]
    of_pairs = format_comparison(compare_pairs(a, b), nan)
    assert of_pairs.pop("runs") == "2 above, 1 below 0, of 4"
    assert format_comparison(compare_paired(a, b), nan) == of_pairs | {"runs": "4, 4"}
    assert of_pairs["effect"].startswith("+") and of_pairs["p_holm"] == "–"


def test_a_level_has_no_sign_and_one_number_of_runs() -> None:
    level = compare([2.0, 3.0], [1.0, 1.0])._replace(n_b=0, low=nan)
    texts = format_comparison(level, 0.5)
    assert (texts["effect"], texts["runs"]) == ("1.50", "2")
