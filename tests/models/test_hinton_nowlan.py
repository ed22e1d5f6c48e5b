"""Test strings that guess, against plain Python and exact theory.

A trial of a string with q alleles ? and without 0 succeeds with the probability 2^-q. The closed
forms follow from this.
"""

from __future__ import annotations

from math import comb
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

import baldwinlab as bl
from baldwinlab.evolution import GenerationKey
from baldwinlab.experiment import assign
from baldwinlab.models.hinton_nowlan import HintonNowlan, MovingNeedle
from baldwinlab.parts import LIFE, uniforms
from tests.evolution.single_runs import breed, draw_genomes
from tests.models.runs import measure_runs
from tests.oracles.models import evaluate_hinton_nowlan

LOCI = 20
TRIALS = 1000


def expected_fitness(unset: Any, trials: int = TRIALS) -> Any:
    """Return the mean fitness of a string without 0: 1 + 19 E[remaining trials] / trials."""
    chance = 0.5**unset
    return 1 + 19 * (1 - (1 - (1 - chance) ** trials) / (chance * trials))


def make_strings(unset: int, agents: int, zeros: int = 0) -> npt.NDArray[np.float32]:
    """Return equal genomes [run, agent, module, locus]."""
    alleles = np.array([0.5] * unset + [0.0] * zeros + [1.0] * (LOCI - unset - zeros), np.float32)
    return np.tile(alleles, (1, agents, 1, 1))


def simulate_strings(genomes: npt.NDArray[np.float32], **fields: Any) -> Any:
    return HintonNowlan(**fields).simulate(7, [0], 3, genomes)


@pytest.mark.parametrize(
    "fields",
    [
        {},
        {"guessing": False},
        {"counts_success": False},
        {"trials": 3},
        {"cost_of_trials": 0.3},
        {"cost_of_trials": 200, "counts_success": False},
    ],
)
def test_fitness_agrees_with_the_plain_oracle(fields: dict[str, Any]) -> None:
    genomes = np.random.default_rng(1).choice(
        np.array([0, 0.5, 1, 1, 1, 1], np.float32), (1, 300, 1, 6)
    )
    energy = simulate_strings(genomes, loci=6, **fields).energy[0]
    luck = uniforms(7, 0, 3, LIFE, (300, 1))[:, 0, 0]
    model = HintonNowlan(loci=6, **fields)
    assert energy.tolist() == [
        evaluate_hinton_nowlan(model, genome[0].tolist(), chance)
        for genome, chance in zip(genomes[0], luck, strict=True)
    ]
    assert len(set(energy.tolist())) > (2 if fields.get("guessing", True) else 1)


def test_without_a_cost_of_trials_each_success_has_the_maximum_fitness() -> None:
    results = simulate_strings(make_strings(6, 200), cost_of_trials=0)
    assert len(np.unique(results.records["used"])) > 50
    assert (results.energy == 20).all()


@pytest.mark.parametrize("unset", range(0, 21, 2))
def test_mean_fitness_agrees_with_the_closed_form(unset: int) -> None:
    energy = simulate_strings(make_strings(unset, 4000)).energy
    error = energy.std() / np.sqrt(energy.size)
    assert abs(energy.mean() - expected_fitness(unset)) <= 4 * error + 1e-9


def test_a_string_with_a_0_never_succeeds_and_uses_all_trials() -> None:
    results = simulate_strings(make_strings(3, 50, zeros=1))
    assert (
        (results.energy == 1).all()
        and (results.records["succeeded"] == 0).all()
        and (results.records["used"] == TRIALS).all()
    )


def test_learned_alleles_are_correct_and_shares_of_alleles_add_up() -> None:
    results = simulate_strings(make_strings(2, 50))
    assert (results.learned == 1).all() and (results.records["succeeded"] == 1).all()
    shares = {name: results.records[name] for name in ("ones", "unset", "zeros")}
    assert {name: share[0, 0].item() for name, share in shares.items()} == pytest.approx(
        {"ones": 0.9, "unset": 0.1, "zeros": 0}
    )


def test_loci_of_founders_are_independent() -> None:
    """The share of founders without a 0 is a power of the share of one locus."""
    genomes = np.concatenate(
        [draw_genomes(bl.load("guessing"), GenerationKey(0, run, 0)) for run in range(40)]
    )
    can_learn = (genomes[:, 0] != 0).all(axis=-1)
    expected = 0.75**LOCI * len(can_learn)
    assert abs(can_learn.sum() - expected) < 4 * np.sqrt(expected)


