"""The explorable: an essay in one HTML file. The pictures of the essay simulate in the browser.

The experiments with foragers (scenes) are conditions of `le-2019` on map A. Lifetimes have a fifth
of the steps, so that a browser simulates a run in about a second. The strings that guess and the
strings that climb landscapes are models in JavaScript, which tests compare with those of Python.
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
STYLES: Final = ("base.css", "explorable/explorable.css")
STRINGS_FILE: Final = Path(__file__).parent / "strings.toml"
RECORDINGS_FILE: Final = Path(__file__).parent / "recordings.json"
# The names of the compiled modules on the page, see `shipped_experiments`.
PROGRAMS: Final = (
    "none-simultaneous",
    "self-taught-simultaneous",
    "none-walls-patches",
    "self-taught-walls-patches",
)
# A piece of a text in braces: "{food}" or "{innate|at birth}".
_PLACEHOLDER: Final = re.compile(r"\{(\w+)(?:\|([^}]*))?\}")
# The words of these meanings have the color of the parts of the pictures with the same meaning.
MEANINGS: Final = ("innate", "learned", "wrong", "control", "eaten")
SEED: Final = 7
RUNS: Final = 20
STEPS: Final = 1000
# Number of generations of a run. At the generation of the fork, learning is switched off in a copy
# of the run.
GENERATIONS: Final = 100
FORK_GENERATION: Final = 60
# Number of generations of a run on a map.
EVOLUTION_GENERATIONS: Final = 40
# The lifetime of the first map: the first run, so that it is not selected by its result.
FIRST_RUN: Final = 0
FIRST_GENERATION: Final = 20
# The shown part of map A: its left, right, upper and lower edge. Agents are in it nearly always.
REGION: Final = (0, 640, 0, 320)
# The choices of the reader for the strings that guess. A period of 0: the world never changes.
NEEDLE_TRIALS: Final = (0, 100, 1000, 10_000)
NEEDLE_COSTS: Final = (0.25, 0.5, 1.0, 1.5, 2.0)
NEEDLE_PERIODS: Final = (2, 5, 10, 20, 50, 100, 0)
PUZZLE_GENERATIONS: Final = 51
CHANGING_GENERATIONS: Final = 201
# Number of landscapes on which strings climb, and generations before and after the fork.
LANDSCAPES: Final = 40
CLIMBER_SETTINGS: Final = {"bits": 12, "k": 6}
CLIMBING_GENERATIONS: Final = 100
CLIMBING_GENERATIONS_AFTER: Final = 20


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
    # The values of the next three are indices of the choices above.
    "trials": Dial(2, 0, len(NEEDLE_TRIALS) - 1, 1),
    "cost": Dial(2, 0, len(NEEDLE_COSTS) - 1, 1),
    "period": Dial(2, 0, len(NEEDLE_PERIODS) - 1, 1),
    "k": Dial(6, 0, 11, 1, "nk_climbers.k"),
    "fork": Dial(FORK_GENERATION, 10, 80, 10),
}


@cache
def make_scenes() -> Mapping[str, Experiment]:
    """Return the experiments of the page by name.

    `map` is the experiment for a map that the reader draws.
    """
    learning = _shorten(presets.load("evo+self-taught/A"))
    return {
        "alone": _shorten(presets.load("evo/A")),
        "learning": learning,
        "map": learning.replace(name="map", world={"features": MAP_FEATURES}),
    }


def _shorten(experiment: BaseExperiment) -> Experiment:
    shortened = experiment.replace(
        lifetime={"steps": STEPS}, evolution={"generations": GENERATIONS}
    )
    assert isinstance(shortened, Experiment)
    return shortened


def render_explorable(strings_file: Path = STRINGS_FILE) -> bytes:
    """Return the page as HTML without references to other files. `strings_file`: its texts."""
    strings = tomllib.loads(strings_file.read_text("utf-8"))
    return single_page.render_page(
        "explorable.html",
        FIRST_MODULE,
        STYLES,
        title=strings["page"]["title"],
        strings=strings,
        steps=list(_list_steps(strings)),
        worker=join_worker_code(),
        data=collect_data(strings),
    )


def collect_data(strings: Mapping[str, Any]) -> dict[str, Any]:
    """Return the data of the page. The type `PageData` in explorable/source.js describes it."""
    return {
        "version": __version__,
        "seed": SEED,
        "fork_generation": FORK_GENERATION,
        "evolution_generations": EVOLUTION_GENERATIONS,
        "region": REGION,
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
        "needle": _collect_needle(),
        "climbers": _collect_climbers(),
        "strings": {name: strings[name] for name in ("labels", "figures", "runs", "editor")},
    }


def _collect_needle() -> dict[str, Any]:
    """Return the settings of the strings that guess: `NeedleSettings` in needle_model.js."""
    puzzle, changing = (presets.load(name).to_dict() for name in ("guessing", "guessing/every-10"))
    model = puzzle["hinton_nowlan"]
    return {
        "settings": {
            "agents": puzzle["population"]["size"],
            "loci": model["loci"],
            "trials": model["trials"],
            "cost": model["cost_of_trials"],
            "mutation_rate": puzzle["evolution"]["mutation_rate"],
            "period": 0,
            "redrawn_loci": changing["moving_needle"]["redrawn_loci"],
        },
        "trials": NEEDLE_TRIALS,
        "costs": NEEDLE_COSTS,
        "periods": NEEDLE_PERIODS,
        "mutation_rate": changing["evolution"]["mutation_rate"],
        "puzzle_generations": PUZZLE_GENERATIONS,
        "changing_generations": CHANGING_GENERATIONS,
    }


def _collect_climbers() -> dict[str, Any]:
    """Return the settings of the strings on landscapes: `ClimberSettings` in landscape_model.js."""
    experiment = presets.load("climbing/rugged").replace(nk_climbers=CLIMBER_SETTINGS).to_dict()
    model = experiment["nk_climbers"]
    return {
        "settings": {
            "agents": experiment["population"]["size"],
            **{name: model[name] for name in ("bits", "k", "trials")},
            "mutation_rate": experiment["evolution"]["mutation_rate"],
        },
        "landscapes": LANDSCAPES,
        "fork_generation": CLIMBING_GENERATIONS,
        "generations_after": CLIMBING_GENERATIONS_AFTER,
    }


@cache
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
        "plan": ModuleLayout(experiment).plan(),
    }


def _list_steps(strings: Mapping[str, Any]) -> Iterator[dict[str, Any]]:
    """Yield the steps of the essay. Each text becomes a list of its pieces."""
    for step in strings["steps"]:
        yield {
            **step,
            "paragraphs": [list(_split_text(text, strings)) for text in step["text"]],
            "shown": list(_split_text(step["shown"], strings)),
            "notice": list(_split_text(step["notice"], strings)),
        }


def _split_text(text: str, strings: Mapping[str, Any]) -> Iterator[dict[str, Any]]:
    """Yield the pieces of a text: words, colored words, dials, and values of the page.

    In a text, "{innate|at birth}" stands for words in the color of a meaning, "{food}" for the dial
    `food`, and any other name in braces for a value that the page computes.
    """
    # `split` returns words, names and colored words in turn, because the pattern has two groups.
    pieces = iter(_PLACEHOLDER.split(text))
    yield {"words": next(pieces)}
    for name, colored_words, words in zip(pieces, pieces, pieces, strict=True):
        if name in MEANINGS:
            yield {"words": colored_words, "meaning": name}
        elif name in DIALS:
            numbers = {key: f"{n:g}" for key, n in DIALS[name]._asdict().items() if key != "path"}
            yield {"dial": name, "label": strings["dials"][name], **numbers}
        else:
            yield {"value": name}
        yield {"words": words}
