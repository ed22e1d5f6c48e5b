"""Live runs: started, watched, paused and stopped from the page, and saved as studies.

The server does not push each generation. Each connection checks a few times per second for new
generations. Slow pages therefore do not delay others, and a page that reconnects receives all
generations.
"""

from __future__ import annotations

import re
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from http import HTTPStatus
from pathlib import Path
from typing import Any, Final

import anyio
from starlette.concurrency import run_in_threadpool
from starlette.requests import Request
from starlette.responses import JSONResponse
from starlette.routing import BaseRoute, Route, WebSocketRoute
from starlette.websockets import WebSocket, WebSocketDisconnect

from baldwinlab.core.file_names import find_name_fault
from baldwinlab.core.files import parse_json
from baldwinlab.experiment import Experiment, validate
from baldwinlab.experiment.outcome import describe_experiment_measures
from baldwinlab.experiment.species_measures import list_species_curves
from baldwinlab.lab import Lab, MissingError
from baldwinlab.lab.concurrency import CLIENT_TIMEOUT, release_memory
from baldwinlab.lab.freezer import require_usable_founders
from baldwinlab.lab.limits import check_size, estimate_memory
from baldwinlab.lab.live_run import LiveRun, read_seconds
from baldwinlab.lab.model_displays import describe_species, read_alleles
from baldwinlab.lab.query import read_body, read_body_number
from baldwinlab.papers import presets
from baldwinlab.simulation.simulate import check_seed
from baldwinlab.studies.creation import create_study
from baldwinlab.studies.records import StudyError

# Running or paused live runs.
MAX_ACTIVE_RUNS: Final = 4
# Live runs, including ended ones.
MAX_STORED_RUNS: Final = 20
# Memory of all live runs, including ended ones.
MAX_TOTAL_BYTES: Final = 1_000_000_000
# Time between two checks for new generations.
POLL_SECONDS: Final = 0.05
MAX_GENERATIONS_PER_MESSAGE: Final = 500
MAX_NAME_LENGTH: Final = 100
STUDY_NAME_PATTERN: Final = re.compile(
    r"(?!(.*/)?runs(/|$))[A-Za-z0-9][A-Za-z0-9+_-]*(/[A-Za-z0-9][A-Za-z0-9+_-]*)*"
)


