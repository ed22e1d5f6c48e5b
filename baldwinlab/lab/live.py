"""Live runs: started, watched, paused and stopped from the page, and kept as a study like any other.

Nothing is sent as it happens: every page that watches looks, a few times a second, at what has been added since it looked last.
So pages do not wait for each other, and one that was cut off gets all that it missed.
"""

from __future__ import annotations

import re
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any, Final

import anyio
import xarray as xr
from starlette.concurrency import run_in_threadpool
from starlette.requests import Request
from starlette.responses import JSONResponse
from starlette.routing import BaseRoute, Route, WebSocketRoute
from starlette.websockets import WebSocket, WebSocketDisconnect

from baldwinlab.core.files import parse_json
from baldwinlab.experiment import Experiment, validate
from baldwinlab.lab import Lab, MissingError
from baldwinlab.lab.limits import check_size, memory_of
from baldwinlab.lab.live_run import LiveRun, seconds_in
from baldwinlab.lab.memory import release_memory
from baldwinlab.lab.query import body, whole_number
from baldwinlab.lab.rate_limit import CLIENT_TIMEOUT
from baldwinlab.lab.studies import alleles_of
from baldwinlab.papers import presets
from baldwinlab.simulation.simulate import check_seed
from baldwinlab.studies.records import StudyError
from baldwinlab.studies.store import create

MOST_AT_ONCE: Final = 4  # live runs that live or are paused
MOST_MEMORY: Final = 1_000_000_000  # bytes of all live runs, ended ones too
GRACE: Final = 60.0  # seconds that a run waits for a page to come back
LOOK: Final = 0.05  # seconds between two looks at a run
BATCH: Final = 500  # generations in a message
LONGEST_NAME: Final = 100
NAME: Final = re.compile(
    r"(?!(.*/)?runs(/|$))[A-Za-z0-9][A-Za-z0-9+_-]*(/[A-Za-z0-9][A-Za-z0-9+_-]*)*"
)


class Live:
    """The live runs of one server. Whoever starts one watches it; one that nobody watches for `grace` seconds is freed."""

    def __init__(self, grace: float = GRACE) -> None:
        self._grace = grace
        self._runs: dict[str, LiveRun] = {}
        self._lock = threading.Lock()

    def start(self, experiment: Experiment, seed: int, runs: int, seconds: float = 0.0) -> LiveRun:
        """Raises ValueError, with a sentence for the user, for one that is too large to be lived while somebody waits."""
        check_seed(seed)
        check_size(experiment, runs)
        with self._lock:
            if sum(not run.ended for run in self._runs.values()) >= MOST_AT_ONCE:
                raise ValueError(
                    f"{MOST_AT_ONCE} live runs live already, which is the most; stop one of them first"
                )
            self._make_room(memory_of(experiment, runs))
            run = LiveRun(experiment, seed, runs, seconds)
            self._runs[run.id] = run
            self._say_farewell(run)
        return run

    def _make_room(self, wanted: int) -> None:
        """Forget runs that have ended and that nobody watches, the oldest first. Raises ValueError where that is not enough."""
        over = wanted - MOST_MEMORY + sum(run.memory for run in self._runs.values())
        forgotten = []
        for run in self._runs.values():
            if over > 0 and run.ended and not run.watchers:
                forgotten.append(run)
                over -= run.memory
        if over > 0:
            raise ValueError(
                f"live runs may hold {MOST_MEMORY:,} bytes of memory together, and with this one they would hold {over:,} more; "
                "close the page of one that has ended"
            )
        for run in forgotten:
            run.farewell.cancel()
            del self._runs[run.id]

    def all(self) -> list[LiveRun]:
        with self._lock:
            return list(self._runs.values())

    def run(self, id: str) -> LiveRun:
        """Raises MissingError where there is none."""
        run = self._runs.get(id)
        if run is None:
            raise MissingError(
                f"there is no live run {id!r}: one whose page is closed for a minute is stopped and forgotten"
            )
        return run

    @contextmanager
    def watched(self, id: str) -> Iterator[LiveRun]:
        """Somebody watches, for as long as this is open. Raises as `run`."""
        with self._lock:
            run = self.run(id)
            run.farewell.cancel()
            run.watchers += 1
        try:
            yield run
        finally:
            with self._lock:
                run.watchers -= 1
                self._say_farewell(run)

    def recording_source(
        self, id: str, run: int, generation: int
    ) -> tuple[Experiment, int, int, xr.DataArray]:
        """What `replay` takes for a generation that has lived: experiment, seed, run, energy so far.

        Raises MissingError, and ValueError for a run or a generation that there is not (yet).
        """
        found = self.run(id)
        return found.experiment, found.seed, run, found.energy(run, generation)

    def keep(self, id: str, root: Path, name: str) -> None:
        """Write a live run as a study in `root`: the one that `baldwinlab run` makes with as many generations as have lived.

        Raises MissingError, and StudyError for a name that is taken or leads elsewhere, and for a run that cannot be kept.
        """
        run = self.run(id)
        records = run.records()
        experiment = run.experiment.replace(evolution={"generations": run.lived})
        with self._lock:
            study = create(
                new_directory(root, name), [experiment], run.seed, factors=presets.factors()
            )
        for number, record in enumerate(records):
            study.write(experiment.name, number, record)
        run.kept = name

    def close(self) -> None:
        """Stop all."""
        for run in self.all():
            run.farewell.cancel()
            run.stop()

    def _say_farewell(self, run: LiveRun) -> None:
        """Free a run that nobody watches, if nobody comes back in time."""
        if run.watchers:
            return
        run.farewell = threading.Timer(self._grace, self._free, [run.id])
        run.farewell.daemon = True
        run.farewell.start()

    def _free(self, id: str) -> None:
        with self._lock:
            if id not in self._runs or self._runs[id].watchers:
                return
            run = self._runs.pop(id)
        run.stop()
        run.wait()
        del run
        release_memory()


