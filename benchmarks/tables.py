"""What `compare` measured, as markdown and as a picture."""

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
SEPARATE = ("runs", "starts")  # races that are not between contenders
Found = dict[str, Any]


def tables(found: Found) -> str:
    """All tables, with the machine and the versions."""
    machine, races = found["machine"], found["races"]
    versions = ", ".join(f"{name} {version}" for name, version in machine["versions"].items())
    head = (
        f"{machine['cpu']}, {machine['cores']} cores, {machine['system']}; Python {machine['python']}, {versions}. "
        f"Started {found['began']}; {found['rounds']} rounds; load of the machine {machine['load']} before and "
        f"{found['load_at_the_end']} after."
    )
    scenarios = [name for name in races if name not in SEPARATE]
    of_scenarios = [scenario_table(name, races[name]) for name in scenarios]
    return (
        "\n\n".join([head, *of_scenarios, cost_table(found, scenarios), runs_table(races["runs"])])
        + "\n"
    )


def scenario_table(name: str, records: Sequence[Found]) -> str:
    ours = records[0]
    rows = [
        (
            label(record),
            record["cores"],
            lives(record),
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


def cost_table(found: Found, scenarios: Sequence[str]) -> str:
    """What it takes to begin, and to hold."""
    *starts, cold = found["races"]["starts"]
    rows = []
    for contender in dict.fromkeys(record["contender"] for record in starts):
        seconds = sorted(
            one["first_seconds"]
            for one in starts
            if one["contender"] == contender and not one["not_measured"]
        )
        records = [
            one
            for name in scenarios
            for one in found["races"][name]
            if one["contender"] == contender and one["rates"]
        ]
        peak = max((one["peak_mib"] for one in records if one["cores"] == 1), default=None)
        size = found["installed_mib"][contender]
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


def runs_table(records: Sequence[Found]) -> str:
    rows = [(record["scenario"], *speed(record)) for record in records]
    titles = ("condition", "million/s", "(minimum to maximum)")
    return (
        "**baldwinlab, complete runs** (100 generations with evolution, a batch of 4 runs on one core)\n\n"
        + table(titles, rows)
    )


def label(record: Found) -> str:
    return NAMES[record["contender"]] + (
        f" (not measured: {record['not_measured']})" if record["not_measured"] else ""
    )


def lives(record: Found) -> str:
    """Agent-steps in a call; 100,000 are a world's whole life in our model."""
    return f"{record['agent_steps_of_call']:,}"


def speed(record: Found) -> tuple[str, str]:
    if not record["rates"]:
        return "", ""
    low, middle, high = (
        value / 1e6
        for value in (min(record["rates"]), median(record["rates"]), max(record["rates"]))
    )
    return f"{middle:.3g}", f"{low:.3g} to {high:.3g}"


def ratio(ours: Found, theirs: Found) -> str:
    """Median of the ratios round by round, and their range."""
    pairs = [our / their for our, their in zip(ours["rates"], theirs["rates"], strict=False)]
    if not pairs or ours is theirs:
        return ""
    return f"{_brief(median(pairs))} ({_brief(min(pairs))} to {_brief(max(pairs))})"


def _brief(value: float) -> str:
    """In three places, as 1,090 or 15.8."""
    return f"{value:,.0f}" if value >= 1000 else f"{value:.3g}"


def spread(values: Sequence[float]) -> str:
    """Median of sorted values, and their range."""
    return f"{median(values):.2f}" + (
        f" ({values[0]:.2f} to {values[-1]:.2f})" if len(values) > 1 else ""
    )


def number(value: float | None, form: str) -> str:
    return "" if value is None else format(value, form)


def table(titles: Sequence[str], rows: Sequence[Sequence[Any]]) -> str:
    lines = [titles, ["---"] * len(titles), *rows]
    return "\n".join("| " + " | ".join(str(cell) for cell in line) + " |" for line in lines)


def draw_comparison(found: Found, out: Path) -> None:
    """Bars of every contender's rate on one core, on a logarithmic scale, a panel a scenario."""
    scenarios = [name for name in found["races"] if name not in SEPARATE]
    figure, axes = plt.subplots(
        1, len(scenarios), figsize=(11, 2.8), sharex=True, layout="constrained"
    )
    for axis, name in zip(axes, scenarios, strict=True):
        records = [one for one in found["races"][name] if one["cores"] == 1 and one["rates"]][::-1]
        for place, record in enumerate(records):
            rate, ours = median(record["rates"]), record["contender"] == "baldwinlab_lives"
            axis.barh(place, rate, color="#0072B2" if ours else "#999999", left=1e3)
            axis.text(rate * 1.3 + 1e3, place, f"{_brief(rate / 1e6)} M", va="center", fontsize=8)
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
