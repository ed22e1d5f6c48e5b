"""A live laboratory to give away: one HTML file in which evolution runs in the reader's own browser. It needs no extra."""

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
from baldwinlab.models.miniworld.appearance import look
from baldwinlab.models.miniworld.backends.browser_layout import OF_ANY_INHERITANCE, Habitat
from baldwinlab.models.miniworld.backends.wasm_modules import built_in, module_of
from baldwinlab.models.miniworld.description import about
from baldwinlab.models.miniworld.state import FOOD
from baldwinlab.papers import presets
from baldwinlab.parts.agent_parts import Network, numeric_fields
from baldwinlab.simulation.simulate import check_seed

FIRST: Final = "live_page.js"  # the module that the page begins with
WORKER: Final = (
    "engine.js",
    "simulation.js",
    "lifetime_recorder.js",
    "engine_worker.js",
)  # what a worker is made of, in this order
STYLES: Final = (
    *("vendor/uPlot.min.css", "style.css", "world.css", "world_figure.css"),
    *("charts.css", "live.css", "share.css", "guide.css"),
)
MOST_RUNS: Final = 50
MOST_BYTES: Final = 2_000_000
CHOICES: Final = (
    "learning.rule",
    "lifetime.update",
)  # of which each combination has a module that ships

RULES: Final = (
    {
        "path": "world.start.x",
        "than": "world.width",
        "says": "agents are born on the map, so this must be less than",
    },
    {
        "path": "world.start.y",
        "than": "world.height",
        "says": "agents are born on the map, so this must be less than",
    },
    *(
        {
            "path": path,
            "than": f"world.{span}",
            "share": 0.5,
            "equal": True,
            "says": "this must be at most half the map,",
        }
        for path in ("world.start.radius", "senses.visual_radius", "contact.reach")
        for span in ("width", "height")
    ),
    *(
        {
            "path": f"world.food.*.{axis}.{0}",
            "than": f"world.food.*.{axis}.{1}",
            "says": "edges go from a smaller to a larger,",
        }
        for axis in "xy"
    ),
    *(
        {
            "path": f"world.food.*.{axis}.1",
            "than": f"world.{span}",
            "equal": True,
            "says": "food lies on the map, at most to",
        }
        for axis, span in (("x", "width"), ("y", "height"))
    ),
)
"""What the classes of experiments check between fields: that one number is smaller than another."""


def live_page(experiments: Sequence[BaseExperiment], seed: int = 0) -> bytes:
    """The page, which begins with the first of some experiments. Raises RefusedError where it cannot be made."""
    for experiment in experiments:
        if not isinstance(experiment, Experiment):
            raise RefusedError(
                f"{experiment.name} is of the model {experiment.model}, whose lives are Python: a browser has none"
            )
    given = [experiment for experiment in experiments if isinstance(experiment, Experiment)]
    check_seed(seed)
    told = laboratory(given) | {"seed": seed}
    made = single_page.render_page(
        "live.html", FIRST, STYLES, title=given[0].name, worker=_worker(), laboratory=told
    )
    if len(made) > MOST_BYTES:
        raise RefusedError(
            f"the page would take {len(made):,} bytes, and may take {MOST_BYTES:,}: export fewer conditions"
        )
    return made


def laboratory(experiments: Sequence[Experiment]) -> dict[str, Any]:
    """What the page is told: see browser_lab.js."""
    from scipy import (
        stats,
    )  # here, because it takes a second to load, in which the lab would not open

    programs: dict[str, dict[str, Any]] = {}
    for experiment in experiments:
        for name, one in _modules_for(experiment):
            programs.setdefault(name, _program(name, one))
    schemas = [_schema(experiment) for experiment in experiments]
    different = [schema for number, schema in enumerate(schemas) if schema not in schemas[:number]]
    return {
        "version": __version__,
        "presets": [
            _preset(experiment) | {"schema": different.index(schema)}
            for experiment, schema in zip(experiments, schemas, strict=True)
        ],
        "schemas": different,
        "programs": list(programs.values()),
        "rules": RULES,
        "quantiles": [
            0.0,
            *(float(stats.t.ppf(0.975, max(1, runs - 1))) for runs in range(1, MOST_RUNS + 1)),
        ],
    }


def _modules_for(experiment: Experiment) -> Iterator[tuple[str, Experiment]]:
    """The modules that an experiment, or what a reader makes of it, may need: of built-in parts, all."""
    if any(added_choices(experiment)):
        yield experiment.name, experiment
    else:
        yield from built_in().items()


def _program(name: str, experiment: Experiment) -> dict[str, Any]:
    own = any(added_choices(experiment))
    paths = (
        [
            path
            for path, _, _ in choosing_fields(type(experiment))
            if path not in _choosable(experiment)
        ]
        if own
        else []
    )
    when = {path: look_up(experiment, path)[0] for path in (*CHOICES, *paths)}
    plain = {
        path: list(value) if isinstance(value, tuple) else value for path, value in when.items()
    }
    return {
        "name": name,
        "when": plain,
        "module": single_page.compress(module_of(experiment)),
        "plan": Habitat(experiment).plan(),
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
        "look": _look(experiment),
        "elders": has_parent_teachers(experiment),
        "about": [topic._asdict() for topic in about(experiment)],
    }


