"""Text and table rows of a report, computed from a study and its findings."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from itertools import product
from pathlib import Path
from typing import Any, Final

import xarray as xr

from baldwinlab.analysis import figures
from baldwinlab.analysis.claims import ClaimResult, Finding, ModelMeasure
from baldwinlab.analysis.report import phrases
from baldwinlab.analysis.statistics import fitness
from baldwinlab.analysis.statistics.contrasts import Contrasts
from baldwinlab.analysis.statistics.rules import HOLDS, VERDICTS, Verdict
from baldwinlab.experiment import BaseExperiment, Experiment, ExperimentError
from baldwinlab.experiment.factors import Factors, of_study
from baldwinlab.experiment.toml import from_toml
from baldwinlab.papers import Paper, PaperError
from baldwinlab.papers.claims import Choice
from baldwinlab.papers.paper import STANDARD

Experiments = Mapping[str, Experiment]
# Appearances of MiniWorld conditions whose parts are installed.
Looks = Mapping[str, figures.Look]

# Above this number of conditions, a report lists learners and maps instead of conditions.
MOST_LISTED: Final = 12
# Singular and plural of each verdict.
VERBS: Final = (
    ("holds", "hold"),
    ("is undecided", "are undecided"),
    ("does not hold", "do not hold"),
    ("is not evaluated", "are not evaluated"),
)


@dataclass(frozen=True)
class ReportData:
    """A study and its results, from which a report is drawn.

    Parameters
    ----------
    directory : Path
        Directory of the study. Figures are written to its folder `figures`.
    data : xr.Dataset
        The runs, with the dimensions (condition, run, generation, agent).
    experiments : mapping of str to Experiment
        Experiments by condition.
    results : sequence of ClaimResult
        The evaluated claims.
    traces : sequence of xr.Dataset
        Lifetimes of one population at `emergence_generations`, or none.
    provenance : mapping of str to Any
        Known facts: seed, versions, platform, seconds, agent_steps, workers, compile_seconds.
    last : int
        Number of final generations to average in each run.
    paper : Paper or None
        The paper of the claims. Without a paper, the report mentions none.
    looks : mapping of str to Look
        Appearances of MiniWorld conditions whose parts are installed.
    contrasts : Contrasts or None
        The comparisons of the conditions.
    model_measures : sequence of ModelMeasure
        Measures of the models that claims compare.
    is_reproduction : bool
        Whether `paper` defines the study.
    """

    directory: Path
    data: xr.Dataset
    experiments: Experiments
    results: Sequence[ClaimResult] = ()
    traces: Sequence[xr.Dataset] = ()
    provenance: Mapping[str, Any] = field(default_factory=dict)
    last: int = 10
    paper: Paper | None = None
    looks: Looks = field(default_factory=dict)
    contrasts: Contrasts | None = None
    model_measures: Sequence[ModelMeasure] = ()
    is_reproduction: bool = False


def experiment_texts(data: xr.Dataset) -> dict[str, str]:
    """Return the experiment of each condition as TOML."""
    pairs = zip(data["condition"].values, data["experiment"].values, strict=True)
    return {str(name): str(text) for name, text in pairs}


def parse_experiments(texts: Mapping[str, str]) -> dict[str, Experiment]:
    """Return the experiment of each condition.

    Parameters
    ----------
    texts : mapping of str to str
        TOML by condition.

    Returns
    -------
    dict of str to Experiment
        Experiments by condition.

    Raises
    ------
    ExperimentError
        A text is not a valid experiment.
    """
    return {
        name: from_toml(text, where=f"the experiment of {name}", lenient=True)
        for name, text in texts.items()
    }


def select_foragers(conditions: Mapping[str, BaseExperiment]) -> dict[str, Experiment]:
    """Return the conditions of the MiniWorld model, which have a map, senses and food."""
    return {
        name: experiment
        for name, experiment in conditions.items()
        if isinstance(experiment, Experiment)
    }


def compute_shares(data: xr.Dataset, conditions: Mapping[str, BaseExperiment]) -> xr.Dataset:
    """Return the composition of each generation, such as the shares of alleles.

    Parameters
    ----------
    data : xr.Dataset
        The runs, with the dimensions (condition, run, generation, agent).
    conditions : mapping of str to BaseExperiment
        Experiments by condition.

    Returns
    -------
    xr.Dataset
        Shares with the dimensions (condition, run, generation) and their meaning as `long_name`.
        Empty unless all conditions have models that define the same shares.
    """
    shares = [model.all_shares() for model in _loaded_models(conditions)]
    meanings = [
        {name: share.meaning for name, share in model_shares.items()} for model_shares in shares
    ]
    if len(shares) < len(conditions) or any(meaning != meanings[0] for meaning in meanings):
        return xr.Dataset()
    return xr.Dataset(
        {
            name: share.of(data).assign_attrs(long_name=share.meaning, valid_max=1.0)
            for name, share in shares[0].items()
        }
    )


def find_clock(conditions: Mapping[str, BaseExperiment]) -> str:
    """Return the variable that counts evaluations, or "" if the conditions do not share one."""
    clocks = [model.clock for model in _loaded_models(conditions)]
    is_shared = len(clocks) == len(conditions) and len({*clocks}) == 1
    return clocks[0] if is_shared else ""


def _loaded_models(conditions: Mapping[str, BaseExperiment]) -> Iterator[Any]:
    """Yield the loaded models other than MiniWorld. A report needs no parts."""
    models = (experiment.loaded_model for experiment in conditions.values())
    return (model for model in models if model is not None)


def count_runs(data: xr.Dataset) -> dict[str, int]:
    """Return the number of finished runs of each condition."""
    counts = fitness.best(data).notnull().any("generation").sum("run")
    pairs = zip(data["condition"].values, counts.values, strict=True)
    return {str(name): int(count) for name, count in pairs}


def summarize_setup(
    data: xr.Dataset, conditions: Experiments, provenance: Mapping[str, Any], paper: Paper | None
) -> list[tuple[str, str]]:
    """Return what was run, as pairs of a heading and a text.

    Parameters
    ----------
    data : xr.Dataset
        The runs, with the dimensions (condition, run, generation, agent).
    conditions : mapping of str to Experiment
        Experiments by condition.
    provenance : mapping of str to Any
        Known facts about the study, such as its seed.
    paper : Paper or None
        The paper whose variant is named.

    Returns
    -------
    list of (str, str)
        Headings and texts. Headings without a text are left out.
    """
    experiments = conditions.values()
    foraging = select_foragers(conditions).values()
    variants = [describe_variant(experiment, paper) for experiment in foraging] if paper else []
    models = ", ".join(dict.fromkeys(experiment.model for experiment in experiments))
    rows = [
        *describe_conditions(of_study(data)),
        ("models", "" if models == "miniworld" else models),
        ("runs per condition", format_range(count_runs(data).values())),
        (
            "generations per run",
            format_range(experiment.evolution.generations for experiment in experiments),
        ),
        (
            "time steps per lifetime",
            format_range(experiment.lifetime.steps for experiment in foraging),
        ),
        (
            "agents per population",
            format_range(experiment.population.size for experiment in experiments),
        ),
        ("fitness", describe_fitness(foraging)),
        ("variant of the paper", "; ".join(dict.fromkeys(variants))),
        ("seed", str(provenance.get("seed", data.attrs.get("seed", "unknown")))),
    ]
    return [(heading, text) for heading, text in rows if text]


def describe_conditions(factors: Mapping[str, Factors]) -> list[tuple[str, str]]:
    """Return the conditions as pairs of a heading and a text.

    Parameters
    ----------
    factors : mapping of str to Factors
        Factors by condition.

    Returns
    -------
    list of (str, str)
        All conditions, or learners and maps if many conditions combine each learner with each map.
    """
    learners = dict.fromkeys(condition.learner for condition in factors.values())
    maps = dict.fromkeys(condition.map for condition in factors.values())
    combinations = {(condition.learner, condition.map) for condition in factors.values()}
    is_complete = combinations == {*product(learners, maps)}
    is_complete = is_complete and len(factors) == len(learners) * len(maps)
    if len(factors) <= MOST_LISTED or not is_complete or len(maps) < 2:
        return [("conditions", ", ".join(factors))]
    return [
        (
            "conditions",
            f"{len(factors)}: each of {len(learners)} learners on each of {len(maps)} maps",
        ),
        ("learners", ", ".join(learners)),
        ("maps", ", ".join(maps)),
    ]


def describe_fitness(foraging: Iterable[Experiment]) -> str:
    """Return the definition and unit of fitness.

    Parameters
    ----------
    foraging : iterable of Experiment
        Experiments of the MiniWorld model.

    Returns
    -------
    str
        A phrase, or "" if there is no such experiment.
    """
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
    return f"energy of the items that an agent eats in its lifetime{costs}; an item gives {values}{count}"


def format_range(values: Iterable[int]) -> str:
    """Return the smallest and the largest value, for example ``8 to 30``."""
    distinct = sorted(set(values))
    if not distinct:
        return ""
    if len(distinct) == 1:
        return f"{distinct[0]:,}"
    return f"{distinct[0]:,} to {distinct[-1]:,}"


def describe_variant(experiment: Experiment, paper: Paper) -> str:
    """Return the variant of the paper that an experiment follows.

    Parameters
    ----------
    experiment : Experiment
        An experiment of the MiniWorld model.
    paper : Paper
        The paper.

    Returns
    -------
    str
        The name of the variant, or a phrase with all differences from the standard one.
    """
    differences = dict[str, list[str]]()
    for name in dict.fromkeys([STANDARD, *paper.names("variants")]):
        # The paper may lack the condition, or the variant may not apply to it.
        with suppress(ExperimentError, PaperError):
            differences[name] = _list_changes(paper.experiment(experiment.name, name), experiment)
            if not differences[name]:
                return name
    if STANDARD not in differences:
        return f"{experiment.name} is not a condition of the paper"
    return f"{experiment.name} is standard except for {', '.join(differences[STANDARD])}"


def _list_changes(base: Experiment, experiment: Experiment) -> list[str]:
    base_settings = dict(_iterate_settings(base.to_dict()))
    settings = dict(_iterate_settings(experiment.to_dict()))
    return [
        f"{path} = {format_value(value)}"
        for path, value in settings.items()
        if base_settings.get(path) != value and not path.startswith("record.")
    ]


def _iterate_settings(tree: Mapping[str, Any], path: str = "") -> Iterator[tuple[str, Any]]:
    """Yield the path and value of every setting."""
    for key, value in tree.items():
        if isinstance(value, dict):
            yield from _iterate_settings(value, f"{path}{key}.")
        else:
            yield f"{path}{key}", value


def title_worlds(conditions: Experiments, factors: Mapping[str, Factors]) -> dict[str, str]:
    """Return the first condition of each distinct world.

    Parameters
    ----------
    conditions : mapping of str to Experiment
        Experiments by condition.
    factors : mapping of str to Factors
        Factors by condition.

    Returns
    -------
    dict of str to str
        Conditions by a title: the map if each world has its own, else the conditions.
    """
    names: dict[str, list[str]] = {}
    for name, experiment in conditions.items():
        names.setdefault(_world_key(experiment), []).append(name)
    maps = {
        world: sorted({factors[name].map for name in shared} - {""})
        for world, shared in names.items()
    }
    unique_maps = {world_maps[0] for world_maps in maps.values() if len(world_maps) == 1}
    if len(unique_maps) == len(names):
        return {f"Map {world_maps[0]}": names[world][0] for world, world_maps in maps.items()}
    titles = {}
    for shared in names.values():
        more = f" and {len(shared) - 1} more" if len(shared) > 1 else ""
        titles[f"{shared[0]}{more}"] = shared[0]
    return titles


def _world_key(experiment: Experiment) -> str:
    """Return a world as text. A map shows positions, so headings do not distinguish worlds."""
    start = experiment.world.start.model_copy(update={"headings": "equal"})
    # Worlds with other features have other classes, so equal worlds are compared as text.
    return experiment.world.model_copy(update={"start": start}).model_dump_json()


def describe_verdicts(results: Sequence[ClaimResult]) -> str:
    """Return the number of claims by verdict, such as "7 hold, 1 is undecided"."""
    phrases = []
    for verdict, (singular, plural) in zip(VERDICTS, VERBS, strict=True):
        count = _count(results, verdict)
        if count:
            phrases.append(f"{count} {plural if count > 1 else singular}")
    return ", ".join(phrases)


def _count(results: Sequence[ClaimResult], verdict: Verdict) -> int:
    return sum(result.verdict == verdict for result in results)


def weakest_findings(result: ClaimResult) -> list[Finding]:
    """Return the weakest finding under each rule of a claim."""
    rules = dict.fromkeys(finding.comparison.rule for finding in result.findings)
    parts = [
        tuple(finding for finding in result.findings if finding.comparison.rule == rule)
        for rule in rules
    ]
    weakest = [ClaimResult(result.claim, part, ()).deciding for part in parts]
    return [finding for finding in weakest if finding]


def differing_claims(results: Sequence[ClaimResult]) -> list[ClaimResult]:
    """Return the evaluated claims whose verdict or effect size differs from the paper."""
    return [
        result
        for result in results
        if result.findings and (result.verdict != HOLDS or not phrases.agrees_with_paper(result))
    ]


def relevant_choices(
    results: Sequence[ClaimResult], conditions: Experiments
) -> list[tuple[Choice, str, list[str]]]:
    """Return the open choices of the paper that may explain these claims.

    Parameters
    ----------
    results : sequence of ClaimResult
        The claims that differ from the paper.
    conditions : mapping of str to Experiment
        Experiments by condition.

    Returns
    -------
    list of (Choice, str, list of str)
        Each choice with its value in the study and the identifiers of the claims.
    """
    claims_of: dict[Choice, list[str]] = {}
    for result in results:
        for choice in result.claim.choices:
            claims_of.setdefault(choice, []).append(result.claim.id)
    return [
        (choice, format_setting(choice.field, conditions), names)
        for choice, names in claims_of.items()
    ]


def format_setting(field: str, conditions: Experiments) -> str:
    """Return the values of a setting, such as senses.visual_radius, in the study."""
    values = [
        dict(_iterate_settings(experiment.to_dict())).get(field)
        for experiment in conditions.values()
    ]
    return " or ".join(dict.fromkeys(format_value(value) for value in values if value is not None))


def format_value(value: Any) -> str:
    """Return the value of a setting as text."""
    if isinstance(value, bool):
        return str(value).lower()
    return f"{value:g}" if isinstance(value, float) else str(value)


def changed_settings(data: xr.Dataset, conditions: Experiments, paper: Paper) -> list[str]:
    """Return a sentence for each difference between the study and the paper.

    Parameters
    ----------
    data : xr.Dataset
        The runs, with the dimensions (condition, run, generation, agent).
    conditions : mapping of str to Experiment
        Experiments by condition.
    paper : Paper
        The paper.

    Returns
    -------
    list of str
        Sentences on changed settings, on the variant and on the number of runs.
    """
    declared = paper.own()
    variants = [
        describe_variant(experiment, paper)
        for name, experiment in select_foragers(conditions).items()
        if name in declared
    ]
    sentences = [f"{variant}." for variant in dict.fromkeys(variants) if " " in variant]
    for variant in dict.fromkeys(variants):
        if " " not in variant and variant != STANDARD:
            description = paper.describe("variants", variant)
            sentences.append(f"The variant is {variant}: {description}.")
    counts = count_runs(data)
    if max(counts.values()) < paper.about.runs:
        sentences.append(
            f"This study has {format_range(counts.values())} runs per condition, and the paper "
            f"has {paper.about.runs}. Its intervals are therefore wider."
        )
    return sentences


def format_timing(provenance: Mapping[str, Any]) -> str:
    """Return the run time of the study, the number of workers and the compile time, if known."""
    parts = []
    if seconds := provenance.get("seconds"):
        time = f"{phrases.format_number(seconds)} s"
        if steps := provenance.get("agent_steps"):
            rate = steps / seconds / 1e6
            time = f"{steps:,} agent-steps in {time} ({rate:,.1f} million per second)"
        parts.append(time)
    if workers := provenance.get("workers"):
        counts = workers if isinstance(workers, list) else [workers]
        parts.append(f"workers: {', '.join(str(count) for count in counts)}")
    if provenance.get("compile_seconds") is not None:
        parts.append(f"compilation: {phrases.format_number(provenance['compile_seconds'])} s")
    return "; ".join(parts)