def new_directory(root: Path, name: str) -> Path:
    """Raises StudyError for a name that is taken, or leads out of `root`."""
    if len(name) > LONGEST_NAME or not NAME.fullmatch(name):
        raise StudyError(
            f"{name!r} cannot be a study's name: letters, digits, + - _ and / between folders may be in it, "
            f"at most {LONGEST_NAME}, and no folder may be called runs"
        )
    directory = root / name
    if not directory.resolve().is_relative_to(root.resolve()):
        raise StudyError(f"{name} leads out of {root}; choose another name")
    if directory.exists():
        raise StudyError(f"{name} exists already in {root}; choose another name")
    return directory


def _about(run: LiveRun) -> dict[str, Any]:
    """What a page must know of a live run to show it."""
    return {
        "id": run.id,
        "experiment": run.experiment.to_dict(),
        "alleles": list(alleles_of(run.experiment)),
        "seed": run.seed,
        "runs": run.runs,
        "seconds": run.seconds,
        "lived": run.lived,
        "state": run.state,
        "kept": run.kept,
    }


async def _send(websocket: WebSocket, news: dict[str, Any]) -> None:
    """Raises TimeoutError for a page that takes nothing."""
    with anyio.fail_after(CLIENT_TIMEOUT):
        await websocket.send_json(news)


async def _tell(websocket: WebSocket, run: LiveRun) -> None:
    """Send what there is of a run, and then what is new, until it has ended."""
    told, state = 0, ""
    await _send(websocket, {"type": "run", **_about(run)})
    while True:
        now, ended = (
            run.state,
            run.ended,
        )  # before the generations, so that the end is told after the last
        lived = run.lived
        for first in range(told, lived, BATCH):
            measures = await run_in_threadpool(
                run.measures, first, min(first + BATCH, lived)
            )  # they take too long to wait here
            await _send(websocket, {"type": "generations", "first": first, **measures})
        told = lived
        if now != state:
            await _send(websocket, {"type": "state", "state": now, "message": run.message})
            state = now
        if ended:
            return
        await anyio.sleep(LOOK)


async def _listen(websocket: WebSocket, run: LiveRun) -> None:
    """Do what the page asks."""
    async for text in websocket.iter_text():
        try:
            run.obey(parse_json(text))
        except ValueError as error:
            await _send(websocket, {"type": "problem", "message": str(error)})


async def _talk(websocket: WebSocket, run: LiveRun) -> None:
    """Until the page is gone, or takes nothing."""
    async with anyio.create_task_group() as group:

        async def tell() -> None:
            try:
                await _tell(websocket, run)
            except (WebSocketDisconnect, TimeoutError):
                group.cancel_scope.cancel()

        group.start_soon(tell)
        with suppress(WebSocketDisconnect, TimeoutError):
            await _listen(websocket, run)
        group.cancel_scope.cancel()


async def _follow(websocket: WebSocket, live: Live) -> None:
    await websocket.accept()
    try:
        with live.watched(websocket.path_params["id"]) as run:
            await _talk(websocket, run)
    except MissingError as error:
        await websocket.send_json({"type": "state", "state": "gone", "message": str(error)})
        await websocket.close()


def routes(lab: Lab) -> list[BaseRoute]:
    async def start(request: Request) -> JSONResponse:
        order = await body(request)
        runs, seed, seconds = (
            whole_number(order, "runs", 1),
            whole_number(order, "seed", 0),
            seconds_in(order),
        )
        run = lab.live.start(validate(order.get("experiment", {})), seed, runs, seconds)
        return JSONResponse({"id": run.id}, 201)

    async def listed(request: Request) -> JSONResponse:
        return JSONResponse({"runs": [_about(run) for run in lab.live.all()]})

    async def keep(request: Request) -> JSONResponse:
        name = str((await body(request)).get("name", ""))
        await run_in_threadpool(lab.live.keep, request.path_params["id"], lab.root, name)
        return JSONResponse({"study": name}, 201)

    async def follow(websocket: WebSocket) -> None:
        await _follow(websocket, lab.live)

    return [
        Route("/api/live", start, methods=["POST"]),
        Route("/api/live", listed),
        Route("/api/live/{id}/keep", keep, methods=["POST"]),
        WebSocketRoute("/api/live/{id}", follow),
    ]
