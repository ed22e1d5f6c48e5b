"""Files of an analysis: `baldwin.json` and `baldwin.csv`."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, Final

from baldwinlab.analysis import statistics
from baldwinlab.analysis.assays.analysis import Analysis, Answer, ConditionResult
from baldwinlab.analysis.assays.criteria import load_rules
from baldwinlab.analysis.statistics.csv import finite_or_none, to_csv
from baldwinlab.core.file_writing import write_atomically, write_json

CSV_COLUMNS: Final = (
    "condition",
    "quantity",
    "when",
    "against",
    "runs",
    "left_out",
    "median",
    "low",
    "high",
    "p",
    "p_holm",
    "verdict",
)


def write_analysis(analysis: Analysis, directory: Path) -> None:
    """Write `baldwin.json` and `baldwin.csv`, each atomically.

    `analysis`: `baldwin.csv` has one row per number and per comparison.
    """
    record = {
        "last": analysis.last,
        "conditions": {result.condition: _condition_record(result) for result in analysis.results},
        "numbers": [_to_json(vars(number)) for number in analysis.numbers],
    }
    write_json(directory / "baldwin.json", record)
    write_atomically(directory / "baldwin.csv", to_csv(CSV_COLUMNS, [*_iterate_csv_rows(analysis)]))


def _condition_record(result: ConditionResult) -> dict[str, Any]:
    return {
        "control": result.control or None,
        "phase_1": result.phase_verdict(1),
        "phase_2": result.phase_verdict(2),
        "criteria": [_answer_record(answer) for answer in result.answers],
    }


def _answer_record(answer: Answer) -> dict[str, Any]:
    criterion = answer.criterion
    numbers = answer.numbers._asdict() if answer.numbers else {}
    return {
        **vars(criterion),
        "rule": load_rules()[criterion.rule],
        "verdict": answer.verdict,
        **_to_json(numbers),
        "left_out": answer.left_out,
        "p_holm": finite_or_none(answer.p_holm),
        "smallest_p_holm": finite_or_none(answer.smallest_p_holm),
        "too_few_runs": answer.has_too_few_runs,
    }


def _to_json(values: Mapping[str, Any]) -> dict[str, Any]:
    """Replace undefined numbers by None."""
    return {
        name: finite_or_none(value) if isinstance(value, float) else value
        for name, value in values.items()
    }


def _iterate_csv_rows(analysis: Analysis) -> Iterator[dict[str, Any]]:
    for number in analysis.numbers:
        row = vars(number) | {"quantity": number.measure}
        yield {name: row.get(name, "") for name in CSV_COLUMNS}
    for result in analysis.results:
        for answer in result.answers:
            if answer.numbers:
                yield _make_answer_row(result.condition, answer, answer.numbers)


def _make_answer_row(condition: str, answer: Answer, pairs: statistics.Pairs) -> dict[str, Any]:
    quantity, when = answer.criterion.a
    return {
        "condition": condition,
        "quantity": quantity,
        "when": when,
        "against": ", ".join(answer.criterion.b),
        "runs": pairs.n,
        "left_out": answer.left_out,
        "median": pairs.effect,
        "low": pairs.low,
        "high": pairs.high,
        "p": pairs.p,
        "p_holm": answer.p_holm,
        "verdict": answer.verdict,
    }
