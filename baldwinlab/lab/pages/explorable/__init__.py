"""The explorable: an essay in one HTML file. The pictures of the essay simulate in the browser.

The experiments (scenes) are conditions of `le-2019` on map A. Lifetimes have a fifth of the steps,
so that a browser simulates a run in about a second. The figure of the needle, a model without a
world, shows stored results.
"""

from __future__ import annotations

import json
import re
import tomllib
from collections.abc import Iterator, Mapping
from functools import cache
from pathlib import Path
from typing import Any, Final, NamedTuple

from baldwinlab._version import __version__
from baldwinlab.core.errors import RefusedError
from baldwinlab.experiment import BaseExperiment, Experiment
from baldwinlab.lab.pages import single_page
from baldwinlab.lab.pages.export import join_worker_code, make_appearance_template
from baldwinlab.models.miniworld.backends.browser_layout import ModuleLayout
from baldwinlab.models.miniworld.backends.wasm_modules import (
    MAP_FEATURES,
    MODULES_FOLDER,
    shipped_experiments,
)
from baldwinlab.papers import presets

FIRST_MODULE: Final = "explorable/page.js"
STYLES: Final = ("vendor/uPlot.min.css", "base.css", "explorable/explorable.css")
STRINGS_FILE: Final = Path(__file__).parent / "strings.toml"
RECORDINGS_FILE: Final = Path(__file__).parent / "recordings.json"
MAX_PAGE_BYTES: Final = 1_500_000
# The names of the compiled modules on the page, see `shipped_experiments`.
PROGRAMS: Final = (
    "none-simultaneous",
    "self-taught-simultaneous",
    "random-targets-simultaneous",
    "none-walls-patches",
    "self-taught-walls-patches",
)
# Settings of the moving needle from which the page computes a law.
NEEDLE_SETTINGS: Final = ("loci", "trials", "redrawn_loci")
_PLACEHOLDER: Final = re.compile(r"\{(\w+)\}")
SEED: Final = 7
RUNS: Final = 5
STEPS: Final = 1000
# Number of generations of a run. At the generation of the fork, learning is switched off in a copy
# of the run.
GENERATIONS: Final = 100
FORK_GENERATION: Final = 60
# The final comparison averages this number of generations at the end of a run.
LAST_GENERATIONS: Final = 10
# The lifetime that the first map shows. In this lifetime, agents eat early and often.
FIRST_RUN: Final = 3
FIRST_GENERATION: Final = 20
# The moving needle is a peak of fitness that moves every PERIOD generations. The file of recordings
# has results of these costs of a trial, these periods, and this number of runs.
NEEDLE_COSTS: Final = (0.25, 0.5, 1.0, 1.5, 2.0)
NEEDLE_PERIODS: Final = (2, 5, 10, 20, 50, 100)
NEEDLE_RUNS: Final = 3


class Dial(NamedTuple):
    """A number in a sentence that the reader can change."""

    # The value when the page opens. The reader can choose minimum, minimum + step, ..., maximum.
    value: float
    minimum: float
    maximum: float
    step: float
    path: str = ""  # The setting, or "" if the figure uses the number in another way.


DIALS: Final[Mapping[str, Dial]] = {
    "visual_radius": Dial(40, 10, 80, 5, "senses.visual_radius"),
    "food": Dial(50, 5, 150, 5, "world.food.0.count"),
    "mutation_rate": Dial(5, 0, 30, 1, "evolution.mutation_rate"),
    "agents": Dial(20, 4, 40, 2, "population.size"),
    "rate": Dial(0.01, 0, 0.1, 0.005, "learning.rate"),
    "runs": Dial(RUNS, 1, RUNS, 1),
    "fork": Dial(FORK_GENERATION, 10, 80, 10),
    # The values are indices into `NEEDLE_COSTS` and `NEEDLE_PERIODS`.
    "cost": Dial(2, 0, len(NEEDLE_COSTS) - 1, 1),
    "period": Dial(2, 0, len(NEEDLE_PERIODS) - 1, 1),
}


@cache
def make_scenes() -> Mapping[str, Experiment]:
    """Return the experiments of the page by name.

    `map` is the experiment for a map that the reader draws. A browser can simulate all scenes
    except `yoked`, which shows recordings.
    """
    conditions = {
        "alone": "evo/A",
        "learning": "evo+self-taught/A",
        "random": "evo+random-targets/A",
    }
    scenes = {name: _shorten(presets.load(condition)) for name, condition in conditions.items()}
    learning = scenes["learning"]
    return {
        **scenes,
        "yoked": learning.replace(name="yoked", learning={"control": "yoked"}),
        "map": learning.replace(name="map", world={"features": MAP_FEATURES}),
    }


