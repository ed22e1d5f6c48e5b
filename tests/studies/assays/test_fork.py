"""The fork assay evolves learners and their control further, with learning on and off."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import xarray as xr

import baldwinlab as bl
from baldwinlab.analysis.assays.fork import compute_effects, name_quantity
from baldwinlab.analysis.estimands import estimate
from baldwinlab.analysis.gallery.decisions import SystemName, decide
from baldwinlab.analysis.results.verdicts import EQUIVALENT, YES
from baldwinlab.analysis.statistics import median_interval
from baldwinlab.core.errors import ArgumentError
from baldwinlab.evolution import GenerationKey
from baldwinlab.experiment import Experiment
from baldwinlab.papers.presets import load
from baldwinlab.simulation.reevaluation import reevaluate, restore_genomes
from baldwinlab.studies.assays import Sample
from baldwinlab.studies.assays.catalog import why_not_in_study
from baldwinlab.studies.assays.fork import FORKS, copy_mode, fit_genomes
from baldwinlab.studies.assays.results import find_missing_assays, open_assay, read_assay
from baldwinlab.studies.assays.run import run_assays
from baldwinlab.studies.creation import extend_study
from baldwinlab.studies.record_files import StudyError, record_path
from baldwinlab.studies.store import StudyStore
from tests.evolution.single_runs import make_founders
from tests.small_studies import ignore_message, ignore_progress, make_small_study
from tests.studies.completion import complete_runs
from tests.worlds import make_small_experiment

LEARNER = "evo+self-taught/A"
CONTROL = "evo/A"


def measure_fork(
    study: StudyStore, condition: str = LEARNER, generations: int = 3, name: str = "fork"
) -> xr.Dataset:
    missing = find_missing_assays(study, [name], generations)
    run_assays(study, missing, 2, ignore_progress, ignore_message, generations=generations)
    return open_assay(study.directory, name, condition)


def make_pair(**changes: object) -> list[Experiment]:
    """Return the control and the learner, which learns fast because its life is short."""
    return [
        make_small_experiment(name, **changes).replace(
            lifetime={"steps": 120}, learning={"rate": 0.5}
        )
        for name in ("evo", "evo+self-taught")
    ]


def make_climbers(k: int, size: int = 100, generations: int = 60) -> list[Experiment]:
    """Return NK climbers with free learning and their control."""
    climbing = load("climbing/rugged").replace(
        nk_climbers={"bits": 12, "k": k},
        population={"size": size},
        evolution={"generations": generations},
    )
    return [climbing.without_learning().replace(name="still"), climbing.replace(name="climbing")]


def mean_fitness(fork: xr.Dataset, measure: str, history: str, regime: str) -> np.ndarray:
    return fork[measure].sel(history=history, regime=regime).mean("agent").values


def estimate_effect(fork: xr.Dataset, effect: str) -> tuple[float, float, float]:
    """Return the median over runs of an effect on innate fitness, and its interval."""
    values = compute_effects(fork)[name_quantity(effect, "innate_fitness")]
    last = values.isel(generation=-1).values
    low, high = median_interval(last)
    return float(np.median(last)), low, high


@pytest.mark.parametrize(
    "experiments",
    [
        make_pair(),
        make_pair(evolution={"generations": 1}),
        make_pair(population={"size": 1}),
        make_pair(evolution={"lamarckian_share": 1.0}, record={"genome_every": 2}),
        make_pair(evolution={"elite": 2}),
        make_climbers(3, size=10, generations=4),
    ],
    ids=["miniworld", "one generation", "one agent", "inherited weights", "elite", "NK"],
)
def test_branches_with_the_regime_of_their_history_equal_extended_runs(
    tmp_path: Path, experiments: list[Experiment]
) -> None:
    control, learner = experiments
    study = make_small_study(tmp_path, experiments, runs=2)
    generations = learner.evolution.generations
    fork = measure_fork(study, learner.name).sel(generation=generations - 1)
    extended = extend_study(study, generations + 3)
    complete_runs(extended, 2)
    for run in range(2):
        end = fork.sel(run=run)
        learned = end.sel(history="learner", regime="on")
        record = extended.read(learner.name, run)
        assert np.array_equal(learned.fitness, record.energy[-1])
        genomes = restore_genomes(learner, extended.record(learner.name, run), generations + 2)
        newborns = reevaluate(
            learner.without_learning(), study.seed, [run], generations + 2, genomes[None]
        )
        assert np.array_equal(learned.innate_fitness, newborns.energy[0])
        continued = end.sel(history="control", regime="off")
        assert np.array_equal(continued.fitness, extended.read(control.name, run).energy[-1])
        assert continued.fitness.equals(continued.innate_fitness)


def test_histories_are_equal_at_the_start_of_evolution(tmp_path: Path) -> None:
    """The control gets the missing module of the learner's founders, so the founders are equal."""
    experiments = make_pair(evolution={"generations": 1})
    fork = measure_fork(make_small_study(tmp_path, experiments, runs=2)).sel(generation=0)
    learner = fork.sel(history="learner", drop=True)
    assert learner.equals(fork.sel(history="control", drop=True))
    assert not np.array_equal(learner.fitness.sel(regime="on"), learner.fitness.sel(regime="off"))


