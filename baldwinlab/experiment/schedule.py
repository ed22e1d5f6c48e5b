"""Scheduled changes: settings of an experiment that change at a generation.

The new value is valid in this generation and in all later generations. In TOML:

    [[schedule]]
    generation = 50
    "learning.rule" = "none"
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from functools import lru_cache
from typing import Any, Final

from pydantic import Field, model_validator

from baldwinlab.experiment.fields import ExperimentError, Fields, to_plain_data
from baldwinlab.experiment.file import File
from baldwinlab.experiment.paths import (
    combine_settings,
    iterate_settings,
    look_up,
    nest_settings,
    parse_assignment,
)

# Settings that cannot change during a run, because they determine the layout of runs or genomes.
FIXED_TABLES: Final = ("name", "model", "population", "record", "schedule", "network")
FIXED_FIELDS: Final = (
    "evolution.generations",
    "evolution.founders",
    "lifetime.steps",
    "lifetime.repeats",
)


class Change(Fields, extra="allow"):
    """Settings that change at a generation: the new value of each setting, by path."""

    generation: int = Field(
        ge=0, le=1_000_000, description="First generation with the new values, from 0."
    )

    @model_validator(mode="before")
    @classmethod
    def _flatten_tables(cls, tree: Any) -> Any:
        """Read a table `learning` with the setting `rule` as the key "learning.rule"."""
        if not isinstance(tree, Mapping):
            return tree
        settings = dict(iterate_settings(to_plain_data(tree)))
        # A data file is one setting with a table of its path and its hash.
        for path in [path.removesuffix(".sha256") for path in settings if path.endswith(".sha256")]:
            names = ("path", "sha256")
            settings[path] = {name: settings.pop(f"{path}.{name}", "") for name in names}
        return settings

    @property
    def settings(self) -> dict[str, Any]:
        """New values by path, such as {"learning.rule": "none"}."""
        return dict(self.model_extra or {})


SCHEDULE_FIELD: Any = Field(
    (),
    max_length=1000,
    description="Settings that change at a generation. []: the settings hold for all generations.",
)


def parse_changes(words: Sequence[str]) -> list[dict[str, Any]]:
    """Return [{"generation": 50, "learning.rule": "none"}] for ["50", "learning.rule=none"]."""
    changes: list[dict[str, Any]] = []
    for word in words:
        if word.isdecimal():
            changes.append({"generation": int(word)})
        elif changes:
            path, value = parse_assignment(word)
            changes[-1][path] = value
        else:
            raise ExperimentError(
                f"schedule: {word!r} must follow a generation, for example 50 learning.rule=none"
            )
    for change in changes:
        if len(change) == 1:
            raise ExperimentError(
                f"schedule: generation {change['generation']} changes nothing; add an assignment "
                "such as learning.rule=none"
            )
    return changes


@lru_cache(maxsize=256)
def apply_changes(experiment: Any, n_changes: int) -> Any:
    """Return an experiment after the first `n_changes` scheduled changes, without a schedule."""
    changes = [change.settings for change in experiment.schedule[:n_changes]]
    return experiment.replace(schedule=[], **nest_settings(combine_settings(changes)))


def require_valid_schedule(experiment: Any) -> None:
    """Raise ExperimentError if a run cannot follow the schedule of an experiment."""
    faults = list(_find_fixed_settings(experiment.schedule))
    generations = [change.generation for change in experiment.schedule]
    if generations != sorted(generations):
        faults.append(f"schedule: the generations {generations} must be in ascending order")
    if faults:
        raise ExperimentError("\n".join(faults))
    for generation in generations:
        try:
            changed = experiment.at(generation)
        except ExperimentError as error:
            raise ExperimentError(f"schedule, generation {generation}: {error}") from None
        _require_same_layout(experiment, changed, generation)


def _find_fixed_settings(changes: Sequence[Change]) -> Iterator[str]:
    """Yield a sentence for each change without settings, and each setting that must not change."""
    for change_index, change in enumerate(changes):
        if not change.settings:
            yield f"schedule.{change_index}: generation {change.generation} changes no setting"
        for path in change.settings:
            is_fixed = path.split(".")[0] in FIXED_TABLES or path.startswith(FIXED_FIELDS)
            if is_fixed:
                yield (
                    f"schedule.{change_index}: {path} cannot change during a run; settings of the "
                    "world, of learning and of evolution can"
                )


def _require_same_layout(experiment: Any, changed: Any, generation: int) -> None:
    """Raise ExperimentError if a change needs genomes or records with another layout.

    After the change, agents may use fewer modules than the genomes have.
    """
    # Imported late, because xarray takes a while to load, and few experiments have a schedule.
    from baldwinlab.core import variables

    modules = changed.modules
    has_same_genes = changed.genome_length == experiment.genome_length
    if modules != experiment.modules[: len(modules)] or not has_same_genes:
        raise ExperimentError(
            f"schedule, generation {generation}: the genomes would have the modules "
            f"{', '.join(modules)} with {changed.genome_length} genes, and those of the "
            f"experiment have {', '.join(experiment.modules)} with {experiment.genome_length}"
        )
    if variables.record_variables(changed).keys() != variables.record_variables(experiment).keys():
        raise ExperimentError(
            f"schedule, generation {generation}: the runs would have other recorded variables"
        )


def add_file_hashes(experiment: Any) -> list[dict[str, Any]]:
    """Return the schedule of an experiment, with the hash of each data file in it."""
    changes = []
    for change in to_plain_data(experiment.schedule):
        changed = experiment.at(change["generation"])
        values = {path: look_up(changed, path)[0] for path in change if path != "generation"}
        files = {path: value for path, value in values.items() if isinstance(value, File)}
        changes.append(change | to_plain_data(files))
    return changes


def drop_settings(
    schedule: Any, changes: Mapping[str, Any], choosing_paths: Collection[str]
) -> list[dict[str, Any]]:
    """Return a schedule without the settings that get one value for the whole run.

    `changes`: the settings that get one value, as nested tables. A new choice of a part, such as
    `evolution.selection`, also drops the scheduled settings of parts of this table, for example
    `evolution.larger_tournament.size`. `choosing_paths`: the settings that choose parts.
    """
    replaced_values = dict(iterate_settings(changes))
    sections = {
        _parent_path(path)
        for path, value in replaced_values.items()
        if isinstance(value, str) and "." in path and path in choosing_paths
    }
    remaining_changes = []
    for change in schedule:
        settings = {
            path: value
            for path, value in change.items()
            # A setting, or a list that contains the setting, gets a value.
            if not any(path == other or path.startswith(f"{other}.") for other in replaced_values)
            and _parent_path(_parent_path(path)) not in sections
        }
        # The generation of the change always remains. A change with no other entry is dropped.
        if len(settings) > 1:
            remaining_changes.append(settings)
    return remaining_changes


def _parent_path(path: str) -> str:
    return path.rpartition(".")[0]
