"""Messages, progress bars and curves on the terminal and in notebooks."""

from __future__ import annotations

import json
import math
import os
import re
import sys
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import cache
from html import escape
from pathlib import Path
from typing import IO, Any, ClassVar, Final, NoReturn

from rich.console import Console, ConsoleOptions, RenderableType
from rich.progress import (
    BarColumn,
    Progress,
    ProgressColumn,
    Task,
    TaskProgressColumn,
    TextColumn,
    TimeRemainingColumn,
)
from rich.segment import Segment
from rich.text import Text

# Characters that control a terminal or change the order of a text: control characters except for
# line breaks and tabs, directional marks, line separators, and bytes of names that are not UTF-8.
CONTROLS: Final = re.compile(
    r"[\x00-\x08\x0b-\x1f\x7f-\x9f\u061c\u200e\u200f\u2028-\u202e\u2066-\u2069\ud800-\udfff]"
)
# Exit status of a process that SIGPIPE ended, because the reader of the output (`head`) has ended.
CLOSED_PIPE_STATUS = 141
# Seconds between two updates of the bar of a notebook.
BAR_INTERVAL = 0.2
# Seconds between two progress lines of a log.
LINE_INTERVAL = 10.0
# Maximum number of characters of a message, about 23 lines.
MAX_MESSAGE_CHARACTERS = 1800
# Minimum rate that is shown in millions per second.
MIN_RATE_IN_MILLIONS = 100_000
# Minimum rate that is shown without decimals.
MIN_RATE_WITHOUT_DECIMALS = 100
# Shortest duration, in seconds, for which a rate is computed. It avoids a division by 0.
MIN_RATE_DURATION = 1e-9
# Characters of a curve, from the lowest to the highest value.
BARS: Final = "▁▂▃▄▅▆▇█"
# Width of the curve of a study, in characters.
CURVE_WIDTH: Final = 20
# Seconds without a new value of the shown condition, after which the line shows another one.
MAX_SILENCE: Final = 2.0


def _end_at_closed_pipe() -> NoReturn:
    """End the process without a message, because no process reads the output."""
    # At its end, the interpreter writes the rest of the buffer. The null device accepts it.
    os.dup2(os.open(os.devnull, os.O_WRONLY), console.file.fileno())
    raise SystemExit(CLOSED_PIPE_STATUS)


def escape_controls(text: str) -> str:
    r"""Return a text in which control characters are visible, as in JSON and TOML: `\u001b`."""
    return CONTROLS.sub(lambda match: f"\\u{ord(match[0]):04x}", text)


class _Console(Console):
    """A console that prints any text as it is: without markup, and with visible controls.

    It ends the process with the usual exit status if the pipe is closed.

    `own_stdout`: the stream to stdout within `own_stdout`, else None.
    """

    own_stdout: ClassVar[IO[str] | None] = None

    def __init__(self, **options: Any) -> None:
        super().__init__(markup=False, emoji=False, **options)

    @property  # type: ignore[misc]
    def file(self) -> IO[str]:
        """The stream to which the console writes."""
        return super().file if self.stderr or self.own_stdout is None else self.own_stdout

    def render_str(self, text: str, **options: Any) -> Text:
        """Return the text of a message or a cell."""
        return super().render_str(escape_controls(text), **options)

    def render(
        self, renderable: RenderableType, options: ConsoleOptions | None = None
    ) -> Iterator[Segment]:
        """Yield the segments of any output. The control codes of a progress bar are segments."""
        for segment in super().render(renderable, options):
            text, style, control = segment
            yield segment if control else Segment(escape_controls(text), style)

    def on_broken_pipe(self) -> NoReturn:
        """End the process."""
        _end_at_closed_pipe()


def _is_terminal(file: IO[str] | None) -> bool:
    """Return whether an output is a terminal. A program without output has no stdout."""
    return file is not None and not file.closed and file.isatty()


console = _Console(highlight=False, soft_wrap=not _is_terminal(sys.stdout))
errors = _Console(stderr=True, highlight=False, soft_wrap=True)
help_console = _Console()


class _OutcomeProgress(Progress):
    """Progress bars, and below them the outcome of the finished work.

    A column for the outcome would be too narrow in most terminals.
    """

    outcome: object = ""

    def get_renderables(self) -> Iterable[RenderableType]:
        yield from super().get_renderables()
        if text := str(self.outcome):
            yield Text(text, style="green", no_wrap=True, overflow="ellipsis")


