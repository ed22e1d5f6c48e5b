"""What the report says: from a study and its findings to the words and rows that the template lays out."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from itertools import product
from typing import Any

import xarray as xr

from baldwinlab.analysis.claims import ClaimResult, Finding
from baldwinlab.analysis.report import phrases
from baldwinlab.analysis.statistics import fitness
from baldwinlab.analysis.statistics.rules import HOLDS, VERDICTS
from baldwinlab.experiment import BaseExperiment, Experiment, ExperimentError
from baldwinlab.experiment.factors import Factors, of_study
from baldwinlab.experiment.toml import from_toml
from baldwinlab.papers import Paper, PaperError
from baldwinlab.papers.claims import Choice
from baldwinlab.papers.paper import STANDARD

Experiments = Mapping[str, Experiment]

MOST_NAMED = 12  # conditions, one after the other


def experiment_texts(dataset: xr.Dataset) -> dict[str, str]:
    """Each condition's experiment as TOML."""
    return {
        str(name): str(text)
        for name, text in zip(
            dataset["condition"].values, dataset["experiment"].values, strict=True
        )
    }


def experiments(texts: Mapping[str, str]) -> dict[str, Experiment]:
    """Each condition's experiment. Raises ExperimentError for one that cannot be."""
    return {
        name: from_toml(text, where=f"the experiment of {name}", lenient=True)
        for name, text in texts.items()
    }


def foragers(conditions: Mapping[str, BaseExperiment]) -> dict[str, Experiment]:
    """Those of MiniWorld: what has a world, senses and food."""
    return {
        name: experiment
        for name, experiment in conditions.items()
        if isinstance(experiment, Experiment)
    }


def shares(dataset: xr.Dataset, conditions: Mapping[str, BaseExperiment]) -> xr.Dataset:
    """Return the shares that the models of all conditions declare, as (condition, run, generation).

    `long_name` is the meaning of a share. The dataset is empty if the conditions declare different shares, and for MiniWorld.
    """
    found = [model.all_shares() for model in _other_models(conditions)]
    meanings = [{name: share.meaning for name, share in each.items()} for each in found]
    if len(found) < len(conditions) or any(each != meanings[0] for each in meanings):
        return xr.Dataset()
    named = {
        name: share.of(dataset).assign_attrs(long_name=share.meaning, valid_max=1.0)
        for name, share in found[0].items()
    }
    return xr.Dataset(named)


def clock(conditions: Mapping[str, BaseExperiment]) -> str:
    """The record by which all conditions count how often an agent asked its world; "" where they do not."""
    found = [model.clock for model in _other_models(conditions)]
    return found[0] if len(found) == len(conditions) and len({*found}) == 1 else ""


def _other_models(conditions: Mapping[str, BaseExperiment]) -> Iterator[Any]:
    """The models that are not MiniWorld and are loaded: a report needs no part."""
    models = (experiment.loaded_model for experiment in conditions.values())
    return (model for model in models if model is not None)


def run_counts(dataset: xr.Dataset) -> dict[str, int]:
    """The finished runs of each condition."""
    finished = fitness.best(dataset).notnull().any("generation").sum("run")
    return {
        str(name): int(count)
        for name, count in zip(dataset["condition"].values, finished.values, strict=True)
    }


def overview(
    dataset: xr.Dataset, conditions: Experiments, provenance: Mapping[str, Any], paper: Paper | None
) -> list[tuple[str, str]]:
    """What was run, as pairs of a heading and what it is."""
    settings, foraging = conditions.values(), foragers(conditions).values()
    found = [
        *named(of_study(dataset)),
        ("models", ", ".join(dict.fromkeys(experiment.model for experiment in settings))),
        ("independent runs", span(run_counts(dataset).values())),
        ("generations a run", span(experiment.evolution.generations for experiment in settings)),
        ("time steps a generation", span(experiment.lifetime.steps for experiment in foraging)),
        (
            "agents in a world" if foraging else "agents",
            span(experiment.population.size for experiment in settings),
        ),
        ("fitness", fitness_in_words(foraging)),
        (
            "variant of the paper",
            "; ".join(dict.fromkeys(describe_variant(one, paper) for one in foraging))
            if paper
            else "",
        ),
        ("seed", str(provenance.get("seed", dataset.attrs.get("seed", "not known")))),
    ]
    return [
        (heading, text)
        for heading, text in found
        if text and (heading, text) != ("models", "miniworld")
    ]


