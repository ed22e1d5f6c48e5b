"""A paper with stages: tuning, confirmation in other runs, specification curve, and report."""

from __future__ import annotations

import hashlib
import json
import math
import shutil
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import pytest
import xarray as xr

import baldwinlab as bl
from baldwinlab import papers
from baldwinlab.analysis.statistics.fitness import UNSEEN_MAPS_VARIABLE
from baldwinlab.api.publish.stages import read_staged_results
from baldwinlab.core.errors import RefusedError
from baldwinlab.experiment.conditions import Factors
from baldwinlab.papers.design import read_design, read_tuned, specification_conditions
from baldwinlab.studies.store import StudyStore
from tests.commands import Command
from tests.paused_studies import run_until_paused
from tests.small_studies import read_records

# Other tests draw these figures.
pytestmark = pytest.mark.usefixtures("placeholder_figures_of_module")

PAPER = """
name = "staged"
title = "Staged"
authors = ["A. Reader"]
year = 2026
citation = "A. Reader, Staged, 2026"
description = "a rule and its controls"
conditions = ["plain", "noise", "hebb", "random"]
maps = ["near", "far"]
runs = 3
first_run = 2
figures = ["final-fitness"]
assays = ["unseen-maps"]
"""
DESIGN = """
noise_controls = ["random", "noise"]
[tuning]
runs = 2
settings = { "lifetime.steps" = 40 }
[[tuning.grids]]
name = "noise"
field = "motor.noise"
values = [0.2, 0.6]
conditions = ["plain"]
target = "noise"
[[tuning.grids]]
name = "rate"
field = "learning.rate"
values = [0.01, 0.3]
conditions = ["hebb", "random"]
[matched_controls]
kinds = ["yoked", "drift"]
maps = ["near"]
[specification_curve]
runs = 1
maps = ["near"]
[specification_curve.settings]
"evolution.generations" = 1
[specification_curve.factors]
"learning.rate" = [0.01, 0.1]
"network.hidden" = [[3], [5]]
[quick]
maps = ["near"]
tuning_runs = 1
runs = 1
"""
# Each further control and network is another program to compile.
QUICK_DESIGN = DESIGN.replace('["yoked", "drift"]', '["yoked"]').replace(
    '"network.hidden" = [[3], [5]]\n', ""
)
CLAIMS = """
[[claims]]
id = "N1"
title = "hebb eats more than noise"
kind = "own"
claim = "Agents with Hebb's rule eat more than each noise control."
rule = "greater"
comparisons = [
    { a = "hebb/near", b = "random/near", measure = "unseen-maps" },
    { a = "hebb/near", b = "noise/near", measure = "unseen-maps" },
]
[[claims]]
id = "C1"
title = "hebb eats more than its yoked control"
kind = "own"
claim = "Agents with Hebb's rule eat more than their yoked control."
rule = "greater"
comparisons = [{ a = "hebb/near", b = "hebb+yoked/near", measure = "unseen-maps" }]
"""
SHORT = "[lifetime]\nsteps = 60\n[evolution]\ngenerations = 2\n[population]\nsize = 4\n"
RULES = {"plain": "none", "noise": "none", "hebb": "hebb", "random": "random-targets"}


# The package contains the code of this rule. The compilation of another one takes ten seconds.
QUICK_RULES = RULES | {"hebb": "self-taught", "random": "self-taught"}


