"""Claims held against a study: those of its paper, or a file of anybody's."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from baldwinlab import console
from baldwinlab.api.tables import claims_table
from baldwinlab.errors import require_positive
from baldwinlab.experiment import Experiment
from baldwinlab.papers import PaperError, of_study
from baldwinlab.papers.claims import Claim, read_claims
from baldwinlab.papers.paper import require_known
from baldwinlab.papers.verdicts import Claiming, ClaimResult, evaluate
from baldwinlab.studies.store import Study
from baldwinlab.studies.study import open_conditions


@dataclass(frozen=True)
class Own:
    """Claims about the conditions of a study, whoever makes them."""

    claims: tuple[Claim, ...]
    study: Study

    def measures(self, name: str) -> Mapping[str, Any]:
        """Those of the condition's model, which must be here unless it is that of the foragers."""
        experiment = self.study.experiments[name]
        return {} if isinstance(experiment, Experiment) else experiment.of_model.measures


def claims(study: Study, file: Path | None = None, *, last: int = 10) -> list[ClaimResult]:
    """Decide the claims in a file, or those of the study's paper, and show them; nothing is written.

    A run counts with its average over its `last` generations; all tests are corrected together. Raises StudyError where no run is
    stored, and PaperError for a file that is not what it should be, or that is about what the study has not.
    """
    require_positive("last", last)
    study.require_runs()
    title, wanted = _wanted(study, file)
    about = sorted(set().union(*(claim.conditions for claim in wanted.claims)) & set(study.experiments))
    found = evaluate(open_conditions(study, about or list(study.experiments)), last, wanted)
    console.console.print(claims_table(found, title))
    return found


def _wanted(study: Study, file: Path | None) -> tuple[str, Claiming]:
    if file is None:
        paper = of_study(study.directory, study.paper)
        return f"The claims of {paper.name}", paper
    made = read_claims(file)
    if not made:
        raise PaperError(f"there is no {file}, or no [[claims]] in it; docs/papers.md says what a claim is")
    own = Own(made, study)
    require_known(made, file, list(study.experiments), own.measures)
    return f"The claims of {file.name}", own
