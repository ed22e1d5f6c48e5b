"""Strings that guess: as in plain Python, trial by trial; and as exact theory has it.

The closed forms follow from the model's text: of a string with q alleles ? and no 0, a trial succeeds with chance 2^-q.
"""

from __future__ import annotations

from math import comb
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
import xarray as xr

import baldwinlab as bl
from baldwinlab.check import check_part
from baldwinlab.evolution import Moment, breed, draw_genome
from baldwinlab.experiment import Experiment, assign
from baldwinlab.library.models.needle import HintonNowlan, OnePointOfAlleles
from baldwinlab.parts import LIFE, uniforms
from baldwinlab.runs.simulate import live_batch

LOCI, TRIALS = 20, 1000


def expected_fitness(unset: Any, trials: int = TRIALS) -> Any:
    """Of a string without 0: 1 + 19 E[trials that remain] / trials."""
    chance = 0.5**unset
    return 1 + 19 * (1 - (1 - (1 - chance) ** trials) / (chance * trials))


def strings(unset: int, agents: int, zeros: int = 0) -> npt.NDArray[np.float32]:
    """[run, agent, module, locus], all alike."""
    alleles = np.array([0.5] * unset + [0.0] * zeros + [1.0] * (LOCI - unset - zeros), np.float32)
    return np.tile(alleles, (1, agents, 1, 1))


def lives(genomes: npt.NDArray[np.float32], **fields: Any) -> Any:
    return HintonNowlan(**fields).live(7, [0], 3, genomes)


@pytest.mark.parametrize("fields", [{}, {"guessing": False}, {"counts_success": False}, {"trials": 3}])
def test_a_life_is_worth_what_it_is_trial_by_trial(fields: dict[str, Any]) -> None:
    genomes = np.random.default_rng(1).choice(np.array([0, 0.5, 1, 1, 1, 1], np.float32), (1, 300, 1, 6))
    found = lives(genomes, loci=6, **fields).energy[0]
    luck = uniforms(7, 0, 3, LIFE, (300, 1))[:, 0, 0]
    model = HintonNowlan(loci=6, **fields)
    assert found.tolist() == [model.oracle(one[0].tolist(), chance) for one, chance in zip(genomes[0], luck, strict=True)]
    assert len(set(found.tolist())) > (2 if fields.get("guessing", True) else 1)


@pytest.mark.parametrize("unset", range(0, 21, 2))
def test_mean_fitness_is_that_of_the_closed_form(unset: int) -> None:
    energy = lives(strings(unset, 4000)).energy
    error = energy.std() / np.sqrt(energy.size)
    assert abs(energy.mean() - expected_fitness(unset)) <= 4 * error + 1e-9


def test_the_closed_form_has_the_values_of_the_specification() -> None:
    expected = [19.981, 19.962, 19.924, 19.848, 19.696, 19.392, 18.784, 17.569, 15.233, 11.649, 7.868, 4.965, 3.140, 2.113]
    assert [round(expected_fitness(unset), 3) for unset in range(14)] == expected


def test_who_has_a_0_never_succeeds_and_tries_all_its_life() -> None:
    found = lives(strings(3, 50, zeros=1))
    assert (found.energy == 1).all() and (found.records["succeeded"] == 0).all() and (found.records["used"] == TRIALS).all()


def test_what_is_learned_is_what_was_guessed_and_alleles_add_up_to_all() -> None:
    found = lives(strings(2, 50))
    assert (found.learned == 1).all() and (found.records["succeeded"] == 1).all()
    shares = {name: found.records[name] for name in ("ones", "unset", "zeros")}
    assert {name: share[0, 0].item() for name, share in shares.items()} == pytest.approx({"ones": 0.9, "unset": 0.1, "zeros": 0})


def test_founders_have_a_half_of_question_marks_and_the_rest_alike() -> None:
    genomes = np.concatenate([draw_genome(bl.load("guessing"), Moment(0, run, 0)) for run in range(40)])
    shares = [float((genomes == allele).mean()) for allele in (0, 0.5, 1)]
    assert shares == pytest.approx([0.25, 0.5, 0.25], abs=4 * 0.5 / np.sqrt(genomes.size))
    able = (genomes[:, 0] != 0).all(axis=-1)
    expected = 0.75**LOCI * len(able)
    assert abs(able.sum() - expected) < 4 * np.sqrt(expected), "who could ever learn it"


