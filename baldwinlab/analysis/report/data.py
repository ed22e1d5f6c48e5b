"""The study and the results from which a report is drawn."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any

import xarray as xr

from baldwinlab.analysis import figures
from baldwinlab.analysis.claim_results import ClaimResult
from baldwinlab.analysis.claim_samples import ModelMeasure
from baldwinlab.analysis.report.replays import StoredLife, find_typical_lives
from baldwinlab.analysis.statistics.contrasts import Contrasts
from baldwinlab.experiment import Experiment
from baldwinlab.papers import Paper

Experiments = Mapping[str, Experiment]
# Appearances of MiniWorld conditions whose parts are installed.
Appearances = Mapping[str, figures.Appearance]


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