@pytest.mark.nightly
def test_learning_hides_on_every_landscape_and_guides_only_across_valleys(tmp_path: Path) -> None:
    for k in (0, 10):
        study = make_small_study(tmp_path / str(k), make_climbers(k), runs=10)
        fork = measure_fork(study, "climbing", 20)
        assert fork.sizes["run"] == 10
        _, _, regime_high = estimate_effect(fork, "regime")
        assert regime_high < 0, k
        history, history_low, history_high = estimate_effect(fork, "history")
        if k == 0:
            assert history_low == history == history_high == 0
        else:
            assert history_low > 0.02


# 360 runs take a minute and a half.
@pytest.mark.nightly
def test_the_history_of_learning_helps_across_valleys_with_and_without_a_cost(
    tmp_path: Path,
) -> None:
    estimates = {}
    for k in (0, 5, 10):
        experiments = [
            load(f"{name}/rugged").replace(nk_climbers={"k": k})
            for name in ("not-climbing", "climbing", "costly-climbing")
        ]
        study = make_small_study(tmp_path / str(k), experiments, runs=40)
        for learner in experiments[1:]:
            fork = measure_fork(study, learner.name, 20)
            rows = estimate(study.read(learner.name, 0), {"fork": fork}, learner, 10)
            system = SystemName(f"K = {k}", learner.name)
            estimates[system] = [row for row in rows if row.question == "fork-history"]
    verdicts = {decision.system: decision.row()["verdict"] for decision in decide(estimates)}
    expected: dict[SystemName, str | None] = dict.fromkeys(estimates, YES)
    # On a single peak, one run of 40 differs without a cost, and none with a cost.
    expected[SystemName("K = 0", "climbing/rugged")] = EQUIVALENT
    expected[SystemName("K = 0", "costly-climbing/rugged")] = None
    assert verdicts == expected


def test_the_mode_of_a_population_with_a_better_location_evolves_further(tmp_path: Path) -> None:
    study = make_small_study(tmp_path, make_climbers(5), runs=10)
    _, low, _ = estimate_effect(measure_fork(study, "climbing", 20, "fork-mode"), "history")
    assert low > 0


def test_the_mode_is_the_most_frequent_genotype_or_the_nearest_to_the_mean() -> None:
    population = np.array([[[0, 1]], [[1, 1]], [[1, 1]], [[9, 9]]], np.float32)
    assert np.array_equal(copy_mode(population), np.tile(population[1], (4, 1, 1)))
    population = np.array([[[0.0]], [[5.0]], [[2.5]], [[1.0]]], np.float32)
    assert np.array_equal(copy_mode(population), np.full((4, 1, 1), 2.5, np.float32))


def test_genomes_get_missing_modules_of_founders_and_lose_unused_ones() -> None:
    control, learner = make_pair()
    founders = {
        experiment.name: make_founders(experiment, GenerationKey(7, 0, 0))[None]
        for experiment in (control, learner)
    }
    samples = {
        experiment.name: Sample(Path(), 7, experiment, (0,), [], (), lambda steps: None)
        for experiment in (control, learner)
    }
    changed = founders[CONTROL] + 1
    fitted = fit_genomes(changed, samples[LEARNER])
    assert np.array_equal(fitted[:, :, :1], changed)
    assert np.array_equal(fitted[:, :, 1:], founders[LEARNER][:, :, 1:])
    assert np.array_equal(fit_genomes(fitted, samples[CONTROL]), changed)


def test_an_evolved_learning_rate_of_a_learner_is_fitted_too(tmp_path: Path) -> None:
    control, learner = make_pair()
    learner = learner.replace(learning={"evolved_rate": True})
    assert learner.genome_length == control.genome_length + 1
    fork = measure_fork(make_small_study(tmp_path, [control, learner], runs=1))
    assert np.isfinite(fork.fitness).all()