def exact_step(shares: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
    """The shares of 1, 0 and ? after a generation of an infinite population whose loci are independent."""
    ones, zeros, unset = shares
    q = np.arange(LOCI + 1)
    of_q = np.array([comb(LOCI, int(k)) for k in q]) * unset**q * ones ** (LOCI - q)
    gain = of_q * (expected_fitness(q) - 1)
    mean = 1 + gain.sum()
    after = [ones + (gain * (LOCI - q) / LOCI).sum(), zeros, unset + (gain * q / LOCI).sum()]
    return np.array([share / mean for share in after])


def test_the_exact_recursion_has_the_values_of_the_specification() -> None:
    shares = np.array([0.25, 0.25, 0.5])
    seen = {}
    for generation in range(1, 51):
        shares = exact_step(shares)
        seen[generation] = shares
    assert seen[10] == pytest.approx([0.2662, 0.2310, 0.5029], abs=1e-4)
    assert seen[20] == pytest.approx([0.3045, 0.1892, 0.5063], abs=1e-4)
    assert seen[50] == pytest.approx([0.8231, 0, 0.1769], abs=1e-4)


def test_a_generation_of_free_recombination_follows_the_exact_recursion() -> None:
    """From shares at which learning pays, so that the change is many times its error."""
    experiment = assign(bl.load("guessing"), ["evolution.variation=crossover", "population.size=20000"])
    before, generator = np.array([0.6, 0.02, 0.38]), np.random.default_rng(5)
    genome = generator.choice(np.array([1, 0, 0.5], np.float32), (20_000, 1, LOCI), p=before)
    energy = lives(genome[None]).energy[0]
    children, _ = breed(experiment, genome, energy, Moment(0, 0, 1))
    found = np.array([(children == allele).mean() for allele in (1, 0, 0.5)])
    expected = exact_step(before)
    error = 4 * np.sqrt(expected * (1 - expected) / (20_000 * LOCI)) * 3  # parents are drawn, so children are not independent
    assert (abs(found - expected) < error).all() and (abs(expected - before) > 2 * error)[:1].all()


def test_only_with_guessing_is_the_needle_found_and_then_the_wrong_alleles_vanish() -> None:
    guessing, all_set = (
        [_measured(history) for history in live_batch(bl.load(name), 0, range(4))] for name in ("guessing", "all-set")
    )
    assert all(one["taken-off"] == 1 and one["zeros"] < 0.005 and one["fall"] > 0 for one in guessing)
    assert sum(one["hit"] for one in all_set) <= 1


def _measured(history: Any) -> dict[str, float]:
    names = ("ones", "unset", "zeros", "succeeded")
    run = xr.Dataset({name: (("run", "generation", "agent"), history.of_agents(name)[None]) for name in names})
    return {name: float(measure.of(run).item()) for name, measure in HintonNowlan.measures.items()}


def test_a_run_that_never_takes_off_has_no_take_off() -> None:
    never: Experiment = assign(bl.load("never-guessing"), ["evolution.generations=3", "population.size=20"])
    (history,) = live_batch(never, 0, [0])
    found = _measured(history)
    assert np.isnan(found["take-off"]) and np.isnan(found["unset-at-take-off"]) and found["taken-off"] == 0


def test_the_parts_are_as_parts_should_be() -> None:
    found = [*check_part(HintonNowlan), *check_part(OnePointOfAlleles, only=["fields", "limits", "arithmetic", "oracle"])]
    assert [one for one in found if one.holds is False] == []


def test_a_mutated_allele_is_any_of_the_three() -> None:
    experiment = assign(bl.load("guessing"), ["evolution.mutation_rate=1", "population.size=2000"])
    children, _ = breed(experiment, strings(0, 2000)[0], np.ones(2000), Moment(0, 0, 1))
    shares = [float((children == allele).mean()) for allele in (0, 0.5, 1)]
    assert shares == pytest.approx([1 / 3] * 3, abs=4 * 0.5 / np.sqrt(children.size))
