"""The questions on the Baldwin effect, and the estimand that answers each question.

An estimand has one value per run. 0 means no effect, and a value above 0 means yes.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Final, Literal, NamedTuple

import xarray as xr

from baldwinlab.analysis.assays.evaluation import drop_labels
from baldwinlab.analysis.assays.fork import compute_effects, name_quantity
from baldwinlab.analysis.estimands.expected_offspring import SCHEMES
from baldwinlab.analysis.estimands.quantitative_genetics import (
    average_difference,
    compute_differentials,
    is_sign_informative,
)
from baldwinlab.analysis.estimands.traits import (
    INNATE_FITNESS,
    Trait,
    describe_learned_distance,
    measure_foraging_times,
    measure_log_fall,
    read_record,
    select_innate_trait,
)
from baldwinlab.analysis.results.numbers import format_percentage
from baldwinlab.analysis.results.verdicts import EQUAL
from baldwinlab.experiment import BaseExperiment, Experiment

Measurability = Literal[
    "impossible", "by design: cannot rise", "not measurable", "equal in every run", "measured"
]
IMPOSSIBLE: Final[Measurability] = "impossible"
CANNOT_RISE: Final[Measurability] = "by design: cannot rise"
NOT_MEASURABLE: Final[Measurability] = "not measurable"
MEASURED: Final[Measurability] = "measured"
# Bounds of equivalence, fixed before any result is known.
DIFFERENCE_BOUND: Final = 0.01  # Standard deviations per generation.
LOG_BOUND: Final = 0.05  # Logarithm of a ratio, about 5 %.
FORK_BOUND: Final = 0.02  # Fraction of the innate fitness of the better genomes.
# Smallest share of agents above the lowest fitness, in both compared groups together.
MIN_SHARE_ABOVE_FLOOR: Final = 0.05
LOG_RATIO: Final = "log ratio"
STANDARD_DEVIATIONS: Final = "standard deviations per generation"
RELATIVE_INNATE_FITNESS: Final = "relative innate fitness"


@dataclass(frozen=True)
class Estimate:
    """An estimand of a condition, with one value per run.

    Attributes
    ----------
    measurability : str
        "impossible": the construction of the experiment determines the answer.
        "by design: cannot rise": the construction excludes a value above 0.
        "not measurable": the stored data or the scale cannot show an effect.
        "equal in every run": the value is exactly 0 in every run, so there is no test.
        "measured": the values are defined.
    reason : str
        Reason for the measurability, or the definition of the values, in one sentence.
    trait : str
        Trait or measure on which the question is answered.
    unit : str
        Unit of the values.
    values : xr.DataArray or None
        Values (run). 0 means no effect, and a value above 0 means yes. NaN marks a run in which
        the value is undefined. None unless `measurability` is "measured".
    equivalence_bound : float
        Largest absolute effect that counts as equivalent to no effect, in the unit of the values.
    question : str
        Name of the question, for example "assimilation".
    terms : mapping of str to xr.DataArray
        The measured quantities (run) whose difference is the value, by name, in the same unit. A
        quantity that is shown for comparison alone is also a term.
    """

    measurability: Measurability
    reason: str
    trait: str = ""
    unit: str = "1"
    values: xr.DataArray | None = None
    equivalence_bound: float = 0.0
    question: str = ""
    terms: Mapping[str, xr.DataArray] = field(default_factory=dict)


class ConditionData(NamedTuple):
    """Stored data of one condition that evolves and learns."""

    runs: xr.Dataset  # With the dimensions (run, generation, agent).
    assays: Mapping[str, xr.Dataset]  # Stored assays by name.
    experiment: BaseExperiment
    last: int  # Number of generations in the first and the last window.


class Estimand(NamedTuple):
    """A question with the function that answers it.

    Attributes
    ----------
    question : str
        Name of the question.
    text : str
        The question. A value above 0 means yes.
    statement : str
        The answer "yes" as a statement.
    opposite : str
        Meaning of a value below 0.
    measure : callable
        Function that returns the `Estimate` of a condition from the `ConditionData`.
    """

    question: str
    text: str
    statement: str
    opposite: str
    measure: Callable[[ConditionData], Estimate]


def _missing_assay(name: str) -> Estimate:
    return Estimate(NOT_MEASURABLE, f"The assay {name} is not stored.")


def _measure_selection(data: ConditionData) -> Estimate:
    if "innate" not in data.assays:
        return _missing_assay("innate")
    innate = data.assays["innate"]
    scheme = data.experiment.evolution.selection
    if scheme not in SCHEMES:
        reason = f"The expected number of offspring under the selection {scheme} is not known."
        return Estimate(NOT_MEASURABLE, reason)
    trait = select_innate_trait(data.runs, innate, data.experiment)
    if not is_sign_informative(data.experiment, trait.name == INNATE_FITNESS):
        reason = (
            "Selection by ranks gives innate fitness the largest possible S_off, so S_on cannot be "
            "larger."
        )
        return Estimate(CANNOT_RISE, reason, trait.name)
    differentials = compute_differentials(innate, trait.values, data.experiment)
    return Estimate(
        MEASURED,
        "S_on - S_off: selection differential with learning minus that without, mean over "
        "generations.",
        trait.name,
        STANDARD_DEVIATIONS,
        average_difference(differentials),
        DIFFERENCE_BOUND,
    )


def _measure_fork(data: ConditionData, effect: str, definition: str) -> Estimate:
    if "fork" not in data.assays:
        return _missing_assay("fork")
    fork = data.assays["fork"].isel(generation=[-1])  # The list keeps the dimension.
    innate_fitness = fork["innate_fitness"]
    without_learning = innate_fitness.sel(regime="off", generation=fork["generation"][0])
    compared = without_learning if effect == "history" else innate_fitness
    floor = float(innate_fitness.min())
    share = float((compared > floor).mean())
    if share < MIN_SHARE_ABOVE_FLOOR:
        reason = (
            f"{format_percentage(share)} of the agents of both groups are above the lowest innate "
            f"fitness, {floor:g}, and {format_percentage(MIN_SHARE_ABOVE_FLOOR)} are needed."
        )
        return Estimate(NOT_MEASURABLE, reason)
    effects = compute_effects(fork)[name_quantity(effect, "innate_fitness")].isel(generation=0)
    # With the larger mean of both histories as the unit, the mean effect of the history is between
    # -1 and 1 for fitness of at least 0.
    scale = abs(without_learning.mean(("run", "agent"))).max()
    values = effects / scale.where(scale > 0)
    return Estimate(MEASURED, definition, RELATIVE_INNATE_FITNESS, "1", values, FORK_BOUND)


def _measure_assimilation(data: ConditionData) -> Estimate:
    model = data.experiment.loaded_model
    if model is not None and model.assimilation_obstacle:
        return Estimate(IMPOSSIBLE, model.assimilation_obstacle)
    if data.experiment.evolution.lamarckian_share > 0:
        return Estimate(IMPOSSIBLE, "Children inherit what their parents have learned.")
    if "assimilation" not in data.assays:
        return _missing_assay("assimilation")
    distance = data.assays["assimilation"]["distance"]
    if not bool(distance.notnull().any()):
        return Estimate(NOT_MEASURABLE, "The model records no distance that learning covers.")
    falls = measure_log_fall(distance, data.last)
    terms = {name: falls.sel(history=name, drop=True) for name in falls["history"].values.tolist()}
    return Estimate(
        MEASURED,
        "log(d_first / d_last) of learners minus that of control genomes, which evolved without "
        "learning and are tested with learning.",
        describe_learned_distance(data.experiment),
        LOG_RATIO,
        terms["learner"] - terms["control"],
        LOG_BOUND,
        terms=terms,
    )


def _measure_savings(data: ConditionData) -> Estimate:
    times = _select_learning_times(data)
    if times is None and isinstance(data.experiment, Experiment):
        return _missing_assay("within-life")
    if times is None:
        return Estimate(NOT_MEASURABLE, "The model records no performance within life.")
    return Estimate(
        MEASURED,
        "log(t_first / t_last): fall of the learning time, with the lifetime as the time of an "
        "agent that does not reach its goal.",
        times.name,
        LOG_RATIO,
        measure_log_fall(times.values, data.last),
        LOG_BOUND,
    )


def _select_learning_times(data: ConditionData) -> Trait | None:
    """Return mean learning times (run, generation), or None if none is stored."""
    model = data.experiment.loaded_model
    if model is not None and model.learning_time:
        times_of_agents = read_record(data.runs, model, model.learning_time)
        return times_of_agents._replace(values=times_of_agents.values.mean("agent"))
    if "within-life" not in data.assays:
        return None
    name = "steps until 90 % of the final performance"
    times = measure_foraging_times(data.assays["within-life"], data.experiment.steps)
    return Trait(name, "steps", times)


ESTIMANDS: Final = (
    Estimand(
        "fork-history",
        "Has evolution with learning led to genomes from which innate fitness is higher?",
        "Evolution with learning leads to genomes of higher innate fitness",
        "It has led to genomes from which innate fitness is lower.",
        partial(
            _measure_fork,
            effect="history",
            definition="Innate fitness of learners' genomes minus that of the control's, both "
            "after the same further generations without learning.",
        ),
    ),
    Estimand(
        "fork-regime",
        "Does learning raise innate fitness in the next generations?",
        "Learning raises innate fitness in the next generations",
        "Learning lowers innate fitness in the next generations.",
        partial(
            _measure_fork,
            effect="regime",
            definition="Innate fitness after further generations with learning minus that after "
            "as many without, mean over the genomes of learners and of the control.",
        ),
    ),
    Estimand(
        "selection-by-learning",
        "Does learning strengthen selection on an innate trait?",
        "Learning strengthens selection on the innate trait",
        "Learning hides innate differences from selection.",
        _measure_selection,
    ),
    Estimand(
        "assimilation",
        "Does the distance that agents learn fall more than in evolution without learning?",
        "Learned behavior becomes innate",
        "It falls less, or grows more, than in evolution without learning.",
        _measure_assimilation,
    ),
    Estimand(
        "savings",
        "Do agents reach their final performance earlier in life over the generations?",
        "Later generations learn faster",
        "They reach it later.",
        _measure_savings,
    ),
)
"""All questions, in the order of tables."""
QUESTIONS: Final = tuple(estimand.question for estimand in ESTIMANDS)


def estimate(
    data: xr.Dataset, assays: Mapping[str, xr.Dataset], experiment: BaseExperiment, last: int
) -> list[Estimate]:
    """Estimate every question for one condition that evolves and learns.

    Parameters
    ----------
    data : xr.Dataset
        The runs of the condition, with the dimensions (run, generation, agent).
    assays : mapping of str to xr.Dataset
        Stored assays of the condition by name.
    experiment : BaseExperiment
        Experiment of the condition.
    last : int
        Number of generations in the first and the last window.

    Returns
    -------
    list of Estimate
        One estimate per question, in the order of `QUESTIONS`.
    """
    condition = ConditionData(data, assays, experiment, last)
    return [_answer(estimand, condition) for estimand in ESTIMANDS]


def _answer(estimand: Estimand, data: ConditionData) -> Estimate:
    if data.experiment.evolution.inheritance == "none":
        result = Estimate(IMPOSSIBLE, "Genomes are not inherited.")
    elif data.experiment.population.species:
        result = Estimate(NOT_MEASURABLE, "The agents of a generation belong to several species.")
    else:
        result = estimand.measure(data)
    return classify(replace(result, question=estimand.question))


def classify(result: Estimate) -> Estimate:
    """Return a measured estimate in its class, which depends on the values; else the estimate."""
    if result.values is None:
        return result
    values = drop_labels(result.values)
    if not bool(values.notnull().any()):
        reason = (
            f"In every run, the values are undefined, because {result.trait!r} is constant or 0."
        )
        return replace(result, measurability=NOT_MEASURABLE, reason=reason, values=None)
    if bool((values.fillna(0) == 0).all()):
        reason = "The value is exactly 0 in every run."
        return replace(result, measurability=EQUAL, reason=reason, values=None)
    return replace(result, values=values)
