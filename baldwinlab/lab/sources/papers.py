"""The cards of the Papers tab: the papers, their claims, and the studies that test the claims."""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Iterator
from contextlib import suppress
from pathlib import Path
from typing import Any, Final

from baldwinlab import papers
from baldwinlab.core.files import find_paths, quote_path
from baldwinlab.core.names import suggest
from baldwinlab.experiment import BaseExperiment
from baldwinlab.lab import Lab, MissingError, Query, read_text
from baldwinlab.lab.sources import model_displays, studies
from baldwinlab.lab.sources.limits import check_size
from baldwinlab.papers import Paper, PaperError
from baldwinlab.papers.claims import EXPLORATORY, KINDS
from baldwinlab.papers.paper import CARD_FILE
from baldwinlab.studies.records import StudyError
from baldwinlab.studies.status import CLAIMS_FILE, read_claims
from baldwinlab.studies.store import StudyStore

# The number of runs in the form of a live run when the page opens it.
DEFAULT_LIVE_RUNS: Final = 5

# Each study by its path in the served folder, which is the name on the page.
Studies = dict[str, StudyStore]


def list_cards(lab: Lab, query: Query) -> dict[str, Any]:
    """Return {"papers": [CARD, ...], "problem": MESSAGE or None}.

    The problem is that the query names a paper that does not exist.
    """
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
        # The files of users' papers are in studies. Opening all studies takes time.
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
    return {name: study for name, study in _find_readable_studies(lab) if study.paper}


def _find_readable_studies(lab: Lab) -> Iterator[tuple[str, StudyStore]]:
    """Yield name and study of each readable study. `studies.list_studies` has the errors."""
    for name in studies.list_study_names(lab.root):
        try:
            yield name, studies.find_study(lab, name)
        except StudyError:
            continue


def _load_papers(lab: Lab, paper_studies: Studies) -> dict[str, Paper]:
    """Return the built-in papers, and the users' papers that studies contain, by name."""
    paper_by_name = dict(papers.built_in())
    for study in paper_studies.values():
        if study.paper not in paper_by_name:
            # A paper that cannot be read has no card, but the page still shows the study.
            with suppress(StudyError, PaperError):
                paper_by_name[study.paper] = _load_stored_paper(lab, study)
    return paper_by_name


def _load_stored_paper(lab: Lab, study: StudyStore) -> Paper:
    paper = papers.load_stored_paper(study.directory, study.paper)
    for path in (paper.folder, *find_paths(paper.folder, "**/*")):
        studies.require_inside(lab.root, path)
    # The caller suppresses errors in these cached properties, so they are read here.
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
        "argument": quote_path(study.directory),
        "is_viewable": is_viewable,
    }


def _choose_live_preset(paper: Paper) -> str | None:
    """Return the preset that the button "Run live" starts for a paper, such as "evo+self-taught/A".

    The candidates are the condition of the paper's main figure and then all conditions, in order.
    The result is the first candidate that learns, or the first candidate if none learns. A name
    that two papers use belongs to the earlier paper. The result is None for users' papers, because
    the Live run tab does not list the conditions of users' papers.
    """
    # A dictionary keeps the last value of a key. The first paper is therefore the last one here.
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
    """Return the largest allowed number of runs in a live run, at most `DEFAULT_LIVE_RUNS`."""
    for n_runs in range(DEFAULT_LIVE_RUNS, 1, -1):
        with suppress(ValueError):
            check_size(experiment, n_runs)
            return n_runs
    return 1


def _count_verdicts(lab: Lab, study: StudyStore) -> tuple[dict[str, dict[str, int]], str | None]:
    """Return the number of claims by kind and verdict, and an error if the claims are not valid.

    For example ({"claims of the paper": {"holds": 3}}, None). Older files have the kind "".
    Exploratory claims are not counted.
    """
    try:
        studies.require_inside(lab.root, study.directory / CLAIMS_FILE)
        counts = Counter((claim.get("kind", ""), claim["verdict"]) for claim in read_claims(study))
    except StudyError as error:
        return {}, str(error)
    # This import of SciPy's statistics takes time.
    from baldwinlab.analysis.results.verdicts import VERDICTS

    # The plural name of each kind. The page shows kinds and verdicts in the order of the result.
    names_by_kind = {"": ""} | {kind: plural for kind, (_, plural) in KINDS.items()}
    ordered_counts: dict[str, dict[str, int]] = {
        name: {verdict: counts[kind, verdict] for verdict in VERDICTS if counts[kind, verdict]}
        for kind, name in names_by_kind.items()
        if kind != EXPLORATORY
    }
    return {kind: verdicts for kind, verdicts in ordered_counts.items() if verdicts}, None
