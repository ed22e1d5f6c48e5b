"""Pages in one HTML file that simulate evolution in the browser. They need no extra packages.

Such a page contains compiled modules: WebAssembly programs of the engine.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import suppress
from typing import Any, Final

from baldwinlab._version import __version__
from baldwinlab.core.errors import RefusedError
from baldwinlab.experiment import BaseExperiment, Experiment, ExperimentError
from baldwinlab.experiment.added_parts import added_choices
from baldwinlab.experiment.class_builder import choosing_fields
from baldwinlab.experiment.outcome import describe_experiment_measures
from baldwinlab.experiment.paths import look_up
from baldwinlab.lab.pages import single_page
from baldwinlab.lab.pages.browser_form import (
    CONTROL,
    FIELD_RULES,
    MODULE_SETTINGS,
    list_choosable_parts,
    make_form_schema,
    require_browser_settings,
)
from baldwinlab.models.miniworld.appearance import describe_appearance, list_topics
from baldwinlab.models.miniworld.backends.browser_layout import ModuleLayout
from baldwinlab.models.miniworld.backends.wasm_modules import built_in_experiments, load_module
from baldwinlab.models.miniworld.regions import FOOD_COLOR, item_regions
from baldwinlab.models.miniworld.state import FOOD
from baldwinlab.papers import presets
from baldwinlab.parts.breeding import uses_run_arrays
from baldwinlab.simulation.simulate import check_seed

# The JavaScript module that the page starts with.
FIRST_MODULE: Final = "engine/live_page.js"
STYLES: Final = ("vendor/uPlot.min.css", "base.css", "lab.css")
# The JavaScript modules of a worker, in the order in which they are joined.
WORKER_MODULES: Final = (
    "engine/engine.js",
    "engine/simulation.js",
    "engine/lifetime_recorder.js",
    "engine/frame_recorder.js",
    "engine/engine_worker.js",
)
MAX_RUNS: Final = 50
MAX_PAGE_BYTES: Final = 2_000_000
# Student's t has this cumulative probability at the upper end of a 95 % interval.
UPPER_PROBABILITY: Final = 0.975


def render_live_page(experiments: Sequence[BaseExperiment], seed: int = 0) -> bytes:
    """Return a page that simulates experiments. Raise RefusedError if a browser cannot."""
    supported = require_browser_support(experiments)
    check_seed(seed)
    page = single_page.render_page(
        "live.html",
        FIRST_MODULE,
        STYLES,
        title=supported[0].name,
        worker=join_worker_code(),
        laboratory=collect_page_data(supported) | {"seed": seed},
    )
    if len(page) > MAX_PAGE_BYTES:
        raise RefusedError(
            f"the page would have {len(page):,} bytes, and the limit is {MAX_PAGE_BYTES:,}; export"
            " fewer conditions"
        )
    return page


def require_browser_support(experiments: Sequence[BaseExperiment]) -> list[Experiment]:
    """Return the experiments. Raise RefusedError if the browser engine cannot simulate all."""
    for experiment in experiments:
        if not isinstance(experiment, Experiment):
            raise RefusedError(
                f"{experiment.name} cannot run in a browser: its model {experiment.model} is"
                " simulated in Python"
            )
        if experiment.gene_names:
            raise RefusedError(
                f"{experiment.name} cannot run in a browser: its parts have the genes"
                f" {', '.join(experiment.gene_names)}, which only the engine in Python supports"
            )
        if experiment.part_records or uses_run_arrays(experiment):
            raise RefusedError(
                f"{experiment.name} cannot run in a browser: its parts have records or arrays of"
                " the run, which only the engine in Python supports"
            )
        require_browser_settings(experiment)
    return [experiment for experiment in experiments if isinstance(experiment, Experiment)]


def collect_page_data(experiments: Sequence[Experiment]) -> dict[str, Any]:
    """Return the data of the page. The type `Laboratory` in browser_lab.js describes it."""
    # This import takes a second, which would delay the lab.
    from scipy import stats

    programs: dict[str, dict[str, Any]] = {}
    for experiment in experiments:
        for name, module_experiment in _list_modules(experiment):
            programs.setdefault(name, _make_program(name, module_experiment))
    schemas = [make_form_schema(experiment) for experiment in experiments]
    unique_schemas: list[Any] = []
    for schema in schemas:
        # Schemas are dictionaries, which a set cannot contain.
        if schema not in unique_schemas:
            unique_schemas.append(schema)
    # Half of a 95 % interval of n runs is the standard error multiplied by the factor of n.
    # `max`: a single run has no interval, but the list needs an entry.
    quantiles = [
        float(stats.t.ppf(UPPER_PROBABILITY, df=max(1, n_runs - 1)))
        for n_runs in range(1, MAX_RUNS + 1)
    ]
    return {
        "version": __version__,
        "presets": [
            _make_preset(experiment) | {"schema": unique_schemas.index(schema)}
            for experiment, schema in zip(experiments, schemas, strict=True)
        ],
        "schemas": unique_schemas,
        "programs": list(programs.values()),
        "rules": FIELD_RULES,
        # The index is the number of runs. 0.0 is the unused entry for 0 runs.
        "quantiles": [0.0, *quantiles],
    }


def _list_modules(experiment: Experiment) -> Iterator[tuple[str, Experiment]]:
    """Yield name and experiment of each compiled module that a page with an experiment needs.

    An experiment with only built-in parts gets all modules, because a user of the page can choose
    other built-in parts. An experiment with an added part gets one module, compiled for it.
    """
    if any(added_choices(experiment)):
        yield experiment.name, experiment
    else:
        yield from built_in_experiments().items()


def _make_program(name: str, experiment: Experiment) -> dict[str, Any]:
    """Return a program: a compiled module, its memory layout, and the settings that select it."""
    # Without learning, a control has no effect, so the control does not select the module.
    paths = [path for path in MODULE_SETTINGS if experiment.learns or path != CONTROL]
    if any(added_choices(experiment)):
        choosable_parts = list_choosable_parts(experiment)
        part_fields = choosing_fields(type(experiment))
        paths += [path for path, _, _ in part_fields if path not in choosable_parts]
    settings = {}
    for path in paths:
        value, _ = look_up(experiment, path)
        # The page compares lists, as in JSON.
        settings[path] = list(value) if isinstance(value, tuple) else value
    return {
        "name": name,
        "when": settings,
        "module": single_page.compress(load_module(experiment)),
        "plan": ModuleLayout(experiment).plan(),
    }


def _make_preset(experiment: Experiment) -> dict[str, Any]:
    description = ""
    with suppress(ExperimentError, StopIteration):
        kind = next(kind for kind in presets.PRESET_KINDS if experiment.name in presets.names(kind))
        description = presets.describe(kind, experiment.name)
    return {
        "name": experiment.name,
        "description": description,
        "experiment": experiment.to_dict(),
        "appearance": make_appearance_template(experiment),
        "topics": [topic._asdict() for topic in list_topics(experiment)],
        "measures": describe_experiment_measures(experiment),
    }


def join_worker_code() -> str:
    """Return the code of a worker: all modules in one text, because a worker imports none."""
    paths = [single_page.STATIC_FOLDER / name for name in WORKER_MODULES]
    code = "".join(path.read_text("utf-8") for path in paths)
    lines = [line for line in code.splitlines() if not line.startswith("import ")]
    return "\n".join(line.removeprefix("export ") for line in lines)


def make_appearance_template(experiment: Experiment) -> dict[str, Any]:
    """Return the appearance of a world, with references to the fields that the page can change.

    For example, the width of the start area is `{"sum": [["world.start.radius", 2]]}`: twice the
    radius. `fillTemplate` in program_table.js replaces references by values.
    """
    appearance = describe_appearance(experiment).to_dict()
    n_foods = len(experiment.world.food)
    n_regions = len(item_regions(experiment))
    # In an entry with `table`, a path is relative to a row of this table: `count` is the field
    # `world.food.0.count` for the first row.
    food = {"name": FOOD, "color": FOOD_COLOR, "number": {"path": "count"}}
    food_region = {
        "kind": "rectangle",
        "x": {"path": "x.0"},
        "y": {"path": "y.0"},
        "width": {"path": "x.1", "less": "x.0"},
        "height": {"path": "y.1", "less": "y.0"},
        "color": FOOD_COLOR,
        "label": FOOD,
        "solid": False,
    }
    # The marks have this order: food regions, other regions, start area, marks of features.
    start_area = appearance["marks"][n_regions] | {
        "x": {"sum": [["world.start.x", 1], ["world.start.radius", -1]]},
        "y": {"sum": [["world.start.y", 1], ["world.start.radius", -1]]},
        "width": {"sum": [["world.start.radius", 2]]},
        "height": {"sum": [["world.start.radius", 2]]},
    }
    radius = {"path": "senses.visual_radius"}
    # The list has an entry for each input. None is an input that senses no sector of the map.
    appearance["sectors"] = [
        None if sector is None else sector | {"radius": radius} for sector in appearance["sectors"]
    ]
    appearance["item_kinds"] = [
        {"table": "world.food", "row": food},
        *appearance["item_kinds"][n_foods:],
    ]
    appearance["marks"] = [
        {"table": "world.food", "row": food_region},
        *appearance["marks"][n_foods:n_regions],
        start_area,
        *appearance["marks"][n_regions + 1 :],
    ]
    return appearance | {"has_memory": not experiment.part("network.kind").is_memoryless}