class _Rate(ProgressColumn):
    def render(self, task: Task) -> Text:
        # Before the first finished work, rich has no rate.
        rate = task.finished_speed or task.speed
        return Text(_format_rate(rate, task.fields["unit"]) if rate else "", style="cyan")


def _format_rate(rate: float, unit: str) -> str:
    if rate >= MIN_RATE_IN_MILLIONS:
        return f"{rate / 1e6:.1f} million {unit}/s"
    decimals = 0 if rate >= MIN_RATE_WITHOUT_DECIMALS else 1
    return f"{rate:,.{decimals}f} {unit}/s"


@contextmanager
def progress(
    description: str, total: int, unit: str = "agent-steps", outcome: object = ""
) -> Iterator[Callable[[int], None]]:
    """Show the progress, the rate and the time left of long work.

    Yields a function that is called with each amount of finished work. A terminal and a notebook
    show a bar. Other outputs get a line every few seconds.

    - `description`: the work, such as "simulating".
    - `unit`: plural noun of the unit of work.
    - `outcome`: object that a terminal shows as text at each update, for example `FitnessCurves`.
    """
    if console.is_jupyter:
        show = _display_notebook_bar()
        yield _ProgressReporter(description, total, unit, show, BAR_INTERVAL)
        return
    # A variable such as FORCE_COLOR makes `console.is_terminal` true for a file.
    if not _is_terminal(console.file):
        yield _ProgressReporter(
            description, total, unit, lambda sentence, share: info(sentence), LINE_INTERVAL
        )
        return
    columns = (
        TextColumn("{task.description}", markup=False),
        BarColumn(),
        TaskProgressColumn(),
        _Rate(),
        TimeRemainingColumn(elapsed_when_finished=True),
    )
    with _OutcomeProgress(*columns, console=console, speed_estimate_period=10) as bar:
        bar.outcome = outcome
        task = bar.add_task(description, total=total, unit=unit)
        yield lambda amount: bar.advance(task, amount)


@dataclass
class _ProgressReporter:
    """Report progress at most once per interval, and at the end."""

    description: str
    total: int
    unit: str
    # Called with a sentence and the finished fraction of the work, from 0 to 1.
    show: Callable[[str, float], None]
    # Minimum number of seconds between two calls of `show`.
    interval: float
    work_done: int = 0
    started_at: float = field(default_factory=time.monotonic)
    reported_at: float = field(default_factory=time.monotonic)

    def __call__(self, amount: int) -> None:
        """Add a finished amount of work."""
        self.work_done += amount
        now = time.monotonic()
        is_recently_reported = now - self.reported_at < self.interval
        if is_recently_reported and self.work_done < self.total:
            return
        self.reported_at = now
        rate = self.work_done / max(now - self.started_at, MIN_RATE_DURATION)
        seconds_left = (self.total - self.work_done) / rate
        share = self.work_done / self.total
        rate_text = _format_rate(rate, self.unit)
        self.show(f"{self.description}: {share:.0%}, {rate_text}, {seconds_left:.0f} s left", share)


def _display_notebook_bar() -> Callable[[str, float], None]:
    """Return a function that updates a bar in the output of a cell, without ipywidgets."""
    from IPython.display import HTML, display

    bar = display(HTML("<progress></progress>"), display_id=True)
    return lambda sentence, share: bar.update(
        HTML(f'<progress value="{share:.3f}"></progress> {escape(sentence)}')
    )


@contextmanager
def own_stdout() -> Iterator[None]:
    """Let only this module write to stdout. The output of parts, also of C code, goes to stderr."""
    previous = sys.stdout
    if previous is None or sys.stderr is None:
        yield
        return
    has_descriptor = previous is sys.__stdout__
    _Console.own_stdout = previous
    if has_descriptor:
        previous.flush()
        _Console.own_stdout = os.fdopen(
            os.dup(1), "w", encoding=previous.encoding, errors=previous.errors
        )
        os.dup2(2, 1)
        # A part can close this stream, which leaves stderr open.
        sys.stdout = os.fdopen(
            2,
            "w",
            buffering=1,
            encoding=sys.stderr.encoding,
            errors="backslashreplace",
            closefd=False,
        )
    else:
        sys.stdout = sys.stderr
    try:
        yield
    finally:
        sys.stdout = previous
        if has_descriptor:
            _Console.own_stdout.flush()
            os.dup2(_Console.own_stdout.fileno(), 1)
            _Console.own_stdout.close()
        _Console.own_stdout = None


def reserve_stdout(is_reserved: bool) -> None:
    """Print messages, progress and tables on stderr if stdout is reserved for data."""
    console.stderr = is_reserved


