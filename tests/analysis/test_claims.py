"""Each claim on studies that bear it out, contradict it, and say nothing."""

from __future__ import annotations

import csv
import json
import math
import shutil
import warnings
from collections.abc import Mapping, Sequence
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
import xarray as xr
from scipy import stats

from baldwinlab.analysis.claim_results import ClaimResult
from baldwinlab.analysis.claims import claim_records, evaluate_claims, write_statistics
from baldwinlab.analysis.results.verdicts import Verdict, combine_verdicts
from baldwinlab.experiment import Experiment
from baldwinlab.papers import load
from baldwinlab.papers.claims import ClaimComparison
from baldwinlab.papers.paper import Paper, open_paper
from baldwinlab.papers.presets import paper
from baldwinlab.parts import Measure
from tests.analysis.results.studies import AS_THE_PAPER, RUNS, Claims, compare_conditions, study

Eaten = Mapping[str, Sequence[float]]


# Several tests evaluate the same studies.
@cache
def _evaluate(
    eaten: tuple[tuple[str, tuple[float, ...]], ...], options: tuple[tuple[str, Any], ...]
) -> list[ClaimResult]:
    return evaluate_claims(study(dict(eaten), **dict(options)), last=5)


def evaluate(eaten: Eaten, **options: Any) -> list[ClaimResult]:
    items = tuple((name, tuple(values)) for name, values in eaten.items())
    return _evaluate(items, tuple(options.items()))


def verdicts(eaten: Eaten, **options: Any) -> dict[str, Verdict]:
    return {result.claim.id: result.verdict for result in evaluate(eaten, **options)}


def evaluate_claim(name: str, eaten: Eaten, **options: Any) -> ClaimResult:
    return next(result for result in evaluate(eaten, **options) if result.claim.id == name)


def swapped(first: str, second: str) -> Eaten:
    return {**AS_THE_PAPER, first: AS_THE_PAPER[second], second: AS_THE_PAPER[first]}


def test_every_claim_holds_for_the_results_of_the_paper() -> None:
    assert verdicts(AS_THE_PAPER, hungry=6) == dict.fromkeys(
        (f"C{number}" for number in range(1, 10)), "holds"
    )


@pytest.mark.parametrize(
    ("name", "first", "second"),
    [
        ("C1", "evo+self-taught/A", "evo/A"),
        ("C2", "evo+self-taught/A", "evo/A"),
        ("C3", "evo/B", "self-taught/B"),
        ("C4", "evo+self-taught/B", "evo/B"),
        ("C5", "evo+self-taught/B", "self-taught/B"),
        ("C6", "self-taught/A", "evo/A"),
        ("C7", "self-taught/B", "evo/B"),
        ("C8", "self-taught/A", "self-taught/B"),
    ],
)
def test_a_claim_does_not_hold_for_the_opposite_results(name: str, first: str, second: str) -> None:
    assert verdicts(swapped(first, second))[name] == "does not hold"


def test_equal_conditions_decide_only_claims_of_no_difference() -> None:
    alike = {name: range(RUNS) for name in AS_THE_PAPER}
    assert set(verdicts(alike, hungry=0).values()) == {"undecided", "does not hold"}
    assert verdicts(alike, hungry=0)["C3"] == "does not hold"


def test_emergence_needs_both_a_rise_and_nearly_all() -> None:
    # All ate from the first generation on.
    assert verdicts(AS_THE_PAPER, hungry=0)["C9"] == "undecided"
    few = study(AS_THE_PAPER)
    late = {"condition": "evo+self-taught/B", "agent": slice(0, 2), "generation": slice(6, None)}
    few["food_eaten"].loc[late] = 0
    emergence = evaluate_claims(few, last=5)[8]
    assert [finding.verdict for finding in emergence.findings] == ["holds", "does not hold"]
    assert emergence.verdict == "does not hold"
    assert emergence.record()["effect"] == 0.7
    # Emergence fails where the share falls.
    falling = study(AS_THE_PAPER, hungry=0)
    falling["food_eaten"].loc[
        {"condition": "evo+self-taught/B", "agent": 0, "generation": slice(6, None)}
    ] = 0
    assert [finding.verdict for finding in evaluate_claims(falling, last=5)[8].findings] == [
        "does not hold",
        "holds",
    ]