class Live:
    """The live runs of one server.

    Runs continue without a page. An ended run stays until a new run needs its place or memory.
    """

    def __init__(self) -> None:
        self._runs: dict[str, LiveRun] = {}
        self._lock = threading.Lock()

    def start(
        self,
        experiment: Experiment,
        seed: int,
        n_runs: int,
        seconds_per_generation: float = 0.0,
    ) -> LiveRun:
        """Start a live run. The parameters are those of `LiveRun`.

        Raise ValueError if it is too large, or if too many live runs are active.
        """
        check_seed(seed)
        check_size(experiment, n_runs)
        with self._lock:
            n_active = sum(not run.has_ended for run in self._runs.values())
            if n_active >= MAX_ACTIVE_RUNS:
                raise ValueError(
                    f"{MAX_ACTIVE_RUNS} live runs are active, and no more are allowed; stop one of"
                    " them first"
                )
            self._make_room(estimate_memory(experiment, n_runs))
            run = LiveRun(experiment, seed, n_runs, seconds_per_generation)
            self._runs[run.id] = run
        return run

    def _make_room(self, required_bytes: int) -> None:
        """Remove ended runs that no page watches, until a new run has a place and memory.

        Saved runs are removed first, and then the oldest ones.

        Raise ValueError if the removal of all such runs is not enough.
        """
        used_bytes = sum(run.memory_bytes for run in self._runs.values())
        excess_bytes = used_bytes + required_bytes - MAX_TOTAL_BYTES
        excess_runs = len(self._runs) + 1 - MAX_STORED_RUNS
        removable = [run for run in self._runs.values() if run.has_ended and not run.n_watchers]
        runs_to_remove = []
        # The runs are in the order of their start.
        for run in sorted(removable, key=lambda run: not run.saved_as):
            if excess_bytes > 0 or excess_runs > 0:
                runs_to_remove.append(run)
                excess_bytes -= run.memory_bytes
                excess_runs -= 1
        if excess_bytes > 0:
            raise ValueError(
                f"live runs may use {MAX_TOTAL_BYTES:,} bytes of memory in total, and this run"
                f" would exceed the limit by {excess_bytes:,} bytes; remove a run from the list of"
                " live runs"
            )
        if excess_runs > 0:
            raise ValueError(
                f"the lab stores at most {MAX_STORED_RUNS} live runs, and pages show all of them;"
                " remove a run from the list of live runs"
            )
        for run in runs_to_remove:
            del self._runs[run.id]

    def list_runs(self) -> list[LiveRun]:
        """Return all live runs."""
        with self._lock:
            return list(self._runs.values())

    def find_run(self, id: str) -> LiveRun:
        """Return a live run. Raise MissingError if it does not exist."""
        run = self._runs.get(id)
        if run is None:
            raise MissingError(
                f"there is no live run {id!r}: it was removed, or the lab was started again since"
            )
        return run

    @contextmanager
    def watch(self, id: str) -> Iterator[LiveRun]:
        """Count a watching page while the context is open. Raise MissingError as `find_run`."""
        with self._lock:
            run = self.find_run(id)
            run.n_watchers += 1
        try:
            yield run
        finally:
            with self._lock:
                run.n_watchers -= 1

    def save(self, id: str, root: Path, name: str) -> None:
        """Save a live run as a study in `root`.

        The study equals that of `baldwinlab run` with the finished number of generations.

        Raise MissingError for an unknown run. Raise StudyError for a name that exists or leads out
        of the folder, and for a run that cannot be saved.
        """
        run = self.find_run(id)
        records = run.make_records()
        experiment = run.experiment.replace(evolution={"generations": run.generations_done})
        with self._lock:
            directory = choose_study_directory(root, name)
            study = create_study(directory, [experiment], run.seed, factors=presets.factors())
        for run_number, record in enumerate(records):
            study.write(experiment.name, run_number, record)
        run.saved_as = name

    def close(self) -> None:
        """Stop all runs."""
        for run in self.list_runs():
            run.stop()

    def remove(self, id: str) -> None:
        """Stop and remove a run. Raise MissingError as `find_run`."""
        with self._lock:
            run = self.find_run(id)
            del self._runs[id]
        run.stop()
        run.wait()
        # The memory can be released only after the last reference is deleted.
        del run
        release_memory()


def choose_study_directory(root: Path, name: str) -> Path:
    """Return the directory of a new study.

    Raise StudyError for a name that is not valid, exists, or leads out of `root`.
    """
    if len(name) > MAX_NAME_LENGTH or not STUDY_NAME_PATTERN.fullmatch(name):
        raise StudyError(
            f"{name!r} is not a valid name of a study: use letters, digits, + - _ and / between"
            f" folders, at most {MAX_NAME_LENGTH} characters, and no folder called runs"
        )
    if fault := find_name_fault(name):
        raise StudyError(f"{name!r} is not a valid name of a study: {fault}; choose another name")
    directory = root / name
    if not directory.resolve().is_relative_to(root.resolve()):
        raise StudyError(f"{name} leads out of {root}; choose another name")
    if directory.exists():
        raise StudyError(f"{name} exists already in {root}; choose another name")
    return directory


def _summarize_run(run: LiveRun) -> dict[str, Any]:
    """Return the data with which a page shows a live run."""
    return {
        "id": run.id,
        "experiment": run.experiment.to_dict(),
        "alleles": list(read_alleles(run.experiment)),
        **describe_species(run.experiment),
        "species_curves": list_species_curves(run.experiment),
        "measures": describe_experiment_measures(run.experiment),
        "seed": run.seed,
        "runs": run.n_runs,
        "seconds": run.seconds_per_generation,
        "generations_done": run.generations_done,
        "state": run.state,
        "saved_as": run.saved_as,
        "bytes": run.memory_bytes,
    }


async def _send(websocket: WebSocket, message: dict[str, Any]) -> None:
    """Send a message. Raise TimeoutError if the page does not read it."""
    with anyio.fail_after(CLIENT_TIMEOUT):
        await websocket.send_json(message)