def print_json(value: Any) -> None:
    """Print data as JSON on stdout. NaN and infinite numbers become null."""
    text = json.dumps(_replace_nan(value), indent=2, ensure_ascii=False, allow_nan=False)
    write_output(f"{text}\n")


def write_output(text: str) -> None:
    """Write JSON or TOML on stdout, if there is one."""
    stdout = console.own_stdout or sys.stdout
    if stdout is None:
        return
    try:
        stdout.write(escape_controls(text))
        stdout.flush()
    except BrokenPipeError:
        _end_at_closed_pipe()


def _replace_nan(value: Any) -> Any:
    """Return plain data with None instead of NaN and infinite numbers."""
    if isinstance(value, dict):
        return {str(key): _replace_nan(entry) for key, entry in value.items()}
    if isinstance(value, list | tuple):
        return [_replace_nan(entry) for entry in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


def info(message: str, *, has_address: bool = False) -> None:
    """Print a message. The terminal, not rich, wraps a message with an address."""
    console.print(shorten_paths(message), soft_wrap=has_address or None)


@cache
def info_once(message: str) -> None:
    """Print a message, unless this process has already printed it."""
    info(message)


def info_if_any(message: str) -> None:
    """Print a message unless it is empty."""
    if message:
        info(message)


def warn_if_any(message: str) -> None:
    """Print a warning unless it is empty."""
    if message:
        warn(message)


def warn(message: str) -> None:
    """Print a warning or an error on stderr."""
    errors.print(f"baldwinlab: {clip_for_terminal(shorten_paths(message))}")


def shorten_paths(message: str) -> str:
    """Return a message with paths relative to the working directory, as users write them."""
    try:
        folder = str(Path.cwd())
    except OSError:
        # The working directory was removed.
        return message
    if folder == os.sep:
        return message
    return re.sub(rf"(?<![\w./~-]){re.escape(folder + os.sep)}", "", message)


def clip_for_terminal(message: str) -> str:
    """Return the message, cut to the size of a screen."""
    excess = len(message) - MAX_MESSAGE_CHARACTERS
    if excess <= 0:
        return message
    return f"{message[:MAX_MESSAGE_CHARACTERS]}... and {excess:,} more characters"


def draw_sparkline(values: Sequence[float], width: int) -> str:
    """Return a line of bars, such as "▁▃▆█". A bar is the mean of neighboring values.

    NaN is a gap. The lowest bar is 0, or the lowest mean if this is below 0.
    """
    n_bars = min(width, len(values))
    means = []
    for bar in range(n_bars):
        group = values[bar * len(values) // n_bars : (bar + 1) * len(values) // n_bars]
        finite = [value for value in group if math.isfinite(value)]
        means.append(sum(finite) / len(finite) if finite else math.nan)
    finite_means = [mean for mean in means if math.isfinite(mean)]
    low = min([0.0, *finite_means])
    high = max([0.0, *finite_means])
    return "".join(_choose_bar(mean, low, high) for mean in means)


def _choose_bar(value: float, low: float, high: float) -> str:
    if not math.isfinite(value):
        return " "
    share = (value - low) / (high - low) if high > low else 0.0
    return BARS[min(int(share * len(BARS)), len(BARS) - 1)]


class FitnessCurves:
    """Mean fitness by generation in a running study, as a line of text about one condition."""

    def __init__(self) -> None:
        # [condition][generation]: sum and number of the values of `add`.
        self._sums: dict[str, dict[int, tuple[float, int]]] = {}
        self._shown = ""
        self._shown_at = -math.inf

    def add(self, condition: str, generation: int, fitness: float, runs: int) -> None:
        """Add the mean fitness of a finished generation of several runs."""
        now = time.monotonic()
        # Tasks run in parallel. The line must not alternate between their conditions.
        if condition == self._shown or now - self._shown_at > MAX_SILENCE:
            self._shown = condition
            self._shown_at = now
        sums = self._sums.setdefault(condition, {})
        total, number = sums.get(generation, (0.0, 0))
        sums[generation] = (total + fitness * runs, number + runs)

    def __str__(self) -> str:
        """Return condition, curve and last value, such as "evo/A ▁▃▆█ 42.7"."""
        sums = dict(self._sums.get(self._shown, {}))
        if not sums:
            return ""
        means = [total / number for _, (total, number) in sorted(sums.items())]
        return f"{self._shown} {draw_sparkline(means, CURVE_WIDTH)} {means[-1]:.3g}"