def make_forked_scene() -> Experiment:
    """Return the scene `learning`, with learning switched off from the fork on."""
    return make_scenes()["learning"].replace(
        schedule=[{"generation": FORK_GENERATION, "learning.rate": 0.0}]
    )


def make_needle(cost: float, period: int) -> BaseExperiment:
    """Return the moving needle with a cost of trials and a period. 0: the needle never moves."""
    return presets.load("guessing/every-10").replace(
        moving_needle={"cost_of_trials": cost, "period": period}
    )


def _shorten(experiment: BaseExperiment) -> Experiment:
    shortened = experiment.replace(
        lifetime={"steps": STEPS}, evolution={"generations": GENERATIONS}
    )
    assert isinstance(shortened, Experiment)
    return shortened


def render_explorable(strings_file: Path = STRINGS_FILE) -> bytes:
    """Return the page as HTML without references to other files. `strings_file`: its texts."""
    strings = tomllib.loads(strings_file.read_text("utf-8"))
    page = single_page.render_page(
        "explorable.html",
        FIRST_MODULE,
        STYLES,
        title=strings["page"]["title"],
        strings=strings,
        steps=list(_list_steps(strings)),
        worker=join_worker_code(),
        data=collect_data(strings),
    )
    if len(page) > MAX_PAGE_BYTES:
        raise RefusedError(
            f"the page would have {len(page):,} bytes, and the limit is {MAX_PAGE_BYTES:,}"
        )
    return page


def collect_data(strings: Mapping[str, Any]) -> dict[str, Any]:
    """Return the data of the page. The type `PageData` in explorable/source.js describes it."""
    needle = make_needle(1.0, 0).to_dict()
    return {
        "version": __version__,
        "seed": SEED,
        "runs": RUNS,
        "fork_generation": FORK_GENERATION,
        "last_generations": LAST_GENERATIONS,
        "first_life": {"run": FIRST_RUN, "generation": FIRST_GENERATION},
        "scenes": {
            name: {
                "experiment": experiment.to_dict(),
                "appearance": make_appearance_template(experiment),
            }
            for name, experiment in make_scenes().items()
        },
        "programs": [
            _make_program(name) for name in PROGRAMS if (MODULES_FOLDER / f"{name}.wasm").exists()
        ],
        "recordings": json.loads(RECORDINGS_FILE.read_text("utf-8")),
        "needle": {
            "costs": NEEDLE_COSTS,
            "periods": NEEDLE_PERIODS,
            "mutation_rate": needle["evolution"]["mutation_rate"],
            **{name: needle["moving_needle"][name] for name in NEEDLE_SETTINGS},
        },
        "strings": {name: strings[name] for name in ("labels", "figures", "editor")},
    }


def _make_program(name: str) -> dict[str, Any]:
    """Return a compiled module, its memory layout, and the settings that select it."""
    experiment = shipped_experiments()[name]
    return {
        "name": name,
        "when": {
            "learning.rule": experiment.learning.rule,
            "world.features": list(experiment.world.features),
        },
        "module": single_page.compress((MODULES_FOLDER / f"{name}.wasm").read_bytes()),
        "plan": _make_plan(experiment),
    }


@cache
def _make_plan(experiment: Experiment) -> dict[str, Any]:
    return ModuleLayout(experiment).plan()


def _list_steps(strings: Mapping[str, Any]) -> Iterator[dict[str, Any]]:
    """Yield the steps of the essay. Each paragraph becomes a list of the pieces of its text."""
    for step in strings["steps"]:
        yield {**step, "paragraphs": [list(_split_text(text, strings)) for text in step["text"]]}


def _split_text(text: str, strings: Mapping[str, Any]) -> Iterator[dict[str, Any]]:
    """Yield the pieces of a text: words, dials, and values that the page computes.

    In a text, "{food}" stands for the dial `food`, and any other name in braces for a value.
    """
    # `split` returns words and names alternately, because the pattern has a group.
    for index, piece in enumerate(_PLACEHOLDER.split(text)):
        if index % 2 == 0:
            yield {"words": piece}
        elif piece in DIALS:
            yield {"dial": piece, "label": strings["dials"][piece], **_format_dial(piece)}
        else:
            yield {"value": piece}


def _format_dial(name: str) -> dict[str, str]:
    numbers = DIALS[name]._asdict()
    return {key: f"{value:g}" for key, value in numbers.items() if key != "path"}