async def _send_progress(websocket: WebSocket, run: LiveRun) -> None:
    """Send all generations of a run, and new ones until the run has ended."""
    n_sent = 0
    sent_state = ""
    await _send(websocket, {"type": "run", **_summarize_run(run)})
    while True:
        # Read the state before the generations, so that the end is sent after the last generation.
        state = run.state
        has_ended = run.has_ended
        n_done = run.generations_done
        for first_generation in range(n_sent, n_done, MAX_GENERATIONS_PER_MESSAGE):
            stop = min(first_generation + MAX_GENERATIONS_PER_MESSAGE, n_done)
            measures = await run_in_threadpool(run.compute_measures, first_generation, stop)
            await _send(websocket, {"type": "generations", "first": first_generation, **measures})
        n_sent = n_done
        if state != sent_state:
            await _send(websocket, {"type": "state", "state": state, "message": run.message})
            sent_state = state
        if has_ended:
            return
        await anyio.sleep(POLL_SECONDS)


async def _receive_commands(websocket: WebSocket, run: LiveRun) -> None:
    """Handle the commands of a page."""
    async for text in websocket.iter_text():
        try:
            run.handle_command(parse_json(text))
        except ValueError as error:
            await _send(websocket, {"type": "problem", "message": str(error)})


async def _serve_page(websocket: WebSocket, run: LiveRun) -> None:
    """Send progress and receive commands until the page closes or stops reading."""
    async with anyio.create_task_group() as group:

        async def send_progress() -> None:
            try:
                await _send_progress(websocket, run)
            except (WebSocketDisconnect, TimeoutError):
                group.cancel_scope.cancel()

        group.start_soon(send_progress)
        with suppress(WebSocketDisconnect, TimeoutError):
            await _receive_commands(websocket, run)
        group.cancel_scope.cancel()


async def _follow(websocket: WebSocket, live: Live) -> None:
    await websocket.accept()
    try:
        with live.watch(websocket.path_params["id"]) as run:
            await _serve_page(websocket, run)
    except MissingError as error:
        await websocket.send_json({"type": "state", "state": "removed", "message": str(error)})
        await websocket.close()


def make_routes(lab: Lab) -> list[BaseRoute]:
    """Return the routes of this module."""

    async def start(request: Request) -> JSONResponse:
        body = await read_body(request, "experiment", "runs", "seed", "seconds")
        n_runs = read_body_number(body, "runs", 1)
        seed = read_body_number(body, "seed", 0)
        experiment = validate(body.get("experiment", {}))
        await run_in_threadpool(require_usable_founders, lab, experiment, n_runs)
        run = lab.live.start(experiment, seed, n_runs, read_seconds(body))
        return JSONResponse({"id": run.id}, HTTPStatus.CREATED)

    async def list_runs(request: Request) -> JSONResponse:
        limits = {"runs": MAX_STORED_RUNS, "active": MAX_ACTIVE_RUNS, "bytes": MAX_TOTAL_BYTES}
        runs = [_summarize_run(run) for run in lab.live.list_runs()]
        return JSONResponse({"runs": runs, "limits": limits})

    async def stop(request: Request) -> JSONResponse:
        lab.live.find_run(request.path_params["id"]).stop()
        return JSONResponse({})

    async def remove(request: Request) -> JSONResponse:
        await run_in_threadpool(lab.live.remove, request.path_params["id"])
        return JSONResponse({})

    async def save(request: Request) -> JSONResponse:
        body = await read_body(request, "name")
        name = str(body.get("name", ""))
        await run_in_threadpool(lab.live.save, request.path_params["id"], lab.root, name)
        return JSONResponse({"study": name}, HTTPStatus.CREATED)

    async def follow(websocket: WebSocket) -> None:
        await _follow(websocket, lab.live)

    return [
        Route("/api/live", start, methods=["POST"]),
        Route("/api/live", list_runs),
        Route("/api/live/{id}/save", save, methods=["POST"]),
        Route("/api/live/{id}/stop", stop, methods=["POST"]),
        Route("/api/live/{id}", remove, methods=["DELETE"]),
        WebSocketRoute("/api/live/{id}", follow),
    ]
