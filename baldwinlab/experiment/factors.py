"""What tells the conditions of a study apart: written down in `study.toml`, and coordinates of `open_runs`."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final, Literal, NamedTuple

if TYPE_CHECKING:  # presets are shown without it, which takes a while to load
    import xarray as xr

Kind = Literal["conditions", "sweep", "multiverse"]
CONDITIONS: Final[Kind] = "conditions"
SWEEP: Final[Kind] = "sweep"
MULTIVERSE: Final[Kind] = "multiverse"
KINDS: Final = (CONDITIONS, SWEEP, MULTIVERSE)


class Factors(NamedTuple):
    """By which a condition differs from others; "" where a factor says nothing of it."""

    learner: str = ""  # who lives there, such as evo+self-taught
    map: str = ""
    variant: str = ""  # of the paper, in a multiverse

    @property
    def title(self) -> str:
        """Over a picture of the condition."""
        return f"Map {self.map}, {self.learner}" if self.map else self.learner


def coordinates(factors: list[Factors]) -> dict[str, tuple[str, list[str]]]:
    """Coordinates along `condition`: of each factor that says something of any of these conditions."""
    columns = {name: [getattr(one, name) for one in factors] for name in Factors._fields}
    return {name: ("condition", values) for name, values in columns.items() if any(values)}


def of_study(dataset: xr.Dataset) -> dict[str, Factors]:
    """The factors of each condition of a dataset as `open_runs` gives it."""
    names = [str(name) for name in dataset["condition"].values]
    columns = [
        dataset[name].values if name in dataset.coords else [""] * len(names)
        for name in Factors._fields
    ]
    return {
        name: Factors(*map(str, values))
        for name, values in zip(names, zip(*columns, strict=True), strict=True)
    }
