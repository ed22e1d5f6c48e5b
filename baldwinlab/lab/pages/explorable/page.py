"""The page of the explorable: its text, its experiments, compiled modules and recorded runs."""

from __future__ import annotations

import json
import re
import tomllib
from collections.abc import Iterator, Mapping
from functools import cache
from pathlib import Path
from typing import Any, Final

from baldwinlab._version import __version__
from baldwinlab.core.errors import RefusedError
from baldwinlab.experiment import Experiment
from baldwinlab.lab.pages import single_page
from baldwinlab.lab.pages.explorable import scenes
from baldwinlab.lab.pages.export import join_worker_code, make_appearance_template
from baldwinlab.models.miniworld.backends.browser_layout import ModuleLayout
from baldwinlab.models.miniworld.backends.wasm_modules import MODULES_FOLDER, shipped_experiments

FIRST_MODULE: Final = "explorable/page.js"
STYLES: Final = ("vendor/uPlot.min.css", "base.css", "explorable/explorable.css")
STRINGS_FILE: Final = Path(__file__).parent / "strings.toml"
RECORDINGS_FILE: Final = Path(__file__).parent / "recordings.json"
MAX_PAGE_BYTES: Final = 1_500_000
# The compiled modules of the page, by the names of the package.
PROGRAMS: Final = (
    "none-simultaneous",
    "self-taught-simultaneous",
    "random-targets-simultaneous",
    "none-walls-patches",
    "self-taught-walls-patches",
)
# Settings of the needle that its law needs.
NEEDLE_SETTINGS: Final = ("loci", "trials", "redrawn_loci")
_PLACEHOLDER: Final = re.compile(r"\{(\w+)\}")


def render_explorable(strings_file: Path = STRINGS_FILE) -> bytes:
    """Return the page.

    Returns HTML without references to other files.
    """
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
    """Return the data of the page. See `PageData` in explorable/source.js."""
    needle = scenes.make_needle(1.0, 0).to_dict()
    return {
        "version": __version__,
        "seed": scenes.SEED,
        "runs": scenes.RUNS,
        "fork_generation": scenes.FORK_GENERATION,
        "last_generations": scenes.LAST_GENERATIONS,
        "first_life": {"run": scenes.FIRST_RUN, "generation": scenes.FIRST_GENERATION},
        "scenes": {
            name: {
                "experiment": experiment.to_dict(),
                "appearance": make_appearance_template(experiment),
            }
            for name, experiment in scenes.make_scenes().items()
        },
        "programs": [
            _make_program(name) for name in PROGRAMS if (MODULES_FOLDER / f"{name}.wasm").exists()
        ],
        "recordings": json.loads(RECORDINGS_FILE.read_text("utf-8")),
        "needle": {
            "costs": scenes.NEEDLE_COSTS,
            "periods": scenes.NEEDLE_PERIODS,
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
    """Yield the steps, with each text as a list of pieces."""
    for step in strings["steps"]:
        yield {**step, "paragraphs": [list(_split_text(text, strings)) for text in step["text"]]}


def _split_text(text: str, strings: Mapping[str, Any]) -> Iterator[dict[str, Any]]:
    """Yield the pieces of a text: words, dials, and values that the page computes.

    A placeholder is the name of a dial in braces, or the name of a value of the figure.
    """
    # The odd elements are the names of placeholders.
    for index, piece in enumerate(_PLACEHOLDER.split(text)):
        if index % 2 == 0:
            yield {"words": piece}
        elif piece in scenes.DIALS:
            yield {"dial": piece, "label": strings["dials"][piece], **_format_dial(piece)}
        else:
            yield {"value": piece}


def _format_dial(name: str) -> dict[str, str]:
    """Return the attributes of a dial."""
    numbers = scenes.DIALS[name]._asdict()
    return {key: f"{value:g}" for key, value in numbers.items() if key != "path"}