def test_a_single_item_refutes_that_evo_never_eats() -> None:
    eaten = study(AS_THE_PAPER)
    eaten["food_eaten"][{"condition": 3, "run": 1, "generation": 0, "agent": 2}] = 1
    third = evaluate_claims(eaten, last=5)[2]
    assert third.verdict == "does not hold" and third.record()["effect"] == 1


def test_claims_about_absent_and_custom_conditions_are_not_evaluated() -> None:
    some = {name: AS_THE_PAPER[name] for name in ("evo/A", "evo+self-taught/A")} | {
        "self-taught/A": [math.nan]
    }
    results = {result.claim.id: result for result in evaluate_claims(study(some))}
    assert results["C1"].verdict == results["C2"].verdict == "holds"
    assert results["C6"].verdict == "not evaluated"
    assert results["C6"].missing == ("self-taught/A",)
    assert results["C5"].missing == ("evo+self-taught/B", "self-taught/A", "self-taught/B")
    assert results["C6"].record()["p"] is None and results["C6"].record()["comparisons"] == []
    assert set(verdicts({"my-rule": [1, 2, 3]}).values()) == {"not evaluated"}


@pytest.mark.parametrize("generations", [1, 3])
def test_a_single_run_decides_only_rules_without_statistics(generations: int) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        results = verdicts(
            {name: list(values)[:1] for name, values in AS_THE_PAPER.items()},
            generations=generations,
            agents=1,
        )
    assert results.pop("C3") == "holds"
    assert set(results.values()) == {"undecided"}


def test_all_p_values_of_all_claims_are_one_family() -> None:
    findings = [
        finding for result in evaluate_claims(study(AS_THE_PAPER)) for finding in result.findings
    ]
    tested = [finding for finding in findings if not math.isnan(finding.numbers.p)]
    smallest = min(tested, key=lambda finding: finding.numbers.p)
    assert len(tested) == 19
    assert smallest.p_holm == pytest.approx(19 * smallest.numbers.p)


def test_the_record_shows_the_weakest_comparison_and_the_distance_from_the_paper() -> None:
    weak = {
        **AS_THE_PAPER,
        "self-taught/B": [value + 46 for value in AS_THE_PAPER["self-taught/B"]],
    }
    fifth = evaluate_claim("C5", weak).record()
    assert (fifth["condition"], fifth["comparison"]) == ("evo+self-taught/B", "self-taught/B")
    assert fifth["p_holm"] == max(comparison["p_holm"] for comparison in fifth["comparisons"])
    first = evaluate_claim("C1", AS_THE_PAPER)
    assert first.record()["figure"] == 40 and first.difference_from_paper == 0
    assert evaluate_claim("C4", AS_THE_PAPER).difference_from_paper is None


