"""Tests of the models that the explorable simulates in JavaScript, against theory and Python."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from playwright.sync_api import Browser, Page

from baldwinlab.analysis.theory.needle import balance_of_unset
from baldwinlab.lab.pages import explorable
from baldwinlab.lab.pages.lesson_pack import find_texts
from baldwinlab.papers import presets
from baldwinlab.simulation.reevaluation import reevaluate
from baldwinlab.simulation.simulate import simulate, simulate_batch
from tests.lab.essays import RECORDINGS, STRINGS, open_essay
from tests.models.test_hinton_nowlan import PAYING, exact_step

Numbers = npt.NDArray[np.float64]
DATA = json.loads(json.dumps(explorable.collect_data(STRINGS)))
PUZZLE = DATA["needle"]["settings"]
CHANGING = PUZZLE | {"mutation_rate": DATA["needle"]["mutation_rate"], "period": 10}
CLIMBERS = DATA["climbers"]["settings"]


@pytest.fixture(scope="module")
def page(browser: Browser, essay: Path) -> Iterator[Page]:
    with open_essay(browser, essay, reduced_motion="reduce") as opened:
        yield opened


def evaluate(page: Page, module: str, body: str, argument: Any = None) -> Any:
    """Return the result of a function body with the names of a module and `argument`."""
    script = f"""async argument => {{
      const module = await import("lab/explorable/{module}.js");
      return (({{ {", ".join(NAMES[module])} }}) => {{ {body} }})(module);
    }}"""
    return page.evaluate(script, argument)


NAMES = {
    "random": ["createRandom", "drawInteger"],
    "needle_model": ["NeedlePopulation", "OPEN", "computeBalance"],
    "landscape_model": ["createClimbers", "ClimberPopulation"],
    "lesson_model": ["Learner", "chooseAction"],
}


def assert_agree(first: Any, second: Any) -> None:
    """Require that the means of two samples [run, quantity] differ by chance only."""
    first, second = np.array(first, float), np.array(second, float)
    error = np.sqrt(first.var(axis=0) / len(first) + second.var(axis=0) / len(second))
    assert (abs(first.mean(axis=0) - second.mean(axis=0)) < 4 * error).all(), (
        first.mean(axis=0),
        second.mean(axis=0),
    )


def test_random_numbers_are_uniform_and_depend_on_their_keys(page: Page) -> None:
    draw = """
      const draw = (...keys) => Array.from({ length: 20000 }, createRandom(...keys));
      return [draw(7, 0), draw(7, 0), draw(7, 1), draw(8, 0)];
    """
    first, again, other_run, other_seed = np.array(evaluate(page, "random", draw))
    assert (first == again).all()
    error = 1 / np.sqrt(first.size)
    for numbers in (first, other_run, other_seed):
        counts = np.histogram(numbers, 10, (0, 1))[0]
        assert abs(counts - 2000).max() < 4 * np.sqrt(2000 * 0.9)
        assert abs(np.corrcoef(numbers[1:], numbers[:-1])[0, 1]) < 4 * error
    for numbers in (other_run, other_seed):
        assert abs(np.corrcoef(first, numbers)[0, 1]) < 4 * error


@pytest.mark.parametrize("unset", [0, 1, 4, 8, 12])
def test_the_number_of_guesses_agrees_with_the_closed_form(page: Page, unset: int) -> None:
    """A trial succeeds with p = 2^-q, so T trials have the mean (1 - (1 - p)^T) / p."""
    guess = """
      const population = new NeedlePopulation(argument.settings, 1);
      population.genomes.forEach((_, index) =>
        (population.genomes[index] = index % 20 < argument.unset ? OPEN : 1));
      const { trials, succeeded } = population.next();
      return [trials, succeeded, Array.from(population.fitness)];
    """
    agents = 4000
    argument = {"settings": PUZZLE | {"agents": agents}, "unset": unset}
    trials, succeeded, fitness = evaluate(page, "needle_model", guess, argument)
    chance, limit = 0.5**unset, PUZZLE["trials"]
    failure = (1 - chance) ** limit
    mean = (1 - failure) / chance
    assert abs(trials - mean) <= 4 * np.sqrt(1 - chance) / chance / np.sqrt(agents)
    assert abs(succeeded - (1 - failure)) <= 4 * np.sqrt(failure / agents)
    assert np.mean(fitness) == pytest.approx(1 + 19 * (1 - trials / limit), abs=1e-9)


def test_a_generation_follows_the_exact_recursion(page: Page) -> None:
    """The recursion of tests/models/test_hinton_nowlan.py, for independent loci."""
    step = """
      const { settings, shares } = argument;
      const population = new NeedlePopulation(settings, 5);
      const draw = () => {
        const number = population.random();
        return number < shares[0] ? 1 : number < shares[0] + shares[1] ? 0 : OPEN;
      };
      population.genomes = population.genomes.map(draw);
      population.next();
      const { right, wrong, open } = population.next();
      return [right, wrong, open];
    """
    agents = 20_000
    argument = {"settings": PUZZLE | {"agents": agents}, "shares": PAYING.tolist()}
    after = np.array(evaluate(page, "needle_model", step, argument))
    expected = exact_step(PAYING)
    error = 4 * np.sqrt(expected * (1 - expected) / (agents * PUZZLE["loci"])) * 3
    assert (abs(after - expected) < error).all()
    assert abs(after - PAYING)[0] > 2 * error[0]


def simulate_strings(page: Page, settings: dict[str, Any], runs: int, generations: int) -> Numbers:
    """Return shares of right and open switches, trials and successes [run, generation, 4]."""
    run = """
      const { settings, runs, generations, seed } = argument;
      return Array.from({ length: runs }, (_, run) => {
        const population = new NeedlePopulation(settings, seed, run);
        return Array.from({ length: generations }, () => {
          const { right, open, trials, succeeded } = population.next();
          return [right, open, trials, succeeded];
        });
      });
    """
    argument = {
        "settings": settings,
        "runs": runs,
        "generations": generations,
        "seed": DATA["seed"],
    }
    return np.array(evaluate(page, "needle_model", run, argument))


def test_the_puzzle_agrees_with_python_and_learned_becomes_innate(page: Page) -> None:
    generations = explorable.PUZZLE_GENERATIONS
    strings = simulate_strings(page, PUZZLE, 20, generations)
    runs = simulate_batch(presets.load("guessing"), 0, range(10))
    names = ("ones", "unset", "used", "succeeded")
    python = np.array([[run[name].mean("agent") for name in names] for run in runs])
    # The last generation, and the first generation in which half of the strings succeed.
    assert_agree(strings[:, -1, :3], python[:, :3, -1])
    take_off = (strings[:, :, 3] >= 0.5).argmax(axis=1)
    assert_agree(take_off[:, None], (python[:, 3] >= 0.5).argmax(axis=1)[:, None])
    # Switches become right at birth, and fewer guesses suffice, in each run.
    assert (strings[:, -1, 0] > strings[:, 0, 0] + 0.4).all()
    assert (strings[:, -1, 1] < strings[:, 0, 1] - 0.15).all()
    assert (strings[:, -1, 2] < strings[:, 0, 2] / 10).all()


def test_without_guesses_nothing_happens(page: Page) -> None:
    strings = simulate_strings(page, PUZZLE | {"trials": 0}, 20, explorable.PUZZLE_GENERATIONS)
    assert (strings[:, :, 3] == 0).all(), "no string ever succeeds"
    # Without selection, shares change by drift only, in both directions.
    change = strings[:, -1, 0] - strings[:, 0, 0]
    assert abs(change.mean()) < 4 * change.std() / np.sqrt(len(change))
    silent = presets.load("guessing").replace(hinton_nowlan={"guessing": False})
    run = simulate(silent, seed=0)
    assert run.succeeded.sum() == 0


# [cost, period]: the lowest and the highest choices of the reader, and the first ones.
CORNERS = ((0.25, 2), (0.25, 0), (2.0, 2), (2.0, 0), (1.0, 10))


def test_open_switches_agree_with_theory_and_python(page: Page) -> None:
    half = explorable.CHANGING_GENERATIONS // 2
    shares, errors = {}, []
    for cost, period in CORNERS:
        settings = CHANGING | {"cost": cost, "period": period}
        strings = simulate_strings(page, settings, 2, explorable.CHANGING_GENERATIONS)
        shares[cost, period] = strings[:, half:, 1].mean(axis=1)
        theory = balance_of_unset(cost_of_trials=cost, period=period or np.inf)
        errors.append(abs(shares[cost, period].mean() - theory))
    # The law has no fitted parameter, and an infinite population.
    assert max(errors) < 0.1 and np.mean(errors) < 0.04
    # More becomes innate if guesses are costly, and if the world is stable.
    mean = {choice: values.mean() for choice, values in shares.items()}
    assert mean[2.0, 0] < mean[0.25, 0] < mean[0.25, 2] - 0.1
    assert mean[2.0, 0] < mean[2.0, 2] - 0.1 < mean[0.25, 2] - 0.1
    cost, period = CORNERS[-1]
    needle = presets.load("guessing/every-10").replace(
        moving_needle={"cost_of_trials": cost, "period": period}
    )
    runs = simulate_batch(needle, 0, range(3))
    python = [float(run.unset[half:].mean()) for run in runs]
    assert abs(np.mean(python) - mean[CORNERS[-1]]) < 0.03


THEORY_CASES = (
    (20, 1000, 1.0, 0.01, 10, 2),
    (20, 1000, 0.25, 0.01, 2, 2),
    (20, 1000, 2.0, 0.01, 0, 2),
    (12, 300, 0.7, 0.03, 7, 3),
    (20, 1000, 0.0, 0.01, 5, 2),
    (20, 1000, 1.0, 0.0, 20, 1),
)


def test_the_theory_in_the_page_is_that_of_python(page: Page) -> None:
    names = ("loci", "trials", "cost", "mutation_rate", "period", "redrawn_loci")
    settings = [dict(zip(names, case, strict=True)) for case in THEORY_CASES]
    expected = [
        balance_of_unset(loci, trials, cost, rate, period or np.inf, redrawn)
        for loci, trials, cost, rate, period, redrawn in THEORY_CASES
    ]
    shares = evaluate(page, "needle_model", "return argument.map(computeBalance);", settings)
    assert shares == pytest.approx(expected, abs=1e-9)


def count_peaks(page: Page, k: int, runs: int) -> Numbers:
    count = """
      const { settings, runs } = argument;
      const isPeak = (landscape, string) => Array.from({ length: settings.bits }).every(
        (_, bit) => landscape[string ^ (1 << bit)] < landscape[string]);
      return Array.from({ length: runs }, (_, run) => {
        const { landscape } = createClimbers(settings, 3, run).learners;
        return landscape.filter((_, string) => isPeak(landscape, string)).length;
      });
    """
    argument = {"settings": CLIMBERS | {"k": k}, "runs": runs}
    return np.array(evaluate(page, "landscape_model", count, argument))


def test_the_number_of_peaks_agrees_with_theory(page: Page) -> None:
    """One peak with K = 0; 2^N / (N + 1) on average with K = N - 1 (Kauffman 1993)."""
    assert (count_peaks(page, 0, 5) == 1).all()
    bits = CLIMBERS["bits"]
    peaks = count_peaks(page, bits - 1, 30)
    assert abs(peaks.mean() - 2**bits / (bits + 1)) < 4 * peaks.std() / np.sqrt(peaks.size)


def climb(page: Page, k: int) -> Numbers:
    """Return fitness [landscape, 5]: learners at birth and death and the control before the fork.

    Then learners and the control at birth in the last generation.
    """
    run = """
      const { settings, landscapes, fork_generation: fork, generations_after: after } =
        argument.climbers;
      return Array.from({ length: landscapes }, (_, run) => {
        const changed = { ...settings, k: argument.k };
        const { learners, control } = createClimbers(changed, argument.seed, run);
        const simulate = (generations) => {
          let results;
          for (let count = 0; count < generations; count++)
            results = [learners.next(), control.next()];
          return results;
        };
        const before = simulate(fork);
        learners.stopLearning();
        const end = simulate(after);
        return [before[0].born, before[0].died, before[1].born, end[0].born, end[1].born];
      });
    """
    argument = {"climbers": DATA["climbers"], "seed": DATA["seed"], "k": k}
    return np.array(evaluate(page, "landscape_model", run, argument))


def test_learning_hides_and_guides_on_landscapes(page: Page) -> None:
    born, _, control, end, control_end = climb(page, CLIMBERS["k"]).T
    hidden, guided = born - control, end - control_end
    error = np.sqrt(len(born))
    assert hidden.mean() < -4 * hidden.std() / error
    assert guided.mean() > 4 * guided.std() / error
    # With one peak, learning hides even more, and does not guide.
    born, _, control, end, control_end = climb(page, 0).T
    assert (born - control).mean() < hidden.mean()
    assert abs(end - control_end).max() < 0.05 and abs((end - control_end).mean()) < 0.005


def test_strings_on_landscapes_agree_with_python(page: Page) -> None:
    last = explorable.CLIMBING_GENERATIONS - 1
    climbers = presets.load("climbing/rugged").replace(
        nk_climbers=explorable.CLIMBER_SETTINGS, evolution={"generations": last + 1}
    )
    runs = {
        trials: simulate_batch(climbers.replace(nk_climbers={"trials": trials}), 0, range(40))
        for trials in (CLIMBERS["trials"], 0)
    }
    learners, control = (
        np.array([[run.innate[last].mean(), run.learned[last].mean()] for run in of_trials])
        for of_trials in runs.values()
    )
    python = np.column_stack([learners, control[:, 0]])
    assert_agree(climb(page, CLIMBERS["k"])[:, :3], python)


def test_lessons_agree_with_python_and_the_agent_learns_to_turn(page: Page) -> None:
    learn = """
      const { genome, inputs, rate } = argument;
      const learner = new Learner(genome, rate);
      const read = ({ weights }) => Array.from(weights);
      const first = learner.learn(inputs[0]);
      for (const input of inputs.slice(1)) learner.learn(input);
      const situations = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]];
      const choose = (weights) => situations.map((situation) => chooseAction(weights, situation));
      return [read(learner), choose(learner.born), choose(learner.weights), first];
    """
    agent, genome = RECORDINGS["learner"]["agent"], RECORDINGS["learner"]["genome"]
    inputs = page.evaluate(
        """async agent => {
          const { RecordedSource } = await import("lab/explorable/source.js");
          const { findMiddleAgent } = await import("lab/explorable/map_view.js");
          const data = JSON.parse(document.getElementById("data").textContent);
          const life = await new RecordedSource(data).loadLife("learning");
          const inputs = Array.from({ length: life.last }, (_, step) =>
            [0, 1, 2].map(input => life.readInput(step, agent, input)));
          return findMiddleAgent(life) === agent ? inputs : null;
        }""",
        agent,
    )
    assert inputs is not None, "the agent is that with the ring of step 1"
    experiment = explorable.make_scenes()["learning"]
    argument = {"genome": genome, "inputs": inputs, "rate": experiment.learning.rate}
    weights, born, learned, first = evaluate(page, "lesson_model", learn, argument)
    run = simulate(experiment, seed=DATA["seed"], run=explorable.FIRST_RUN)
    generation = explorable.FIRST_GENERATION
    newborns = run.genome.values[None, generation]
    death = reevaluate(experiment, DATA["seed"], [explorable.FIRST_RUN], generation, newborns)
    assert weights == pytest.approx(death.weights[0, agent].tolist(), abs=1e-3)
    # An output moves toward its target. It is born to go ahead (1), and learns to turn.
    before, target, after = (np.array(first[name]) for name in ("before", "target", "after"))
    assert (abs(after - target) < abs(before - target)).all()
    assert born == [1, 1, 1, 1] and 1 not in learned


SPAN = r"(\d+) to (\d+)"


def find_answers(pattern: str) -> list[tuple[float, ...]]:
    """Return the numbers of the rows of the lecturer's answers that match a pattern."""
    text = (find_texts() / "answers.md").read_text("utf-8").replace(",", "")
    rows = [row.groups() for row in re.finditer(rf"^\| {pattern} \|$", text, re.MULTILINE)]
    assert rows, pattern
    return [tuple(float(number) for number in row) for row in rows]


