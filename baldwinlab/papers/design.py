"""Design of a study in stages, read from the files `design.toml` and `tuned.toml` of a paper.

A paper with a `design.toml` is reproduced in three stages:

1. Tuning: conditions are simulated with each value of a setting. The best value is chosen.
2. Confirmation: conditions with the chosen values are simulated in runs that tuning did not use.
3. Specification curve: all conditions are simulated in each combination of other settings.

The confirmation uses the values in `tuned.toml`. Without this file, it uses the values that the
tuning runs of the same reproduction have chosen. `api/stages.py` runs the stages.
"""

from __future__ import annotations

import hashlib
from collections.abc import Mapping, Sequence
from itertools import product
from typing import Any, Final, Literal, NamedTuple

from pydantic import Field, model_validator

from baldwinlab.core.names import GRID_NAME
from baldwinlab.experiment import Experiment, assign
from baldwinlab.experiment.conditions import Factors
from baldwinlab.experiment.toml import format_assignments
from baldwinlab.papers.loading import (
    DeclaredTable,
    PaperError,
    read_content,
    read_tables,
    validate_tables,
)
from baldwinlab.papers.paper import Paper

DESIGN_FILE: Final = "design.toml"
TUNED_FILE: Final = "tuned.toml"
TUNING_FOLDER: Final = "tuning"
CONFIRMATION_FOLDER: Final = "confirmation"
SPECIFICATIONS_FOLDER: Final = "specifications"
FROZEN_FILE: Final = "frozen.json"
"""File of a confirmation. It has the SHA-256 of the claims and of the tuned values at the start."""

TunedSettings = Mapping[str, Mapping[str, float]]
"""Chosen value of each tuned setting, by condition: {"evo+hebb/A": {"learning.rate": 0.03}}."""


class TuningGrid(DeclaredTable):
    """Values of a setting. The tuning chooses the best of these values for each condition."""

    # Beginning of the names of the study folders: "rate" for the folder rate-0.01.
    name: str = Field(pattern=GRID_NAME)
    # Path of the setting.
    field: str
    values: tuple[float, ...] = Field(min_length=2)
    conditions: tuple[str, ...] = Field(min_length=1)
    # Condition of the confirmation that gets the chosen value. By default the simulated condition.
    target: str = ""

    def folder(self, value: float) -> str:
        """Return the name of the folder with the study of a value, such as "rate-0.01"."""
        return f"{self.name}-{value}"


class Tuning(DeclaredTable):
    """The tuning simulates the runs 0 to `runs` - 1 for each value of each grid."""

    runs: int = Field(ge=1)
    grids: tuple[TuningGrid, ...] = Field(min_length=1)
    # Settings of all tuning runs.
    settings: Mapping[str, Any] = Field(default_factory=dict)

    @model_validator(mode="after")
    def _require_one_grid_per_target(self) -> Tuning:
        """Refuse two grids for one condition, because the confirmation uses one chosen value."""
        targets = [grid.target or name for grid in self.grids for name in grid.conditions]
        for target in targets:
            if targets.count(target) > 1:
                raise ValueError(
                    f"grids: two grids or conditions choose the value of {target!r}, and a "
                    "condition of the confirmation has one; leave one, or give another target"
                )
        return self


class MatchedControls(DeclaredTable):
    """Controls of each learning rule: the same settings, but with a `learning.control`."""

    kinds: tuple[Literal["yoked", "drift"], ...]
    maps: tuple[str, ...]


class SpecificationCurve(DeclaredTable):
    """All rules and noise controls are simulated in each combination of the values of `factors`."""

    # Values of each setting, by the path of the setting.
    factors: Mapping[str, tuple[Any, ...]]
    # Settings that are equal in all combinations.
    settings: Mapping[str, Any] = Field(default_factory=dict)
    maps: tuple[str, ...]
    runs: int = Field(ge=1)


class QuickStudy(DeclaredTable):
    """Changes for `--quick`: a check of the procedure, with too few runs for verdicts."""

    maps: tuple[str, ...]
    tuning_runs: int = Field(ge=1)
    runs: int = Field(ge=1)
    # Settings of the specification curve. A setting that is also a factor then has this one value.
    settings: Mapping[str, Any] = Field(default_factory=dict)


class Design(DeclaredTable):
    """The fields of `design.toml`."""

    # Controls without useful learning. A claim compares a learning rule with each of them.
    noise_controls: tuple[str, ...] = Field(min_length=1)
    tuning: Tuning
    matched_controls: MatchedControls
    specification_curve: SpecificationCurve
    quick: QuickStudy

    def with_tuning_runs(self, runs: int) -> Design:
        """Return the design with another number of runs of the tuning."""
        return self.model_copy(update={"tuning": self.tuning.model_copy(update={"runs": runs})})

    def shorten(self) -> Design:
        """Return the design of `--quick`."""
        quick = self.quick
        curve = self.specification_curve
        return self.with_tuning_runs(quick.tuning_runs).model_copy(
            update={
                "matched_controls": self.matched_controls.model_copy(update={"maps": quick.maps}),
                "specification_curve": curve.model_copy(
                    update={
                        "maps": quick.maps,
                        "runs": 1,
                        "settings": {**curve.settings, **quick.settings},
                        "factors": {
                            field: values
                            for field, values in curve.factors.items()
                            if field not in quick.settings
                        },
                    }
                ),
            }
        )


