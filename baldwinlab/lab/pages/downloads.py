"""Files that the lab makes: pages that replay or simulate, movies, figures, and reports."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any, NamedTuple
from urllib.parse import parse_qsl, quote

from baldwinlab.analysis.movie import Scene, write_scenes
from baldwinlab.core.files import quote_path
from baldwinlab.core.lab_address import DEFAULT_LAB_PORT, LAB_HOST
from baldwinlab.experiment import ExperimentError
from baldwinlab.experiment.toml import to_toml
from baldwinlab.lab import Lab, MissingError, Query, read_number, read_text
from baldwinlab.lab.pages import single_page
from baldwinlab.lab.pages.export import render_live_page
from baldwinlab.lab.sources import life_query, studies
from baldwinlab.lab.sources.life_query import Life
from baldwinlab.lab.sources.recording import estimate_bytes_per_step, record_life
from baldwinlab.papers import presets
from baldwinlab.simulation.replay import replay

if TYPE_CHECKING:
    from starlette.datastructures import QueryParams

MOVIE_TYPES = {"mp4": "video/mp4", "gif": "image/gif"}
FIGURE_TYPES = {
    "svg": "image/svg+xml",
    "pdf": "application/pdf",
    "png": "image/png",
    "csv": "text/csv",
}
# A movie needs the complete trace, with about 100 bytes of memory per agent-step.
MAX_MOVIE_AGENT_STEPS = 2_000_000
_REPORT_PATH = re.compile(
    r"(?:(?P<study>.+)/)?(?P<file>report\.html|figures/[\w.+-]+\.(?:svg|pdf|png|csv))"
)


class Download(NamedTuple):
    """A file that the browser saves."""

    content: bytes
    media_type: str
    name: str


def make_replay(lab: Lab, query: Query) -> Download:
    """Return a page that replays the requested lifetimes without a server.

    The page has only the first steps of a lifetime that is too large for one response.
    """
    sources = _read_sources(query)
    lifetimes = [life_query.find_life(lab, source) for source in sources]
    panels = [_make_panel(*panel) for panel in zip(lifetimes, sources, strict=True)]
    page = single_page.render_replay_page(panels, read_number(query, "step", 0))
    return Download(page, "text/html", f"{_make_file_name(lifetimes)}.html")


def make_laboratory(lab: Lab, query: Query) -> Download:
    """Return a page that simulates the conditions of the lifetimes, with the first one's seed."""
    lifetimes = [life_query.find_life(lab, source) for source in _read_sources(query)]
    first_life = lifetimes[0]
    # If both lifetimes are of one condition, the page contains this condition once.
    experiment_by_name = {life.experiment.name: life.experiment for life in lifetimes}
    page = render_live_page(list(experiment_by_name.values()), first_life.key.seed)
    return Download(page, "text/html", f"{_make_file_name([first_life])}-live.html")


def make_movie(lab: Lab, query: Query) -> Download:
    """Return a movie. `ticket`: an id of the page's choice, for `read_movie_progress`."""
    lifetimes = [life_query.find_life(lab, source) for source in _read_sources(query)]
    movie_format = read_text(query, "format")
    ticket = query.get("ticket", "")
    try:
        movie = render_movie(
            lifetimes,
            movie_format,
            report_progress=lambda share_done: lab.movie_progress.update({ticket: share_done}),
        )
    finally:
        lab.movie_progress.pop(ticket, None)
    name = f"{_make_file_name(lifetimes)}.{movie_format}"
    return Download(movie, MOVIE_TYPES[movie_format], name)


def read_movie_progress(lab: Lab, query: Query) -> dict[str, float]:
    """Return {"share": 0.4}: the finished fraction of the movie with a ticket."""
    return {"share": lab.movie_progress.get(read_text(query, "ticket"), 0.0)}


def make_figure(lab: Lab, query: QueryParams) -> Download:
    """Return a figure of the report. The query can have several parameters `condition`."""
    # This import takes a second, which would delay the first page.
    from baldwinlab.api.publish.result_figures import make_figure_file

    study = studies.find_study(lab, read_text(query, "study"))
    conditions = query.getlist("condition")
    for condition in conditions:
        studies.find_condition(study, condition)
    name, file_format = read_text(query, "figure"), read_text(query, "format")
    file = make_figure_file(study, name, file_format, conditions, query.get("measure", ""))
    return Download(file.content, FIGURE_TYPES[file_format], file.name)