def test_files_are_strict_and_complete(tmp_path: Path) -> None:
    data = study({**AS_THE_PAPER, "evo/A": [80], "mine": [math.nan]})
    results = evaluate_claims(data)
    write_statistics(results, data, tmp_path)
    records = claim_records(results)
    json.dumps(records, allow_nan=False)
    needed = {"id", "claim", "condition", "comparison", "measure", "effect", "interval"}
    needed |= {"p", "p_holm", "a12", "verdict", "rule"}
    assert all(needed | {"paper", "comparisons"} <= record.keys() for record in records)
    assert records[0]["interval"] is None  # one run has none
    with (tmp_path / "statistics.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == sum(len(record["comparisons"]) for record in records)
    assert rows[0]["claim"] == "C1" and rows[0]["low"] == "" and float(rows[0]["median_a"]) == 123.5
    with (tmp_path / "summary.csv").open() as file:
        assert {row["condition"] for row in csv.DictReader(file)} == set(AS_THE_PAPER)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["statistics.csv", "summary.csv"]
    # The same study gives the same bytes.
    data = study(
        {name: np.random.default_rng(3).poisson(9, RUNS).tolist() for name in AS_THE_PAPER}
    )
    for folder in ("one", "two"):
        write_statistics(evaluate_claims(data), data, tmp_path / folder)
    for name in ("statistics.csv", "summary.csv"):
        assert (tmp_path / "one" / name).read_bytes() == (tmp_path / "two" / name).read_bytes()


def test_tables_have_the_map_of_each_condition_where_there_are_maps(tmp_path: Path) -> None:
    header = "claim,condition_a,condition_b,measure,"
    for suffix, has_maps in (("", False), ("/A", True)):
        data = study({f"plain{suffix}": range(20, 26), f"mine{suffix}": range(6)})
        write_statistics([], data, tmp_path, 10, compare_conditions(data).rows)
        statistics, summary = (
            pd.read_csv(tmp_path / name) for name in ("statistics.csv", "summary.csv")
        )
        assert ("map" in summary, "map_a" in statistics, "map_b" in statistics) == (has_maps,) * 3
        assert (tmp_path / "statistics.csv").read_text().startswith(header)
    for column in (summary["map"], statistics["map_a"], statistics["map_b"]):
        assert len(column) and set(column) == {"A"}


def test_claims_name_only_existing_conditions_rules_and_fields() -> None:
    names = {experiment.name for experiment in paper()}
    fields = Experiment().to_dict()
    for claim in load().claims:
        for comparison in claim.comparisons:
            assert comparison.conditions <= names
        for choice in claim.choices:
            part, field = choice.field.split(".")
            assert field in fields[part]


def strings(**unset: Sequence[float]) -> xr.Dataset:
    """Return runs of strings with two generations. The share of ? is 0.9 in the first."""
    conditions = []
    for name, values in unset.items():
        share = np.stack(
            [np.full((len(values), 4), 0.9), np.tile(np.array(values)[:, None], (1, 4))], axis=1
        )
        dims = ("run", "generation", "agent")
        variables = {
            "energy": share + 1,
            "unset": share,
            "ones": 1 - share,
            "zeros": 0 * share,
            "succeeded": np.ones_like(share),
        }
        runs = xr.Dataset({variable: (dims, array) for variable, array in variables.items()})
        conditions.append(runs.expand_dims(condition=[name.replace("_", "-")]))
    return xr.concat(conditions, "condition", join="outer")


def of_strings(
    tmp_path: Path, comparison: str, data: xr.Dataset | None = None, **unset: Sequence[float]
) -> ClaimResult:
    """Evaluate a claim about `data`, by default strings with these shares of ?."""
    paper = open_strings(tmp_path, comparison)
    (result,) = evaluate_claims(strings(**unset) if data is None else data, source=paper)
    return result


def open_strings(tmp_path: Path, comparison: str) -> Paper:
    """Return the paper on strings with a single claim."""
    facts = "".join(f'{key} = "S"\n' for key in ("id", "title", "claim", "paper"))
    comparisons = f'comparisons = [{{ a = "guessing", {comparison} }}]\n'
    shutil.copytree(load("hinton-nowlan-1987").folder, tmp_path / "strings")
    claims = f"[choices]\n[[claims]]\n{facts}{comparisons}"
    (tmp_path / "strings" / "claims.toml").write_text(claims)
    return open_paper(tmp_path / "strings")


SPREAD = [0.40, 0.42, 0.44, 0.46, 0.48, 0.50]
MEAN_WITHIN = 'measure = "unset", rule = "mean_within", bound = [0.44, 0.46]'
TAKE_OFF = 'measure = "take-off", rule = "within", bound = [0, 0]'


@pytest.mark.parametrize(
    ("comparison", "verdict"),
    [
        ('measure = "unset", rule = "within", bound = [0.3, 0.6]', "holds"),
        ('measure = "unset", rule = "within", bound = [0.45, 0.6]', "undecided"),
        ('measure = "unset", rule = "within", bound = [0.6, 0.7]', "does not hold"),
        ('measure = "unset", rule = "mean_within", bound = [0.44, 0.46]', "holds"),
        ('measure = "unset", rule = "mean_within", bound = [0.46, 0.48]', "does not hold"),
        ('measure = "unset", rule = "mean_at_most", bound = 0.451', "holds"),
        ('measure = "unset", rule = "every_at_most", bound = 0.49', "does not hold"),
        ('measure = "unset", rule = "every_at_most", bound = 0.50', "holds"),
        ('measure = "fall", rule = "every_at_least", bound = 0.399', "holds"),
        ('measure = "fall", rule = "every_at_least", bound = 0.41', "does not hold"),
        ('measure = "take-off", rule = "within", bound = [0, 0]', "holds"),
    ],
)
def test_a_measure_of_a_model_is_compared_with_bounds(
    tmp_path: Path, comparison: str, verdict: Verdict
) -> None:
    assert of_strings(tmp_path, comparison, guessing=SPREAD).verdict == verdict


@pytest.mark.parametrize("rule", ['"within", bound = [0.3, 0.6]', '"at_least", bound = 0.1'])
def test_an_interval_of_fewer_than_six_runs_decides_nothing(tmp_path: Path, rule: str) -> None:
    result = of_strings(tmp_path, f'measure = "unset", rule = {rule}', guessing=SPREAD[:5])
    assert (result.verdict, result.label) == ("undecided", "too few runs")
    assert result.note.startswith("an interval needs 6 runs; about 6 runs would decide this")


def test_a_measure_of_a_model_ignores_missing_runs_and_generations(
    tmp_path: Path,
) -> None:
    padded = strings(guessing=SPREAD).pad(run=(0, 2), generation=(0, 3), agent=(0, 1))
    result = of_strings(tmp_path, MEAN_WITHIN, padded)
    assert result.verdict == "holds" and result.deciding is not None
    assert result.deciding.numbers.n_a == len(SPREAD)


def test_two_conditions_are_compared_in_a_measure_of_a_model(tmp_path: Path) -> None:
    comparison = 'b = "all-set", measure = "ones", rule = "lower"'
    less = [share / 2 for share in SPREAD]
    result = of_strings(tmp_path, comparison, guessing=SPREAD, all_set=less)
    assert result.verdict == "holds" and result.deciding is not None
    assert result.deciding.numbers.effect == pytest.approx(-0.225)
    assert result.deciding.meaning == "share of 1 in the last generation"


@pytest.mark.parametrize(
    "rule", ['"within", bound = [1, 2]', '"every_at_least", bound = 0', '"lower", b = "all-set"']
)
def test_a_measure_without_values_leaves_a_claim_undecided(tmp_path: Path, rule: str) -> None:
    """No agent of these runs ever succeeds, so that no run has a take-off."""
    never = strings(guessing=SPREAD, all_set=SPREAD).assign(
        succeeded=lambda runs: 0 * runs["succeeded"]
    )
    comparison = f'measure = "take-off", rule = {rule}'
    assert of_strings(tmp_path, comparison, never).verdict == "undecided"


def test_a_measure_of_an_absent_model_is_not_evaluated(tmp_path: Path) -> None:
    """A report needs no part, so a claim about the measure of an absent model stays open."""
    open_strings(tmp_path, 'measure = "ones", rule = "every_at_least", bound = 0')
    (tmp_path / "strings" / "conditions" / "guessing.toml").write_text(
        'description = "gone"\nmodel = "gone"\n'
    )
    (result,) = evaluate_claims(strings(guessing=SPREAD), source=open_paper(tmp_path / "strings"))
    assert result.verdict == "not evaluated" and result.unmeasured == ("ones",)


@pytest.mark.parametrize(("shared", "verdict"), [(0.01, "holds"), (0.0, "undecided")])
def test_paired_runs_show_a_small_difference_that_all_pairs_have(
    tmp_path: Path, shared: float, verdict: Verdict
) -> None:
    more = [share + shared for share in SPREAD]
    runs = strings(guessing=more, all_set=SPREAD)
    comparison = 'b = "all-set", measure = "unset", rule = "greater"'
    result = of_strings(tmp_path, f"{comparison}, paired = true", runs)
    assert result.verdict == verdict and result.deciding is not None
    assert result.deciding.numbers.effect == pytest.approx(shared, abs=1e-6)
    # The differences between runs are larger.
    assert of_strings(tmp_path / "unpaired", comparison, runs).verdict == "undecided"


@pytest.mark.parametrize(
    ("apart", "verdict"), [(0.0, "holds"), (0.02, "undecided"), (0.2, "does not hold")]
)
def test_two_conditions_are_close_if_the_interval_of_their_difference_is(
    tmp_path: Path, apart: float, verdict: Verdict
) -> None:
    """The difference of each pair is `apart`, less or more by 0.015."""
    shares = [
        share + apart + (0.015 if number % 2 else -0.015) for number, share in enumerate(SPREAD)
    ]
    comparison = 'b = "all-set", measure = "unset", rule = "close", paired = true, bound = 0.02'
    result = of_strings(tmp_path, comparison, guessing=shares, all_set=SPREAD)
    assert result.verdict == verdict and "within 0.02 of 0" in result.claim.rule


def populations(**survived: Sequence[float]) -> xr.Dataset:
    """Return populations by strategy with their survival times, which end at step 1000."""
    conditions = []
    for name, times in survived.items():
        steps = np.array(times, np.float64)[:, None, None]
        dims = ("run", "generation", "agent")
        runs = xr.Dataset(
            {"energy": (dims, steps), "extinct": (dims, (steps < 1000).astype(np.int32))}
        )
        conditions.append(
            runs.assign_coords(run=np.arange(len(times))).expand_dims(condition=[name])
        )
    return xr.concat(conditions, "condition", join="outer")


EARLY = np.arange(10, 60, 2).tolist()
LATE = [*range(100, 120), *[1000] * 5]


@pytest.mark.parametrize(
    ("first", "second", "verdict"),
    [
        (LATE, EARLY, "holds"),
        (EARLY, LATE, "does not hold"),
        (LATE, LATE, "undecided"),
        ([1000] * 25, [1000] * 25, "undecided"),
    ],
)
def test_survival_times_are_compared_by_the_log_rank_test(
    first: list[float], second: list[float], verdict: Verdict
) -> None:
    result, *_ = evaluate_claims(
        populations(ERL=first, E=second), source=load("ackley-littman-1991")
    )
    assert result.claim.id == "A1" and result.verdict == verdict and result.deciding is not None
    first_times, second_times = (
        stats.CensoredData.right_censored(times, np.array(times) == 1000)
        for times in (first, second)
    )
    with np.errstate(invalid="ignore"):
        p = stats.logrank(first_times, second_times).pvalue
    assert result.deciding.numbers.p == pytest.approx(1.0 if math.isnan(p) else p)
    assert result.deciding.numbers.effect == pytest.approx(np.mean(first) - np.mean(second)), (
        "all simulations end at the same step"
    )


def test_a_claim_is_undecided_if_the_test_and_the_restricted_mean_disagree() -> None:
    """Most populations die sooner, but two survive much longer."""
    few = [*range(10, 33), 999, 999]
    first, *_ = evaluate_claims(
        populations(ERL=few, E=list(range(30, 55))), source=load("ackley-littman-1991")
    )
    assert first.deciding is not None and first.deciding.p_holm < 0.05
    assert first.deciding.numbers.effect > 0 > first.deciding.numbers.u
    assert first.verdict == "undecided"


def test_a_missing_run_is_left_out_of_survival_times() -> None:
    less, all_of = (
        evaluate_claims(populations(ERL=LATE, E=times), source=load("ackley-littman-1991"))[0]
        for times in (EARLY[:9], EARLY)
    )
    assert less.verdict == "holds" and less.deciding is not None and all_of.deciding is not None
    assert (less.deciding.numbers.n_a, less.deciding.numbers.n_b) == (25, 9)
    assert all_of.deciding.numbers.n_b == 25


def test_a_claim_is_as_weak_as_its_weakest_part() -> None:
    assert combine_verdicts(["holds", "holds"]) == "holds"
    assert combine_verdicts(["holds", "undecided"]) == "undecided"
    assert combine_verdicts(["undecided", "does not hold", "holds"]) == "does not hold"
    assert combine_verdicts([]) == "not evaluated"


STOPPED_DIMS = ("condition", "run")


def stop_runs(data: xr.Dataset, n_generations: Sequence[int]) -> xr.Dataset:
    """Return the runs without the values after their numbers of generations."""
    counts = xr.DataArray(np.tile(n_generations, (data.sizes["condition"], 1)), dims=STOPPED_DIMS)
    data = data.assign_coords(generation=range(data.sizes["generation"]))
    return data.where(data["generation"] < counts).assign_coords(n_generations=counts)


def test_a_stopped_run_has_the_value_of_its_own_last_generation(tmp_path: Path) -> None:
    # Only the last run has a third generation, in which its share of ? is 0.9.
    longer = xr.concat([strings(guessing=SPREAD), strings(guessing=[0.9] * 6)], "generation")
    stopped = stop_runs(longer.isel(generation=slice(3)), [2, 2, 2, 2, 2, 3])
    result = of_strings(tmp_path, MEAN_WITHIN, stopped)
    assert result.deciding is not None
    assert result.deciding.numbers.n_a == len(SPREAD)
    assert result.deciding.numbers.effect == pytest.approx(np.mean([*SPREAD[:-1], 0.9]))
    assert not result.note


@pytest.mark.parametrize(
    "other_comparison",
    ["", 'measure = "unset", rule = "within", bound = [0.3, 0.6] }, { a = "guessing", '],
    ids=["the deciding comparison", "another comparison"],
)
def test_a_claim_states_the_number_of_runs_without_a_value(
    tmp_path: Path, other_comparison: str
) -> None:
    data = strings(guessing=[*SPREAD, 0.43, 0.45])
    # Half of the agents never succeed in two of the runs.
    data["succeeded"] = data["succeeded"].where(data["succeeded"]["run"] < 6, 0)
    record = of_strings(tmp_path, other_comparison + TAKE_OFF, data).record()
    assert record["verdict"] == "holds"
    assert record["note"] == "2 of 8 runs of guessing have no value"
    assert record["comparisons"][-1]["unused_runs"] == {"guessing": 2}
    assert record["comparisons"][-1]["n_a"] == 6


def test_a_claim_counts_no_run_whose_measure_is_infinite(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    source = open_strings(tmp_path, TAKE_OFF)
    # A ratio to a change of 0, in two of the runs.
    infinite = Measure("ratio", lambda runs: (0.0 * runs["run"]).where(runs["run"] > 1, -np.inf))
    monkeypatch.setattr(type(source), "measures", lambda paper, name: {"take-off": infinite})
    (result,) = evaluate_claims(strings(guessing=[*SPREAD, 0.43, 0.45]), source=source)
    assert result.record()["note"] == "2 of 8 runs of guessing have no value"


@pytest.mark.parametrize(
    ("rule", "bound", "effect"), [("mean_at_most", 7.0, 4.0), ("every_at_most", 7.0, 9.0)]
)
def test_the_statistic_of_the_measure_most_is_that_of_the_rule(
    rule: str, bound: float, effect: float
) -> None:
    comparison = ClaimComparison(a="evo/A", measure="most", rule=rule, bound=bound)
    claim = load().claims[2].model_copy(update={"comparisons": (comparison,)})
    (result,) = evaluate_claims(study({"evo/A": [0, 3, 9]}), 10, Claims((claim,)))
    assert result.findings[0].numbers.effect == effect
