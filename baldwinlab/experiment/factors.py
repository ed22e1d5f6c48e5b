"""Factors of the conditions of a study: learner, map and variant."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final, Literal, NamedTuple

# Commands that show presets do not load xarray, which takes time.
if TYPE_CHECKING:
    import xarray as xr

StudyKind = Literal["conditions", "sweep", "multiverse"]
CONDITIONS: Final[StudyKind] = "conditions"
SWEEP: Final[StudyKind] = "sweep"
MULTIVERSE: Final[StudyKind] = "multiverse"
STUDY_KINDS: Final = (CONDITIONS, SWEEP, MULTIVERSE)


class Factors(NamedTuple):
    """Factors of a condition."""

    learner: str = ""  # Learning condition, for example "evo+self-taught".
    map: str = ""  # Name of the map, or "".
    variant: str = ""  # Variant of the paper in a multiverse, or "".

    @property
    def title(self) -> str:
        """Title of a figure of the condition."""
        return f"Map {self.map}, {self.learner}" if self.map else self.learner


def factor_coordinates(factors: list[Factors]) -> dict[str, tuple[str, list[str]]]:
    """Return the coordinates along `condition` of the factors that are not empty."""
    columns = {
        name: [getattr(condition, name) for condition in factors] for name in Factors._fields
    }
    return {name: ("condition", values) for name, values in columns.items() if any(values)}


def read_factors(dataset: xr.Dataset) -> dict[str, Factors]:
    """Return the factors of each condition of a dataset of `open_runs`."""
    names = [str(name) for name in dataset["condition"].values]
    columns = [
        dataset[name].values if name in dataset.coords else [""] * len(names)
        for name in Factors._fields
    ]
    rows = zip(*columns, strict=True)
    return {name: Factors(*map(str, row)) for name, row in zip(names, rows, strict=True)}
