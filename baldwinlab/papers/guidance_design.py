"""Design of the study what-guides, read from the file `papers/guidance/design.toml`.

A group has cells: experiments with learning that differ in the values of `fields`. The study
compares the learner of a cell with its control without learning, and with further controls.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from itertools import product
from pathlib import Path
from typing import Any, Final, Literal, NamedTuple

from pydantic import Field

from baldwinlab.core.names import MAP_NAME, PREDICTION
from baldwinlab.experiment import Experiment, assign
from baldwinlab.experiment.paths import look_up
from baldwinlab.experiment.toml import format_assignments
from baldwinlab.papers import presets
from baldwinlab.papers.atlas_design import AtlasClaim
from baldwinlab.papers.loading import DeclaredTable, digest_folder, read_tables, validate_tables

FOLDER: Final = Path(__file__).with_name("guidance")
DESIGN_FILE: Final = "design.toml"

NoiseKind = Literal["drift", "yoked"]
StartKind = Literal["population", "mode"]


class GuidanceGroup(DeclaredTable):
    """Cells of one model."""

    name: str = Field(pattern=MAP_NAME)
    title: str
    # The model, in a few sentences.
    description: str
    # The learner, and settings that differ from it in all cells.
    preset: str
    settings: Mapping[str, Any] = Field(default_factory=dict)
    # Values by swept field: the cells have all combinations.
    fields: Mapping[str, tuple[Any, ...]] = Field(default_factory=dict)
    # Values of swept fields in the quick form. A group with a field without values is omitted.
    quick: Mapping[str, tuple[Any, ...]] = Field(default_factory=dict)
    runs: int = Field(ge=2)
    quick_runs: int = Field(8, ge=2)
    # Numbers of common generations without learning after which innate fitness is measured.
    horizons: tuple[int, ...] = Field(min_length=1)
    # Controls of `simulation.noise_controls`, or of `learning.control` in MiniWorld.
    noise: tuple[NoiseKind, ...] = ()
    # Further conditions with noise instead of learning: the preset by the name of the condition.
    noise_presets: Mapping[str, str] = Field(default_factory=dict)
    starts: tuple[StartKind, ...] = ("population",)
    # Phenotypes that a learner evaluates for each one of its control: a number, or a field with
    # the number of trials in addition to the evaluation at the end of life.
    evaluations: int | str = 1
    # Settings of a cost. The learner and its noise are simulated also with this cost.
    costs: Mapping[str, float] = Field(default_factory=dict)
    # Whether effects are divided by the higher innate fitness, as those of the fork assay are.
    is_relative: bool = False
    # Whether `analysis.theory.landscape_chain` predicts the effect on each landscape.
    has_law: bool = False

    def change_fields(self, fields: Mapping[str, tuple[Any, ...]], runs: int) -> GuidanceGroup:
        """Return the group with other values of some fields, and another number of runs."""
        return self.model_copy(update={"fields": {**self.fields, **fields}, "runs": runs})


class GuidancePrediction(AtlasClaim):
    """A prediction, with the rule that decides whether it holds."""

    id: str = Field(pattern=PREDICTION)


class GuidanceDesign(DeclaredTable):
    """The fields of `design.toml`."""

    title: str
    # Number of the first run. Pilot runs and the quick form have smaller numbers.
    first_run: int = Field(ge=0)
    # Smallest number of runs in a cell with which a prediction is decided.
    least_runs: int = Field(ge=2)
    groups: tuple[GuidanceGroup, ...] = Field(min_length=1)
    predictions: tuple[GuidancePrediction, ...] = Field(min_length=1)

    def shorten(self) -> GuidanceDesign:
        """Return the design of `--quick`: fewer cells, other runs, and no predictions."""
        quick = [group.change_fields(group.quick, group.quick_runs) for group in self.groups]
        groups = tuple(group for group in quick if all(group.fields.values()))
        # The first run is another one, so that a quick look shows no confirmatory run.
        return self.model_copy(update={"groups": groups, "predictions": (), "first_run": 0})

    def with_runs(self, runs: int) -> GuidanceDesign:
        """Return the design with this number of runs in all cells."""
        groups = tuple(group.change_fields({}, runs) for group in self.groups)
        return self.model_copy(update={"groups": groups})


class Cell(NamedTuple):
    """A learner, with the values of the swept fields of its group."""

    group: GuidanceGroup
    learner: Experiment
    values: Mapping[str, Any]

    @property
    def name(self) -> str:
        """Name of the cell, which is that of the learner."""
        return str(self.learner.name)

    @property
    def evaluations(self) -> int:
        """Number of phenotypes that a learner evaluates for each one of its control."""
        given = self.group.evaluations
        return given if isinstance(given, int) else 1 + int(look_up(self.learner, given)[0])

    @property
    def costly_learner(self) -> Experiment:
        """The learner with a cost."""
        return _change(self.learner, self.group.costs)

    def load_noise(self, condition: str) -> Experiment:
        """Return the experiment of one of `noise_presets`, with the settings of the group."""
        return _change(presets.load(self.group.noise_presets[condition]), self.group.settings)


def read_guidance() -> GuidanceDesign:
    """Return the design. Raises PaperError."""
    path = FOLDER / DESIGN_FILE
    return validate_tables(GuidanceDesign, read_tables(path), path)


def digest_guidance() -> dict[str, str]:
    """Return the SHA-256 of the file of the design, by its name."""
    return digest_folder(FOLDER, [DESIGN_FILE])


def list_cells(group: GuidanceGroup) -> Iterator[Cell]:
    """Yield the cells of a group, with the last field varying fastest.

    The name of a cell has the numbers of its values, for example nk-k-5-trials-30-size-100.
    """
    base = _change(presets.load(group.preset), group.settings)
    for combination in product(*group.fields.values()):
        values = dict(zip(group.fields, combination, strict=True))
        labels = [f"{field.rpartition('.')[2]}-{value}" for field, value in values.items()]
        learner = _change(base, values).replace(name="-".join([group.name, *labels]))
        yield Cell(group, learner, values)


def _change(experiment: Experiment, settings: Mapping[str, Any]) -> Experiment:
    changed: Experiment = assign(experiment, format_assignments(settings))
    return changed
