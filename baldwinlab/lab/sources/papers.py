"""The papers and their studies, for the cards of the Papers tab."""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Iterator
from contextlib import suppress
from pathlib import Path
from typing import Any, Final

from baldwinlab import papers
from baldwinlab.core.names import suggest
from baldwinlab.experiment import BaseExperiment
from baldwinlab.lab import Lab, MissingError, Query, read_text
from baldwinlab.lab.sources import model_displays, studies
from baldwinlab.lab.sources.limits import check_size
from baldwinlab.papers import Paper, PaperError
from baldwinlab.papers.claims import KINDS
from baldwinlab.papers.paper import CARD_FILE
from baldwinlab.studies.records import StudyError
from baldwinlab.studies.status import CLAIMS_FILE, read_claims
from baldwinlab.studies.store import StudyStore

# The number of runs in the form of a live run at opening.
DEFAULT_LIVE_RUNS: Final = 5

# Studies by the name that the page shows.
Studies = dict[str, StudyStore]


def list_cards(lab: Lab, query: Query) -> dict[str, Any]:
    """Return the cards of all papers, and a problem if there is no paper of the requested name."""
    paper_studies = _find_paper_studies(lab)
    paper_by_name = _load_papers(lab, paper_studies)
    name = query.get("paper")
    problem = None
    if name and name not in paper_by_name:
        problem = _format_unknown_paper(name, paper_by_name)
    cards = [_make_card(lab, paper, paper_studies) for paper in paper_by_name.values()]
    return {"papers": cards, "problem": problem}


def find_picture(lab: Lab, query: Query) -> Path:
    """Return the file of the picture on the card of a paper."""
    name = read_text(query, "paper")
    paper_by_name = papers.built_in()
    if name not in paper_by_name:
        # Only users' papers need a look at all studies.
        paper_by_name = _load_papers(lab, _find_paper_studies(lab))
    if name not in paper_by_name:
        raise MissingError(_format_unknown_paper(name, paper_by_name))
    path = paper_by_name[name].folder / CARD_FILE
    if not path.is_file():
        raise MissingError(f"the paper {name} has no picture")
    return path


def _format_unknown_paper(name: str, paper_names: Collection[str]) -> str:
    return f"there is no paper {name!r}{suggest(name, paper_names)}"


def _find_paper_studies(lab: Lab) -> Studies:
    """Return the readable studies of papers."""
    return {name: study for name, study in _find_readable_studies(lab) if study.paper}


def _find_readable_studies(lab: Lab) -> Iterator[tuple[str, StudyStore]]:
    """Yield all readable studies. The list of studies reports the errors of unreadable ones."""
    for name in studies.list_study_names(lab.root):
        try:
            yield name, studies.find_study(lab, name)
        except StudyError:
            continue


def _load_papers(lab: Lab, paper_studies: Studies) -> dict[str, Paper]:
    """Return the built-in papers and the users' papers that studies contain, by name."""
    paper_by_name = dict(papers.built_in())
    for study in paper_studies.values():
        if study.paper not in paper_by_name:
            # The results of a study remain available if its paper cannot be read.
            with suppress(StudyError, PaperError):
                paper_by_name[study.paper] = _load_stored_paper(lab, study)
    return paper_by_name


def _load_stored_paper(lab: Lab, study: StudyStore) -> Paper:
    """Return the user's paper that a study contains."""
    paper = papers.load_stored_paper(study.directory, study.paper)
    for path in (paper.folder, *paper.folder.rglob("*")):
        studies.require_inside(lab.root, path)
    # Reading the claims and the card checks them. The paper caches them.
    paper.claims  # noqa: B018
    paper.card  # noqa: B018
    return paper


def _make_card(lab: Lab, paper: Paper, paper_studies: Studies) -> dict[str, Any]:
    metadata = paper.metadata.model_dump(
        include={"name", "title", "authors", "year", "published", "description", "link", "runs"}
    )
    contents = {
        "conditions": len(paper.study_names()),
        "claims": len(paper.claims),
        "picture": (paper.folder / CARD_FILE).is_file(),
    }
    summaries = [
        _summarize_study(lab, name, study)
        for name, study in paper_studies.items()
        if study.paper == paper.name
    ]
    card = paper.card
    preset = _choose_live_preset(paper)
    return {
        **metadata,
        **contents,
        "card": card.model_dump(by_alias=True, mode="json") if card else None,
        "preset": preset,
        "live_runs": _count_live_runs(paper.experiment(preset)) if preset else None,
        "studies": summaries,
    }


def _summarize_study(lab: Lab, name: str, study: StudyStore) -> dict[str, Any]:
    """Return the verdicts of a study, and whether the World tab can show it."""
    is_viewable = any(
        study.runs(experiment.name) and model_displays.is_viewable(experiment)
        for experiment in study.experiments.values()
    )
    verdicts, problem = _count_verdicts(lab, study)
    return {
        "study": name,
        "changes": list(study.changes),
        "verdicts": verdicts,
        "problem": problem,
        "is_viewable": is_viewable,
    }


def _choose_live_preset(paper: Paper) -> str | None:
    """Return the preset that the button "Run live" starts for a paper.

    The candidates are the condition of the paper's main figure and then all conditions, in order.
    The result is the first candidate that learns, or the first candidate if none learns. A name
    that two papers use belongs to the earlier paper. The result is None for users' papers, because
    the Live run tab does not list their conditions.
    """
    # The papers are reversed, because an entry replaces those of later papers.
    owner_by_condition = {
        condition: built_in_paper.name
        for built_in_paper in reversed(papers.built_in().values())
        for condition in built_in_paper.experiment_names()
    }
    candidates = (paper.metadata.emergence, *paper.study_names())
    presets_of_paper = [name for name in candidates if owner_by_condition.get(name) == paper.name]
    if not presets_of_paper:
        return None
    learning_presets = (name for name in presets_of_paper if paper.experiment(name).learns)
    return next(learning_presets, presets_of_paper[0])


def _count_live_runs(experiment: BaseExperiment) -> int:
    """Return the number of runs that a live run can have, at most `DEFAULT_LIVE_RUNS`."""
    for n_runs in range(DEFAULT_LIVE_RUNS, 1, -1):
        with suppress(ValueError):
            check_size(experiment, n_runs)
            return n_runs
    return 1


def _count_verdicts(lab: Lab, study: StudyStore) -> tuple[dict[str, dict[str, int]], str | None]:
    """Return the number of claims by kind and verdict, or an error if the claims are not valid."""
    try:
        studies.require_inside(lab.root, study.directory / CLAIMS_FILE)
        # Older files have no kind.
        counts = Counter((claim.get("kind", ""), claim["verdict"]) for claim in read_claims(study))
    except StudyError as error:
        return {}, str(error)
    # This import of SciPy's statistics takes time.
    from baldwinlab.analysis.results.verdicts import VERDICTS

    # The page shows kinds and verdicts in this order.
    names_by_kind = {"": ""} | {kind: plural for kind, (_, plural) in KINDS.items()}
    ordered_counts: dict[str, dict[str, int]] = {
        name: {verdict: counts[kind, verdict] for verdict in VERDICTS if counts[kind, verdict]}
        for kind, name in names_by_kind.items()
    }
    return {kind: verdicts for kind, verdicts in ordered_counts.items() if verdicts}, None
