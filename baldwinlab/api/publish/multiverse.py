"""Write the results, figures and page of a stored multiverse."""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

from baldwinlab.analysis.multiverse import analysis
from baldwinlab.analysis.multiverse.analysis import write_multiverse
from baldwinlab.analysis.multiverse.records import Multiverse, VariantResult
from baldwinlab.analysis.multiverse.section import compose_lead, make_section
from baldwinlab.analysis.report.sections import write_page
from baldwinlab.api.publish import results_cache
from baldwinlab.api.publish.plan import ReportPlan
from baldwinlab.core import console
from baldwinlab.papers import Paper
from baldwinlab.studies.multiverse import group_by_variant
from baldwinlab.studies.open import open_sample
from baldwinlab.studies.run import Progress
from baldwinlab.studies.run_samples import format_sample_sentence
from baldwinlab.studies.store import StudyStore

MULTIVERSE_FILE: Final = "multiverse.json"
# Folders of multiverses in a study of the paper. The report shows the first existing folder.
MULTIVERSE_FOLDERS: Final = ("multiverse-full", "multiverse")


def publish_multiverse(
    plan: ReportPlan,
    progress: Callable[[str, int, str], Progress],
    log: Callable[[str], None],
) -> Multiverse:
    """Write multiverse.json, results.json, the figures and the page of a multiverse.

    `plan`: variants without runs are left out.
    """
    study = plan.study
    study.require_runs()
    paper = plan.paper
    assert paper is not None, "the plan of a multiverse has a paper"
    variants = _evaluate_variants(study, paper, plan.last, progress)
    multiverse = Multiverse(
        seed=study.seed,
        last=plan.last,
        claims=analysis.list_claims(paper),
        variants=tuple(variants),
        source=paper.metadata.source,
    )
    write_multiverse(multiverse, study.directory / MULTIVERSE_FILE)
    log("drawing the figures")
    figures = study.directory / "figures"
    sections = [make_section(multiverse, figures)]
    title = "Claims of the paper under all variants"
    write_page(title, compose_lead(multiverse), sections, plan.out, figures)
    results_cache.cache_results(study)
    return multiverse


def _evaluate_variants(
    study: StudyStore, paper: Paper, last: int, progress: Callable[[str, int, str], Progress]
) -> list[VariantResult]:
    results = []
    console.info_if_any(format_sample_sentence(study))
    groups = group_by_variant(study.factors, paper)
    with progress("evaluating the claims", len(groups), "variants") as advance:
        for variant, conditions in groups.items():
            data = open_sample(study, list(conditions))
            if data.sizes["run"]:
                # Claims name the conditions of the paper, without the variant.
                data = data.assign_coords(condition=list(conditions.values()))
                results.append(analysis.evaluate_variant(data, variant, last, paper))
            advance(1)
    return results
