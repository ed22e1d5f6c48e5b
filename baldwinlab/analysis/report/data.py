"""The study and the results from which a report is drawn."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any, Final

import xarray as xr

from baldwinlab.analysis.claim_results import ClaimResult
from baldwinlab.analysis.claim_samples import ModelMeasure
from baldwinlab.analysis.report.replays import StoredLife, find_typical_lives
from baldwinlab.analysis.results.contrasts import Contrasts
from baldwinlab.experiment import Experiment
from baldwinlab.papers import Paper

Experiments = Mapping[str, Experiment]
# Appearances of MiniWorld conditions whose parts are installed.
Appearances = Mapping[str, Mapping[str, Any]]
# Largest number of generations in the figure of emergence.
MAX_EMERGENCE_PANELS: Final = 6


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
    # Appearances of MiniWorld conditions whose parts are installed.
    appearances: Appearances = field(default_factory=dict)
    contrasts: Contrasts | None = None  # The comparisons of the conditions.
    model_measures: Sequence[ModelMeasure] = ()  # Measures of the models that claims compare.
    # Variant of the paper by condition, from `settings.describe_variants`.
    variants: Mapping[str, str] = field(default_factory=dict)
    is_reproduction: bool = False  # Whether `paper` defines the study.
    instruction: str = ""  # A sentence that says how to add runs, with "{runs}" for their number.

    @cached_property
    def lives(self) -> dict[str, StoredLife]:
        """A typical lifetime of each condition."""
        return find_typical_lives(self.data)


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