def named(factors: Mapping[str, Factors]) -> list[tuple[str, str]]:
    """The conditions; where they are many, and each learner lives on each map, learners and maps instead."""
    learners, maps = (
        dict.fromkeys(getattr(one, name) for one in factors.values()) for name in ("learner", "map")
    )
    whole = {(one.learner, one.map) for one in factors.values()} == {*product(learners, maps)}
    if (
        len(factors) <= MOST_NAMED
        or not whole
        or len(factors) != len(learners) * len(maps)
        or len(maps) < 2
    ):
        return [("conditions", ", ".join(factors))]
    return [
        (
            "conditions",
            f"{len(factors)}: each of {len(learners)} learners on each of {len(maps)} maps",
        ),
        ("learners", ", ".join(learners)),
        ("maps", ", ".join(maps)),
    ]


def fitness_in_words(foraging: Iterable[Experiment]) -> str:
    """What fitness is, in which unit, and what an item counts; nothing where nobody forages."""
    items, costs = set[float](), False
    for experiment in foraging:
        items |= {region.energy for region in experiment.world.food}
        costs |= experiment.learning.cost_per_step > 0 or experiment.learning.cost_per_change > 0
    if not items:
        return ""
    less = ", less what learning costs" if costs else ""
    gives = " or ".join(f"{energy:g}" for energy in sorted(items))
    same = ", so it is the number of items eaten" if items == {1.0} and not costs else ""
    return f"energy of the items that an agent eats in its life{less}; an item gives {gives}{same}"


def span(values: Iterable[int]) -> str:
    found = sorted(set(values))
    if not found:
        return ""
    return f"{found[0]:,}" if len(found) == 1 else f"{found[0]:,} to {found[-1]:,}"


def describe_variant(experiment: Experiment, paper: Paper) -> str:
    """The variant of the paper that an experiment follows, or how it departs from the standard one."""
    departures = dict[str, list[str]]()
    for name in dict.fromkeys([STANDARD, *paper.names("variants")]):
        with suppress(
            ExperimentError, PaperError
        ):  # not a condition of the paper, or not one that this variant can be laid over
            departures[name] = _changes(paper.experiment(experiment.name, name), experiment)
            if not departures[name]:
                return name
    if STANDARD not in departures:
        return f"{experiment.name} is an experiment of its own"
    return f"{experiment.name} is standard but for {', '.join(departures[STANDARD])}"


def _changes(base: Experiment, experiment: Experiment) -> list[str]:
    there, here = dict(_leaves(base.to_dict())), dict(_leaves(experiment.to_dict()))
    return [
        f"{path} = {toml_value(value)}"
        for path, value in here.items()
        if there.get(path) != value and not path.startswith("record.")
    ]


def _leaves(tree: Mapping[str, Any], path: str = "") -> Iterator[tuple[str, Any]]:
    for key, value in tree.items():
        if isinstance(value, dict):
            yield from _leaves(value, f"{path}{key}.")
        else:
            yield f"{path}{key}", value


def worlds(conditions: Experiments, factors: Mapping[str, Factors]) -> dict[str, str]:
    """The first condition of each different world, by a title: its map where that tells them apart, else its conditions."""
    names: dict[
        str, list[str]
    ] = {}  # by the world as text, for of other rules its table is of another class
    for name, experiment in conditions.items():
        alike = experiment.world.start.model_copy(
            update={"headings": "equal"}
        )  # a map shows where, not whereto
        names.setdefault(
            experiment.world.model_copy(update={"start": alike}).model_dump_json(), []
        ).append(name)
    maps = {
        world: sorted({factors[name].map for name in shared} - {""})
        for world, shared in names.items()
    }
    single = {found[0] for found in maps.values() if len(found) == 1}
    if len(single) == len(names):
        return {f"Map {found[0]}": names[world][0] for world, found in maps.items()}
    others = {
        world: f" and {len(shared) - 1} more" if len(shared) > 1 else ""
        for world, shared in names.items()
    }
    return {f"{shared[0]}{others[world]}": shared[0] for world, shared in names.items()}


