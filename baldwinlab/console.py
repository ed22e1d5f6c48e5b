"""What the command line shows: progress, tables and messages."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

from rich.box import SIMPLE_HEAD
from rich.console import Console
from rich.progress import BarColumn, Progress, ProgressColumn, Task, TaskProgressColumn, TextColumn, TimeRemainingColumn
from rich.table import Table
from rich.text import Text

from baldwinlab.statistics.rules import MARKS

if TYPE_CHECKING:
    from baldwinlab.analysis.claims import ClaimResult
    from baldwinlab.multiverse.analysis import Multiverse

console = Console(highlight=False, soft_wrap=not sys.stdout.isatty())
errors = Console(stderr=True, highlight=False, soft_wrap=True)

VERDICT_STYLE = {"holds": "green", "does not hold": "red", "undecided": "yellow"}
LINE_EVERY = 10.0  # seconds between progress lines where there is no terminal


class _Rate(ProgressColumn):
    def render(self, task: Task) -> Text:
        speed = task.finished_speed or task.speed
        return Text(_rate(speed, task.fields["unit"]) if speed else "", style="cyan")


def _rate(speed: float, unit: str) -> str:
    return f"{speed / 1e6:.1f} million {unit}/s" if speed >= 1e5 else f"{speed:.1f} {unit}/s"


@contextmanager
def progress(description: str, total: int, unit: str = "agent-steps") -> Iterator[Callable[[int], None]]:
    """Show how far a long piece of work is, its rate and the time left. Yields the function to call with what has been done.

    On a terminal that is a bar; elsewhere, as in a log, a plain line every few seconds.
    """
    if not console.is_terminal:
        yield _Lines(description, total, unit)
        return
    columns = (
        TextColumn("{task.description}"),
        BarColumn(),
        TaskProgressColumn(),
        _Rate(),
        TimeRemainingColumn(elapsed_when_finished=True),
    )
    with Progress(*columns, console=console, speed_estimate_period=10) as bar:
        task = bar.add_task(description, total=total, unit=unit)
        yield lambda amount: bar.advance(task, amount)


class _Lines:
    def __init__(self, description: str, total: int, unit: str) -> None:
        self._description, self._total, self._unit, self._done = description, total, unit, 0
        self._began = self._last = time.monotonic()

    def __call__(self, amount: int) -> None:
        self._done += amount
        now = time.monotonic()
        if now - self._last < LINE_EVERY and self._done < self._total:
            return
        self._last = now
        rate = self._done / max(now - self._began, 1e-9)
        left = (self._total - self._done) / rate
        share = self._done / self._total
        say(f"{self._description}: {share:.0%}, {_rate(rate, self._unit)}, {left:.0f} s left")


def say(message: str) -> None:
    console.print(message, markup=False)


def complain(message: str) -> None:
    errors.print(f"baldwinlab: {message}", markup=False)


def claims_table(results: Sequence[ClaimResult]) -> Table:
    """Every claim with its verdict, what was measured (of several comparisons, the one that decided) and the paper's figure."""
    table = Table(title="What the paper claims, and what we measured", title_style="bold", box=SIMPLE_HEAD, padding=(0, 1, 1, 0))
    table.add_column("")
    table.add_column("verdict", width=13)
    table.add_column("claim, measured effect [95 % interval], corrected p, effect size; the paper's figure")
    for result in results:
        record = result.record()
        verdict = Text(record["verdict"], style=VERDICT_STYLE.get(record["verdict"], ""))
        table.add_row(record["id"], verdict, Text.assemble(record["claim"], ("\n" + _measured(record), "dim")))
    return table


def _measured(record: dict[str, Any]) -> str:
    """For example: `282.4 [212, 293.2], p 1.9e-08, A12 0.95; paper: about 40 items more`."""
    parts = [f"{record['effect']:.4g}" if record["effect"] is not None else "not measured"]
    if record["interval"]:
        parts[0] += " [{:.4g}, {:.4g}]".format(*record["interval"])
    if record["p_holm"] is not None:
        parts.append(f"p {record['p_holm']:.2g}")
    if record["a12"] is not None:
        parts.append(f"A12 {record['a12']:.2f}")
    return f"{', '.join(parts)}; paper: {record['paper']}"


def readings_table(multiverse: Multiverse) -> Table:
    """Every claim under each reading that makes at most one choice otherwise, and how near the reading comes to the paper."""
    table = Table(title="Every reading of the paper", title_style="bold", box=SIMPLE_HEAD, padding=(0, 1, 0, 0))
    for heading in ("reading", *(claim.id for claim in multiverse.claims), "hold"):
        table.add_column(heading, no_wrap=True)
    table.add_column("distance", justify="right")
    for reading in multiverse.singles.readings:
        verdicts = [reading.outcomes[claim.id].verdict for claim in multiverse.claims]
        marks = [Text(MARKS[verdict], style=VERDICT_STYLE.get(verdict, "")) for verdict in verdicts]
        distance = "" if reading.distance is None else f"{reading.distance:.2f}"
        table.add_row(" ".join((reading.name, *reading.choices)), *marks, str(reading.held), distance)
    return table
