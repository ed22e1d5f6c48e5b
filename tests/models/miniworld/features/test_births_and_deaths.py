"""Test births and deaths in mid-life against a plain Python reference and against theory."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

from baldwinlab.api.checks.fixture import group_parts
from baldwinlab.api.checks.oracles import check_oracle
from baldwinlab.engine import rng
from baldwinlab.experiment import Experiment, registry
from baldwinlab.models.miniworld.backends.cpu import CpuBatch
from baldwinlab.papers.presets import load
from baldwinlab.parts.part import compiled_values
from baldwinlab.simulation.replay import replay
from baldwinlab.simulation.simulate import simulate, simulate_batch
from baldwinlab.studies.assays.catalog import get_assay, load_assays
from tests.models.miniworld.plain import draw_founders, simulate_steps
from tests.oracles.parts import use_oracles
from tests.oracles.variation import breed_crossover
from tests.worlds import make_small_experiment

SEED = 5
AGENTS = 6
FIELDS = {"initial_energy": 1.5, "cost_per_step": 0.1, "max_age": 40}
Account = dict[str, float]


def make_experiment(
    condition: str = "evo", fields: dict[str, Any] | None = None, **changes: Any
) -> Experiment:
    """Return an experiment in which an agent dies every few steps."""
    world = {"features": ["births-and-deaths"], "births_and_deaths": fields or FIELDS}
    return make_small_experiment(
        condition, **{"world": world, "evolution": {"elite": AGENTS, "generations": 3}} | changes
    )


def draw_words(number: int, purpose: int, draws: int = 1) -> npt.NDArray[np.uint32]:
    """Return random words [draw, 4] of a number in generation 0."""
    return np.array(
        [rng.philox(draw, number, 0, purpose, SEED, 0) for draw in range(draws)], np.uint32
    )


def draw_first_accounts(fields: dict[str, Any]) -> list[Account]:
    """Return the random ages and energies of the first agents."""
    accounts = []
    for agent in range(AGENTS):
        words = draw_words(agent, rng.AGE)[0]
        age = int(float(rng.unit(words[0])) * fields["max_age"])
        share = float(rng.unit(words[1]))
        accounts.append({"age": age, "energy": share * fields["initial_energy"]})
    return accounts


def select_parent(shares: list[float], word: Any) -> int:
    """Select an agent by roulette, with a random word."""
    point = float(rng.unit(word)) * sum(shares)
    return int(np.searchsorted(np.cumsum(shares), point, side="right"))


def select_parents(shares: list[float], number: int) -> tuple[int, int]:
    """Return two parents, the fitter one first, of the child with this number."""
    words = draw_words(number, rng.SELECTION)[0]
    first = select_parent(shares, words[0])
    second = select_parent(shares, words[1])
    return (second, first) if shares[second] > shares[first] else (first, second)


def make_child(
    experiment: Experiment, genome: npt.NDArray[np.float32], parents: tuple[int, int], number: int
) -> Any:
    part: Any = compiled_values(
        experiment.part("evolution.variation"), experiment, lambda array: array
    )
    draws = (draw_words(number, rng.INHERITANCE, genome[0].size) + 0.5) * 2.0**-32
    gate = (float(draw_words(number, rng.MUTATION_GATE)[0, 0]) + 0.5) * 2.0**-32
    fitter, second = (genome[parent].astype(float).tolist() for parent in parents)
    return np.array(breed_crossover(part, fitter, second, draws.tolist(), gate), np.float32)


def is_dead(account: Account, max_age: float) -> bool:
    return account["energy"] <= 1e-5 or account["age"] >= max_age


@pytest.mark.usefixtures("in_plain_python")
@pytest.mark.parametrize(
    ("condition", "max_age"), [("evo", 40), ("evo+self-taught", 40), ("evo", 4)]
)
def test_births_and_deaths_agree_with_a_plain_python_reference(
    condition: str, max_age: int
) -> None:
    # Sums of this cost have no rounding errors.
    fields = FIELDS | {"max_age": max_age, "cost_per_step": 0.125}
    learning = {"rate": 0.5} if condition != "evo" else {}
    experiment = make_experiment(condition, fields, learning=learning)
    genome = draw_founders(experiment)
    batch = simulate_steps(experiment, genome, 0)
    accounts = draw_first_accounts(fields)
    birth_counts = [0] * AGENTS
    largest_number_of_deaths = 0
    eaten = np.zeros(AGENTS)
    genome = genome.copy()
    for step in range(experiment.lifetime.steps):
        batch.simulate(step, step + 1)
        meals = batch.eaten_in_life()[0].sum(axis=1) - eaten
        eaten = eaten + meals
        for account, meal in zip(accounts, meals, strict=True):
            account["age"] += 1
            account["energy"] += meal - fields["cost_per_step"]
        dying_agents = [agent for agent in range(AGENTS) if is_dead(accounts[agent], max_age)]
        largest_number_of_deaths = max(largest_number_of_deaths, len(dying_agents))
        for agent in dying_agents:
            # The energy of a child counts for the next child of the same step.
            shares = [max(0.0, account["energy"]) for account in accounts]
            shares = shares if any(shares) else [1.0] * AGENTS
            # The engine has float32 sums, whose rounding decides between parents of equal energy.
            sums = np.cumsum(np.array(shares, np.float32), dtype=np.float32)
            shares = np.diff(sums, prepend=np.float32(0)).tolist()
            number = AGENTS + sum(birth_counts)
            genome[agent] = make_child(experiment, genome, select_parents(shares, number), number)
            accounts[agent] = {"age": 0, "energy": FIELDS["initial_energy"]}
            birth_counts[agent] += 1
            # The newborn has learned nothing.
            np.testing.assert_array_equal(
                batch.weights()[0, agent], batch.state.genome[0, agent, 0]
            )
        np.testing.assert_allclose(batch.state.genome[0], genome, rtol=1e-6, atol=1e-7)
        assert batch.state.birth_count[0].tolist() == birth_counts
    assert largest_number_of_deaths > 1
    assert sum(birth_counts) > 2 * AGENTS and eaten.sum() > AGENTS


@pytest.mark.usefixtures("in_plain_python")
def test_a_population_without_deaths_equals_one_without_births_in_mid_life() -> None:
    fields = {"initial_energy": 1000.0, "cost_per_step": 0.0, "max_age": 100_000_000}
    immortal = make_experiment(fields=fields, evolution={"elite": 0, "generations": 2})
    plain = make_small_experiment("evo", evolution={"generations": 2})
    actual = simulate(immortal, seed=2)
    expected = simulate(plain, seed=2)
    assert actual["born"].sum() == 0 and expected["food_eaten"].sum() > 0
    for name in ("food_eaten", "energy", "parents", "genome"):
        np.testing.assert_array_equal(actual[name], expected[name])


@pytest.mark.usefixtures("in_plain_python")
def test_the_final_population_is_the_next_generation_and_the_record_has_its_parents() -> None:
    experiment = make_experiment()
    run = simulate(experiment, seed=SEED)
    for generation in (0, 1):
        genomes = run["genome"].values[generation]
        batch = simulate_steps(experiment, genomes, experiment.lifetime.steps, generation)
        final_genomes = batch.state.genome[0]
        origin = batch.state.origin[0]
        assert run["born"].values[generation].tolist() == batch.state.birth_count[0].tolist()
        for agent, genome in enumerate(run["genome"].values[generation + 1]):
            (parent, *_) = np.flatnonzero((final_genomes == genome).all(axis=(1, 2)))
            assert run["parents"].values[generation + 1, agent].tolist() == origin[parent].tolist()
    np.testing.assert_array_equal(
        replay(experiment, seed=SEED, generation=2)["weight_birth"], run["genome"][2]
    )


@pytest.mark.usefixtures("in_plain_python")
def test_births_do_not_depend_on_the_division_of_a_lifetime_into_parts() -> None:
    for update in ("simultaneous", "sequential"):
        experiment = make_experiment("evo+self-taught", lifetime={"steps": 60, "update": update})
        genome = draw_founders(experiment)
        undivided = simulate_steps(experiment, genome, 60)
        divided = simulate_steps(experiment, genome, 7)
        divided.simulate(7, 31)
        divided.simulate(31, 60)
        assert undivided.state.birth_count.sum() > AGENTS
        for name in ("genome", "weights", "birth_count", "origin", "positions"):
            expected = getattr(undivided.state, name)
            np.testing.assert_array_equal(getattr(divided.state, name), expected)


@pytest.mark.usefixtures("in_plain_python")
def test_the_next_generation_inherits_the_learned_weights_of_the_final_population() -> None:
    lamarckian = {"elite": AGENTS, "generations": 2, "lamarckian_share": 1.0}
    experiment = make_experiment("evo+self-taught", evolution=lamarckian, learning={"rate": 0.5})
    run = simulate(experiment, seed=SEED)
    batch = simulate_steps(experiment, run["genome"].values[0], experiment.lifetime.steps)
    learned = {weights.tobytes() for weights in batch.weights()[0]}
    assert {genome[0].tobytes() for genome in run["genome"].values[1]} == learned
    assert batch.weights()[0].tobytes() != batch.state.genome[0, :, 0].tobytes()


@pytest.mark.usefixtures("in_plain_python")
@pytest.mark.parametrize(
    "changes", [{"population": {"size": 1}}, {"world": {"food": []}}], ids=["one agent", "no food"]
)
def test_births_continue_with_a_single_agent_and_without_food(changes: dict[str, Any]) -> None:
    experiment = make_experiment(evolution={"elite": 1, "generations": 1}).replace(**changes)
    run = simulate(experiment, seed=1)
    assert (run["born"] > 0).all()
    if "world" in changes:
        assert run["food_eaten"].sum() == 0


@pytest.mark.usefixtures("in_plain_python")
@pytest.mark.parametrize(
    ("kind", "name"),
    [
        ("sense", "last-action"),
        ("sense", "touch"),
        ("sense", "energy"),
        ("network", "simple-recurrent"),
        ("network", "continuous-time"),
    ],
)
def test_a_part_with_data_of_earlier_steps_agrees_with_its_oracle_after_births(
    kind: str, name: str
) -> None:
    """An oracle has no data of the agent that a newborn replaces."""
    group = next(group_parts([registry.find_class(kind, name)]))
    world = {"features": ["births-and-deaths"], "births_and_deaths": FIELDS | {"max_age": 9}}
    experiment = group.experiment.replace(world=world, lifetime={"steps": 25})
    with use_oracles():
        check_oracle(group._replace(experiment=experiment))


@pytest.mark.nightly
def test_heterozygosity_of_the_neutral_control_follows_the_moran_model() -> None:
    """In Moran's model, H = H(0) (1 - 2/N^2)^births. Parents and dead agents are random."""
    runs = range(300)
    control = make_experiment(
        fields={"initial_energy": 1.0, "cost_per_step": 0.0, "max_age": 30},
        evolution={"selection": "neutral", "mutation_rate": 0.0, "generations": 1},
    )
    assert control.evolution.elite == 0
    batch = CpuBatch(control, 3, runs)
    alleles = np.arange(AGENTS, dtype=np.float32)[:, None, None]
    batch.begin(0, np.broadcast_to(alleles, (len(runs), AGENTS, 1, control.genome_length)))
    batch.simulate(0, 100)
    shares = (batch.state.genome[:, :, 0, :, None] == np.arange(AGENTS)).mean(axis=1)
    births = batch.state.birth_count.sum(axis=1)
    ratio = (1 - (shares**2).sum(axis=-1).mean(axis=1)) / (1 - 2 / AGENTS**2) ** births
    assert births.min() > AGENTS
    assert abs(ratio.mean() - (1 - 1 / AGENTS)) < 4 * ratio.std(ddof=1) / len(runs) ** 0.5


@pytest.mark.nightly
def test_foraging_evolves_by_births_and_deaths_but_not_in_the_neutral_control() -> None:
    selected = load("evo/births-and-deaths").replace(evolution={"generations": 12})
    eaten = []
    for experiment in (selected, selected.neutral_control()):
        runs = simulate_batch(experiment, 1, range(8))
        eaten.append([float(run["food_eaten"][-4:].mean()) for run in runs])
    assert np.median(eaten[0]) > 15 > 5 > np.median(eaten[1])


def test_an_unsupported_assay_is_refused_in_a_sentence() -> None:
    experiment = make_experiment("evo+self-taught")
    reasons = {name: get_assay(name).find_obstacle(experiment) for name in load_assays()}
    assert [name for name, reason in reasons.items() if not reason] == ["descent"]
    assert "newborns replace agents" in reasons["innate"]
