"""Write the statistics, figures and report of a stored study, of a sweep, and of a multiverse."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any, Final, NamedTuple

import numpy as np

from baldwinlab.analysis.assays import section as assays_section
from baldwinlab.analysis.assays.analysis import Analysis, evaluate_assays
from baldwinlab.analysis.assays.evaluation import (
    Assays,
    evolves_and_learns,
    make_own_sections,
    select_with_quantities,
)
from baldwinlab.analysis.claim_results import ClaimResult
from baldwinlab.analysis.claim_samples import Samples
from baldwinlab.analysis.claims import claim_records, evaluate_samples, write_statistics
from baldwinlab.analysis.estimands import trait_changes
from baldwinlab.analysis.estimands.trait_changes import TraitChanges, find_obstacle, measure_changes
from baldwinlab.analysis.multiverse import section as multiverse_section
from baldwinlab.analysis.multiverse.analysis import (
    STANDARD,
    evaluate_variant,
    list_claims,
    read_multiverse,
    write_multiverse,
)
from baldwinlab.analysis.multiverse.records import Multiverse, VariantResult
from baldwinlab.analysis.multiverse.section import compose_lead
from baldwinlab.analysis.report.content import count_runs
from baldwinlab.analysis.report.data import ReportData, emergence_generations
from baldwinlab.analysis.report.sections import Section, write_page
from baldwinlab.analysis.report.setup import describe_variants
from baldwinlab.analysis.report.study import draw_report, write_report
from baldwinlab.analysis.results.contrasts import (
    COMPARED_MEASURES,
    COMPARISON_COLUMNS,
    Contrasts,
    final_values,
)
from baldwinlab.analysis.results.numbers import to_csv
from baldwinlab.analysis.stages import section as stages_section
from baldwinlab.analysis.statistics import fitness
from baldwinlab.analysis.statistics.fitness import add_unseen_maps
from baldwinlab.analysis.sweeps.analysis import compute_finals, write_responses
from baldwinlab.analysis.sweeps.section import link_points, write_sweep_report
from baldwinlab.api.publish.comparisons import compare_finals, has_comparisons, instruction_of
from baldwinlab.api.publish.lab_results import cache_results
from baldwinlab.api.publish.plan import ReportPlan
from baldwinlab.api.publish.stages import describe_size, read_staged_results
from baldwinlab.core import console
from baldwinlab.core.deferred import xr
from baldwinlab.core.file_writing import write_atomically
from baldwinlab.models.miniworld.appearance import describe_appearance
from baldwinlab.papers import Paper
from baldwinlab.papers.design import read_design
from baldwinlab.simulation.replay import count_generations, replay
from baldwinlab.studies.assays.results import read_assays
from baldwinlab.studies.assays.unseen_maps import UNSEEN_MAPS
from baldwinlab.studies.multiverse import group_by_variant
from baldwinlab.studies.open import format_sample_sentence, open_sample
from baldwinlab.studies.status import provenance, write_claims
from baldwinlab.studies.store import StudyStore
from baldwinlab.studies.sweeps.design import label_points

MULTIVERSE_FILE: Final = "multiverse.json"
# Folders of multiverses in a study of the paper. The report shows the first existing folder.
MULTIVERSE_FOLDERS: Final = ("multiverse-full", "multiverse")
NO_PAIRS: Final = (
    "No two successive generations of the stored assay innate have values of the trait."
)


class Published(NamedTuple):
    """The results of a study, and a function that writes the report again."""

    claims: Sequence[ClaimResult]
    contrasts: Contrasts
    # Writes the report again, with the results that were added to the study after `publish_study`.
    write: Callable[[], object]


def publish_study(plan: ReportPlan) -> Published:
    """Write the results, figures and report of a study of conditions.

    The files are claims.json, statistics.csv, summary.csv, results.json, the figures and the
    report.
    """
    study = plan.study
    study.require_runs()
    unseen_maps = read_assays(study, [UNSEEN_MAPS]).get(UNSEEN_MAPS, {})
    n_files = sum(len(study.files(name)) for name in study.experiments)
    with console.progress("reading", n_files, "files") as report_file:
        data = open_sample(study, list(study.experiments), report_file)
    data = fitness.cache_measures(data)
    data = add_unseen_maps(data, unseen_maps)
    samples = Samples(data, plan.last, plan.paper) if plan.paper else None
    results = evaluate_samples(samples) if samples else []
    instruction = instruction_of(study)
    contrasts = compare_finals(study, final_values(data, plan.last), plan.last, plan.baseline)
    paper_name = plan.paper.name if plan.paper else ""
    write_claims(study, claim_records(results, paper_name, study.changes))
    write_statistics(results, data, study.directory, plan.last, contrasts.rows)
    console.info("drawing the figures")
    report = ReportData(
        directory=study.directory,
        data=data,
        experiments=study.experiments,
        results=results,
        traces=_replay_emergence(plan, data),
        provenance=provenance(study, plan.incomplete),
        last=plan.last,
        paper=plan.paper,
        appearances={
            name: describe_appearance(study.experiments[name]).to_dict() for name in plan.replayable
        },
        contrasts=contrasts,
        model_measures=samples.model_measures() if samples else (),
        variants=describe_variants(study.experiments, plan.paper),
        is_reproduction=bool(study.paper),
        instruction=instruction,
    )
    template_values = draw_report(report)
    standard = _standard_study(report)

    def write() -> None:
        """Write the report with the assays and the multiverse that are stored now."""
        _write_report(plan, report, template_values, standard)

    write()
    cache_results(study, data)
    return Published(results, contrasts, write)


def _write_report(
    plan: ReportPlan,
    report: ReportData,
    template_values: dict[str, Any],
    standard: multiverse_section.StandardStudy | None,
) -> None:
    """Write the report with the assays and the multiverse that are stored now."""
    study = plan.study
    stored = read_assays(study)
    assays = select_with_quantities(stored)
    analysis = evaluate_assays(assays, plan.last, report.instruction) if assays else None
    sections = _extra_sections(plan, assays, analysis, standard)
    if changes := _make_trait_section(study, assays.get("innate", {})):
        sections.append(changes)
    sections += make_own_sections(stored, study.directory / "figures", report.instruction)
    summary = None
    design = read_design(plan.paper) if plan.paper else None
    if plan.paper and design:
        staged = read_staged_results(study, plan.paper, design, report.data, report.results)
        if staged:
            summary = stages_section.make_summary(staged, study.directory)
            sections.insert(0, stages_section.make_section(staged, study.directory))
        elif note := " ".join(describe_size(study, plan.paper, report.data)):
            body = f"<p>{note}</p>"
            sections.insert(0, Section("stage", "Stage of the study", body, summary=note))
    write_report(study.directory, template_values, plan.out, sections, summary)


def _extra_sections(
    plan: ReportPlan,
    assays: Assays,
    analysis: Analysis | None,
    standard: multiverse_section.StandardStudy | None,
) -> list[Section]:
    """Return the sections of the stored assays and of the stored multiverse, if any."""
    directory = plan.study.directory
    sections = []
    if analysis:
        inference = plan.paper.texts.inference if plan.paper else None
        sections.append(
            assays_section.make_section(assays, directory, analysis.last, inference, analysis)
        )
    paths = [directory / folder / MULTIVERSE_FILE for folder in MULTIVERSE_FOLDERS]
    multiverse_path = next((path for path in paths if path.exists()), None)
    if multiverse_path:
        multiverse = read_multiverse(multiverse_path)
        sections.append(
            multiverse_section.make_section(multiverse, directory / "figures", standard)
        )
    return sections


def _standard_study(report: ReportData) -> multiverse_section.StandardStudy | None:
    """Return the verdicts by claim, and the smallest and largest number of runs of a condition.

    None without a paper, or if a condition does not follow the standard variant.
    """
    if set(report.variants.values()) != {STANDARD}:
        return None
    counts = count_runs(report.data).values()
    verdicts = {result.claim.id: result.verdict for result in report.results}
    return multiverse_section.StandardStudy(verdicts, (min(counts), max(counts)))


def _replay_emergence(plan: ReportPlan, data: xr.Dataset) -> list[xr.Dataset]:
    """Return traces of some generations of the typical run, for the figure of emergence."""
    condition = plan.emergence_condition
    if condition is None:
        return []
    experiment = plan.study.experiments[condition]
    run = fitness.typical_run(data, condition, plan.last)
    energy = data.energy.sel(condition=condition, run=run)
    # `force` skips the check of memory, because `required_memory` includes all replays.
    return [
        replay(
            experiment,
            seed=plan.study.seed,
            run=run,
            generation=generation,
            energy=energy,
            force=True,
        )
        for generation in emergence_generations(count_generations(energy))
    ]


def _make_trait_section(study: StudyStore, innate: Mapping[str, xr.Dataset]) -> Section | None:
    """Make the section on the changes of innate traits, and write its figures and its CSV file.

    None if no condition with the assay evolves and learns.
    """
    changes: dict[str, TraitChanges] = {}
    obstacles: dict[str, str] = {}
    for name, data in innate.items():
        experiment = study.experiments[name]
        if not evolves_and_learns(experiment, data):
            continue
        obstacles[name] = find_obstacle(experiment)
        if obstacles[name]:
            continue
        runs = open_sample(study, [name]).sel(condition=name)
        result = measure_changes(runs, data, experiment, _read_genotypes(study, name, data))
        if result.values.sizes["generation"]:
            changes[name] = result
        else:
            obstacles[name] = NO_PAIRS
    obstacles = {name: reason for name, reason in obstacles.items() if reason}
    if not (changes or obstacles):
        return None
    return trait_changes.make_section(changes, innate, obstacles, study.directory)


def _read_genotypes(study: StudyStore, condition: str, innate: xr.Dataset) -> xr.DataArray | None:
    """Return the stored genomes of the last generation (run, agent, gene).

    None if the genomes are not stored, or are graphs, in which genes have no fixed index.
    """
    experiment = study.experiments[condition]
    model = experiment.loaded_model
    has_graphs = (
        experiment.network.kind == "neat"
        if experiment.model == "miniworld"
        else model is None or model.has_graph_genomes
    )
    if has_graphs:
        return None
    last_generation = experiment.evolution.generations - 1
    genomes = []
    for run in innate["run"].values.tolist():
        record = study.record(condition, run)
        if record["kept_generation"].values[-1] != last_generation:
            return None
        stored_genomes = record["kept_genome"].values[-1]  # [agent, ...]
        genomes.append(stored_genomes.reshape(len(stored_genomes), -1))
    return xr.DataArray(
        np.stack(genomes),
        dims=("run", "agent", "gene"),
        coords={"run": innate["run"], "generation": last_generation},
    )


def publish_sweep(plan: ReportPlan) -> Contrasts:
    """Write responses.csv, statistics.csv, results.json, the figures and the report of a sweep."""
    study = plan.study
    study.require_runs()
    data = open_sample(study, list(study.experiments))
    console.info_if_any(format_sample_sentence(study))
    finals = compute_finals(label_points(study, data), plan.last)
    write_responses(finals, study.directory)
    contrasts = _compare_points(plan, finals)
    rows = [contrast.row() for contrast in contrasts.rows]
    write_atomically(study.directory / "statistics.csv", to_csv(COMPARISON_COLUMNS, rows))
    console.info("drawing the figures")
    experiments = study.experiments.values()
    links = link_points(
        finals, [*study.experiments], [point.evolution.generations for point in experiments]
    )
    write_sweep_report(
        study.directory,
        finals,
        provenance(study, plan.incomplete),
        plan.out,
        plan.last,
        contrasts=contrasts,
        links=links,
    )
    cache_results(study, data)
    return contrasts


def _compare_points(plan: ReportPlan, finals: xr.Dataset) -> Contrasts:
    """Return the comparisons of the points, empty for a large sweep or a random sample."""
    study = plan.study
    if not has_comparisons(study):
        return Contrasts("", plan.last, ())
    # Points become conditions, which `compare_finals` compares.
    by_condition = finals[list(COMPARED_MEASURES)].rename(point="condition").reset_coords(drop=True)
    by_condition = by_condition.assign_coords(condition=list(study.experiments))
    return compare_finals(study, by_condition, plan.last, plan.baseline)


def publish_multiverse(plan: ReportPlan) -> Multiverse:
    """Write multiverse.json, results.json, the figures and the page, of all variants with runs."""
    study = plan.study
    study.require_runs()
    paper = plan.paper
    assert paper is not None, "the plan of a multiverse has a paper"
    variants = _evaluate_variants(study, paper, plan.last)
    multiverse = Multiverse(
        seed=study.seed,
        last=plan.last,
        claims=list_claims(paper),
        variants=tuple(variants),
        source=paper.metadata.source,
    )
    write_multiverse(multiverse, study.directory / MULTIVERSE_FILE)
    console.info("drawing the figures")
    figures = study.directory / "figures"
    sections = [multiverse_section.make_section(multiverse, figures)]
    title = "Claims of the paper under all variants"
    write_page(title, compose_lead(multiverse), sections, plan.out, figures)
    cache_results(study)
    return multiverse


def _evaluate_variants(study: StudyStore, paper: Paper, last: int) -> list[VariantResult]:
    results = []
    console.info_if_any(format_sample_sentence(study))
    groups = group_by_variant(study.factors, paper)
    with console.progress("evaluating the claims", len(groups), "variants") as advance:
        for variant, conditions in groups.items():
            data = open_sample(study, list(conditions))
            if data.sizes["run"]:
                # Claims name the conditions of the paper, without the variant.
                data = data.assign_coords(condition=list(conditions.values()))
                results.append(evaluate_variant(data, variant, last, paper))
            advance(1)
    return results