def _worker() -> str:
    """The code of a worker, in which nothing can be imported."""
    lines = "".join((single_page.STATIC / name).read_text("utf-8") for name in WORKER).splitlines()
    return "\n".join(
        line.removeprefix("export ") for line in lines if not line.startswith("import ")
    )


def _choosable(experiment: Experiment) -> dict[str, list[str]]:
    """What a reader may choose of, by the path of the field: the parts that are in the page's modules."""
    own = experiment.evolution.selection
    schemes = list(BUILT_IN["selection"])
    found = {"evolution.selection": schemes if own in schemes else [*schemes, own]}
    if experiment.evolution.inheritance in OF_ANY_INHERITANCE:
        found["evolution.inheritance"] = list(OF_ANY_INHERITANCE)
    if not any(added_choices(experiment)):
        found["learning.rule"] = list(BUILT_IN["learning rule"])
    return found


def _schema(experiment: Experiment) -> Any:
    """The fields that the page shows: those that it cannot change are as they are."""
    schema = schema_of(type(experiment))
    choosable = _choosable(experiment)
    fixed = [
        "model",
        "record.genome_every",
        *(path for path, _, _ in choosing_fields(type(experiment)) if path not in choosable),
    ]
    if any(added_choices(experiment)):
        fixed += ["name", "lifetime.update", *_settled(experiment)]
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


def _settled(experiment: Experiment) -> Iterator[str]:
    """The fields that a foreign part has made something of which compiled code takes as it is."""
    network = type(experiment.part("network.kind"))
    if network.layers is not Network.layers or getattr(
        network, "graphs", False
    ):  # only its part checks a graph's room
        yield "network.hidden"
    for path, kind, _ in choosing_fields(type(experiment)):
        for part in experiment.parts(path):
            if type(part).name not in BUILT_IN[kind]:
                free = numeric_fields(type(part))
                table = f"{path.rpartition('.')[0]}.{key_of(type(part).name)}"
                yield from (
                    f"{table}.{name}" for name in type(part).model_fields if name not in free
                )
    settled = _constants(experiment)
    for path, value in _numbers(experiment.to_dict()):
        other = _changed(experiment, path, value)
        if other is not None and _constants(other) != settled:
            yield path


def _constants(experiment: Experiment) -> str:
    """All that a plan has as it is, and no field of."""
    return repr(Habitat(experiment).plan())


def _numbers(tree: dict[str, Any], prefix: str = "") -> Iterator[tuple[str, float]]:
    for name, value in tree.items():
        if isinstance(value, dict):
            yield from _numbers(value, f"{prefix}{name}.")
        elif isinstance(value, int | float) and not isinstance(value, bool):
            yield f"{prefix}{name}", value


def _changed(experiment: Experiment, path: str, value: float) -> Experiment | None:
    """The experiment with another number there, whichever is allowed."""
    for number in (value / 2, value * 2, value + 1, value - 1):
        change: Any = int(number) if isinstance(value, int) else number
        for step in reversed(path.split(".")):
            change = {step: change}
        with suppress(ExperimentError):
            return experiment.replace(**change)
    return None


def _look(experiment: Experiment) -> dict[str, Any]:
    """How its world looks, with what follows from fields left open: see `filled` in browser_lab.js."""
    seen, foods = look(experiment).to_dict(), len(experiment.world.food)
    regions = len(item_regions(experiment))
    food = {"name": FOOD, "colour": FOOD_COLOR, "number": {"path": "count"}}
    box = {"x": {"path": "x.0"}, "y": {"path": "y.0"}}
    box |= {"width": {"path": "x.1", "less": "x.0"}, "height": {"path": "y.1", "less": "y.0"}}
    mark = {"kind": "rectangle", **box, "colour": FOOD_COLOR, "label": FOOD, "solid": False}
    start, side = seen["marks"][regions], {"sum": [["world.start.radius", 2]]}
    around = {
        axis: {"sum": [[f"world.start.{axis}", 1], ["world.start.radius", -1]]} for axis in "xy"
    }
    seen["sectors"] = [
        sector and sector | {"radius": {"path": "senses.visual_radius"}}
        for sector in seen["sectors"]
    ]
    seen["item_kinds"] = [{"table": "world.food", "row": food}, *seen["item_kinds"][foods:]]
    seen["marks"] = [
        {"table": "world.food", "row": mark},
        *seen["marks"][foods:regions],
        start | around | {"width": side, "height": side},
        *seen["marks"][regions + 1 :],
    ]
    return seen | {"remembers": not experiment.part("network.kind").is_memoryless}
