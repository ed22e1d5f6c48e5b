"""Write the report of a study, or evaluate claims about it, and print the results."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from baldwinlab.analysis.claim_results import ClaimResult
from baldwinlab.analysis.claim_samples import ClaimSource, Samples
from baldwinlab.analysis.claims import describe_claims_too_few, evaluate_samples
from baldwinlab.analysis.multiverse.sentences import compose_sentences, describe_combinations
from baldwinlab.api.publish.comparisons import instruction_of, require_baseline
from baldwinlab.api.publish.plan import ReportPlan, plan_report, required_memory
from baldwinlab.api.publish.study import Published, publish_multiverse, publish_study, publish_sweep
from baldwinlab.api.tables import (
    VERDICT_STYLE,
    make_claims_table,
    make_variants_table,
    show_contrasts,
)
from baldwinlab.core import console
from baldwinlab.core.errors import RefusedError
from baldwinlab.core.file_writing import require_writable_path
from baldwinlab.core.files import REPORT_MARK, is_local, require_writable, shorten_path
from baldwinlab.core.numbers import check_numbers
from baldwinlab.core.resources import require_resources
from baldwinlab.experiment.conditions import CONDITIONS, MULTIVERSE, SWEEP
from baldwinlab.papers import Paper, PaperError, load, load_stored_paper, require_existing_names
from baldwinlab.papers.claims import Claim, read_claims
from baldwinlab.studies.open import format_sample_sentence, open_sample
from baldwinlab.studies.status import CLAIMS_FILE
from baldwinlab.studies.store import StudyStore


@check_numbers
def report(
    study: StudyStore,
    out: Path | None = None,
    *,
    last: int = 10,
    force: bool = False,
    add_results: Callable[[], None] | None = None,
    baseline: str = "",
    paper: Paper | None = None,
) -> Path:
    """Write the statistics, figures and page of a study, and print its results.

    `Study.report` describes the other arguments. `add_results` adds results to the study, for
    example assays. It is called after the page of a study of conditions is written. The page is
    then written again. Returns the path of the page.
    """
    _check_options(study, baseline, paper)
    page = study.directory / "report.html" if out is None else out
    if out is not None and is_local(out):
        require_writable("--out", out, REPORT_MARK.encode(), force=force, suffixes=[".html"])
    if out is None:
        # The other files of the report are in the folders of these two files.
        for path in (study.directory / CLAIMS_FILE, study.directory / "figures" / "fitness.svg"):
            require_writable_path(path, ", or write the page to another folder with --out")
    plan = plan_report(study, page, last, baseline, paper)
    require_resources(f"the report of {study.location}", required_memory(plan), force=force)
    study.remove_abandoned_files()
    console.warn_if_any(plan.incomplete)
    if study.kind == MULTIVERSE:
        _report_multiverse(plan)
    elif study.kind == SWEEP:
        show_contrasts(publish_sweep(plan))
        console.info(f"report: {shorten_path(page)}")
    else:
        _report_conditions(plan, add_results)
    return page


def _check_options(study: StudyStore, baseline: str, paper: Paper | None) -> None:
    """Raise RefusedError for an option that does not apply to this kind of study."""
    require_baseline(study, baseline)
    if baseline and study.kind == MULTIVERSE:
        raise RefusedError(
            f"--baseline {baseline} does not apply: {study.location} is a multiverse, whose "
            "report compares no conditions. Remove the option."
        )
    if paper and study.kind != CONDITIONS:
        raise RefusedError(
            f"--paper {paper.name} does not apply: {study.location} is a {study.kind}, whose "
            "report evaluates no claims of another paper. Remove the option."
        )


def _report_multiverse(plan: ReportPlan) -> None:
    """Write and print the results of a multiverse."""
    multiverse = publish_multiverse(plan)
    console.console.print(make_variants_table(multiverse))
    sentences = compose_sentences(multiverse.singles)
    for sentence in (*sentences, *describe_combinations(multiverse)):
        console.info(f"- {sentence}")
    console.info(f"report: {shorten_path(plan.out)}")


def _report_conditions(plan: ReportPlan, add_results: Callable[[], None] | None) -> None:
    """Write and print the results of a study of conditions, without and with added results."""
    published = publish_study(plan)
    _show_results(plan.study, published, plan.out)
    if add_results:
        add_results()
        published.write()
        _show_results(plan.study, published, plan.out)


def _show_results(study: StudyStore, published: Published, page: Path) -> None:
    """Print the comparisons of the conditions and the claims.

    If a study of a paper has verdicts of claims, the comparisons are not printed.
    """
    has_verdicts = any(claim.verdict in VERDICT_STYLE for claim in published.claims)
    if not (study.paper and has_verdicts):
        show_contrasts(published.contrasts)
    if has_verdicts:
        console.console.print(
            make_claims_table(published.claims, changed_model=study.changed_model)
        )
        console.info_if_any(describe_claims_too_few(published.claims, instruction_of(study)))
    console.info(f"report: {shorten_path(page)}")


@dataclass(frozen=True)
class CustomClaims:
    """User-defined claims about the conditions of a study, as a source for `Samples`."""

    claims: tuple[Claim, ...]
    study: StudyStore

    def measures(self, name: str) -> Mapping[str, Any] | None:
        """Return the measures of the model of a condition, or None if the model is not loaded."""
        return self.study.experiments[name].measures


@check_numbers
def evaluate_claims(
    study: StudyStore, source: str | Path = "", *, last: int = 10
) -> list[ClaimResult]:
    """Evaluate claims about a study and print the verdicts. Nothing is written.

    The p-values of all tests are corrected together. Returns one result per claim.

    `source`: TOML file with claims, or the name or folder of a paper; "" for the paper that defines
    the study. Raises `RefusedError` if `source` is "" and no paper defines the study.
    """
    study.require_runs()
    title, claim_source = _select_claims(study, str(source))
    claim_conditions = set().union(*(claim.conditions for claim in claim_source.claims))
    # Claims of another paper may name no condition of the study. Then all conditions are read.
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
