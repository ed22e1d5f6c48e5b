"""From a stored multiverse to its results, figures and page."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from baldwinlab.analysis.multiverse import analysis
from baldwinlab.analysis.multiverse.section import lead, section
from baldwinlab.analysis.report import write_page
from baldwinlab.papers import of_study
from baldwinlab.studies.multiverse import by_variant
from baldwinlab.studies.open import open_conditions
from baldwinlab.studies.run import Progress
from baldwinlab.studies.store import StudyStore

FILE = "multiverse.json"  # what came of a multiverse, in its folder
FOLDERS = (
    "multiverse-full",
    "multiverse",
)  # in a study of the paper: the first that is there stands in its report


def publish(
    study: StudyStore,
    out: Path,
    last: int,
    progress: Callable[[str, int, str], Progress],
    tell: Callable[[str], None],
) -> analysis.Multiverse:
    """Write multiverse.json, the figures and the page of a multiverse, and return what came of it.

    A variant of which no run is stored is left out. Raises StudyError if there is no other.
    """
    study.require_runs()
    found = []
    paper = of_study(study.directory, study.paper)
    wanted = by_variant(study.factors, paper)
    with progress("deciding the claims", len(wanted), "variants") as show:
        for variant, conditions in wanted.items():
            data = open_conditions(study, list(conditions))
            if data.sizes["run"]:
                data = data.assign_coords(condition=list(conditions.values()))
                about = (variant.name, variant.description, variant.choices, variant.fields)
                found.append(analysis.evaluate_variant(data, *about, last, paper))
            show(1)
    claims = analysis.paper_claims(paper)
    multiverse = analysis.Multiverse(
        seed=study.seed, last=last, claims=claims, variants=tuple(found), source=paper.about.source
    )
    analysis.write(multiverse, study.directory / FILE)
    tell("drawing the figures")
    shown = section(multiverse, study.directory / "figures")
    write_page(
        "The paper's claims under every variant",
        lead(multiverse),
        [shown],
        out,
        study.directory / "figures",
    )
    return multiverse