def exact_step(shares: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
    """Return the shares of 1, 0 and ? after a generation of an infinite population."""
    share_of_1, share_of_0, unset = shares
    q = np.arange(LOCI + 1)
    of_q = np.array([comb(LOCI, int(k)) for k in q]) * unset**q * share_of_1 ** (LOCI - q)
    gain = of_q * (expected_fitness(q) - 1)
    mean = 1 + gain.sum()
    next_shares = [
        share_of_1 + (gain * (LOCI - q) / LOCI).sum(),
        share_of_0,
        unset + (gain * q / LOCI).sum(),
    ]
    return np.array([share / mean for share in next_shares])


AGENTS = 20_000
# Shares of 1, 0 and ? at which learning raises fitness.
PAYING = np.array([0.6, 0.02, 0.38])


def measure_differences(variation: str, generations: int, seed: int) -> npt.NDArray[np.float64]:
    """Return the shares of 1, 0 and ? by generation, minus those of the exact recursion."""
    experiment = assign(
        bl.load("guessing"), [f"evolution.variation={variation}", f"population.size={AGENTS}"]
    )
    generator = np.random.default_rng(seed)
    expected = PAYING
    differences = []
    genome = generator.choice(np.array([1, 0, 0.5], np.float32), (AGENTS, 1, LOCI), p=PAYING)
    for generation in range(1, generations + 1):
        energy = HintonNowlan().simulate(seed, [0], generation - 1, genome[None]).energy[0]
        genome, _ = breed(experiment, genome, energy, GenerationKey(seed, 0, generation))
        expected = exact_step(expected)
        differences.append([(genome == allele).mean() for allele in (1, 0, 0.5)] - expected)
    return np.array(differences)


@pytest.mark.parametrize("variation", ["crossover", "gene-pool"])
def test_a_generation_from_independent_loci_follows_the_exact_recursion(variation: str) -> None:
    """With independent loci, two parents and the gene pool give the same shares."""
    after = exact_step(PAYING)
    # The factor 3 allows for children of the same parents, which are not independent.
    error = 4 * np.sqrt(after * (1 - after) / (AGENTS * LOCI)) * 3
    assert (abs(measure_differences(variation, 1, seed=5)[0]) < error).all() and abs(
        after - PAYING
    )[0] > 2 * error[0]


def test_a_gene_pool_follows_the_exact_recursion_and_two_parents_do_not() -> None:
    """Two parents preserve half of the linkage, so the population leaves the recursion."""
    pool, pairs = (
        np.mean([measure_differences(variation, 8, seed) for seed in (5, 6, 7)], axis=0)[-1]
        for variation in ("gene-pool", "crossover")
    )
    assert (abs(pool) < 0.002).all()
    assert abs(pairs[2]) > 0.008


def test_only_agents_that_guess_find_the_needle_and_wrong_alleles_vanish() -> None:
    guessing, all_set = (measure_runs(bl.load(name), 0, 4) for name in ("guessing", "all-set"))
    assert (guessing["taken-off"] == 1).all()
    assert (guessing["zeros"] < 0.005).all()
    assert (guessing["fall"] > 0).all()
    assert all_set["hit"].sum() <= 1


def test_a_run_that_never_takes_off_has_no_take_off() -> None:
    small = ["evolution.generations=3", "population.size=20"]
    measured = measure_runs(assign(bl.load("never-guessing"), small), 0)
    assert np.isnan([measured["take-off"], measured["unset-at-take-off"]]).all()
    assert measured["taken-off"] == 0


@pytest.mark.parametrize(
    ("law", "unset", "expected"),
    [
        ("uniform", 0.5, [1 / 3] * 3),
        ("founders", 0.5, [0.25, 0.5, 0.25]),
        ("founders", 0.0, [0.5, 0.0, 0.5]),
        ("founders", 1.0, [0.0, 1.0, 0.0]),
    ],
)
def test_mutations_draw_alleles_by_their_law(law: str, unset: float, expected: list[float]) -> None:
    settings = [
        "evolution.mutation_rate=1",
        "population.size=2000",
        f"hinton_nowlan.initial_unset_share={unset}",
    ]
    experiment = assign(
        bl.load("guessing"), [*settings, f"evolution.one_point_alleles.mutation_law={law}"]
    )
    children, _ = breed(experiment, make_strings(0, 2000)[0], np.ones(2000), GenerationKey(0, 0, 1))
    shares = [float((children == allele).mean()) for allele in (0, 0.5, 1)]
    assert shares == pytest.approx(expected, abs=4 * 0.5 / np.sqrt(children.size))


SMALL = ["population.size=60", "evolution.generations=12"]


def test_a_needle_that_never_moves_is_bit_identical_to_hinton_and_nowlan() -> None:
    still = bl.simulate(
        assign(
            bl.load("moving-needle"),
            [*SMALL, "evolution.mutation_rate=0", "moving_needle.period=0"],
        ),
        seed=3,
    )
    reference = bl.simulate(
        assign(bl.load("hinton-nowlan"), [*SMALL, "record.genome_every=10"]), seed=3
    )
    np.testing.assert_array_equal(still.genome, reference.genome)
    np.testing.assert_array_equal(still.energy, reference.energy)
    for moved, fixed in {
        "right": "ones",
        "wrong": "zeros",
        "unset": "unset",
        "succeeded": "succeeded",
        "used": "used",
    }.items():
        np.testing.assert_array_equal(still[moved], reference[fixed])


def make_targets(run: int = 0, generations: int = 40, **fields: Any) -> npt.NDArray[np.int64]:
    """Return the targets [generation, locus]."""
    return np.stack(
        [MovingNeedle(**fields).target(5, run, generation) for generation in range(generations)]
    )


def test_the_target_changes_after_each_period_at_most_at_the_given_number_of_loci() -> None:
    values = make_targets(period=8, redrawn_loci=3)
    changed = (values[1:] != values[:-1]).sum(axis=1)
    moves = np.arange(1, 40) % 8 == 0
    assert (values[:8] == 1).all() and (changed[~moves] == 0).all()
    assert changed[moves].max() in (1, 2, 3)
    assert not np.array_equal(values[-1], make_targets(run=1, period=8, redrawn_loci=3)[-1]), (
        "each run has its own target"
    )


def test_a_target_does_not_depend_on_the_generations_that_were_computed_before() -> None:
    model = MovingNeedle(period=1, redrawn_loci=2)
    generations = [30_000, 1, 99, 100, 101, 250, 201]
    values = {generation: model.target(5, 0, generation) for generation in generations}
    expected = np.ones(model.loci, np.int64)
    for generation in range(1, 251):
        draws = uniforms(5, 0, generation, LIFE, (1, 3))[0, 1:]
        for locus_draw, allele_draw, *_ in draws:
            expected[int(locus_draw * model.loci)] = allele_draw < 0.5
        if generation in values:
            np.testing.assert_array_equal(values[generation], expected)


def test_half_of_the_drawn_loci_change_and_all_loci_are_drawn() -> None:
    changes = np.concatenate(
        [
            np.diff(make_targets(run=run, period=1, redrawn_loci=1, generations=60), axis=0) != 0
            for run in range(30)
        ]
    )
    drawn = len(changes)
    assert abs(changes.sum() - drawn / 2) < 4 * np.sqrt(drawn / 4)
    assert changes.any(axis=0).all()


@pytest.mark.parametrize("guessing", [True, False])
def test_a_lifetime_equals_the_lifetime_of_the_string_relative_to_the_target(
    guessing: bool,
) -> None:
    """The reference is Hinton and Nowlan's oracle, with a target of ones."""
    model = MovingNeedle(period=1, guessing=guessing)
    right = model.target(7, 2, 30)
    assert 0 < right.sum() < 20
    generator = np.random.default_rng(1)
    strings = generator.choice(
        np.array([0, 0.5, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1], np.float32), (200, 20)
    )
    strings[:80] = np.where(strings[:80] == 0, 1, strings[:80])
    genomes = np.where(right == 1, strings, 1 - strings)
    results = model.simulate(7, [2], 30, genomes[None, :, None])
    luck = uniforms(7, 2, 30, LIFE, (200, 1))[:, 0, 0]
    plain = HintonNowlan(guessing=guessing)
    assert results.energy[0].tolist() == [
        evaluate_hinton_nowlan(plain, string.tolist(), chance)
        for string, chance in zip(strings, luck, strict=True)
    ]
    assert (results.records["right"][0] == (genomes == right).mean(axis=1, dtype=np.float32)).all()
    succeeded = results.records["succeeded"][0] == 1
    if guessing:
        assert (
            results.learned is not None
            and succeeded.any()
            and (results.learned[0, succeeded] == right).all()
        ), "agents that succeed have the correct alleles at death"


def test_measures_use_the_second_half_of_the_generations() -> None:
    run = bl.simulate(assign(bl.load("moving-needle"), SMALL), seed=1).expand_dims("run")
    assert MovingNeedle.measures["unset"].of(run).item() == pytest.approx(
        run.unset.values[0, 6:].mean()
    )
    assert MovingNeedle.measures["fitness"].of(run).item() == pytest.approx(
        run.energy.values[0, 6:].mean()
    )
