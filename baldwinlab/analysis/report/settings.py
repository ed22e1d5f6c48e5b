"""Comparison of the settings of a study with the variants of a paper."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from contextlib import suppress
from typing import Any

from baldwinlab.analysis.claim_results import ClaimResult
from baldwinlab.analysis.report.content import count_runs, format_range, select_foragers
from baldwinlab.analysis.report.data import Experiments, ReportData
from baldwinlab.experiment import Experiment, ExperimentError
from baldwinlab.experiment.paths import iterate_settings
from baldwinlab.papers import Paper, PaperError
from baldwinlab.papers.claims import OpenChoice
from baldwinlab.papers.design import read_design
from baldwinlab.papers.paper import STANDARD_VARIANT


def describe_variant(
    experiment: Experiment, paper: Paper, tuned_settings: Collection[str] = ()
) -> str:
    """Return the variant of the paper that an experiment follows.

    `tuned_settings`: settings that the stages of the paper choose. They are not compared.
    """
    differences = dict[str, list[str]]()
    for name in dict.fromkeys([STANDARD_VARIANT, *paper.names("variants")]):
        # The paper may lack the condition, or the variant may not apply to it.
        with suppress(ExperimentError, PaperError):
            base = paper.experiment(experiment.name, name)
            differences[name] = _list_changes(base, experiment, tuned_settings)
            if not differences[name]:
                return name
    if STANDARD_VARIANT not in differences:
        return f"{experiment.name} is not a condition of the paper"
    return f"{experiment.name} is standard except for {', '.join(differences[STANDARD_VARIANT])}"


def describe_variants(conditions: Experiments, paper: Paper | None) -> dict[str, str]:
    """Return the result of `describe_variant` by condition, empty without a paper."""
    if paper is None:
        return {}
    design = read_design(paper)
    tuned_settings = [grid.field for grid in design.tuning.grids] if design else []
    return {
        name: describe_variant(experiment, paper, tuned_settings)
        for name, experiment in conditions.items()
    }


def _list_changes(
    base: Experiment, experiment: Experiment, tuned_settings: Collection[str]
) -> list[str]:
    base_settings = dict(iterate_settings(base.to_dict()))
    settings = dict(iterate_settings(experiment.to_dict()))
    return [
        f"{path} = {format_value(value)}"
        for path, value in settings.items()
        if base_settings.get(path) != value
        and not path.startswith("record.")
        and path not in tuned_settings
    ]


def select_open_choices(
    results: Sequence[ClaimResult], conditions: Experiments
) -> list[tuple[OpenChoice, str, list[str]]]:
    """Return the open choices of the paper that may explain differing claims."""
    claims_by_choice: dict[OpenChoice, list[str]] = {}
    for result in results:
        for choice in result.claim.choices:
            claims_by_choice.setdefault(choice, []).append(result.claim.id)
    return [
        (choice, format_setting(choice.field, conditions), names)
        for choice, names in claims_by_choice.items()
    ]


def format_setting(field: str, conditions: Experiments) -> str:
    """Return the values of a setting, such as senses.visual_radius, in the study."""
    values = [
        dict(iterate_settings(experiment.to_dict())).get(field)
        for experiment in conditions.values()
    ]
    return " or ".join(dict.fromkeys(format_value(value) for value in values if value is not None))


def format_value(value: Any) -> str:
    """Return the value of a setting as text."""
    if isinstance(value, bool):
        return str(value).lower()
    return f"{value:g}" if isinstance(value, float) else str(value)


def describe_changed_settings(report: ReportData, paper: Paper) -> list[str]:
    """Return a sentence for each difference between the study and the paper."""
    declared = paper.study_names()
    variants = [
        report.variants[name] for name in select_foragers(report.experiments) if name in declared
    ]
    # `describe_variant` returns the name of a variant, which has no space, or a phrase.
    distinct_variants = list(dict.fromkeys(variants))
    sentences = [f"{phrase}." for phrase in distinct_variants if " " in phrase]
    for variant in distinct_variants:
        if " " not in variant and variant != STANDARD_VARIANT:
            description = paper.describe("variants", variant)
            sentences.append(f"The variant is {variant}: {description}.")
    n_runs = count_runs(report.data).values()
    if max(n_runs) < paper.metadata.runs:
        sentences.append(
            f"This study has {format_range(n_runs)} runs per condition, and the paper "
            f"has {paper.metadata.runs}. Its intervals are therefore wider."
        )
    return sentences
