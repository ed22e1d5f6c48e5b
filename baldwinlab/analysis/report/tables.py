"""Tables of HTML pages, and phrases for the findings in the tables.

A table has a heading for each column, and rows of cells that are text or Markup.
The macro `table` of ``report/macros.html`` writes the HTML of every table.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from typing import Any, Final, NamedTuple

from markupsafe import Markup

from baldwinlab.analysis.claim_results import ClaimResult, Finding
from baldwinlab.analysis.report.content import find_weakest_findings
from baldwinlab.analysis.results.contrasts import Contrasts
from baldwinlab.analysis.results.numbers import format_number, format_signed
from baldwinlab.analysis.results.table import (
    HEADINGS,
    NUMBER_HEADINGS,
    TEST_HEADINGS,
    format_comparison,
    format_medians,
    list_cells,
)
from baldwinlab.analysis.results.verdicts import MARKS, UNSTABLE
from baldwinlab.analysis.statistics.comparisons import Pairs
from baldwinlab.experiment.outcome import FOOD_OUTCOMES, name_share
from baldwinlab.papers.claims import KINDS

# CSS classes of the columns of a comparison, by key. The other columns (numbers) are "plain".
COMPARISON_CLASSES: Final = {"condition": "", "verdict": "plain", "effect": "measured"}

Cells = Sequence[Any]
MEASURE_NAMES = {
    "best": "best agent",
    "mean": "average agent",
    "share": "share of agents that eat",
    "most": "highest number of items that an agent ate",
    "unseen-maps": "average agent on unseen maps",
}


class Table(NamedTuple):
    """A table of a page. A group is a `tbody`: a heading in the first column, and its rows."""

    label: str  # Name for screen readers.
    columns: Mapping[str, str]  # The CSS class of the cells by heading, such as "right".
    groups: Sequence[tuple[Any, Sequence[Cells]]]  # (heading, rows). Rows omit the first column.
    style: str = "numbers"  # CSS classes. The rows of "claims" are blocks on a phone.
    caption: str = ""  # Shown above the table.


def tabulate(
    label: str, texts: Iterable[str], numbers: Iterable[str], rows: Iterable[Cells]
) -> Table:
    """Return a table with one row per group. `texts`, then `numbers` are headings of columns."""
    columns = dict.fromkeys(texts, "") | dict.fromkeys(numbers, "right")
    return Table(label, columns, [(heading, [cells]) for heading, *cells in rows])


def badge(verdict: str) -> Markup:
    """Return the verdict of a claim, a comparison or a measurement, with its mark."""
    return Markup('<span class="verdict {}"><span aria-hidden="true">{}</span> {}</span>').format(
        verdict.replace(" ", "-"), MARKS[verdict], verdict
    )


def show_verdict(entry: Any) -> Markup:
    """Return the badge of the label of an entry, then "unstable" if the entry is unstable."""
    labels = [entry.label, *[UNSTABLE] * entry.is_unstable]
    return Markup(" ").join(map(badge, labels))


def add_detail(text: str, *details: str) -> Markup:
    """Return a text, followed by the non-empty details in small type."""
    detail = "; ".join(filter(None, details))
    return Markup("{} <small>{}</small>").format(text, detail) if detail else Markup.escape(text)


def emphasize(text: str, *details: str) -> Markup:
    """Return a text in bold, followed by the non-empty details in small type."""
    return add_detail(Markup("<strong>{}</strong>").format(text), *details)


def columns_of_comparisons(headings: Mapping[str, str]) -> dict[str, str]:
    """Return the columns of a table in the style "claims": CSS class by heading."""
    return {heading: COMPARISON_CLASSES.get(key, "plain") for key, heading in headings.items()}


def number_cells(numbers: Any, p_holm: float, *details: str) -> list[Any]:
    """Return the cells for `NUMBER_HEADINGS`. The details follow the effect, in small type."""
    cells: dict[str, Any] = dict(format_comparison(numbers, p_holm))
    return [*(cells | {"effect": emphasize(cells["effect"], *details)}).values()]


def describe_medians(pairs: Pairs) -> str:
    """Return the medians of both samples, such as "12.5; compared with 10.2"."""
    return "; compared with ".join(format_medians(pairs))


def tabulate_contrasts(contrasts: Contrasts) -> Table:
    """Return the table of the comparisons of conditions."""
    groups = []
    for contrast, texts in zip(contrasts.rows, list_cells(contrasts), strict=True):
        cells = texts | {
            "verdict": badge(texts["verdict"]),
            "effect": emphasize(texts["effect"], contrast.note),
        }
        heading = emphasize(texts["condition"], texts["context"])
        groups.append((heading, [[cells[key] for key in HEADINGS if key != "condition"]]))
    label = "Comparisons of conditions"
    return Table(label, columns_of_comparisons(HEADINGS), groups, "claims")


def tabulate_tests(contrasts: Contrasts) -> Table:
    """Return the table of the tests of the comparisons: p, corrected p and A12."""
    groups = [
        (
            add_detail(cells["condition"], cells["context"]),
            [[cells[key] for key in TEST_HEADINGS if key != "condition"]],
        )
        for cells in list_cells(contrasts)
    ]
    return Table("Tests", columns_of_comparisons(TEST_HEADINGS), groups, "claims")


def tabulate_claims(results: Sequence[ClaimResult]) -> Table:
    """Return the table of the claims with their weakest findings, and the values of the paper."""
    headings = dict(HEADINGS) | {"condition": "Claim"}
    columns = columns_of_comparisons(headings)
    if any(result.claim.of_paper for result in results):
        columns["Paper"] = "paper"
    groups = []
    for result in results:
        findings = find_weakest_findings(result)
        rows = [_finding_cells(finding) for finding in findings]
        if not rows:
            rows = [[badge(result.verdict), add_detail("", result.why_not), "–"]]
        if "Paper" in columns:
            paper = add_detail(result.claim.paper, describe_distance(result))
            for index, row in enumerate(rows):
                row.append("" if index else paper)
        groups.append((_head_claim(result, len(findings)), rows))
    return Table("Claims", columns, groups, "claims")


def _head_claim(result: ClaimResult, n_parts: int) -> Markup:
    """Return the heading of a claim. Several findings add the verdict of the claim."""
    claim = result.claim
    name = Markup("<strong>{}</strong> {}").format(claim.id, claim.title)
    heading = add_detail(name, f"{claim.text} ({KINDS[claim.kind][0]})")
    return heading + (Markup("All parts: ") + badge(result.label) if n_parts > 1 else "")


def _finding_cells(finding: Finding) -> list[Any]:
    details = (describe_comparison(finding), finding.note)
    texts = format_comparison(finding.numbers, finding.p_holm)
    return [show_verdict(finding), emphasize(texts["effect"], *details), texts["runs"]]


def tabulate_findings(results: Sequence[ClaimResult]) -> Table:
    """Return the table of all comparisons of the claims, with medians and test statistics."""
    rows = []
    for result in results:
        for finding in result.findings:
            comparison, numbers = finding.comparison, finding.numbers
            medians = format_medians(numbers)[: 2 if numbers.n_b else 1]
            rows.append(
                [
                    result.claim.id,
                    show_verdict(finding),
                    comparison.a,
                    comparison.reference,
                    name_measure(finding),
                    ", ".join(medians),
                    format_number(numbers.u),
                    *format_comparison(numbers, finding.p_holm).values(),
                ]
            )
    texts = ("Claim", "Verdict", "Condition", "Compared with", "Measure")
    numbers_headings = ("Medians", "U", *NUMBER_HEADINGS.values())
    return tabulate("All comparisons", texts, numbers_headings, rows)


def name_measures(outcome: str) -> dict[str, str]:
    """Return the name of each common measure, for example "average agent" for "mean"."""
    names = MEASURE_NAMES | {"share": name_share(outcome)}
    if outcome in FOOD_OUTCOMES:
        return names
    return names | {"most": "highest fitness of any agent"}


def name_measure(finding: Finding) -> str:
    """Return the name of the measure of a finding."""
    return finding.meaning or MEASURE_NAMES[finding.comparison.measure]


def describe_comparison(finding: Finding) -> str:
    """Return a phrase: conditions, medians and measure; or one condition, measure and bound."""
    comparison = finding.comparison
    measure = name_measure(finding)
    if not comparison.b:
        is_number = finding.rule.kind == "number" and comparison.rule != "zero"
        aggregate = f", {finding.rule.statistic} over runs" if is_number else ""
        return f"{comparison.a}, {measure}{aggregate}; the bound is {comparison.reference}"
    median_a, median_b = format_medians(finding.numbers)
    method = "; medians" if comparison.rule == "survives_longer" else ""
    method = "; paired runs" if comparison.paired else method
    return f"{comparison.a} {median_a}, {comparison.reference} {median_b} ({measure}{method})"


def describe_finding(finding: Finding) -> str:
    """Return a finding as a short phrase."""
    comparison = finding.comparison
    measure = name_measure(finding)
    effect = format_number(finding.numbers.effect)
    if comparison.rule == "zero":
        return f"{comparison.a}: {measure}: {effect}"
    if not comparison.b and comparison.measure != "share":
        return f"{comparison.a}: {measure}, {finding.rule.statistic} over runs: {effect}"
    if not comparison.b:
        return f"{comparison.a}: share of agents that eat in the last generations: {effect}"
    if comparison.rule == "survives_longer":
        signed = format_signed(finding.numbers.effect)
        return (
            f"{measure}, restricted mean: {signed} in {comparison.a} compared with "
            f"{comparison.reference}"
        )
    median_a, median_b = format_medians(finding.numbers)
    return (
        f"{measure}, median over runs: {median_a} in {comparison.a}, "
        f"{median_b} in {comparison.reference}"
    )


def describe_distance(result: ClaimResult) -> str:
    """Return the difference between the measured effect and the value of the paper, or ""."""
    if result.difference_from_paper is None or result.deciding is None:
        return ""
    if result.difference_from_paper == 0:
        return "measured: the same"
    side = "above" if result.difference_from_paper > 0 else "below"
    distance = f"measured: {format_number(abs(result.difference_from_paper))} {side}"
    if math.isnan(result.deciding.numbers.low):
        return distance
    position = "inside" if result.agrees_with_paper else "outside"
    return f"{distance}; the value of the paper is {position} the interval"
