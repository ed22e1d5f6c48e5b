"""Claims about a study: those of its paper, of another paper, or in a file."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from baldwinlab.analysis.claims import Claiming, ClaimResult, describe_claims_too_few, evaluate
from baldwinlab.api.tables import claims_table
from baldwinlab.core import console
from baldwinlab.core.errors import RefusedError, require_positive
from baldwinlab.experiment import Experiment
from baldwinlab.papers import PaperError, load, of_study
from baldwinlab.papers.claims import Claim, read_claims
from baldwinlab.papers.paper import require_known
from baldwinlab.studies.open import open_conditions
from baldwinlab.studies.store import StudyStore


@dataclass(frozen=True)
class CustomClaims:
    """Claims about the conditions of a study, whoever makes them."""

    claims: tuple[Claim, ...]
    study: StudyStore

    def measures(self, name: str) -> Mapping[str, Any] | None:
        """The measures of the condition's model; None where it is not loaded."""
        experiment = self.study.experiments[name]
        if isinstance(experiment, Experiment):
            return {}
        model = experiment.loaded_model
        return None if model is None else model.measures


def evaluate_claims(
    study: StudyStore, file: Path | None = None, *, paper: str = "", last: int = 10
) -> list[ClaimResult]:
    """Decide the claims in a file, those of a paper, or those of the study's paper, and show them; nothing is written.

    A run counts with its average over its `last` generations; all tests are corrected together. Raises StudyError where no run is
    stored, PaperError for a file that is not valid, or that is about conditions that the study does not have, and RefusedError
    where no claims are given and no paper made the study.
    """
    require_positive("last", last)
    study.require_runs()
    title, wanted = _select_claims(study, file, paper)
    about = sorted(
        set().union(*(claim.conditions for claim in wanted.claims)) & set(study.experiments)
    )
    found = evaluate(open_conditions(study, about or list(study.experiments)), last, wanted)
    console.console.print(claims_table(found, title, study.changed_model))
    console.info_if_any(describe_claims_too_few(found))
    return found


def _select_claims(study: StudyStore, file: Path | None, paper: str) -> tuple[str, Claiming]:
    if file and paper:
        raise RefusedError(
            f"--claims {file} and --paper {paper} exclude each other: give one of them"
        )
    if file is None:
        if not (paper or study.paper):
            raise RefusedError(
                f"{study.directory} was made by no paper: give claims by --claims FILE or --paper NAME"
            )
        chosen = load(paper) if paper else of_study(study.directory, study.paper)
        return f"The claims of {chosen.name}", chosen
    made = read_claims(file)
    if not made:
        raise PaperError(
            f"there is no {file}, or no [[claims]] in it; docs/papers.md says what a claim is"
        )
    own = CustomClaims(made, study)
    require_known(made, file, list(study.experiments), own.measures)
    return f"The claims of {file.name}", own
