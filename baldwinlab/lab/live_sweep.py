"""Sweeps started from the page: lived on a thread, one at a time, and stored as `baldwinlab sweep` stores them."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from starlette.concurrency import run_in_threadpool
from starlette.requests import Request
from starlette.responses import JSONResponse
from starlette.routing import BaseRoute, Route

from baldwinlab.core.files import write_atomically
from baldwinlab.experiment.factors import SWEEP
from baldwinlab.lab import Lab
from baldwinlab.lab.live import new_directory
from baldwinlab.lab.query import body
from baldwinlab.lab.sweep_plan import WORKERS, Plan, plan_of
from baldwinlab.studies.executors.tasks import StoppedError
from baldwinlab.studies.run import missing_runs, run_study
from baldwinlab.studies.store import StudyStore, create
from baldwinlab.studies.sweeps.design import FILE


class LiveSweep:
    """A sweep that lives on a thread of its own from the moment this is made."""

    def __init__(self, plan: Plan, study: StudyStore, name: str) -> None:
        self.plan, self.study, self.name = plan, study, name
        self.state, self.message = (
            "preparing",
            "",
        )  # preparing, running, done, stopped or failed; more of the last
        self.lived = 0  # agent-steps
        self._stopping = False
        self._began = time.monotonic()
        threading.Thread(target=self._live, name=f"sweep {name}", daemon=True).start()

    @property
    def ended(self) -> bool:
        return self.state in ("done", "stopped", "failed")

    def stop(self) -> None:
        """After the generations that live now; the runs that have ended are stored."""
        self._stopping = True

    def about(self) -> dict[str, Any]:
        """What a page shows of it."""
        share = self.lived / self.plan.agent_steps
        left = (
            (time.monotonic() - self._began) * (1 / share - 1) if share and not self.ended else None
        )
        return {
            "name": self.name,
            "state": self.state,
            "message": self.message,
            "fields": list(self.plan.sweep.fields),
            "points": len(self.plan.points),
            "runs": self.plan.runs,
            "stored": sum(len(self.study.runs(condition)) for condition in self.study.experiments),
            "share": share,
            "seconds_left": left,
        }

    def _live(self) -> None:
        try:
            missing = missing_runs(self.study, self.plan.sweep.runs, lambda sentence: None)
            run_study(self.study, missing, WORKERS, self._progress, lambda sentence: None)
            self.state = "done"
        except StoppedError:
            self.state = "stopped"
        except Exception as error:  # whatever it is, those who watch must hear of it
            self.message = f"the sweep failed: {error or type(error).__name__}"
            self.state = "failed"

    @contextmanager
    def _progress(self, description: str, total: int) -> Iterator[Callable[[int], None]]:
        self.state, self._began = "running", time.monotonic()
        yield self._add

    def _add(self, agent_steps: int) -> None:
        self.lived += agent_steps
        if self._stopping:
            raise StoppedError


class Sweeps:
    """The sweeps of one server, one at a time; the last one can be looked at until the next begins."""

    def __init__(self) -> None:
        self.last: LiveSweep | None = None
        self._lock = threading.Lock()

    def start(self, plan: Plan, root: Path, name: str) -> LiveSweep:
        """As a study of that name in `root`. Raises ValueError while another lives, and StudyError for a name that cannot be."""
        with self._lock:
            if self.last and not self.last.ended:
                raise ValueError(
                    f"the sweep {self.last.name} lives already; stop it first, or wait until it is done"
                )
            directory = new_directory(root, name)
            study = create(directory, plan.points, plan.sweep.seed, SWEEP)
            write_atomically(directory / FILE, plan.toml.encode())
            self.last = LiveSweep(plan, study, name)
        return self.last

    def close(self) -> None:
        if self.last:
            self.last.stop()


def routes(lab: Lab, sweeps: Sweeps) -> list[BaseRoute]:
    async def planned(request: Request) -> JSONResponse:
        try:
            plan = await run_in_threadpool(plan_of, await body(request))
        except ValueError as error:  # what is being written is not wrong until it is sent
            return JSONResponse({"problem": str(error)})
        seconds = await run_in_threadpool(plan.seconds)
        facts = {
            "points": len(plan.points),
            "runs": plan.runs,
            "workers": min(WORKERS, plan.runs),
            "disk": plan.disk,
        }
        from baldwinlab.api.publish.sweep_comparison import (
            describe_too_few_runs,  # here, because it takes a while to load
        )

        note = await run_in_threadpool(describe_too_few_runs, plan.sweep, len(plan.points))
        return JSONResponse(facts | {"seconds": seconds, "toml": plan.toml, "note": note})

    async def start(request: Request) -> JSONResponse:
        order = await body(request)
        plan = await run_in_threadpool(plan_of, order)
        sweep = await run_in_threadpool(sweeps.start, plan, lab.root, str(order.get("name", "")))
        return JSONResponse({"name": sweep.name}, 201)

    def last(request: Request) -> JSONResponse:
        return JSONResponse({"sweep": sweeps.last and sweeps.last.about()})

    def stop(request: Request) -> JSONResponse:
        sweeps.close()
        return last(request)

    return [
        Route("/api/sweep/plan", planned, methods=["POST"]),
        Route("/api/sweep", start, methods=["POST"]),
        Route("/api/sweep", last),
        Route("/api/sweep/stop", stop, methods=["POST"]),
    ]
