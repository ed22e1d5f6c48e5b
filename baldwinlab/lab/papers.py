"""The papers as cards: what each is about, what came of its studies here, and where it can be run and watched."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping
from contextlib import suppress
from typing import Any

from starlette.requests import Request
from starlette.responses import FileResponse, JSONResponse
from starlette.routing import BaseRoute, Route

from baldwinlab import papers
from baldwinlab.core.suggestions import suggest
from baldwinlab.lab import Lab, MissingError, studies
from baldwinlab.lab.query import text
from baldwinlab.papers import Paper, PaperError
from baldwinlab.papers.paper import CARD
from baldwinlab.studies.claims_file import CLAIMS, claims_in
from baldwinlab.studies.records import StudyError
from baldwinlab.studies.store import StudyStore

Studies = dict[str, StudyStore]  # by the name that the page has for each


def routes(lab: Lab) -> list[BaseRoute]:
    def cards(request: Request) -> JSONResponse:
        found = _studies(lab)
        known, asked = _papers(lab, found), request.query_params.get("paper")
        problem = _unknown(asked, known) if asked and asked not in known else None
        return JSONResponse(
            {"papers": [_card(lab, paper, found) for paper in known.values()], "problem": problem}
        )

    def picture(request: Request) -> FileResponse:
        known, name = _papers(lab, _studies(lab)), text(request.query_params, "paper")
        if name not in known:
            raise MissingError(_unknown(name, known))
        path = known[name].folder / CARD
        if not path.is_file():
            raise MissingError(f"the paper {name} has no picture")
        return FileResponse(path)

    return [Route("/api/papers", cards), Route("/api/papers/picture", picture)]


def _unknown(name: str, known: Mapping[str, Paper]) -> str:
    return f"there is no paper {name!r}{suggest(name, known)}"


def _studies(lab: Lab) -> Studies:
    """Those that a paper has made, as far as they can be read."""
    return {name: study for name, study in _readable(lab) if study.paper}


def _readable(lab: Lab) -> Iterator[tuple[str, StudyStore]]:
    for name in studies.names(lab.root):
        try:
            yield name, studies.find(lab, name)
        except StudyError:
            continue  # the list of studies says why


def _papers(lab: Lab, found: Studies) -> dict[str, Paper]:
    """By name: those that come with baldwinlab, and those of users whose studies are here."""
    known = dict(papers.built_in())
    for study in found.values():
        if study.paper not in known:
            with suppress(
                StudyError, PaperError
            ):  # a study whose paper cannot be read has its results all the same
                known[study.paper] = _kept(lab, study)
    return known


def _kept(lab: Lab, study: StudyStore) -> Paper:
    """The user's paper that a study keeps. Raises StudyError where it leads elsewhere, PaperError where it cannot be read."""
    paper = papers.of_study(study.directory, study.paper)
    for path in (paper.folder, *paper.folder.rglob("*")):
        studies.require_inside(lab.root, path)
    paper.claims  # noqa: B018 (reading them is the check)
    return paper


def _card(lab: Lab, paper: Paper, found: Studies) -> dict[str, Any]:
    facts = paper.about.model_dump(
        include={"name", "title", "authors", "year", "published", "description", "link", "runs"}
    )
    counts = {
        "conditions": len(paper.own()),
        "claims": len(paper.claims),
        "picture": (paper.folder / CARD).is_file(),
    }
    made = [_about(lab, name, study) for name, study in found.items() if study.paper == paper.name]
    return facts | counts | {"preset": _preset(paper), "studies": made}


def _about(lab: Lab, name: str, study: StudyStore) -> dict[str, Any]:
    """What came of a study of a paper, and whether there is something to watch in it."""
    watched = any(
        study.runs(one.name) and studies.can_be_shown(one) for one in study.experiments.values()
    )
    verdicts, problem = _verdicts(lab, study)
    return {
        "study": name,
        "changes": list(study.changes),
        "verdicts": verdicts,
        "problem": problem,
        "watch": watched,
    }


def _preset(paper: Paper) -> str | None:
    """What the Live tab runs of it: what the paper shows, or else its first condition that learns, or the first of all.

    A name that an earlier paper has taken is that paper's. None of a user's paper, whose conditions that tab does not list.
    """
    owners = {
        name: one.name
        for one in reversed(papers.built_in().values())
        for name in one.experiment_names()
    }
    own = [name for name in (paper.about.emergence, *paper.own()) if owners.get(name) == paper.name]
    return next((name for name in own if paper.experiment(name).learns), own[0] if own else None)


def _verdicts(lab: Lab, study: StudyStore) -> tuple[dict[str, int], str | None]:
    """Count the claims of each verdict in the report of a study; or say why its claims are not valid."""
    try:
        studies.require_inside(lab.root, study.directory / CLAIMS)
        counted = Counter(claim["verdict"] for claim in claims_in(study))
    except StudyError as error:
        return {}, str(error)
    from baldwinlab.analysis.statistics.rules import (
        VERDICTS,  # here, because to load SciPy's statistics takes a while
    )

    return {verdict: counted[verdict] for verdict in VERDICTS if counted[verdict]}, None
