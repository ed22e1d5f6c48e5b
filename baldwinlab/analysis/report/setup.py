"""Setup of a study as rows of a table, and differences between the study and its paper."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping, Sequence
from contextlib import suppress
from itertools import product
from typing import Any, Final

import xarray as xr

from baldwinlab.analysis.claim_results import ClaimResult
from baldwinlab.analysis.report.content import count_runs, format_range, select_foragers
from baldwinlab.analysis.report.data import Experiments, ReportData
from baldwinlab.core.variables import GENERATION_COUNT
from baldwinlab.experiment import Experiment, ExperimentError
from baldwinlab.experiment.conditions import Factors, read_factors
from baldwinlab.experiment.paths import iterate_settings
from baldwinlab.papers import Paper, PaperError
from baldwinlab.papers.claims import OpenChoice
from baldwinlab.papers.design import read_design
from baldwinlab.papers.paper import STANDARD_VARIANT

# With more conditions, a report lists the learners and the maps instead of the conditions.
MAX_LISTED_CONDITIONS: Final = 12


def summarize_setup(
    data: xr.Dataset,
    conditions: Experiments,
    provenance: Mapping[str, Any],
    variants: Mapping[str, str],
) -> list[tuple[str, str]]:
    """Return the setup of a study, as pairs of a heading and a text.

    - `data`: the runs, with the dimensions (condition, run, generation, agent).
    - `provenance`: known facts about the study, such as its seed.
    - `variants`: variant of the paper by condition. Empty without a paper.

    Headings without a text are left out.
    """
    experiments = conditions.values()
    foragers = select_foragers(conditions)
    foraging = foragers.values()
    foraging_variants = [variants[name] for name in foragers if name in variants]
    models = ", ".join(dict.fromkeys(experiment.model for experiment in experiments))
    rows = [
        *describe_conditions(read_factors(data)),
        ("models", "" if models == "miniworld" else models),
        ("runs per condition", format_range(count_runs(data).values())),
        ("sample", provenance.get("sample", "")),
        ("incomplete runs", provenance.get("incomplete", "")),
        (
            "generations per run",
            format_range(experiment.evolution.generations for experiment in experiments),
        ),
        ("runs that stopped before", describe_stopped_runs(data, conditions)),
        (
            "time steps per lifetime",
            format_range(experiment.lifetime.steps for experiment in foraging),
        ),
        (
            "agents per population",
            format_range(experiment.population.size for experiment in experiments),
        ),
        ("fitness", describe_fitness(foraging)),
        ("variant of the paper", "; ".join(dict.fromkeys(foraging_variants))),
        ("seed", str(provenance.get("seed", data.attrs.get("seed", "unknown")))),
    ]
    return [(heading, text) for heading, text in rows if text]


def abridge_setup(data: xr.Dataset, conditions: Experiments) -> str:
    """Return the size of a study, such as "6 conditions; runs: 30; generations: 100"."""
    generations = format_range(
        experiment.evolution.generations for experiment in conditions.values()
    )
    n_conditions = len(conditions)
    noun = "conditions" if n_conditions > 1 else "condition"
    runs = format_range(count_runs(data).values())
    return f"{n_conditions} {noun}; runs: {runs}; generations: {generations}"


def describe_stopped_runs(data: xr.Dataset, conditions: Experiments) -> str:
    """Return sentences on the runs that stopped before the last generation, or ""."""
    if GENERATION_COUNT not in data.coords:
        return ""
    texts = []
    for name, experiment in conditions.items():
        counts = data[GENERATION_COUNT].sel(condition=name).values
        simulated = counts[counts > 0]  # A run that is not stored has the count 0.
        stopped = simulated[simulated < experiment.evolution.generations]
        if stopped.size:
            texts.append(
                f"{name}: {stopped.size} of {simulated.size}, after "
                f"{format_range(stopped.tolist())} generations"
            )
    if not texts:
        return ""
    return (
        f"{'; '.join(texts)}. In figures, tables and assays, a stopped run keeps the values of its "
        "last generation, and its last generations are counted back from there."
    )


def describe_conditions(factors: Mapping[str, Factors]) -> list[tuple[str, str]]:
    """Return rows (heading, text): all conditions, or the learners and maps of a large study."""
    learners = dict.fromkeys(condition.learner for condition in factors.values())
    maps = dict.fromkeys(condition.map for condition in factors.values())
    combinations = {(condition.learner, condition.map) for condition in factors.values()}
    has_all = combinations == {*product(learners, maps)}
    has_no_duplicate = len(factors) == len(learners) * len(maps)
    is_complete_design = has_all and has_no_duplicate and len(maps) > 1
    if len(factors) <= MAX_LISTED_CONDITIONS or not is_complete_design:
        return [("conditions", ", ".join(factors))]
    return [
        (
            "conditions",
            f"{len(factors)}: each of {len(learners)} learners on each of {len(maps)} maps",
        ),
        ("learners", ", ".join(learners)),
        ("maps", ", ".join(maps)),
    ]


def describe_fitness(foraging: Collection[Experiment]) -> str:
    """Return the definition and unit of fitness, or "" without food or MiniWorld conditions."""
    names = dict.fromkeys(experiment.evolution.fitness for experiment in foraging)
    phrases = [
        _describe_energy(
            experiment for experiment in foraging if experiment.evolution.fitness == "energy"
        )
    ]
    phrases += [f"evolution.fitness = {name!r}" for name in names if name != "energy"]
    return "; ".join(filter(None, phrases))


def _describe_energy(foraging: Iterable[Experiment]) -> str:
    """Return the definition and unit of the fitness `energy`."""
    energies = set[float]()
    has_costs = False
    for experiment in foraging:
        energies |= {region.energy for region in experiment.world.food}
        learning = experiment.learning
        has_costs |= learning.cost_per_step > 0 or learning.cost_per_change > 0
    if not energies:
        return ""
    costs = ", minus the cost of learning" if has_costs else ""
    values = " or ".join(f"{energy:g}" for energy in sorted(energies))
    is_count = energies == {1.0} and not has_costs
    count = ", so fitness is the number of eaten items" if is_count else ""
    return (
        f"energy of the items that an agent eats in its lifetime{costs}; "
        f"an item gives {values}{count}"
    )


def describe_variant(
    experiment: Experiment, paper: Paper, tuned_settings: Collection[str] = ()
) -> str:
    """Return the variant with the same settings (except tuned ones), or a phrase on differences."""
    differences = dict[str, list[str]]()
    for name in dict.fromkeys([STANDARD_VARIANT, *paper.names("variants")]):
        # A paper may lack the condition, and a variant may not apply to the condition.
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
    """Return open choices that may explain differing claims: (choice, values, ids of claims)."""
    claims_by_choice: dict[OpenChoice, list[str]] = {}
    for result in results:
        for choice in result.claim.choices:
            claims_by_choice.setdefault(choice, []).append(result.claim.id)
    return [
        (choice, format_setting(choice.field, conditions), names)
        for choice, names in claims_by_choice.items()
    ]


def format_setting(field: str, conditions: Experiments) -> str:
    """Return the values of a setting in the study, such as "40 or 60"; "" without values."""
    values = [
        dict(iterate_settings(experiment.to_dict())).get(field)
        for experiment in conditions.values()
    ]
    return " or ".join(dict.fromkeys(format_value(value) for value in values if value is not None))


def format_value(value: Any) -> str:
    """Return the value of a setting as text."""
    if isinstance(value, bool):
        return str(value).lower()
    return f"{value:.10g}" if isinstance(value, float) else str(value)


def describe_changed_settings(report: ReportData) -> list[str]:
    """Return a sentence for each difference between the study and the paper, if any."""
    paper = report.paper
    if paper is None:
        return []
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
