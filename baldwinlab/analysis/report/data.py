"""The study and the results that a report shows, and the lifetimes to which the report links."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any, Final, NamedTuple
from urllib.parse import urlencode

import xarray as xr

from baldwinlab.analysis.claim_results import ClaimResult
from baldwinlab.analysis.claim_samples import ModelMeasure
from baldwinlab.analysis.results.contrasts import Contrasts
from baldwinlab.analysis.statistics import fitness
from baldwinlab.core.lab_address import DEFAULT_LAB_PORT, LAB_HOST
from baldwinlab.experiment import Experiment
from baldwinlab.papers import Paper

# Largest number of lifetimes that a figure links to.
MAX_LINKED_LIVES: Final = 8
Experiments = Mapping[str, Experiment]
# Appearance by condition, for MiniWorld conditions whose parts are installed.
Appearances = Mapping[str, Mapping[str, Any]]
# Largest number of generations in the figure of emergence.
MAX_EMERGENCE_PANELS: Final = 6


class StoredLife(NamedTuple):
    """A stored lifetime."""

    condition: str
    run: int
    generation: int

    @property
    def options(self) -> str:
        """The options of commands that replay the lifetime."""
        return f"--condition {self.condition} --run {self.run} --generation {self.generation}"


class Link(NamedTuple):
    """A link to lifetimes in the lab."""

    label: str
    address: str


def find_typical_lives(data: xr.Dataset, last: int = 10) -> dict[str, StoredLife]:
    """Return by condition the last generation of a typical run. Skip conditions without runs."""
    has_data = data["energy"].notnull().any(("run", "agent"))
    lives = {}
    for name in map(str, data["condition"].values):
        is_stored = has_data.sel(condition=name)
        if bool(is_stored.any()):
            last_generation = int(is_stored["generation"][is_stored][-1])
            run = fitness.typical_run(data, name, last)
            lives[name] = StoredLife(name, run, last_generation)
    return lives


def make_link(lives: Sequence[StoredLife], label: str = "") -> Link:
    """Return the link to one lifetime, or to two that the lab shows next to each other.

    The lab serves the directory of the study, so the address contains no name of a directory. Keys
    of the second lifetime have the prefix "b.". `label`: text, by default the conditions.
    """
    state: dict[str, str | int] = {}
    for prefix, life in zip(("", "b."), lives, strict=False):
        state[f"{prefix}study"] = "."
        state |= {f"{prefix}{key}": value for key, value in life._asdict().items()}
    label = label or " and ".join(life.condition for life in lives)
    return Link(label, _format_address("world", state))


def link_paper(name: str) -> Link:
    """Return the link to the card of a paper, for a lab that serves the folder of the study."""
    return Link(name, _format_address("papers", {"paper": name}))


def _format_address(view: str, state: Mapping[str, str | int]) -> str:
    return f"http://{LAB_HOST}:{DEFAULT_LAB_PORT}/#/{view}?{urlencode(state)}"


def link_conditions(lives: Mapping[str, StoredLife]) -> list[Link]:
    """Return a link to a typical lifetime of each condition, at most `MAX_LINKED_LIVES`."""
    return [make_link([life]) for life in [*lives.values()][:MAX_LINKED_LIVES]]


def format_replay_command(life: StoredLife) -> str:
    """Return the command that writes a lifetime as a movie, in the directory of the study."""
    return f"baldwinlab replay . {life.options} --out life.mp4"


@dataclass(frozen=True)
class ReportData:
    """A study and its results, from which a report is drawn."""

    directory: Path  # Directory of the study. Figures are written to its folder `figures`.
    data: xr.Dataset  # The runs, with the dimensions (condition, run, generation, agent).
    experiments: Experiments
    results: Sequence[ClaimResult] = ()
    # Lifetimes of one population at `emergence_generations`, or none.
    traces: Sequence[xr.Dataset] = ()
    # Known facts: seed, versions, platform, seconds, agent_steps, workers, compile_seconds.
    provenance: Mapping[str, Any] = field(default_factory=dict)
    last: int = 10  # Number of final generations to average in each run.
    # The paper of the claims. Without a paper, the report mentions none.
    paper: Paper | None = None
    # Appearance by condition, for MiniWorld conditions whose parts are installed.
    appearances: Appearances = field(default_factory=dict)
    contrasts: Contrasts | None = None  # The comparisons of the conditions.
    model_measures: Sequence[ModelMeasure] = ()  # Measures of the models that claims compare.
    # Variant of the paper by condition, from `setup.describe_variants`.
    variants: Mapping[str, str] = field(default_factory=dict)
    is_reproduction: bool = False  # Whether `paper` defines the study.
    instruction: str = ""  # How to add runs, with "{runs}" for the number of runs.

    @cached_property
    def lives(self) -> dict[str, StoredLife]:
        """A typical lifetime of each condition."""
        return find_typical_lives(self.data, self.last)


def emergence_generations(generations: int) -> list[int]:
    """Return the generations that the figure of emergence shows.

    Foraging emerges early, so the interval between generations grows geometrically: of 100
    generations, the figure shows 0, 1, 3, 10, 31 and 99.

    Returns at most six generations, with the first and the last.
    """
    if generations <= MAX_EMERGENCE_PANELS:
        return list(range(generations))
    last_generation = generations - 1
    # The generations have equal distances on a logarithmic axis. Generation 0 is added.
    n_intervals = MAX_EMERGENCE_PANELS - 2
    exponents = [interval_index / n_intervals for interval_index in range(n_intervals + 1)]
    return sorted({0, *(round(last_generation**exponent) for exponent in exponents)})
