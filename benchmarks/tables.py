"""Tables of results in Markdown."""

from __future__ import annotations

from collections.abc import Sequence
from statistics import median
from typing import Any

NAMES = {
    "baldwinlab_lives": "baldwinlab",
    "python_plain": "plain Python",
    "numpy_vectorised": "NumPy",
    "jax_scan": "JAX",
}
Results = dict[str, Any]


def comparison_tables(results: Results) -> str:
    """Return all tables of `compare`, with the machine and the versions."""
    head = (
        f"{describe_machine(results['machine'])}, and {results['load_at_the_end']} after. "
        f"Started {results['began']}; {results['rounds']} rounds."
    )
    scenarios = [scenario_table(name, records) for name, records in results["races"].items()]
    return "\n\n".join([head, *scenarios]) + "\n"


def describe_machine(machine: Results) -> str:
    """Return the result of `provenance` as text, with the load of the machine at the end."""
    versions = ", ".join(f"{name} {version}" for name, version in machine["versions"].items())
    return (
        f"{machine['cpu']}, {machine['cores']} cores, {machine['system']}; "
        f"Python {machine['python']}, {versions}; load of the machine {machine['load']} before"
    )


def scenario_table(name: str, records: Sequence[Results]) -> str:
    ours = records[0]
    rows = [
        (
            label(record),
            record["cores"],
            # A lifetime of a world has 100,000 agent-steps.
            f"{record['agent_steps_of_call']:,}",
            *speed(record),
            ratio(ours, record),
            number(record["eaten"], ".0f"),
            f"{record['first_seconds']:.2f}",
            f"{record['peak_mib']:.0f}",
        )
        for record in records
    ]
    titles = (
        "",
        "cores",
        "agent-steps per call",
        "million/s",
        "(minimum to maximum)",
        "speed of baldwinlab on one core, as a multiple",
        "items eaten",
        "first result, s",
        "peak memory, MiB",
    )
    return f"**{name}**, lives of 5000 steps\n\n" + table(titles, rows)


def label(record: Results) -> str:
    reason = f" (not measured: {record['not_measured']})" if record["not_measured"] else ""
    return NAMES[record["contender"]] + reason


def speed(record: Results) -> tuple[str, str]:
    if not record["rates"]:
        return "", ""
    low, middle, high = (
        value / 1e6
        for value in (min(record["rates"]), median(record["rates"]), max(record["rates"]))
    )
    return f"{middle:.3g}", f"{low:.3g} to {high:.3g}"


def ratio(ours: Results, theirs: Results) -> str:
    """Return the median of the ratios by round, and their range."""
    pairs = [our / their for our, their in zip(ours["rates"], theirs["rates"], strict=False)]
    if not pairs or ours is theirs:
        return ""
    return f"{_brief(median(pairs))} ({_brief(min(pairs))} to {_brief(max(pairs))})"


def _brief(value: float) -> str:
    """Return a number with three digits, for example 1,090 or 15.8."""
    return f"{value:,.0f}" if value >= 1000 else f"{value:.3g}"


def number(value: float | None, form: str) -> str:
    return "" if value is None else format(value, form)


def table(titles: Sequence[str], rows: Sequence[Sequence[Any]]) -> str:
    lines = [titles, ["---"] * len(titles), *rows]
    return "\n".join("| " + " | ".join(str(cell) for cell in line) + " |" for line in lines)
