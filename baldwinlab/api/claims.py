"""Evaluate claims about a study, from its paper, another paper, or a file."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from baldwinlab.analysis.claim_results import ClaimResult
from baldwinlab.analysis.claim_samples import ClaimSource, Samples
from baldwinlab.analysis.claims import describe_claims_too_few, evaluate_samples
from baldwinlab.api.publish.added_runs import instruction_of
from baldwinlab.api.tables import make_claims_table
from baldwinlab.core import console
from baldwinlab.core.errors import RefusedError
from baldwinlab.core.numbers import check_numbers
from baldwinlab.papers import PaperError, load, load_stored_paper, require_existing_names
from baldwinlab.papers.claims import Claim, read_claims
from baldwinlab.studies.open import format_sample_sentence, open_sample
from baldwinlab.studies.store import StudyStore


@dataclass(frozen=True)
class CustomClaims:
    """User-defined claims about the conditions of a study."""

    claims: tuple[Claim, ...]
    study: StudyStore

    def measures(self, name: str) -> Mapping[str, Any] | None:
        """Return the measures of the model of a condition.

        Returns the measures by name; None if the model is not loaded.
        """
        return self.study.experiments[name].measures


@check_numbers
def evaluate_claims(
    study: StudyStore, source: str | Path = "", *, last: int = 10
) -> list[ClaimResult]:
    """Evaluate claims about a study and print the verdicts. Nothing is written.

    The p-values of all tests are corrected together.

    `source`: TOML file with claims, or the name or folder of a paper. By default the paper that
    defines the study. Raises `RefusedError` if no claims are given, and no paper defines the study.
    """
    study.require_runs()
    title, claim_source = _select_claims(study, str(source))
    claim_conditions = set().union(*(claim.conditions for claim in claim_source.claims))
    # Claims of another paper may name no condition of the study.
    conditions = sorted(claim_conditions & set(study.experiments)) or list(study.experiments)
    samples = Samples(open_sample(study, conditions), last, claim_source)
    console.info_if_any(format_sample_sentence(study))
    results = evaluate_samples(samples)
    console.console.print(make_claims_table(results, title, study.changed_model))
    console.info_if_any(describe_claims_too_few(results, instruction_of(study)))
    return results


def _select_claims(study: StudyStore, source: str) -> tuple[str, ClaimSource]:
    """Return the title and the claims of a file, of a paper, or of the paper of the study."""
    if not source.endswith(".toml"):
        if not (source or study.paper):
            raise RefusedError(
                f"{study.location} was made by no paper. Give a file of claims or a paper: "
                "--claims FILE or --claims PAPER."
            )
        paper = load(source) if source else load_stored_paper(study.directory, study.paper)
        return f"The claims of {paper.name}", paper
    file = Path(source)
    claims = read_claims(file)
    if not claims:
        raise PaperError(f"{file} does not exist or has no [[claims]]; write at least one claim")
    custom = CustomClaims(claims, study)
    require_existing_names(claims, file, list(study.experiments), custom.measures)
    return f"The claims of {file.name}", custom