def test_one_run_has_effects_without_intervals(tmp_path: Path) -> None:
    fork = measure_fork(make_small_study(tmp_path, make_pair(), runs=1))
    innate = fork.innate_fitness.isel(run=0, generation=-1).mean("agent")
    (learner_on, learner_off), (control_on, control_off) = innate.values
    history = learner_off - control_off
    regime = (learner_on + control_on - learner_off - control_off) / 2
    interaction = learner_on - learner_off - control_on + control_off
    for effect, expected in (
        ("history", history),
        ("regime", regime),
        ("interaction", interaction),
    ):
        median, low, high = estimate_effect(fork, effect)
        assert median == pytest.approx(expected)
        assert np.isnan([low, high]).all()


def test_a_stored_fork_is_measured_again_only_for_another_number_of_generations(
    tmp_path: Path,
) -> None:
    study = make_small_study(tmp_path, make_pair(), runs=1)
    assert measure_fork(study, generations=2).attrs["generations"] == 2
    assert not any(find_missing_assays(study, ["fork"]).values())
    assert not any(find_missing_assays(study, ["fork"], 2).values())
    assert find_missing_assays(study, ["fork"], 3) == {CONTROL: [], LEARNER: ["fork"]}
    longer = bl.open_study(tmp_path).assay("fork", LEARNER, generations=4)
    assert longer.attrs["generations"] == 4 and longer.attrs["control"] == CONTROL
    assert bl.open_study(tmp_path).assay("fork", LEARNER).identical(longer)


def test_the_number_of_generations_is_checked(tmp_path: Path) -> None:
    study = bl.open_study(make_small_study(tmp_path, make_pair(), runs=1).directory)
    for generations in (0, -3):
        with pytest.raises(ArgumentError, match=r"generations = .* must be a whole number from 1"):
            study.assay("fork", generations=generations)
    with pytest.raises(ArgumentError, match="needs the assay fork"):
        study.assay("descent", generations=5)
    assert not (tmp_path / "assays").exists()


def test_a_fork_needs_a_learner_and_inheritance(tmp_path: Path) -> None:
    control, _ = make_pair()
    study = make_small_study(tmp_path, [control, make_small_experiment("self-taught")], runs=1)
    assert "needs a condition that learns" in why_not_in_study("fork", study, CONTROL)
    reason = why_not_in_study("fork", study, "self-taught/A")
    assert "which needs inherited genomes" in reason
    with pytest.raises(StudyError, match="needs a condition that learns"):
        bl.open_study(study.directory).assay("fork")


@pytest.mark.parametrize(
    "experiments", [make_pair(), make_climbers(3, size=10, generations=4)], ids=["miniworld", "NK"]
)
@pytest.mark.parametrize("name", FORKS.values())
def test_a_control_that_the_study_lacks_is_simulated(
    tmp_path: Path, experiments: list[Experiment], name: str
) -> None:
    _, learner = experiments
    with_control = make_small_study(tmp_path / "pair", experiments, runs=2)
    without_control = make_small_study(tmp_path / "single", [learner], runs=2)
    expected = measure_fork(with_control, learner.name, name=name)
    fork = measure_fork(without_control, learner.name, name=name)
    assert fork.equals(expected)
    assert fork.attrs.get("control", "") == ""
    assert expected.attrs["control"] == experiments[0].name


def test_a_fork_needs_the_same_runs_of_the_control(tmp_path: Path) -> None:
    study = make_small_study(tmp_path, make_pair(), runs=2)
    record_path(tmp_path, CONTROL, 1).unlink()
    assert "run 1 of evo/A is not stored" in why_not_in_study("fork", study, LEARNER)
    assert not any(find_missing_assays(study, ["fork"]).values())


def test_a_changed_record_is_detected(tmp_path: Path) -> None:
    study = make_small_study(tmp_path, make_pair(), runs=1)
    record = study.record(LEARNER, 0)
    study.write(LEARNER, 0, record.assign(energy=record.energy + 1))
    with pytest.raises(StudyError, match="does not eat the stored amount"):
        measure_fork(study)


def test_a_fork_of_another_control_is_refused(tmp_path: Path) -> None:
    study = make_small_study(tmp_path, make_pair(), runs=1)
    measure_fork(study)
    study.experiments[CONTROL] = study.experiments[CONTROL].replace(evolution={"elite": 1})
    with pytest.raises(ValueError, match=f"another experiment than that of {CONTROL}"):
        read_assay(study, "fork", LEARNER)
