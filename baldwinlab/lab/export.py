"""Export a page in one HTML file that simulates evolution in the browser. Needs no extra."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import suppress
from typing import Any, Final

from baldwinlab._version import __version__
from baldwinlab.core.errors import RefusedError
from baldwinlab.evolution import has_parent_teachers
from baldwinlab.experiment import BaseExperiment, Experiment, ExperimentError
from baldwinlab.experiment.base import added_choices
from baldwinlab.experiment.class_builder import choosing_fields
from baldwinlab.experiment.paths import look_up
from baldwinlab.experiment.registry import BUILT_IN, key_of
from baldwinlab.lab import single_page
from baldwinlab.lab.schema import node_at, schema_of
from baldwinlab.models.miniworld.allocation import FOOD_COLOR, item_regions
from baldwinlab.models.miniworld.appearance import describe_appearance
from baldwinlab.models.miniworld.backends.browser_layout import COMMON_INHERITANCES, ModuleLayout
from baldwinlab.models.miniworld.backends.wasm_modules import built_in_experiments, load_module
from baldwinlab.models.miniworld.description import list_topics
from baldwinlab.models.miniworld.state import FOOD
from baldwinlab.papers import presets
from baldwinlab.parts.networks import Network
from baldwinlab.parts.part import numeric_fields
from baldwinlab.simulation.simulate import check_seed

# The module that the page starts with.
FIRST_MODULE: Final = "live_page.js"
# The modules of a worker, in this order.
WORKER_MODULES: Final = ("engine.js", "simulation.js", "lifetime_recorder.js", "engine_worker.js")
STYLES: Final = (
    "vendor/uPlot.min.css",
    "style.css",
    "world.css",
    "world_figure.css",
    "charts.css",
    "live.css",
    "share.css",
    "guide.css",
)
MAX_RUNS: Final = 50
MAX_PAGE_SIZE: Final = 2_000_000  # bytes
# The package contains a compiled module for each combination of these settings.
MODULE_SETTINGS: Final = ("learning.rule", "lifetime.update")

# Checks between two fields, as in the classes of experiments: one number is less than another.
RULES: Final = (
    {
        "path": "world.start.x",
        "than": "world.width",
        "message": "agents are born on the map, so the value must be less than",
    },
    {
        "path": "world.start.y",
        "than": "world.height",
        "message": "agents are born on the map, so the value must be less than",
    },
    *(
        {
            "path": path,
            "than": f"world.{span}",
            "share": 0.5,
            "equal": True,
            "message": "the value must be at most half of the map,",
        }
        for path in ("world.start.radius", "senses.visual_radius", "contact.reach")
        for span in ("width", "height")
    ),
    *(
        {
            "path": f"world.food.*.{axis}.{0}",
            "than": f"world.food.*.{axis}.{1}",
            "message": "the first edge must be less than the second edge,",
        }
        for axis in "xy"
    ),
    *(
        {
            "path": f"world.food.*.{axis}.1",
            "than": f"world.{span}",
            "equal": True,
            "message": "food is on the map, so the value must be at most",
        }
        for axis, span in (("x", "width"), ("y", "height"))
    ),
)


def live_page(experiments: Sequence[BaseExperiment], seed: int = 0) -> bytes:
    """Return a page that simulates experiments in the browser.

    Parameters
    ----------
    experiments
        The presets of the page. It opens with the first one.
    seed
        The seed of the first run.

    Raises
    ------
    RefusedError
        If the model of an experiment has no browser backend, or if the page is too large.

    """
    for experiment in experiments:
        if not isinstance(experiment, Experiment):
            raise RefusedError(
                f"{experiment.name} cannot run in a browser: its model {experiment.model} is"
                " simulated in Python"
            )
    supported = [experiment for experiment in experiments if isinstance(experiment, Experiment)]
    check_seed(seed)
    page = single_page.render_page(
        "live.html",
        FIRST_MODULE,
        STYLES,
        title=supported[0].name,
        worker=_worker_code(),
        laboratory=laboratory(supported) | {"seed": seed},
    )
    if len(page) > MAX_PAGE_SIZE:
        raise RefusedError(
            f"the page would have {len(page):,} bytes, and the limit is {MAX_PAGE_SIZE:,}; export"
            " fewer conditions"
        )
    return page


def laboratory(experiments: Sequence[Experiment]) -> dict[str, Any]:
    """Return the data of the page: presets, schemas, compiled modules and rules.

    See `Laboratory` in browser_lab.js.
    """
    # This import takes a second, which would delay the lab.
    from scipy import stats

    programs: dict[str, dict[str, Any]] = {}
    for experiment in experiments:
        for name, module_experiment in _modules_for(experiment):
            programs.setdefault(name, _program(name, module_experiment))
    schemas = [_schema(experiment) for experiment in experiments]
    unique = [schema for number, schema in enumerate(schemas) if schema not in schemas[:number]]
    quantiles = [float(stats.t.ppf(0.975, max(1, runs - 1))) for runs in range(1, MAX_RUNS + 1)]
    return {
        "version": __version__,
        "presets": [
            _preset(experiment) | {"schema": unique.index(schema)}
            for experiment, schema in zip(experiments, schemas, strict=True)
        ],
        "schemas": unique,
        "programs": list(programs.values()),
        "rules": RULES,
        "quantiles": [0.0, *quantiles],
    }


def _modules_for(experiment: Experiment) -> Iterator[tuple[str, Experiment]]:
    """Yield the compiled modules for an experiment and for all changes that the page allows.

    With built-in parts only, these are all modules of the package.
    """
    if any(added_choices(experiment)):
        yield experiment.name, experiment
    else:
        yield from built_in_experiments().items()


def _program(name: str, experiment: Experiment) -> dict[str, Any]:
    """Return a compiled module with its memory layout, and the settings that it is for."""
    paths = list(MODULE_SETTINGS)
    if any(added_choices(experiment)):
        choosable = _choosable(experiment)
        part_fields = choosing_fields(type(experiment))
        paths += [path for path, _, _ in part_fields if path not in choosable]
    settings = {path: look_up(experiment, path)[0] for path in paths}
    return {
        "name": name,
        "when": {
            path: list(value) if isinstance(value, tuple) else value
            for path, value in settings.items()
        },
        "module": single_page.compress(load_module(experiment)),
        "plan": ModuleLayout(experiment).plan(),
    }


def _preset(experiment: Experiment) -> dict[str, Any]:
    description = ""
    with suppress(ExperimentError, StopIteration):
        kind = next(kind for kind in presets.KINDS if experiment.name in presets.names(kind))
        description = presets.describe(kind, experiment.name)
    return {
        "name": experiment.name,
        "description": description,
        "experiment": experiment.to_dict(),
        "appearance": _appearance_template(experiment),
        "has_parent_teachers": has_parent_teachers(experiment),
        "topics": [topic._asdict() for topic in list_topics(experiment)],
    }


def _worker_code() -> str:
    """Return the code of a worker. It cannot import modules, so they are joined."""
    code = "".join((single_page.STATIC / name).read_text("utf-8") for name in WORKER_MODULES)
    lines = [line for line in code.splitlines() if not line.startswith("import ")]
    return "\n".join(line.removeprefix("export ") for line in lines)


def _choosable(experiment: Experiment) -> dict[str, list[str]]:
    """Return the parts that the page lets a user choose, by the path of the field.

    These parts are in the page's compiled modules.
    """
    selection = experiment.evolution.selection
    selections = list(BUILT_IN["selection"])
    if selection not in selections:
        selections.append(selection)
    choosable = {"evolution.selection": selections}
    if experiment.evolution.inheritance in COMMON_INHERITANCES:
        choosable["evolution.inheritance"] = list(COMMON_INHERITANCES)
    if not any(added_choices(experiment)):
        choosable["learning.rule"] = list(BUILT_IN["learning rule"])
    return choosable


def _schema(experiment: Experiment) -> Any:
    """Return the JSON schema of the form, with constants for fields that the page cannot change."""
    schema = schema_of(type(experiment))
    choosable = _choosable(experiment)
    part_fields = choosing_fields(type(experiment))
    fixed = ["model", "record.genome_every"]
    fixed += [path for path, _, _ in part_fields if path not in choosable]
    if any(added_choices(experiment)):
        fixed += ["name", "lifetime.update", *_compiled_fields(experiment)]
    for path, names in choosable.items():
        fields, name = node_at(schema, path)
        fields[name] |= {"enum": names}
    tree = experiment.to_dict()
    for path in dict.fromkeys(fixed):
        fields, name = node_at(schema, path)
        value: Any = tree
        for step in path.split("."):
            value = value[step]
        fields[name] = {"const": value}
    return schema


def _compiled_fields(experiment: Experiment) -> Iterator[str]:
    """Yield the fields whose values are constants in the module of a third-party part."""
    network = type(experiment.part("network.kind"))
    # Only the part itself can check the size of a network that is a graph.
    if network.layers is not Network.layers or getattr(network, "graphs", False):
        yield "network.hidden"
    for path, kind, _ in choosing_fields(type(experiment)):
        for part in experiment.parts(path):
            if type(part).name not in BUILT_IN[kind]:
                numeric = numeric_fields(type(part))
                table = f"{path.rpartition('.')[0]}.{key_of(type(part).name)}"
                fields = type(part).model_fields
                yield from (f"{table}.{name}" for name in fields if name not in numeric)
    constants = _layout_constants(experiment)
    for path, value in _numbers(experiment.to_dict()):
        changed = _with_other_value(experiment, path, value)
        if changed is not None and _layout_constants(changed) != constants:
            yield path


def _layout_constants(experiment: Experiment) -> str:
    """Return the memory layout, which contains constants and references to fields."""
    return repr(ModuleLayout(experiment).plan())


def _numbers(tree: dict[str, Any], prefix: str = "") -> Iterator[tuple[str, float]]:
    """Yield the path and the value of each number of an experiment."""
    for name, value in tree.items():
        if isinstance(value, dict):
            yield from _numbers(value, f"{prefix}{name}.")
        elif isinstance(value, int | float) and not isinstance(value, bool):
            yield f"{prefix}{name}", value


def _with_other_value(experiment: Experiment, path: str, value: float) -> Experiment | None:
    """Return the experiment with another valid number at a path, or None if there is none."""
    for number in (value / 2, value * 2, value + 1, value - 1):
        change: Any = int(number) if isinstance(value, int) else number
        for step in reversed(path.split(".")):
            change = {step: change}
        with suppress(ExperimentError):
            return experiment.replace(**change)
    return None


def _appearance_template(experiment: Experiment) -> dict[str, Any]:
    """Return the appearance of a world, with references to the fields that the page can change.

    See `fillTemplate` in browser_lab.js.
    """
    appearance = describe_appearance(experiment).to_dict()
    n_foods = len(experiment.world.food)
    n_regions = len(item_regions(experiment))
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
    start_area = appearance["marks"][n_regions] | {
        "x": {"sum": [["world.start.x", 1], ["world.start.radius", -1]]},
        "y": {"sum": [["world.start.y", 1], ["world.start.radius", -1]]},
        "width": {"sum": [["world.start.radius", 2]]},
        "height": {"sum": [["world.start.radius", 2]]},
    }
    appearance["sectors"] = [
        sector and sector | {"radius": {"path": "senses.visual_radius"}}
        for sector in appearance["sectors"]
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
