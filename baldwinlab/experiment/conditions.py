"""Conditions of a study: the factors (learner, map and variant) and the control of a condition.

The control of a condition differs from the condition only in having no learning.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import partial
from typing import TYPE_CHECKING, Any, Final, Literal, NamedTuple

from baldwinlab.experiment import BaseExperiment, Experiment, ExperimentError
from baldwinlab.experiment.registry import table_name

# Commands that show presets do not load xarray, which takes time.
if TYPE_CHECKING:
    import xarray as xr

StudyKind = Literal["conditions", "sweep", "multiverse"]
CONDITIONS: Final[StudyKind] = "conditions"
SWEEP: Final[StudyKind] = "sweep"
MULTIVERSE: Final[StudyKind] = "multiverse"
# Name of a map that is not of a paper. A second one is "your map 2".
YOUR_MAP: Final = "your map"


# The factors that studies store and tables show.
FACTOR_NAMES: Final = ("learner", "map", "variant")


class Factors(NamedTuple):
    """Factors of a condition: `FACTOR_NAMES`, and the world."""

    learner: str = ""  # Learning condition, for example "evo+self-taught".
    map: str = ""  # Name of the map, from the settings: see `papers.worlds`. "" without maps.
    variant: str = ""  # Variant of the paper in a multiverse, or "".
    world: str = ""  # Digest of the settings of the world: see `papers.worlds`.

    @property
    def place(self) -> tuple[str, str, str]:
        """What conditions share that are compared by default: the map, the variant, the world."""
        return self.map, self.variant, self.world

    @property
    def title(self) -> str:
        """Title of a figure of the condition."""
        return f"{title_map(self.map)}, {self.learner}" if self.map else self.learner


def describe_map(name: str) -> str:
    """Return a map in a sentence: "A" -> "map A", "your map" -> "your map"."""
    return name if name.startswith(YOUR_MAP) else f"map {name}"


def title_map(name: str) -> str:
    """Return a map as a title: "A" -> "Map A", "" -> ""."""
    text = describe_map(name) if name else ""
    return f"{text[:1].upper()}{text[1:]}"


def factor_coordinates(factors: list[Factors]) -> dict[str, tuple[str, list[str]]]:
    """Return the factors that are not all "" as coordinates: {"map": ("condition", ["A", "B"])}."""
    columns = {name: [getattr(levels, name) for levels in factors] for name in FACTOR_NAMES}
    return {name: ("condition", values) for name, values in columns.items() if any(values)}


def add_maps(
    columns: Sequence[str], rows: Iterable[Mapping[str, Any]], factors: Mapping[str, Factors]
) -> tuple[list[str], list[dict[str, Any]]]:
    """Return the columns and rows of a table with the map of each condition, if there are maps.

    The column "map_a" has the maps of the conditions in the column "condition_a".
    """
    maps = {name: levels.map for name, levels in factors.items() if levels.map}
    names = [column for column in columns if maps and column.startswith("condition")]
    added = {name.replace("condition", "map"): name for name in names}
    return [*columns, *added], [
        {**row, **{column: maps.get(row[name], "") for column, name in added.items()}}
        for row in rows
    ]


def read_factors(dataset: xr.Dataset) -> dict[str, Factors]:
    """Return the factors of each condition from the coordinates of a dataset of `open_runs`."""
    names = [str(name) for name in dataset["condition"].values]
    columns = [
        dataset[name].values if name in dataset.coords else [""] * len(names)
        for name in FACTOR_NAMES
    ]
    rows = zip(*columns, strict=True)
    return {name: Factors(*map(str, row)) for name, row in zip(names, rows, strict=True)}


def find_control(name: str, experiments: Mapping[str, BaseExperiment]) -> str:
    """Return the name of the control of a condition, or "" if `experiments` has no control."""
    experiment = experiments[name]
    is_control = _make_control_test(experiment)
    for candidate, control in experiments.items():
        if candidate != name and is_control(control):
            return candidate
    return ""


def _make_control_test(experiment: BaseExperiment) -> Callable[[Any], bool]:
    if isinstance(experiment, Experiment):
        return partial(_is_without_rule, experiment)
    try:
        control = _shared_settings(experiment.without_learning())
    except ExperimentError:
        # The model is not loaded.
        return partial(_is_without_learning, experiment)
    return lambda candidate: _shared_settings(candidate) == control


def _shared_settings(experiment: BaseExperiment) -> dict[str, Any]:
    """Return the settings of a control that determine whether two controls are equal."""
    tree = experiment.to_dict()
    # The name differs. `lamarckian_share` has no effect without learning, so it may differ.
    return tree | {"name": "", "evolution": tree["evolution"] | {"lamarckian_share": 0.0}}


def _is_without_rule(experiment: Experiment, candidate: Experiment) -> bool:
    """Return whether only the table `learning` differs, and `candidate` does not learn."""
    if candidate.learns:
        return False
    tree = experiment.to_dict()
    shared = {"name": experiment.name, "learning": tree["learning"]}
    return bool(candidate.to_dict() | shared == tree)


def _is_without_learning(experiment: BaseExperiment, candidate: BaseExperiment) -> bool:
    """Return whether `candidate` is `experiment` without learning, for a model not loaded."""
    key = table_name(experiment.model)
    tree = experiment.to_dict()
    candidate_tree = candidate.to_dict()
    shared = {"name": experiment.name, key: tree[key]}
    if candidate_tree | shared != tree:
        return False
    control = candidate_tree[key]
    differing = [name for name in tree[key] if control.get(name) != tree[key][name]]
    # A single setting of the model switches learning off.
    return len(differing) == 1 and control.get(differing[0]) is False
