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

from baldwinlab.analysis.theory.needle import balance_of_unset
from baldwinlab.experiment import assign
from baldwinlab.lab.pages import explorable
from baldwinlab.simulation.simulate import simulate
from tests.commands import Command
from tests.lab.essays import RECORDINGS, STRINGS, drag, open_essay, read_value, show

STEPS = [step["id"] for step in STRINGS["steps"]]
MAX_WORDS = 120
EXPORT = ("export", "--format", "explorable", "--out")
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
    assert len(page.encode()) <= explorable.MAX_PAGE_BYTES
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


@pytest.mark.parametrize("step", STRINGS["steps"], ids=STEPS)
def test_a_step_is_short_and_has_a_question(step: dict[str, Any]) -> None:
    question = step["question"]
    texts = [step["title"], *step["text"], step["notice"], question["text"], *question["options"]]
    assert len(" ".join(texts).split()) <= MAX_WORDS
    assert 0 <= question["answer"] < len(question["options"])
    assert question["right"] and question["wrong"]


def test_the_texts_about_the_runs_are_true() -> None:
    last = slice(
        explorable.FORK_GENERATION - explorable.LAST_GENERATIONS, explorable.FORK_GENERATION
    )
    curves = {name: np.array(runs) for name, runs in RECORDINGS["curves"].items()}
    means = {name: curve[:, last].mean(axis=1) for name, curve in curves.items()}
    assert all(len(runs) == explorable.RUNS for runs in means.values())
    # Step 4: learners are ahead in each of the runs, and in the mean after a few generations.
    assert (means["learning"] > 2 * means["alone"]).all()
    assert (curves["learning"].mean(axis=0) > curves["alone"].mean(axis=0))[5:].all()
    # Step 5: the mean is highest with learning, and two of five yoked runs come near.
    for control in ("random", "yoked"):
        assert means["alone"].mean() < means[control].mean() < means["learning"].mean()
    assert sum(means["yoked"] > 0.8 * means["learning"].min()) == 2
    # Step 6: the skill disappears at the fork and does not return.
    forked = curves["forked"][:, explorable.FORK_GENERATION :]
    assert (forked < means["learning"][:, None] / 2).all()
    assert forked[:, -explorable.LAST_GENERATIONS :].mean() < means["alone"].mean()


def test_the_texts_about_the_needle_are_true() -> None:
    # [cost, period]
    shares = np.array(RECORDINGS["needle"]).mean(axis=2)
    assert (np.diff(shares[:, [0, -1]], axis=1) < 0).all(), "more stays open if the target changes"
    assert (np.diff(shares[[0, -1]], axis=0) < 0).all(), "less stays open if guesses cost more"
    theory = [
        [
            balance_of_unset(cost_of_trials=cost, period=period)
            for period in explorable.NEEDLE_PERIODS
        ]
        for cost in explorable.NEEDLE_COSTS
    ]
    assert np.abs(shares - theory).max() < 0.1
    assert np.abs(shares - theory).mean() < 0.04


def test_a_recorded_curve_is_that_of_the_engine() -> None:
    run = simulate(explorable.make_scenes()["alone"], seed=explorable.SEED, run=1)
    recorded = RECORDINGS["curves"]["alone"][1]
    assert run.food_eaten.mean("agent").values.tolist() == recorded


@pytest.mark.nightly
def test_all_recordings_are_those_of_the_engine() -> None:
    from scripts.explorable_recordings import make_recordings

    message = "run `python -m scripts.explorable_recordings`"
    assert json.loads(json.dumps(make_recordings())) == RECORDINGS, message


@pytest.mark.parametrize("scene", ["alone", "learning", "random"])
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


@pytest.mark.nightly
def test_the_curves_are_those_of_the_engine(page: Page) -> None:
    section = show(page, "both")
    drag(section, "runs", 1)
    expect(section.locator(".play")).to_have_text("Start again")
    last = explorable.FORK_GENERATION - 1
    for name in ("alone", "learning"):
        expected = RECORDINGS["curves"][name][0][last]
        assert read_value(section, name) == pytest.approx(expected, rel=0.01)


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
    experiment = assign(
        explorable.make_scenes()["learning"], [f"{path}={value}" for path, value in changes.items()]
    ).replace(schedule=[{"generation": 3, "learning.rate": 0.0}])
    means = page.evaluate(FORK, {"changes": changes, "generations": 6, "fork": 3})
    for run in range(2):
        dataset = simulate(experiment, seed=explorable.SEED, run=run)
        expected = dataset.food_eaten.mean("agent").values.tolist()
        assert [values[run] for values in means] == expected


@pytest.mark.nightly
def test_the_picture_of_the_fork_shows_the_values_of_the_engine(page: Page) -> None:
    section = show(page, "innate")
    expect(section.locator(".play")).to_have_text("Start again")
    forked = np.array(RECORDINGS["curves"]["forked"]).mean(axis=0)
    expected = {
        "before": forked[explorable.FORK_GENERATION - 1],
        "after": forked[explorable.FORK_GENERATION],
        "learning": forked[-explorable.LAST_GENERATIONS :].mean(),
    }
    for name, value in expected.items():
        assert read_value(section, name) == pytest.approx(value, rel=0.01)


THEORY_SETTINGS = ("loci", "trials", "cost", "mutationRate", "period", "redrawnLoci")
THEORY_CASES = (
    (20, 1000, 1.0, 0.01, 10, 2),
    (20, 1000, 0.25, 0.01, 2, 2),
    (20, 1000, 2.0, 0.01, 100, 2),
    (12, 300, 0.7, 0.03, 7, 3),
    (20, 1000, 0.0, 0.01, 5, 2),
    (20, 1000, 1.0, 0.0, 20, 1),
)


def test_the_theory_in_the_page_is_that_of_python(page: Page) -> None:
    compute = """async settings => {
      const { computeBalance } = await import("lab/explorable/needle_figure.js");
      return settings.map(computeBalance);
    }"""
    settings = [dict(zip(THEORY_SETTINGS, case, strict=True)) for case in THEORY_CASES]
    # The order of the settings is that of the arguments.
    expected = [balance_of_unset(*case) for case in THEORY_CASES]
    assert page.evaluate(compute, settings) == pytest.approx(expected, abs=1e-9)
