"""Write the report of a study, and print its results."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from baldwinlab.analysis.claims import describe_claims_too_few
from baldwinlab.analysis.multiverse.sentences import compose_sentences, describe_combinations
from baldwinlab.api.publish import lab_results
from baldwinlab.api.publish.added_runs import instruction_of
from baldwinlab.api.publish.multiverse import publish_multiverse
from baldwinlab.api.publish.plan import ReportPlan, plan_report, required_memory
from baldwinlab.api.publish.study import Published, publish_study
from baldwinlab.api.publish.sweep import publish_sweep
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
from baldwinlab.papers import Paper
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

    - `out`: HTML file. By default report.html in the directory of the study.
    - `force`: write even if less memory is free than the estimate, and overwrite an HTML file that
      is not a report.
    - `add_results`: called after the page of a study of conditions is written. The page is then
      written again, with the results that the function has added to the study.
    - `paper`: paper whose claims are evaluated. By default the paper that defines the study.
    """
    _check_options(study, baseline, paper)
    page = study.directory / "report.html" if out is None else out
    if out is not None and is_local(out):
        require_writable("--out", out, REPORT_MARK.encode(), force=force)
    # The other files of the report are in the folders of these two files.
    for path in (study.directory / CLAIMS_FILE, study.directory / "figures" / "fitness.svg"):
        require_writable_path(path)
    plan = plan_report(study, page, last, baseline, paper)
    require_resources(f"the report of {study.location}", required_memory(plan), force=force)
    study.remove_abandoned_files()
    if study.kind == MULTIVERSE:
        _report_multiverse(plan)
    elif study.kind == SWEEP:
        show_contrasts(publish_sweep(plan, console.info))
        console.info(f"report: {shorten_path(page)}")
    else:
        _report_conditions(plan, add_results)
    return page


def _check_options(study: StudyStore, baseline: str, paper: Paper | None) -> None:
    """Raise RefusedError for an option that does not apply to this kind of study."""
    lab_results.require_baseline(study, baseline)
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
    multiverse = publish_multiverse(plan, console.progress, console.info)
    console.console.print(make_variants_table(multiverse))
    sentences = compose_sentences(multiverse.singles)
    for sentence in (*sentences, *describe_combinations(multiverse)):
        console.info(f"- {sentence}")
    console.info(f"report: {shorten_path(plan.out)}")


def _report_conditions(plan: ReportPlan, add_results: Callable[[], None] | None) -> None:
    """Write and print the results of a study of conditions, without and with added results."""
    published = publish_study(plan, console.info, console.progress)
    _show_results(plan.study, published, plan.out)
    if add_results:
        add_results()
        published.write()
        _show_results(plan.study, published, plan.out)


def _show_results(study: StudyStore, published: Published, page: Path) -> None:
    """Print the comparisons of the conditions and the claims.

    A study of a paper whose claims have verdicts is printed without comparisons.
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
