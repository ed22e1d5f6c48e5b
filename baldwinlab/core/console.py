"""What the command line shows: progress and messages."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from html import escape

from rich.console import Console
from rich.progress import (
    BarColumn,
    Progress,
    ProgressColumn,
    Task,
    TaskProgressColumn,
    TextColumn,
    TimeRemainingColumn,
)
from rich.text import Text

console = Console(highlight=False, soft_wrap=not sys.stdout.isatty())
errors = Console(stderr=True, highlight=False, soft_wrap=True)

BAR_EVERY = 0.2  # seconds between two drawings of a notebook's bar
SCREEN = 1800  # characters of a message: those of 23 lines
LINE_EVERY = 10.0  # seconds between progress lines where there is no terminal


class _Rate(ProgressColumn):
    def render(self, task: Task) -> Text:
        speed = task.finished_speed or task.speed
        return Text(_rate(speed, task.fields["unit"]) if speed else "", style="cyan")


def _rate(speed: float, unit: str) -> str:
    if speed >= 1e5:
        return f"{speed / 1e6:.1f} million {unit}/s"
    return f"{speed:,.{0 if speed >= 100 else 1}f} {unit}/s"


@contextmanager
def progress(
    description: str, total: int, unit: str = "agent-steps"
) -> Iterator[Callable[[int], None]]:
    """Show how far a long piece of work is, its rate and the time left. Yields the function to call with what has been done.

    On a terminal and in a notebook that is a bar; elsewhere, as in a log, a plain line every few seconds.
    """
    if console.is_jupyter:
        yield _Told(description, total, unit, _notebook_bar(), BAR_EVERY)
        return
    if not console.is_terminal:
        yield _Told(description, total, unit, lambda sentence, share: info(sentence), LINE_EVERY)
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


class _Told:
    """Tells now and then how far the work is: `show(sentence, share)`, at most every so many seconds, and at the end."""

    def __init__(
        self,
        description: str,
        total: int,
        unit: str,
        show: Callable[[str, float], None],
        every: float,
    ) -> None:
        self._description, self._total, self._unit, self._done = description, total, unit, 0
        self._show, self._every = show, every
        self._began = self._last = time.monotonic()

    def __call__(self, amount: int) -> None:
        self._done += amount
        now = time.monotonic()
        if now - self._last < self._every and self._done < self._total:
            return
        self._last = now
        rate = self._done / max(now - self._began, 1e-9)
        left = (self._total - self._done) / rate
        share = self._done / self._total
        self._show(
            f"{self._description}: {share:.0%}, {_rate(rate, self._unit)}, {left:.0f} s left", share
        )


def _notebook_bar() -> Callable[[str, float], None]:
    """A bar in the cell's output, drawn again in its place; rich's own needs ipywidgets, which not every notebook has."""
    from IPython.display import HTML, display  # a notebook has it

    shown = display(HTML("<progress></progress>"), display_id=True)
    return lambda sentence, share: shown.update(
        HTML(f'<progress value="{share:.3f}"></progress> {escape(sentence)}')
    )


def info(message: str, *, has_address: bool = False) -> None:
    """Print a message. The terminal wraps a message with an address, so that the address stays in one piece."""
    console.print(message, markup=False, soft_wrap=has_address or None)


def info_if_any(message: str) -> None:
    """Print a message unless it is empty."""
    if message:
        info(message)


def warn(message: str) -> None:
    errors.print(f"baldwinlab: {clip_for_terminal(message)}", markup=False)


def clip_for_terminal(message: str) -> str:
    """A message, or as much of it as can be read at once."""
    left = len(message) - SCREEN
    return message if left <= 0 else f"{message[:SCREEN]}... and {left:,} more characters"
