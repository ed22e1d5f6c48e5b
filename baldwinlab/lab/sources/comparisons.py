"""Comparisons from the page, one at a time, on a thread.

A comparison of presets is stored as a study of `baldwinlab run`, and a comparison of values as a
study of `baldwinlab sweep`.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from baldwinlab.core.file_writing import write_atomically
from baldwinlab.lab import Lab, Query
from baldwinlab.lab.sources.comparison_plan import WORKERS, ComparisonPlan, make_comparison_plan
from baldwinlab.lab.sources.live import choose_study_directory
from baldwinlab.studies.creation import create_study
from baldwinlab.studies.executors import StoppedError
from baldwinlab.studies.run import find_missing_runs, run_study
from baldwinlab.studies.store import StudyStore
from baldwinlab.studies.study_length import hold_length
from baldwinlab.studies.sweeps.design import SWEEP_FILE_NAME


class LiveComparison:
    """A comparison of a plan. Creating the object starts it, on a new thread.

    `state`: "preparing", "running", "done", "stopped" or "failed". `message`: the error if the
    comparison failed, else "".
    """

    def __init__(self, plan: ComparisonPlan, study: StudyStore, name: str) -> None:
        self.plan = plan
        self.study = study
        self.name = name
        self.state = "preparing"
        self.message = ""
        self.agent_steps_done = 0
        self._is_stopping = False
        self._start_time = time.monotonic()
        threading.Thread(target=self._simulate, name=f"comparison {name}", daemon=True).start()

    @property
    def has_ended(self) -> bool:
        """Return whether the comparison is done, stopped or failed."""
        return self.state in ("done", "stopped", "failed")

    def stop(self) -> None:
        """Stop the comparison after the current generations. Finished runs stay stored."""
        self._is_stopping = True

    def summarize(self) -> dict[str, Any]:
        """Return the state for the page. `share` is the finished fraction of the agent-steps."""
        share_done = self.agent_steps_done / self.plan.agent_steps
        seconds_left = None
        if share_done and not self.has_ended:
            seconds_passed = time.monotonic() - self._start_time
            ratio_of_remaining_work = 1 / share_done - 1
            seconds_left = seconds_passed * ratio_of_remaining_work
        return {
            "name": self.name,
            "state": self.state,
            "message": self.message,
            "subject": self.plan.subject,
            "runs": self.plan.n_runs,
            "stored": sum(len(self.study.runs(condition)) for condition in self.study.experiments),
            "share": share_done,
            "seconds_left": seconds_left,
        }

    def _simulate(self) -> None:
        try:
            with hold_length(self.study):
                missing_runs = find_missing_runs(self.study, self.plan.runs, _ignore_message)
                run_study(
                    self.study,
                    missing_runs,
                    WORKERS,
                    progress=self._report_progress,
                    log=_ignore_message,
                )
            self.state = "done"
        except StoppedError:
            self.state = "stopped"
        except Exception as error:
            # An error on this thread reaches no caller, so the page shows the message.
            self.message = f"the comparison failed: {error or type(error).__name__}"
            self.state = "failed"

    @contextmanager
    def _report_progress(self, description: str, total: int) -> Iterator[Callable[[int], None]]:
        """Give `run_study` the function that it calls with the number of simulated agent-steps."""
        self.state = "running"
        # The preparation, such as compilation, is not a part of the measured speed.
        self._start_time = time.monotonic()
        yield self._add_steps

    def _add_steps(self, agent_steps: int) -> None:
        self.agent_steps_done += agent_steps
        # An error in this function ends the simulation.
        if self._is_stopping:
            raise StoppedError


def _ignore_message(message: str) -> None:
    """Ignore a log message, because the page shows the state of a comparison."""


class Comparisons:
    """The comparisons of one server, one at a time. The page shows the last one until the next."""

    def __init__(self) -> None:
        self.last: LiveComparison | None = None
        self._lock = threading.Lock()

    def start(self, plan: ComparisonPlan, root: Path, name: str) -> LiveComparison:
        """Start a comparison, which is stored as a study called `name` in `root`."""
        with self._lock:
            if self.last and not self.last.has_ended:
                raise ValueError(
                    f"the comparison {self.last.name} is active; stop it first, or wait until it is"
                    " done"
                )
            directory = choose_study_directory(root, name)
            study = create_study(
                directory, plan.experiments, plan.seed, plan.kind, factors=plan.factors
            )
            if plan.toml:
                write_atomically(directory / SWEEP_FILE_NAME, plan.toml.encode())
            self.last = LiveComparison(plan, study, name)
        return self.last

    def close(self) -> None:
        """Stop the active comparison."""
        if self.last:
            self.last.stop()

    def start_requested(self, lab: Lab, body: Mapping[str, Any]) -> dict[str, str]:
        """Start a comparison. The response is {"name": NAME}."""
        plan = make_comparison_plan(body)
        return {"name": self.start(plan, lab.root, str(body.get("name", ""))).name}

    def describe_last(self, lab: Lab, query: Query) -> dict[str, Any]:
        """Return {"comparison": SUMMARY}. The summary is None before the first comparison."""
        return {"comparison": self.last.summarize() if self.last else None}

    def stop_last(self, lab: Lab, query: Query) -> dict[str, Any]:
        """Stop the active comparison, and return its state."""
        self.close()
        return self.describe_last(lab, query)
