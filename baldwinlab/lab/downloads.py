"""What is on the screen, to take away: a page that plays anywhere or lives, a moving picture, a study's report."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any
from urllib.parse import parse_qsl, quote

from starlette.requests import Request
from starlette.responses import FileResponse, JSONResponse, Response
from starlette.routing import BaseRoute, Route

from baldwinlab._version import __version__
from baldwinlab.analysis.figures.movie import Scene, write_scenes
from baldwinlab.experiment import ExperimentError
from baldwinlab.experiment.toml import to_toml
from baldwinlab.lab import Lab, MissingError, life_query, single_page, studies
from baldwinlab.lab.concurrency import QueuedResponse
from baldwinlab.lab.export import live_page
from baldwinlab.lab.life_query import Life
from baldwinlab.lab.query import Query, number, text
from baldwinlab.lab.recording import bytes_per_step, record_life
from baldwinlab.papers import presets
from baldwinlab.simulation.replay import replay

PLAYER = "replay_page.js"  # the module that a shared page begins with
STYLES = ("style.css", "world.css", "world_figure.css", "replay_page.css")
MOVIES = {"mp4": "video/mp4", "gif": "image/gif"}
MOST_OF_A_MOVIE = (
    2_000_000  # agents times steps: its trace is held in memory, some 100 bytes of each
)
_REPORT = re.compile(r"(?:(?P<study>.+)/)?(?P<file>report\.html|figures/[\w.+-]+\.(?:svg|png|csv))")

# A report is a file that anybody may have made, so it runs no scripts, reaches nothing, and counts as another page.
REPORT_POLICY = "sandbox; default-src 'none'; img-src data:; style-src 'unsafe-inline'"


def routes(lab: Lab) -> list[BaseRoute]:
    async def share(request: Request) -> Response:
        return QueuedResponse(lab, lambda: _shared(lab, request.query_params))

    async def laboratory(request: Request) -> Response:
        return QueuedResponse(lab, lambda: _laboratory(lab, request.query_params))

    async def movie(request: Request) -> Response:
        return QueuedResponse(lab, lambda: _movie(lab, request.query_params))

    def made(request: Request) -> JSONResponse:
        return JSONResponse(
            {"share": lab.movie_progress.get(text(request.query_params, "ticket"), 0.0)}
        )

    def report(request: Request) -> FileResponse:
        path = report_of(lab, request.path_params["place"])
        kind = (
            "text/plain" if path.suffix == ".csv" else None
        )  # shown, as a sandbox lets nothing be downloaded
        return FileResponse(
            path, headers={"Content-Security-Policy": REPORT_POLICY}, media_type=kind
        )

    endpoints = {
        "share": share,
        "laboratory": laboratory,
        "movie": movie,
        "movie/made": made,
        "report/{place:path}": report,
    }
    return [Route(f"/api/{name}", endpoint) for name, endpoint in endpoints.items()]


def _shared(lab: Lab, query: Query) -> Response:
    sources = _sources(query)
    page = shared_page(lab, sources, number(query, "step", 0))
    return _attachment(
        page,
        "text/html",
        f"{_file_name([life_query.find_life(lab, given) for given in sources])}.html",
    )


def _laboratory(lab: Lab, query: Query) -> Response:
    """The conditions of what is shown, each once, with its seed, as a page in which they live again."""
    shown = [life_query.find_life(lab, given) for given in _sources(query)]
    experiments = list({life.experiment.name: life.experiment for life in shown}.values())
    return _attachment(
        live_page(experiments, shown[0].moment.seed),
        "text/html",
        f"{_file_name(shown[:1])}-live.html",
    )


def _movie(lab: Lab, query: Query) -> Response:
    """With a `ticket`, a name of its own, how far it is can be asked for meanwhile."""
    shown, kind, ticket = (
        [life_query.find_life(lab, given) for given in _sources(query)],
        text(query, "format"),
        query.get("ticket", ""),
    )
    try:
        movie = movie_of(shown, kind, lambda share: lab.movie_progress.update({ticket: share}))
    finally:
        lab.movie_progress.pop(ticket, None)
    return _attachment(movie, MOVIES[kind], f"{_file_name(shown)}.{kind}")


def _sources(query: Query) -> list[dict[str, str]]:
    """The lifetimes that are shown, a and perhaps b, each as a request for its recording says it. Raises ValueError without a."""
    return [
        dict(parse_qsl(text(query, name))) for name in ("a", "b") if name == "a" or name in query
    ]


def shared_page(lab: Lab, sources: list[dict[str, str]], step: int) -> bytes:
    """A page that plays one lifetime, or two side by side, with no server: all that it needs is in it. It opens at `step`.

    Of a lifetime that is too large for one answer, it has the part that the recording has. Raises ValueError and StudyError
    as a request for the recording does.
    """
    panels = [_panel(life_query.find_life(lab, given), given) for given in sources]
    title = " and ".join(panel["title"] for panel in panels)
    replay = {"version": __version__, "step": step, "panels": panels}
    return single_page.render_page("replay.html", PLAYER, STYLES, title=title, replay=replay)


def _panel(life: Life, given: dict[str, str]) -> dict[str, Any]:
    """A lifetime: its recording, deflated, and what it takes to live it again."""
    experiment, steps = life.experiment, life.experiment.lifetime.steps
    part = life_query.read_span(given, steps, bytes_per_step(experiment))
    seed, run, generation = life.moment
    own = not _is_preset(life)
    what = "experiment.toml" if own else experiment.name
    return {
        "title": f"{experiment.name}, run {run}, generation {generation}",
        "recording": single_page.compress(record_life(life, part, given)),
        "experiment": to_toml(experiment) if own else None,
        "commands": [
            f"baldwinlab run {what} --seed {seed} --runs {run + 1} --out study",
            f"baldwinlab replay study --condition {experiment.name} --run {run} --generation {generation} --out life.mp4",
        ],
    }


def _is_preset(life: Life) -> bool:
    try:
        return presets.load(life.experiment.name) == life.experiment
    except ExperimentError:
        return False


def movie_of(shown: Sequence[Life], kind: str, drawn: Callable[[float], object]) -> bytes:
    """Whole lifetimes as a moving picture, side by side; `drawn` is told which share of it there is.

    Raises ValueError for other kinds than `MOVIES`, and MovieError.
    """
    if kind not in MOVIES:
        raise ValueError(f"format = {kind!r} must be one of {', '.join(MOVIES)}")
    for experiment in (life.experiment for life in shown):
        if experiment.population.size * experiment.lifetime.steps > MOST_OF_A_MOVIE:
            raise ValueError(
                f"a movie of {experiment.population.size} agents and {experiment.lifetime.steps} steps is too much for the page; "
                "`baldwinlab replay` makes it"
            )
    with TemporaryDirectory() as folder:
        path = Path(folder) / f"life.{kind}"
        write_scenes([_scene(life) for life in shown], path, drawn)
        return path.read_bytes()


def _scene(life: Life) -> Scene:
    experiment, (seed, run, generation) = life.experiment, life.moment
    trace = replay(
        experiment, seed=seed, run=run, generation=generation, energy=life.load_parents().energy
    )
    return Scene(trace, experiment.world.width, experiment.world.height)


def report_of(lab: Lab, place: str) -> Path:
    """The report of a study, STUDY/report.html, or a file that it leads to, STUDY/figures/NAME.

    Raises MissingError where there is none, StudyError where it lies outside of what is served.
    """
    found = _REPORT.fullmatch(place)
    if found is None:
        raise MissingError(f"there is no {place} here")
    name = found["study"] or "."
    path = studies.find_study(lab, name).directory / found["file"]
    studies.require_inside(lab.root, path)
    if not path.is_file():
        raise MissingError(
            f"the study {name} has no {found['file']} yet; `baldwinlab report` makes it"
        )
    return path


def _file_name(shown: Sequence[Life]) -> str:
    names = [
        f"{life.experiment.name}-run{life.moment.run}-generation{life.moment.generation}"
        for life in shown
    ]
    return re.sub(r"[^\w+.-]", "-", "-beside-".join(names))


def _attachment(content: bytes, kind: str, name: str) -> Response:
    return Response(
        content,
        media_type=kind,
        headers={"Content-Disposition": f"attachment; filename*=UTF-8''{quote(name)}"},
    )
