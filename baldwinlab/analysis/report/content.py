"""Texts and table rows of a report, computed from a study and its findings."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any, Final

import numpy as np
import xarray as xr

from baldwinlab.analysis.claim_results import ClaimResult, Finding, rank_weakness
from baldwinlab.analysis.report.data import Experiments
from baldwinlab.analysis.results.numbers import format_number
from baldwinlab.analysis.results.verdicts import VERDICTS, Verdict
from baldwinlab.analysis.statistics import fitness
from baldwinlab.analysis.statistics.intervals import interval_of_median, tabulate_interval
from baldwinlab.experiment import BaseExperiment, Experiment
from baldwinlab.experiment.conditions import Factors, title_map
from baldwinlab.experiment.outcome import capitalize, name_outcome_of
from baldwinlab.papers.claims import EXPLORATORY, KINDS

# Singular and plural of each verdict, in the order of `VERDICTS`.
VERDICT_VERBS: Final = (
    ("holds", "hold"),
    ("is undecided", "are undecided"),
    ("does not hold", "do not hold"),
    ("is not evaluated", "are not evaluated"),
)


def read_experiment_texts(data: xr.Dataset) -> dict[str, str]:
    """Return the experiment of each condition as TOML."""
    pairs = zip(data["condition"].values, data["experiment"].values, strict=True)
    return {str(name): str(text) for name, text in pairs}


def select_foragers(conditions: Mapping[str, BaseExperiment]) -> dict[str, Experiment]:
    """Return the conditions of the MiniWorld model, which have a map, senses and food."""
    return {
        name: experiment
        for name, experiment in conditions.items()
        if isinstance(experiment, Experiment)
    }


def find_evaluation_variable(conditions: Mapping[str, BaseExperiment]) -> str:
    """Return the variable that counts evaluations in all conditions, such as "used", or ""."""
    evaluation_variables = [model.clock for model in iterate_loaded_models(conditions)]
    # A condition whose model is not loaded has no variable.
    are_all_loaded = len(evaluation_variables) == len(conditions)
    is_shared = len(set(evaluation_variables)) == 1
    return evaluation_variables[0] if are_all_loaded and is_shared else ""


def iterate_loaded_models(conditions: Mapping[str, BaseExperiment]) -> Iterator[Any]:
    """Yield the loaded models other than MiniWorld. A report does not require loaded models."""
    models = (experiment.loaded_model for experiment in conditions.values())
    return (model for model in models if model is not None)


def count_runs(data: xr.Dataset) -> dict[str, int]:
    """Return the number of finished runs of each condition."""
    counts = fitness.best(data).notnull().any("generation").sum("run")
    pairs = zip(data["condition"].values, counts.values, strict=True)
    return {str(name): int(count) for name, count in pairs}


def format_range(values: Iterable[int]) -> str:
    """Return the smallest and the largest value, for example ``8 to 30``; "" without values."""
    distinct = sorted(set(values))
    if not distinct:
        return ""
    if len(distinct) == 1:
        return f"{distinct[0]:,}"
    return f"{distinct[0]:,} to {distinct[-1]:,}"


def title_worlds(conditions: Experiments, factors: Mapping[str, Factors]) -> dict[str, str]:
    """Return the first condition of each distinct world.

    Returns conditions by title. The title is, for example, "Map A" if each world has its own map.
    Otherwise the title is the first condition, such as "evo/A and 3 more".
    """
    names: dict[str, list[str]] = {}  # Conditions by world.
    for name, experiment in conditions.items():
        names.setdefault(_serialize_world(experiment), []).append(name)
    maps: dict[str, list[str]] = {}  # Names of maps by world.
    for world, shared in names.items():
        maps[world] = sorted({factors[name].map for name in shared} - {""})
    unique_maps = {world_maps[0] for world_maps in maps.values() if len(world_maps) == 1}
    if len(unique_maps) == len(names):
        return {title_map(world_maps[0]): names[world][0] for world, world_maps in maps.items()}
    titles = {}
    for shared in names.values():
        suffix = f" and {len(shared) - 1} more" if len(shared) > 1 else ""
        titles[f"{shared[0]}{suffix}"] = shared[0]
    return titles


def _serialize_world(experiment: Experiment) -> str:
    """Return a world as text, without the headings at birth, which do not distinguish maps."""
    start = experiment.world.start.model_copy(update={"headings": "equal"})
    # Worlds with different features have different classes, so worlds are compared as text.
    return experiment.world.model_copy(update={"start": start}).model_dump_json()


def describe_verdicts(results: Sequence[ClaimResult]) -> str:
    """Return the number of claims by kind and verdict.

    For example "4 claims of the paper: 3 hold, 1 is undecided; 1 exploratory claim: not counted".
    """
    texts = []
    for kind, (singular, plural) in KINDS.items():
        verdicts = [result.verdict for result in results if result.claim.kind == kind]
        if verdicts:
            noun = plural if len(verdicts) > 1 else singular
            counts = "not counted" if kind == EXPLORATORY else count_verdicts(verdicts)
            texts.append(f"{len(verdicts)} {noun}: {counts}")
    return "; ".join(texts)


def count_verdicts(verdicts: Sequence[Verdict]) -> str:
    """Return the number of each verdict, such as "7 hold, 1 is undecided"."""
    texts = []
    for verdict, (singular, plural) in zip(VERDICTS, VERDICT_VERBS, strict=True):
        count = verdicts.count(verdict)
        if count:
            texts.append(f"{count} {plural if count > 1 else singular}")
    return ", ".join(texts)


def find_weakest_findings(result: ClaimResult) -> list[Finding]:
    """Return the weakest finding under each rule of a claim."""
    findings_by_rule: dict[str, list[Finding]] = {}
    for finding in result.findings:
        findings_by_rule.setdefault(finding.comparison.rule, []).append(finding)
    return [max(findings, key=rank_weakness) for findings in findings_by_rule.values()]


def format_timing(provenance: Mapping[str, Any]) -> str:
    """Return the run time of the study, the number of workers and the compile time, if known."""
    parts = []
    if seconds := provenance.get("seconds"):
        time = f"{format_number(seconds)} s"
        if steps := provenance.get("agent_steps"):
            millions_per_second = steps / seconds / 1e6
            time = (
                f"{steps:,} agent-steps in {time} ({millions_per_second:,.1f} million per second)"
            )
        parts.append(time)
    if workers := provenance.get("workers"):
        counts = workers if isinstance(workers, list) else [workers]
        parts.append(f"workers: {', '.join(str(count) for count in counts)}")
    if provenance.get("compile_seconds") is not None:
        parts.append(f"compilation: {format_number(provenance['compile_seconds'])} s")
    return "; ".join(parts)


def tabulate_generations(data: xr.Dataset, measure: str) -> list[dict[str, Any]]:
    """Return the median over runs (`median`, `low`, `high`) per condition and generation."""
    # The coordinates of the factors are dropped, because the name of a condition contains them.
    values = fitness.MEASURES[measure](data).reset_coords(drop=True)
    rows = tabulate_interval(interval_of_median(values))
    # A stable sort: the rows of a condition follow each other, in the order of generations.
    order = values["condition"].values.tolist()
    rows.sort(key=lambda row: order.index(row["condition"]))
    return [
        {"condition": row["condition"], "measure": measure, **row}
        for row in rows
        if np.isfinite(row["median"])
    ]


def name_fitness(data: xr.Dataset, *agents: str) -> str:
    """Return the name of the outcome, for example "Items eaten by the best agent"."""
    name = name_outcome_of(fitness.outcome(data), " agent and the ".join(agents) + " agent")
    return capitalize(name)


def tabulate_runs(data: xr.Dataset, last: int) -> list[dict[str, Any]]:
    """Return the final best and mean fitness: one row per condition and finished run."""
    finals = {measure: fitness.final(data, measure, last) for measure in ("best", "mean")}
    table = xr.Dataset(finals).reset_coords(drop=True).to_dataframe()
    return [*table.dropna(how="all").reset_index().to_dict("records")]


def describe_final_medians(data: xr.Dataset, last: int) -> str:
    """Return the median over runs of the final mean fitness, as alternative text of a figure."""
    medians = fitness.final(data, "mean", last).median("run")
    values = [
        f"{name} {format_number(float(medians.sel(condition=name)))}"
        for name in medians["condition"].values
    ]
    return f"{name_fitness(data, 'average')} at the end, median over runs: {', '.join(values)}."