def verdict_counts(results: Sequence[ClaimResult]) -> str:
    """Such as: 7 hold, 1 is undecided, 1 does not hold."""
    verbs = dict(zip(VERDICTS, (("holds", "hold"), ("is undecided", "are undecided"), ("does not hold", "do not hold"),
                                ("is not evaluated", "are not evaluated")), strict=True))  # fmt: skip
    counts = {verdict: sum(result.verdict == verdict for result in results) for verdict in VERDICTS}
    return ", ".join(
        f"{count} {verbs[verdict][count > 1]}" for verdict, count in counts.items() if count
    )


def shown(result: ClaimResult) -> list[Finding]:
    """The weakest finding under each of the claim's rules."""
    rules = dict.fromkeys(finding.comparison.rule for finding in result.findings)
    parts = [
        tuple(finding for finding in result.findings if finding.comparison.rule == rule)
        for rule in rules
    ]
    weakest = [ClaimResult(result.claim, part, ()).deciding for part in parts]
    return [finding for finding in weakest if finding]


def differing(results: Sequence[ClaimResult]) -> list[ClaimResult]:
    """The claims that were evaluated and do not come out as in the paper, in their verdict or in their size."""
    return [
        result
        for result in results
        if result.findings and (result.verdict != HOLDS or not phrases.agrees(result))
    ]


def open_choices(
    results: Sequence[ClaimResult], conditions: Experiments
) -> list[tuple[Choice, str, list[str]]]:
    """What the paper leaves open and could account for how these claims come out: the choice, what it is here, the claims."""
    claims_of: dict[Choice, list[str]] = {}
    for result in results:
        for choice in result.claim.choices:
            claims_of.setdefault(choice, []).append(result.claim.id)
    return [
        (choice, setting(choice.field, conditions), names) for choice, names in claims_of.items()
    ]


def setting(field: str, conditions: Experiments) -> str:
    """What a field, such as senses.visual_radius, is in the study's experiments."""
    found = [dict(_leaves(experiment.to_dict())).get(field) for experiment in conditions.values()]
    return " or ".join(dict.fromkeys(toml_value(value) for value in found if value is not None))


def toml_value(value: Any) -> str:
    return (
        str(value).lower()
        if isinstance(value, bool)
        else f"{value:g}"
        if isinstance(value, float)
        else str(value)
    )


def departures(dataset: xr.Dataset, conditions: Experiments, paper: Paper) -> list[str]:
    """What sets this study apart from the paper's, before any open choice."""
    own = paper.own()
    found = [
        describe_variant(experiment, paper)
        for name, experiment in foragers(conditions).items()
        if name in own
    ]
    sentences = [f"{text}." for text in dict.fromkeys(found) if " " in text]
    named = [text for text in dict.fromkeys(found) if " " not in text and text != "standard"]
    sentences += [f"The variant is {name}: {paper.describe('variants', name)}." for name in named]
    counts = run_counts(dataset)
    if max(counts.values()) < paper.about.runs:
        sentences.append(
            f"There are {span(counts.values())} runs, where the paper has {paper.about.runs}: intervals are wider."
        )
    return sentences


def timing(provenance: Mapping[str, Any]) -> str:
    """How long the study took, as far as it is known."""
    parts = []
    if seconds := provenance.get("seconds"):
        parts.append(f"{phrases.number(seconds)} s")
        if steps := provenance.get("agent_steps"):
            parts[0] = (
                f"{steps:,} agent-steps in {parts[0]} ({steps / seconds / 1e6:,.1f} million a second)"
            )
    if workers := provenance.get("workers"):
        counts = workers if isinstance(workers, list) else [workers]
        parts.append(f"workers: {', '.join(str(count) for count in counts)}")
    if provenance.get("compile_seconds") is not None:
        parts.append(f"compiling: {phrases.number(provenance['compile_seconds'])} s")
    return "; ".join(parts)
