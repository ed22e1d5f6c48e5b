"""Births and deaths in mid-life: against a ledger kept by hand, against theory, and that what is recorded is so."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

import baldwinlab as bl
from baldwinlab.engine import rng
from baldwinlab.evolution import GenerationKey, draw_genomes
from baldwinlab.evolution.variation import Crossover
from baldwinlab.experiment import Experiment, ExperimentError
from baldwinlab.models.miniworld.backends.cpu import CpuBatch
from baldwinlab.models.miniworld.features.births_and_deaths import BirthsAndDeaths
from baldwinlab.models.miniworld.senses.sight import perceive
from baldwinlab.papers.presets import load
from baldwinlab.parts.part import compiled_values
from baldwinlab.simulation.replay import replay
from baldwinlab.simulation.simulate import simulate, simulate_batch
from baldwinlab.studies.assays.catalog import ASSAYS, why_not_applicable
from tests.worlds import make_small_experiment

SEED, AGENTS = 5, 6
FIELDS = {"initial_energy": 1.5, "cost_per_step": 0.1, "max_age": 40}
Account = dict[str, float]


def turning_over(
    condition: str = "evo", fields: dict[str, Any] | None = None, **changes: Any
) -> Experiment:
    """The small world, in which somebody dies every few steps."""
    world = {"features": ["births-and-deaths"], "births_and_deaths": fields or FIELDS}
    return make_small_experiment(
        condition, **{"world": world, "evolution": {"elite": AGENTS, "generations": 3}} | changes
    )


def drawn(number: int, purpose: int, draws: int = 1) -> npt.NDArray[np.uint32]:
    """Random words [draw, 4] of a number in generation 0."""
    return np.array(
        [rng.philox(draw, number, 0, purpose, SEED, 0) for draw in range(draws)], np.uint32
    )


def first_accounts() -> list[Account]:
    """How old the first newborns begin, and with how much left: as if in mid-life."""
    accounts = []
    for agent in range(AGENTS):
        words = drawn(agent, rng.AGE)[0]
        age, share = int(float(rng.unit(words[0])) * FIELDS["max_age"]), float(rng.unit(words[1]))
        accounts.append({"age": age, "left": share * FIELDS["initial_energy"]})
    return accounts


def chosen(shares: list[float], word: Any) -> int:
    """Whose slice of the wheel a random word falls in."""
    point, ends = float(rng.unit(word)) * sum(shares), np.cumsum(shares)
    return int(np.searchsorted(ends, point, side="right"))


def child_of(
    experiment: Experiment, genome: npt.NDArray[np.float32], parents: tuple[int, int], number: int
) -> Any:
    part: Any = compiled_values(
        experiment.part("evolution.variation"), experiment, lambda array: array
    )
    draws = (drawn(number, rng.INHERITANCE, genome[0].size) + 0.5) * 2.0**-32
    gate = (float(drawn(number, rng.MUTATION_GATE)[0, 0]) + 0.5) * 2.0**-32
    fitter, other = (genome[parent].astype(float).tolist() for parent in parents)
    return np.array(Crossover.oracle(part, fitter, other, draws.tolist(), gate), np.float32)


@pytest.mark.usefixtures("in_plain_python")
@pytest.mark.parametrize("condition", ["evo", "evo+self-taught"])
def test_who_dies_when_and_whose_child_comes_is_what_a_ledger_kept_by_hand_says(
    condition: str,
) -> None:
    experiment = turning_over(condition, learning={"rate": 0.5} if condition != "evo" else {})
    batch = CpuBatch(experiment, SEED, [0])
    genome = draw_genomes(experiment, GenerationKey(SEED, 0, 0))
    batch.begin(0, genome[None])
    accounts, born, eaten = first_accounts(), [0] * AGENTS, np.zeros(AGENTS)
    genome = genome.copy()
    for step in range(experiment.lifetime.steps):
        batch.simulate(step, step + 1)
        meals = batch.eaten_in_life()[0].sum(axis=1) - eaten
        eaten = eaten + meals
        for account, meal in zip(accounts, meals, strict=True):
            account["age"] += 1
            account["left"] += meal - FIELDS["cost_per_step"]
        shares = [max(0.0, account["left"]) for account in accounts]
        shares = shares if any(shares) else [1.0] * AGENTS
        for agent in [
            k
            for k, one in enumerate(accounts)
            if one["left"] <= 1e-5 or one["age"] >= FIELDS["max_age"]
        ]:
            number = AGENTS + sum(born)
            words = drawn(number, rng.SELECTION)[0]
            one, other = chosen(shares, words[0]), chosen(shares, words[1])
            parents = (other, one) if shares[other] > shares[one] else (one, other)
            genome[agent] = child_of(experiment, genome, parents, number)
            accounts[agent], born[agent] = (
                {"age": 0, "left": FIELDS["initial_energy"]},
                born[agent] + 1,
            )
            np.testing.assert_array_equal(
                batch.weights()[0, agent], batch.state.genome[0, agent, 0]
            )  # nothing is learned yet
        np.testing.assert_allclose(batch.state.genome[0], genome, rtol=1e-6, atol=1e-7)
        assert batch.state.birth_count[0].tolist() == born
    assert sum(born) > 2 * AGENTS and eaten.sum() > AGENTS


@pytest.mark.usefixtures("in_plain_python")
def test_who_cannot_starve_or_grow_old_lives_as_where_nobody_is_born_in_mid_life() -> None:
    eternal = {"initial_energy": 1000.0, "cost_per_step": 0.0, "max_age": 100_000_000}
    with_births = turning_over(fields=eternal, evolution={"elite": 0, "generations": 2})
    plain = make_small_experiment("evo", evolution={"generations": 2})
    one, other = simulate(with_births, seed=2), simulate(plain, seed=2)
    assert one["born"].sum() == 0 and other["food_eaten"].sum() > 0
    for name in ("food_eaten", "energy", "parents", "genome"):
        np.testing.assert_array_equal(one[name], other[name])


@pytest.mark.usefixtures("in_plain_python")
def test_who_lives_at_the_end_is_who_the_next_generation_is_and_the_record_says_of_whom_they_descend() -> (
    None
):
    experiment = turning_over()
    run = simulate(experiment, seed=SEED)
    for generation in (0, 1):
        batch = CpuBatch(experiment, SEED, [0])
        batch.begin(generation, run["genome"].values[generation][None])
        batch.simulate(0, experiment.lifetime.steps)
        living, origin = batch.state.genome[0], batch.state.origin[0]
        assert run["born"].values[generation].tolist() == batch.state.birth_count[0].tolist()
        for agent, genome in enumerate(run["genome"].values[generation + 1]):
            (place, *_) = np.flatnonzero((living == genome).all(axis=(1, 2)))
            assert run["parents"].values[generation + 1, agent].tolist() == origin[place].tolist()
    np.testing.assert_array_equal(
        replay(experiment, seed=SEED, generation=2)["weight_birth"], run["genome"][2]
    )


@pytest.mark.usefixtures("in_plain_python")
def test_a_life_in_pieces_and_one_agent_after_another_has_its_births_all_the_same() -> None:
    for update in ("simultaneous", "sequential"):
        experiment = turning_over("evo+self-taught", lifetime={"steps": 60, "update": update})
        genome = draw_genomes(experiment, GenerationKey(SEED, 0, 0))[None]
        whole, pieces = CpuBatch(experiment, SEED, [0]), CpuBatch(experiment, SEED, [0])
        for batch, cuts in ((whole, [0, 60]), (pieces, [0, 7, 31, 60])):
            batch.begin(0, genome)
            for first, last in pairwise(cuts):
                batch.simulate(first, last)
        assert whole.state.birth_count.sum() > AGENTS
        for name in ("genome", "weights", "birth_count", "origin", "positions"):
            np.testing.assert_array_equal(getattr(whole.state, name), getattr(pieces.state, name))


@pytest.mark.usefixtures("in_plain_python")
def test_what_the_last_to_live_had_learned_is_inherited_from_generation_to_generation() -> None:
    lamarckian = {"elite": AGENTS, "generations": 2, "lamarckian_share": 1.0}
    experiment = turning_over("evo+self-taught", evolution=lamarckian, learning={"rate": 0.5})
    run = simulate(experiment, seed=SEED)
    batch = CpuBatch(experiment, SEED, [0])
    batch.begin(0, run["genome"].values[0][None])
    batch.simulate(0, experiment.lifetime.steps)
    learned = {weights.tobytes() for weights in batch.weights()[0]}
    assert {genome[0].tobytes() for genome in run["genome"].values[1]} == learned
    assert batch.weights()[0].tobytes() != batch.state.genome[0, :, 0].tobytes()


@pytest.mark.usefixtures("in_plain_python")
@pytest.mark.parametrize(
    "changes", [{"population": {"size": 1}}, {"world": {"food": []}}], ids=["one agent", "no food"]
)
def test_one_agent_is_its_own_heir_and_where_there_is_no_food_all_die_and_the_line_goes_on(
    changes: dict[str, Any],
) -> None:
    experiment = turning_over(evolution={"elite": 1, "generations": 1}).replace(**changes)
    run = simulate(experiment, seed=1)
    assert (run["born"] > 0).all()
    if "world" in changes:
        assert run["food_eaten"].sum() == 0


@pytest.mark.usefixtures("in_plain_python")
def test_a_newborn_has_gained_nothing_yet_whatever_was_eaten_in_its_place() -> None:
    experiment = turning_over(senses={"kinds": ["food", "energy"]}, fields=FIELDS | {"max_age": 20})
    batch = CpuBatch(experiment, SEED, [0])
    batch.begin(0, draw_genomes(experiment, GenerationKey(SEED, 0, 0))[None])
    sensed: list[float] = []
    for step in range(experiment.lifetime.steps):
        before = batch.state.birth_count[0].copy()
        batch.simulate(step, step + 1)
        newborn = (batch.state.birth_count[0] > before) & (batch.eaten_in_life()[0].sum(axis=1) > 0)
        for agent in np.flatnonzero(newborn).tolist():
            perceive(batch.model, batch.state, 0, agent)
            sensed.append(float(batch.state.activations[3, agent]))
    assert len(sensed) > AGENTS and set(sensed) == {0.0}


def test_in_the_neutral_twin_heterozygosity_falls_by_2_in_n_squared_a_birth() -> None:
    """As in the model of Moran: H = H(0) (1 - 2/N^2)^births, where parents and the dead are anybody."""
    runs, fields = range(300), {"initial_energy": 1.0, "cost_per_step": 0.0, "max_age": 30}
    twin = turning_over(
        fields=fields, evolution={"selection": "neutral", "mutation_rate": 0.0, "generations": 1}
    )
    assert twin.evolution.elite == 0
    batch = CpuBatch(twin, 3, runs)
    of_agents = np.arange(AGENTS, dtype=np.float32)[:, None, None]
    batch.begin(0, np.broadcast_to(of_agents, (len(runs), AGENTS, 1, twin.genome_length)))
    batch.simulate(0, 100)
    shares = (batch.state.genome[:, :, 0, :, None] == np.arange(AGENTS)).mean(axis=1)
    births = batch.state.birth_count.sum(axis=1)
    ratio = (1 - (shares**2).sum(axis=-1).mean(axis=1)) / (1 - 2 / AGENTS**2) ** births
    assert births.min() > AGENTS
    assert abs(ratio.mean() - (1 - 1 / AGENTS)) < 4 * ratio.std(ddof=1) / len(runs) ** 0.5


def test_foraging_evolves_by_births_and_deaths_in_mid_life_alone_and_not_in_the_neutral_twin() -> (
    None
):
    selected = load("evo/births-and-deaths").replace(evolution={"generations": 12})
    eaten = []
    for experiment in (selected, selected.neutral_control()):
        runs = simulate_batch(experiment, 1, range(8))
        eaten.append([float(run["food_eaten"][-4:].mean()) for run in runs])
    assert np.median(eaten[0]) > 15 > 5 > np.median(eaten[1])


def test_what_cannot_be_is_refused_in_a_sentence() -> None:
    with pytest.raises(
        ExperimentError,
        match=r"needs a variation that creates one child at a time; .* 'neat' does not",
    ):
        turning_over().replace(evolution={"variation": "neat", "selection": "species"})
    asked = {name: why_not_applicable(name, turning_over("evo+self-taught")) for name in ASSAYS}
    assert [name for name, why in asked.items() if not why] == ["descent"]
    assert "newborns replace agents" in asked["innate"]


@pytest.mark.nightly
def test_every_requirement_of_a_part_holds() -> None:
    assert [str(found) for found in bl.check_part(BirthsAndDeaths) if found.holds is False] == []