class StudyConditions(NamedTuple):
    """The conditions of a study, and the factors of each condition by the condition's name."""

    experiments: list[Experiment]
    factors: dict[str, Factors]

    def add(self, experiment: Experiment, factors: Factors) -> None:
        """Add a condition."""
        self.experiments.append(experiment)
        self.factors[experiment.name] = factors


def read_design(paper: Paper) -> Design | None:
    """Return the design of a paper, None without `design.toml`. Raises PaperError."""
    path = paper.folder / DESIGN_FILE
    return validate_tables(Design, read_tables(path), path) if path.exists() else None


def read_tuned(paper: Paper) -> TunedSettings | None:
    """Return the values in `tuned.toml`, or None without this file. Raises PaperError."""
    path = paper.folder / TUNED_FILE
    if not path.exists():
        return None
    tables = read_tables(path)
    for condition, settings in tables.items():
        if not isinstance(settings, dict) or not all(map(_is_number, settings.values())):
            raise PaperError(f"{path}: {condition} must be a table of settings and their numbers")
    return tables


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)


def format_tuned(tuned: TunedSettings, comment: str) -> str:
    """Return the text of `tuned.toml`."""
    lines = [f"# {comment}"]
    for condition, settings in tuned.items():
        values = ", ".join(f'"{field}" = {value}' for field, value in settings.items())
        lines.append(f'"{condition}" = {{ {values} }}')
    return "".join(f"{line}\n" for line in lines)


def digest_files(paper: Paper, tuned: str) -> dict[str, str]:
    """Return the SHA-256 of the claims and of the tuned values, by the name of the file.

    `tuned`: the text to use for a paper without `tuned.toml`.
    """
    contents = {TUNED_FILE: tuned.encode()}
    for name in ("claims.toml", TUNED_FILE):
        path = paper.folder / name
        if path.exists():
            contents[name] = read_content(path)
    return {name: hashlib.sha256(content).hexdigest() for name, content in contents.items()}


def list_rules(paper: Paper, design: Design) -> list[str]:
    """Return the names, without a map, of the conditions that learn and are no noise controls."""
    first_map = (paper.metadata.maps or ("",))[0]
    return [
        condition
        for condition in paper.metadata.conditions
        if condition not in design.noise_controls
        and paper.experiment(join_map(condition, first_map)).learns
    ]


def name_matched_control(condition: str, kind: str) -> str:
    """Return the name of a matched control without a map, such as "evo+hebb+yoked"."""
    return f"{condition}+{kind}"


def join_map(condition: str, map_name: str) -> str:
    """Return the name of a condition on a map; `map_name` is "" if the paper has no maps.

    >>> join_map("evo", "A"), join_map("guessing", "")
    ('evo/A', 'guessing')
    """
    return f"{condition}/{map_name}" if map_name else condition


def tuning_conditions(
    paper: Paper, design: Design, grid: TuningGrid, maps: Sequence[str], value: float
) -> StudyConditions:
    """Return the conditions of the study that simulates one value of a grid."""
    conditions = StudyConditions([], {})
    settings = {**design.tuning.settings, grid.field: value}
    for condition, map_name in product(grid.conditions, maps):
        experiment = paper.experiment(join_map(condition, map_name))
        conditions.add(_change(experiment, settings), Factors(condition, map_name))
    return conditions


def confirmation_conditions(
    paper: Paper, design: Design, maps: Sequence[str], tuned: TunedSettings
) -> StudyConditions:
    """Return the conditions of the confirmation: all of the paper, and the matched controls."""
    conditions = StudyConditions([], {})
    matched = {*product(list_rules(paper, design), design.matched_controls.maps)}
    for map_name, condition in product(maps, paper.metadata.conditions):
        name = join_map(condition, map_name)
        experiment = _change(paper.experiment(name), tuned.get(name, {}))
        conditions.add(experiment, Factors(condition, map_name))
        kinds = design.matched_controls.kinds if (condition, map_name) in matched else ()
        for kind in kinds:
            control = name_matched_control(condition, kind)
            renamed = experiment.replace(name=join_map(control, map_name))
            conditions.add(renamed.replace(learning={"control": kind}), Factors(control, map_name))
    return conditions


def list_matched_names(paper: Paper, design: Design) -> list[str]:
    """Return the names of the matched controls of the confirmation."""
    controls = design.matched_controls
    return [
        join_map(name_matched_control(condition, kind), map_name)
        for map_name, condition, kind in product(
            controls.maps, list_rules(paper, design), controls.kinds
        )
    ]


def specification_conditions(paper: Paper, design: Design) -> StudyConditions:
    """Return the conditions of the specification curve, with names such as "s01/evo+hebb/A"."""
    conditions = StudyConditions([], {})
    learners = [*list_rules(paper, design), *design.noise_controls]
    curve = design.specification_curve
    for number, values in enumerate(product(*curve.factors.values()), 1):
        settings = dict(zip(curve.factors, values, strict=True))
        variant = f"s{number:02d}"
        for map_name, condition in product(curve.maps, learners):
            name = join_map(condition, map_name)
            experiment = _change(paper.experiment(name), {**settings, **curve.settings})
            # Only the first and the last generation have stored genomes, which saves disk space.
            renamed = experiment.replace(
                name=f"{variant}/{name}",
                record={"genome_every": experiment.evolution.generations},
            )
            conditions.add(renamed, Factors(condition, map_name, variant))
    return conditions


def _change(experiment: Experiment, settings: Mapping[str, Any]) -> Experiment:
    changed: Experiment = assign(experiment, format_assignments(settings))
    return changed