def write_staged_paper(folder: Path, design: str = DESIGN, rules: dict[str, str] = RULES) -> Path:
    files = {"paper.toml": PAPER, "design.toml": design, "claims.toml": CLAIMS}
    for name, rule in rules.items():
        text = f'description = "{name}"\n[learning]\nrule = "{rule}"\n{SHORT}'
        files[f"conditions/{name}.toml"] = text
    for name, left in (("near", 120), ("far", 300)):
        files[f"maps/{name}.toml"] = (
            f'description = "{name}"\n[[world.food]]\nx = [{left}, {left + 80}]\ny = [120, 200]\n'
        )
    for name, text in files.items():
        path = folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)
    return folder


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a folder with the paper and its results."""
    folder = tmp_path_factory.mktemp("staged")
    bl.reproduce(write_staged_paper(folder / "paper"), out=folder / "results", workers=1)
    return folder


@pytest.mark.nightly
def test_the_quick_form_has_all_stages(tmp_path: Path) -> None:
    results = tmp_path / "results"
    paper = write_staged_paper(tmp_path / "paper", QUICK_DESIGN, QUICK_RULES)
    bl.reproduce(paper, out=results, quick=True, workers=1)
    confirmation = StudyStore(results / "confirmation")
    for name in ("hebb/near", "random/near"):
        means = {
            rate: float(StudyStore(results / f"tuning/rate-{rate}").read(name, 0).energy.mean())
            for rate in (0.01, 0.3)
        }
        best = max(means, key=lambda rate: (means[rate], -rate))
        assert confirmation.experiments[name].learning.rate == best
        assert confirmation.runs(name) == [2]
    record = json.loads((results / "confirmation/learners.json").read_text())
    assert record["specification_curve"]["specifications"] == 2


# The complete paper takes a minute.
@pytest.mark.nightly
def test_the_confirmation_has_other_runs_than_the_tuning(folder: Path) -> None:
    results = folder / "results"
    for value in ("noise-0.2", "noise-0.6", "rate-0.01", "rate-0.3"):
        study = StudyStore(results / "tuning" / value)
        assert {tuple(study.runs(name)) for name in study.experiments} == {(0, 1)}
        assert {experiment.lifetime.steps for experiment in study.experiments.values()} == {40}
    confirmation = StudyStore(results / "confirmation")
    assert {experiment.lifetime.steps for experiment in confirmation.experiments.values()} == {60}
    assert {tuple(confirmation.runs(name)) for name in confirmation.experiments} == {(2, 3, 4)}
    assert confirmation.first_run == 2 and confirmation.paper == "staged"


@pytest.mark.nightly
def test_the_confirmation_has_the_values_with_the_largest_medians(folder: Path) -> None:
    """The oracle takes the medians from the records of the tuning."""
    confirmation = StudyStore(folder / "results/confirmation")
    for name in ("hebb/near", "hebb/far", "random/near", "random/far"):
        medians = {}
        for value in (0.01, 0.3):
            tuning = StudyStore(folder / f"results/tuning/rate-{value}")
            first, second = (float(tuning.read(name, run).energy.mean()) for run in (0, 1))
            medians[value] = (first + second) / 2
        best = max(medians, key=lambda value: (medians[value], -value))
        assert confirmation.experiments[name].learning.rate == best
    control = confirmation.experiments["hebb+yoked/near"]
    rule = confirmation.experiments["hebb/near"]
    assert control == rule.replace(name="hebb+yoked/near", learning={"control": "yoked"})
    assert "hebb+yoked/far" not in confirmation.experiments


@pytest.mark.nightly
def test_the_record_has_digests_and_each_condition_with_its_controls(folder: Path) -> None:
    confirmation = folder / "results/confirmation"
    digest = hashlib.sha256(CLAIMS.encode()).hexdigest()
    record = json.loads((confirmation / "learners.json").read_text())
    assert record["sha256"]["claims.toml"] == digest
    tuned = (folder / "results/tuned.toml").read_bytes()
    assert record["sha256"]["tuned.toml"] == hashlib.sha256(tuned).hexdigest()
    page = (confirmation / "report.html").read_text()
    assert digest in page and 'id="figure-unseen-maps"' in page
    assert 'id="figure-specifications"' in page and "too few runs" in page
    assert "hebb+yoked" not in page.split('<h2 id="setup"')[0].split("<tbody>")[1]
    record = json.loads((folder / "results/confirmation/learners.json").read_text())
    rows = {(row["learner"], row["map"]): row for row in record["learners"]}
    assert set(rows) == {(name, food) for name in RULES for food in ("near", "far")}
    hebb = rows["hebb", "near"]
    assert hebb["noise_control"] in ("random/near", "noise/near")
    assert hebb["yoked_control"] == "hebb+yoked/near" and hebb["verdict"] == "too few runs"
    assert rows["hebb", "far"]["yoked_control"] is None
    curve = record["specification_curve"]
    assert curve["specifications"] == 4
    assert {row["learner"] for row in curve["learners"]} == {"hebb", "random", "noise"}
    assert {
        (row["field"], row["value"], row["n_specifications"]) for row in curve["by_setting"]
    } == {
        *(("learning.rate", "0.01", 2), ("learning.rate", "0.1", 2)),
        *(("network.hidden", "[3]", 2), ("network.hidden", "[5]", 2)),
    }


# A report of all stages takes too long for every day.
@pytest.mark.nightly
def test_missing_runs_of_any_stage_are_simulated_again_with_the_same_bits(
    folder: Path, tmp_path: Path
) -> None:
    results = tmp_path / "results"
    shutil.copytree(folder / "results", results)
    complete = read_records(results)
    for name in (
        "tuning/rate-0.3/runs/hebb/far/0001.nc",
        "confirmation/runs/random/near/0003.nc",
        "specifications/assays/unseen-maps/s02/hebb/near.nc",
    ):
        (results / name).unlink()
    bl.reproduce(folder / "paper", out=results, workers=2)
    assert read_records(results) == complete


# A report of all stages takes too long for every day.
@pytest.mark.nightly
def test_a_changed_claim_is_reported(folder: Path, tmp_path: Path) -> None:
    changed = tmp_path / "paper"
    shutil.copytree(folder / "paper", changed)
    shutil.copytree(folder / "results", tmp_path / "results")
    (changed / "claims.toml").write_text(CLAIMS + "# changed\n")
    bl.reproduce(changed, out=tmp_path / "results", workers=2)
    page = (tmp_path / "results/confirmation/report.html").read_text()
    assert "claims.toml has been changed since the study was created" in page


def test_committed_values_replace_those_of_the_tuning(tmp_path: Path) -> None:
    paper = write_staged_paper(tmp_path / "paper", QUICK_DESIGN, QUICK_RULES)
    (paper / "tuned.toml").write_text('"hebb/near" = { "learning.rate" = 0.123 }\n')
    study = bl.reproduce(paper, out=tmp_path / "results", quick=True, workers=1)
    assert study.experiment("hebb/near").learning.rate == 0.123
    assert list(study.conditions) == [
        *("plain/near", "noise/near", "hebb/near", "hebb+yoked/near", "random/near"),
    ]
    assert study.runs("hebb/near") == [2]
    page = (tmp_path / "results/confirmation/report.html").read_text()
    assert "This is a quick or incomplete study: 1 of 3 runs and 1 of 2 maps." in page


def test_an_invalid_design_or_option_is_refused(tmp_path: Path, command: Command) -> None:
    with pytest.raises(RefusedError, match="--quick applies to papers with stages"):
        bl.reproduce("hinton-nowlan-1987", quick=True)
    with pytest.raises(RefusedError, match="--variant x applies to papers without stages"):
        bl.reproduce(write_staged_paper(tmp_path), variant="x")
    paper = write_staged_paper(tmp_path / "paper", DESIGN.replace('"plain"', '"plane"'))
    result = command("reproduce", str(paper))
    assert result.code == 2
    assert "design.toml names a condition 'plane', which does not exist" in result.err
    # Of two grids for one condition, only the last would have an effect.
    repeated = DESIGN.replace('target = "noise"', 'target = "hebb"')
    paper = write_staged_paper(tmp_path / "grids", repeated)
    result = command("reproduce", str(paper))
    assert result.code == 2 and "two grids or conditions choose the value of 'hebb'" in result.err
    assert not (tmp_path / "results").exists()


@pytest.mark.nightly
def test_a_killed_reproduction_continues_in_its_stage(folder: Path, tmp_path: Path) -> None:
    results = tmp_path / "results"
    code = f"import baldwinlab as bl; bl.reproduce({str(folder / 'paper')!r}, out={str(results)!r})"
    for stage in ("tuning", "confirmation", "specifications"):
        with run_until_paused(code, results / stage, 1) as process:
            process.kill()
    bl.reproduce(folder / "paper", out=results, workers=2)
    assert read_records(results) == read_records(folder / "results")


def test_the_built_in_paper_compares_each_rule_with_all_noise_controls() -> None:
    paper = papers.load("worlds-and-minds")
    design = read_design(paper)
    assert design is not None
    claims = [claim for claim in paper.claims if claim.id.startswith("N")]
    assert len(claims) == 64
    for claim in claims:
        condition, map_name = claim.comparisons[0].a.split("/")
        references = [f"{control}/{map_name}" for control in design.noise_controls]
        assert [comparison.b for comparison in claim.comparisons] == references
        assert condition not in design.noise_controls
    factors = design.specification_curve.factors
    assert factors["senses.visual_radius"] == (4, 40)
    assert math.prod(map(len, factors.values())) == 64
    tuned = read_tuned(paper)
    targets = {
        f"{condition}/{map_name}"
        for grid in design.tuning.grids
        for condition in ([grid.target] if grid.target else grid.conditions)
        for map_name in "ABCD"
    }
    assert tuned is None or tuned.keys() == targets


def test_a_setting_of_the_quick_form_replaces_the_factor_of_its_name() -> None:
    paper = papers.load("worlds-and-minds")
    design = read_design(paper)
    assert design is not None
    experiments = specification_conditions(paper, design.shorten()).experiments
    assert {experiment.lifetime.steps for experiment in experiments} == {2500}
    assert {experiment.population.size for experiment in experiments} == {20}
    assert {experiment.network.hidden for experiment in experiments} == {(5,)}
    selections = {experiment.evolution.selection for experiment in experiments}
    assert selections == {"roulette", "tournament"}


@pytest.mark.parametrize("values", [[0.5, 1.5], [math.nan, math.nan]])
def test_matched_controls_alone_and_no_runs_give_no_results(
    values: list[float],
) -> None:
    control = "hebb+yoked/near"
    study = SimpleNamespace(experiments={control: None}, factors={control: Factors("hebb+yoked")})
    design = SimpleNamespace(tuning=SimpleNamespace(grids=()), noise_controls=("noise",))
    unseen = xr.DataArray([values], {"condition": [control], "run": [0, 1]})
    data = unseen.to_dataset(name=UNSEEN_MAPS_VARIABLE)
    arguments = cast(Any, (study, None, design, data, []))
    assert read_staged_results(*arguments) is None
