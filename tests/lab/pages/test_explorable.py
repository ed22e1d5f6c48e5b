"""Tests of the explorable: its texts are true, and its runs are those of the engine."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from playwright.sync_api import Browser, Page, expect

from baldwinlab.experiment import assign
from baldwinlab.lab.pages import explorable
from baldwinlab.simulation.reevaluation import reevaluate
from baldwinlab.simulation.simulate import simulate, simulate_batch
from tests.commands import Command
from tests.lab.essays import RECORDINGS, STRINGS, drag, open_essay, read_value, show

# Words of the title and the introduction, up to the first picture, and of all steps together.
MAX_FIRST_WORDS = 80
MAX_WORDS = 600
EXPORT = ("export", "--format", "explorable", "--out")
# Colored words in a text, such as "{innate|at birth}".
COLORED = re.compile(r"\{\w+\|([^}]*)\}")
SIMULATE = """async request => {
  const { food_eaten, genome } = await window.baldwinlab.simulate(request);
  return [Array.from(food_eaten), Array.from(new Uint8Array(genome.buffer))];
}"""


@pytest.fixture
def page(browser: Browser, essay: Path) -> Iterator[Page]:
    """Yield the explorable in a browser without a network."""
    with open_essay(browser, essay) as opened:
        yield opened


def test_the_command_writes_one_small_file(command: Command, tmp_path: Path) -> None:
    out = tmp_path / "baldwin.html"
    assert command(*EXPORT, str(out)).code == 0
    page = out.read_text("utf-8")
    assert len(page.encode()) <= 1_500_000
    assert not re.findall(r'(?:src|href)="(?!data:)[^"]*"', page)
    out.write_text("mine", "utf-8")
    refused = command(*EXPORT, str(out))
    assert refused.code != 0
    assert "was not written by this command" in refused.err
    assert out.read_text("utf-8") == "mine"
    wrong_ending = command(*EXPORT, "baldwin.txt")
    assert "must end in .html, as --format explorable needs" in wrong_ending.err
    with_source = command("export", "evo/A", "--format", "explorable", "--out", "baldwin.html")
    assert "evo/A does not apply to --format explorable" in with_source.err


def count_words(*texts: str) -> int:
    return len(COLORED.sub(r"\1", " ".join(texts)).split())


def list_texts(step: dict[str, Any]) -> list[str]:
    """Return the texts of a step, without the answers to its question."""
    question = step.get("question", {"text": "", "options": []})
    texts = [step["title"], *step["text"], step["shown"], step["notice"]]
    return [*texts, question["text"], *question["options"]]


def test_the_texts_are_short() -> None:
    page, first = STRINGS["page"], STRINGS["steps"][0]
    first_texts = [page["title"], page["lead"], first["title"], *first["text"]]
    assert count_words(*first_texts) <= MAX_FIRST_WORDS
    assert sum(count_words(*list_texts(step)) for step in STRINGS["steps"]) <= MAX_WORDS


def test_each_question_has_an_answer() -> None:
    questions = [step["question"] for step in STRINGS["steps"] if "question" in step]
    assert len(questions) >= 3
    for question in questions:
        assert 0 <= question["answer"] < len(question["options"])
        assert question["right"] and question["wrong"]


LEARNERS = explorable.make_scenes()["learning"]
NEEDLE = explorable.collect_data(STRINGS)["needle"]["settings"]
CLIMBERS = explorable.collect_data(STRINGS)["climbers"]
# Phrases of each step, with the numbers of the settings.
PHRASES = {
    "agent": [f"The first of {explorable.RUNS} runs", f"generation {explorable.FIRST_GENERATION}."],
    "evolution": [f"In {explorable.RUNS} recorded runs"],
    "puzzle": [
        f"its {NEEDLE['loci']} switches",
        f"100 of {NEEDLE['agents']:,} strings",
    ],
    "changing": [f"(step 4: {NEEDLE['cost']:g})"],
    "landscape": [
        f"{CLIMBERS['settings']['trials']} changes per life",
        f"stops in generation {CLIMBERS['fork_generation']}",
        f"{CLIMBERS['landscapes']} worlds",
        f"{CLIMBERS['settings']['agents']} strings of {CLIMBERS['settings']['bits']} switches",
    ],
    "foragers": [f"mean of the {explorable.RUNS} recorded runs"],
}


@pytest.mark.parametrize("name", PHRASES)
def test_the_numbers_in_the_texts_are_those_of_the_settings(name: str) -> None:
    (step,) = (step for step in STRINGS["steps"] if step["id"] == name)
    texts = COLORED.sub(r"\1", " ".join(list_texts(step)))
    assert [phrase for phrase in PHRASES[name] if phrase not in texts] == []


def test_the_texts_about_inheritance_are_true() -> None:
    """Steps 2, 3 and 5: children inherit what their parents had at birth, mixed and mutated."""
    for experiment in explorable.make_scenes().values():
        assert experiment.evolution.inheritance == "darwinian"
        assert experiment.evolution.variation == "crossover"
        assert experiment.evolution.selection == "roulette"
        assert experiment.evolution.fitness == "energy"
    assert NEEDLE["redrawn_loci"] == 2


def test_the_texts_about_evolution_alone_are_true() -> None:
    """Step 2: the mean of 20 runs doubles within ten generations, and then stays."""
    curve = np.mean(RECORDINGS["curves"]["alone"], axis=0)
    assert len(RECORDINGS["curves"]["alone"]) == explorable.RUNS
    early, late = curve[10:40].mean(), curve[40:].mean()
    assert curve[:11].max() > 2 * curve[0] and min(early, late) > 2 * curve[0]
    assert abs(late - early) < 0.1 * early


def test_the_ring_marks_an_agent_in_the_middle() -> None:
    """Step 1: about half of the agents eat more. The run is the eighth best in its generation."""
    run = simulate(LEARNERS, seed=explorable.SEED, run=explorable.FIRST_RUN)
    eaten = run.food_eaten.values[explorable.FIRST_GENERATION]
    marked = eaten[RECORDINGS["learner"]["agent"]]
    half = eaten.size / 2
    assert (eaten > marked).sum() <= half and (eaten < marked).sum() <= half
    assert (eaten >= marked).sum() >= half
    means = np.array(RECORDINGS["curves"]["forked"])[:, explorable.FIRST_GENERATION]
    assert (means > means[explorable.FIRST_RUN]).sum() == 7
    assert "(eighth best)" in STRINGS["steps"][0]["shown"]


def test_the_texts_about_the_foragers_are_true() -> None:
    fork = explorable.FORK_GENERATION
    curves = {name: np.array(runs) for name, runs in RECORDINGS["curves"].items()}
    mean = {name: curve.mean(axis=0) for name, curve in curves.items()}
    # Step 7: learners eat more in the mean, from the first generation on.
    assert (mean["forked"][:fork] > mean["alone"][:fork]).all()
    assert (mean["forked"][20:fork] > 5 * mean["alone"][20:fork]).all()
    # Nothing became innate: without learning, they eat as much as agents that never learned.
    innate = (curves["born"] - curves["alone"][:, :fork])[:, 20:].mean(axis=1)
    assert abs(innate.mean()) < min(1, 2 * innate.std() / np.sqrt(innate.size))
    after = (curves["forked"] - curves["alone"])[:, fork:].mean(axis=1)
    assert abs(after.mean()) < min(1, 2 * after.std() / np.sqrt(after.size))
    # Learning removes most of the selection, and does not reverse it.
    assert 0.6 < RECORDINGS["hiding"] < 1
    newborns = RECORDINGS["newborns"]
    assert newborns["frozen"] < newborns["off"] / 10 < newborns["learning"] / 50
    assert newborns["learning"] == pytest.approx(mean["forked"][fork - 1])
    assert newborns["off"] == pytest.approx(mean["born"][fork - 1])


def test_foragers_are_born_to_go_ahead_and_learn_to_turn() -> None:
    generation, runs = explorable.FORK_GENERATION - 1, range(5)
    simulated = simulate_batch(LEARNERS, explorable.SEED, runs)
    newborns = np.stack([run.genome.values[generation] for run in simulated])
    death = reevaluate(LEARNERS, explorable.SEED, runs, generation, newborns).weights
    ahead = [count_ahead(weights) for weights in (newborns[:, :, 0], death)]
    assert ahead[0] > 0.95 and ahead[1] < 0.2


def count_ahead(weights: np.ndarray[Any, Any]) -> float:
    """Return the share of agents that go ahead if they sense nothing.

    Hidden units are 1/2 then, so the largest sum of weights decides the action.
    """
    sums = weights[..., 30:].reshape(*weights.shape[:-1], 10, 3).sum(axis=-2)
    return float((sums.argmax(axis=-1) == 1).mean())


def test_a_recorded_curve_is_that_of_the_engine() -> None:
    run = simulate(explorable.make_scenes()["alone"], seed=explorable.SEED, run=1)
    recorded = RECORDINGS["curves"]["alone"][1]
    assert run.food_eaten.mean("agent").values.tolist() == recorded


@pytest.mark.nightly
def test_all_recordings_are_those_of_the_engine() -> None:
    from scripts.explorable_recordings import make_recordings

    message = "run `python -m scripts.explorable_recordings`"
    assert json.loads(json.dumps(make_recordings())) == RECORDINGS, message


@pytest.mark.parametrize("scene", ["alone", "learning"])
def test_a_live_run_is_bit_identical_to_python(page: Page, scene: str) -> None:
    changes = {"evolution.generations": 3, "lifetime.steps": 400}
    experiment = assign(
        explorable.make_scenes()[scene], [f"{path}={value}" for path, value in changes.items()]
    )
    run = simulate(experiment, seed=explorable.SEED, run=2)
    food, genome = page.evaluate(SIMULATE, {"scene": scene, "changes": changes, "run": 2})
    assert food == run.food_eaten.values.ravel().tolist()
    assert sum(food) > 0
    assert bytes(genome) == run.genome.values.tobytes()


FORK = """async ({ changes, generations, fork }) => {
  const { LiveSource } = await import("lab/explorable/source.js");
  const data = JSON.parse(document.getElementById("data").textContent);
  const source = new LiveSource(data, document.getElementById("worker").textContent);
  let population = await source.start("learning", changes, [0, 1]);
  const means = [];
  for (let generation = 0; generation < generations; generation++) {
    if (generation === fork) population = await population.fork({ "learning.rate": 0 });
    means.push(await population.next());
  }
  return means;
}"""


def test_a_fork_is_that_of_a_schedule(page: Page) -> None:
    changes = {"evolution.generations": 6, "lifetime.steps": 400}
    experiment = assign(LEARNERS, [f"{path}={value}" for path, value in changes.items()]).replace(
        schedule=[{"generation": 3, "learning.rate": 0.0}]
    )
    means = page.evaluate(FORK, {"changes": changes, "generations": 6, "fork": 3})
    for run in range(2):
        dataset = simulate(experiment, seed=explorable.SEED, run=run)
        expected = dataset.food_eaten.mean("agent").values.tolist()
        assert [values[run] for values in means] == expected


@pytest.mark.nightly
def test_the_picture_of_the_foragers_shows_recorded_and_live_runs(page: Page) -> None:
    section = show(page, "foragers")
    expect(section.locator(".play")).to_have_text("Start again")
    forked = np.array(RECORDINGS["curves"]["forked"])
    fork = explorable.FORK_GENERATION
    recorded = {"learning": forked[:, fork - 1].mean(), "after": forked[:, fork].mean()}
    for name, value in recorded.items():
        assert read_value(section, name) == pytest.approx(value, rel=0.01)
    # A live run switches learning off in another generation.
    drag(section, "fork", 10)
    expect(section).to_contain_text("Live: learners, mean of 3 runs.")
    section.get_by_role("button", name=STRINGS["labels"]["end"]).click()
    expect(section.locator(".play")).to_have_text("Start again")
    assert read_value(section, "learning") == pytest.approx(forked[:3, 9].mean(), rel=0.01)
    assert read_value(section, "after") < read_value(section, "learning") / 2