def test_the_answers_of_the_lessons_are_those_of_the_page(page: Page) -> None:
    for trials, *numbers in find_answers(rf"(\d+) guesses \| {SPAN} % \| {SPAN} % \| {SPAN}"):
        settings = PUZZLE | {"trials": trials}
        strings = simulate_strings(page, settings, 5, explorable.PUZZLE_GENERATIONS)[:, -1]
        shown = np.round(strings[:, :3] * [100, 100, 1])
        assert numbers == np.column_stack([shown.min(axis=0), shown.max(axis=0)]).ravel().tolist()
    for cost, period, low, high, theory in find_answers(
        rf"([\d.]+) \| (\d+) generations \| {SPAN} % \| (\d+) %"
    ):
        settings = CHANGING | {"cost": cost, "period": period}
        strings = simulate_strings(page, settings, 3, explorable.CHANGING_GENERATIONS)
        shown = np.round(100 * strings[:, -1, 1])
        assert (low, high) == (shown.min(), shown.max()), (cost, period)
        assert theory == round(100 * balance_of_unset(cost_of_trials=cost, period=period))
    for k, hidden, guided in find_answers(r"(\d+) others \| (-[\d.]+) \| \+([\d.]+)"):
        born, _, control, end, control_end = 100 * climb(page, int(k)).T
        differences = [(born - control).mean(), (end - control_end).mean()]
        assert np.round(differences, 1).tolist() == [hidden, guided]
    curves = {name: np.mean(runs, axis=0) for name, runs in RECORDINGS["curves"].items()}
    fork = explorable.FORK_GENERATION
    foragers = [curves["forked"][fork - 1], curves["forked"][fork], curves["alone"][fork - 1]]
    rows = find_answers(
        r"(?:learners|agents that never learned) (?:before|after) the switch \| ([\d.]+)"
    )
    assert [number for (number,) in rows] == np.round(foragers, 1).tolist()