def _read_sources(query: Query) -> list[dict[str, str]]:
    """Return the queries of the lifetimes `a` and, if given, `b`: nested query strings."""
    names = ["a", "b"] if "b" in query else ["a"]
    return [dict(parse_qsl(read_text(query, name))) for name in names]


def _make_panel(life: Life, source: dict[str, str]) -> dict[str, Any]:
    """Return the compressed recording of a lifetime, and the commands that reproduce it."""
    experiment = life.experiment
    n_steps = experiment.lifetime.steps
    span = life_query.read_span(source, n_steps, estimate_bytes_per_step(experiment))
    seed, run, generation = life.key
    is_preset = _is_preset(life)
    preset_or_file = experiment.name if is_preset else "experiment.toml"
    return {
        "title": f"{experiment.name}, run {run}, generation {generation}",
        "recording": single_page.compress(record_life(life, span, source)),
        "experiment": None if is_preset else to_toml(experiment),
        "commands": [
            # The study needs all runs up to this one.
            f"baldwinlab run {preset_or_file} --seed {seed} --runs {run + 1} --out study",
            f"baldwinlab replay study --condition {experiment.name} --run {run}"
            f" --generation {generation} --out life.mp4",
        ],
    }


def _is_preset(life: Life) -> bool:
    try:
        return presets.load(life.experiment.name) == life.experiment
    except ExperimentError:
        return False


def render_movie(
    lifetimes: Sequence[Life], movie_format: str, report_progress: Callable[[float], object]
) -> bytes:
    """Return a movie of complete lifetimes, next to each other.

    `movie_format`: a key of `MOVIE_TYPES`. `report_progress`: called with the finished fraction.
    """
    if movie_format not in MOVIE_TYPES:
        raise ValueError(f"format = {movie_format!r} must be one of {', '.join(MOVIE_TYPES)}")
    for life in lifetimes:
        n_agents = life.experiment.agents_per_world
        n_steps = life.experiment.lifetime.steps
        if n_agents * n_steps > MAX_MOVIE_AGENT_STEPS:
            raise ValueError(
                f"a movie of {n_agents} agents and {n_steps} steps is too large for the page; use"
                " `baldwinlab replay`"
            )
    with TemporaryDirectory() as folder:
        path = Path(folder) / f"life.{movie_format}"
        write_scenes([_make_scene(life) for life in lifetimes], path, report_progress)
        return path.read_bytes()


def _make_scene(life: Life) -> Scene:
    experiment = life.experiment
    seed, run, generation = life.key
    fitness = life.load_start_data().fitness
    trace = replay(experiment, seed=seed, run=run, generation=generation, energy=fitness)
    return Scene(trace, experiment.world.width, experiment.world.height)


def link_lifetimes(page: str, study_name: str) -> str:
    """Return the HTML of a report. Links to lifetimes open this lab, also behind a proxy.

    In the file of a report, the links have the default address of a lab, and the study ".". They
    are correct only for a lab at this address that serves the folder of the study.
    """
    # The address is api/report/STUDY/report.html, or api/report/report.html for the study ".".
    # Each folder of this address needs a "../" to reach the page of the lab.
    n_folders = 2 + (0 if study_name == "." else 1 + study_name.count("/"))
    lab_address = f'href="{"../" * n_folders}#/'
    page = page.replace(f'href="http://{LAB_HOST}:{DEFAULT_LAB_PORT}/#/', lab_address)
    return page.replace("study=.&amp;", f"study={quote(study_name)}&amp;")


def find_report(lab: Lab, name: str) -> Path:
    """Return the path of a report, STUDY/report.html, or of a figure, STUDY/figures/NAME."""
    match = _REPORT_PATH.fullmatch(name)
    if match is None:
        raise MissingError(f"there is no {name} here")
    # A name without a folder belongs to the study ".", which is the served folder.
    study_name = match["study"] or "."
    directory = studies.find_study(lab, study_name).directory
    path = directory / match["file"]
    studies.require_inside(lab.root, path)
    if not path.is_file():
        command = f"baldwinlab report {quote_path(directory)}"
        raise MissingError(f"the study {study_name} has no {match['file']} yet; run `{command}`")
    return path


def _make_file_name(lifetimes: Sequence[Life]) -> str:
    names = [
        f"{life.experiment.name}-run{life.key.run}-generation{life.key.generation}"
        for life in lifetimes
    ]
    return re.sub(r"[^\w+.-]", "-", "-and-".join(names))
