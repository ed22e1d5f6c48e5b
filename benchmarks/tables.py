"""Tables and a figure of the results of `compare`."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from statistics import median
from typing import Any

import matplotlib

matplotlib.use("Agg")
from matplotlib import pyplot as plt

NAMES = {
    "baldwinlab_lives": "baldwinlab",
    "baldwinlab_runs": "baldwinlab",
    "python_plain": "plain Python",
    "numpy_vectorised": "NumPy",
    "jax_scan": "JAX",
    "evojax_waterworld": "EvoJAX WaterWorld *",
    "mesa_boids": "Mesa boids *",
}
# Races that do not compare contenders.
SEPARATE = ("runs", "starts")
Results = dict[str, Any]


def tables(results: Results) -> str:
    """Return all tables, with the machine and the versions."""
    machine = results["machine"]
    races = results["races"]
    versions = ", ".join(f"{name} {version}" for name, version in machine["versions"].items())
    head = (
        f"{machine['cpu']}, {machine['cores']} cores, {machine['system']}; "
        f"Python {machine['python']}, {versions}. "
        f"Started {results['began']}; {results['rounds']} rounds; "
        f"load of the machine {machine['load']} before and {results['load_at_the_end']} after."
    )
    scenarios = [name for name in races if name not in SEPARATE]
    of_scenarios = [scenario_table(name, races[name]) for name in scenarios]
    return (
        "\n\n".join(
            [head, *of_scenarios, cost_table(results, scenarios), runs_table(races["runs"])]
        )
        + "\n"
    )


def scenario_table(name: str, records: Sequence[Results]) -> str:
    ours = records[0]
    rows = [
        (
            label(record),
            record["cores"],
            format_steps(record),
            *speed(record),
            ratio(ours, record),
            number(record["eaten"], ".0f"),
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
    )
    return f"**{name}**, lives of 5000 steps\n\n" + table(titles, rows)


def cost_table(results: Results, scenarios: Sequence[str]) -> str:
    """Return the table of start-up time, memory and size."""
    *starts, cold = results["races"]["starts"]
    rows = []
    for contender in dict.fromkeys(record["contender"] for record in starts):
        seconds = sorted(
            record["first_seconds"]
            for record in starts
            if record["contender"] == contender and not record["not_measured"]
        )
        records = [record for name in scenarios for record in results["races"][name]]
        peaks = [
            record["peak_mib"]
            for record in records
            if record["contender"] == contender and record["rates"] and record["cores"] == 1
        ]
        peak = max(peaks, default=None)
        size = results["installed_mib"][contender]
        rows.append(
            (
                NAMES[contender],
                spread(seconds) if seconds else "",
                number(peak, ".0f"),
                number(size, ".0f"),
            )
        )
    rows.append(("baldwinlab, empty cache", spread([cold["first_seconds"]]), "", ""))
    titles = ("", "time to the first result, s", "peak memory, MiB", "installed, MiB")
    return "**Start**: lives of 100 steps, in new processes\n\n" + table(titles, rows)


def runs_table(records: Sequence[Results]) -> str:
    rows = [(record["scenario"], *speed(record)) for record in records]
    titles = ("condition", "million/s", "(minimum to maximum)")
    return (
        "**baldwinlab, complete runs** "
        "(100 generations with evolution, a batch of 4 runs on one core)\n\n" + table(titles, rows)
    )


def label(record: Results) -> str:
    reason = f" (not measured: {record['not_measured']})" if record["not_measured"] else ""
    return NAMES[record["contender"]] + reason


def format_steps(record: Results) -> str:
    """Return the agent-steps of a call; a lifetime of a world has 100,000."""
    return f"{record['agent_steps_of_call']:,}"


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
    """Return a number with three digits, such as 1,090 or 15.8."""
    return f"{value:,.0f}" if value >= 1000 else f"{value:.3g}"


def spread(values: Sequence[float]) -> str:
    """Return the median of sorted values, and their range."""
    return f"{median(values):.2f}" + (
        f" ({values[0]:.2f} to {values[-1]:.2f})" if len(values) > 1 else ""
    )


def number(value: float | None, form: str) -> str:
    return "" if value is None else format(value, form)


def table(titles: Sequence[str], rows: Sequence[Sequence[Any]]) -> str:
    lines = [titles, ["---"] * len(titles), *rows]
    return "\n".join("| " + " | ".join(str(cell) for cell in line) + " |" for line in lines)


def draw_comparison(results: Results, out: Path) -> None:
    """Draw the rates on one core as bars on a logarithmic scale, with a panel per scenario."""
    scenarios = [name for name in results["races"] if name not in SEPARATE]
    figure, axes = plt.subplots(
        1, len(scenarios), figsize=(11, 2.8), sharex=True, layout="constrained"
    )
    for axis, name in zip(axes, scenarios, strict=True):
        on_one_core = (record for record in results["races"][name] if record["cores"] == 1)
        records = [record for record in on_one_core if record["rates"]][::-1]
        for position, record in enumerate(records):
            rate = median(record["rates"])
            color = "#0072B2" if record["contender"] == "baldwinlab_lives" else "#999999"
            axis.barh(position, rate, color=color, left=1e3)
            axis.text(
                rate * 1.3 + 1e3, position, f"{_brief(rate / 1e6)} M", va="center", fontsize=8
            )
        axis.set_yticks(
            range(len(records)), [NAMES[record["contender"]] for record in records], fontsize=8
        )
        axis.set(
            xscale="log", xlim=(1e4, 2e9), title=name, xlabel="agent-steps per second, one core"
        )
        axis.spines[["top", "right"]].set_visible(False)
    save(figure, out / "comparison")


def save(figure: Any, path: Path) -> None:
    for suffix in ("png", "svg"):
        figure.savefig(path.with_suffix(f".{suffix}"), dpi=110)
    plt.close(figure)
