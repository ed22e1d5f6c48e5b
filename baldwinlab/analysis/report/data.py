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
    """A study and its results, from which a report is drawn.

    Parameters
    ----------
    directory : Path
        Directory of the study. Figures are written to its folder `figures`.
    data : xr.Dataset
        The runs, with the dimensions (condition, run, generation, agent).
    experiments : mapping of str to Experiment
        Experiments by condition.
    results : sequence of ClaimResult
        The evaluated claims.
    traces : sequence of xr.Dataset
        Lifetimes of one population at `emergence_generations`, or none.
    provenance : mapping of str to Any
        Known facts: seed, versions, platform, seconds, agent_steps, workers, compile_seconds.
    last : int
        Number of final generations to average in each run.
    paper : Paper or None
        The paper of the claims. Without a paper, the report mentions none.
    appearances : mapping of str to Appearance
        Appearances of MiniWorld conditions whose parts are installed.
    contrasts : Contrasts or None
        The comparisons of the conditions.
    model_measures : sequence of ModelMeasure
        Measures of the models that claims compare.
    variants : mapping of str to str
        Variant of the paper by condition, from `settings.describe_variants`.
    is_reproduction : bool
        Whether `paper` defines the study.
    instruction : str
        A sentence that says how to add runs, with "{runs}" for their number.
    """

    directory: Path
    data: xr.Dataset
    experiments: Experiments
    results: Sequence[ClaimResult] = ()
    traces: Sequence[xr.Dataset] = ()
    provenance: Mapping[str, Any] = field(default_factory=dict)
    last: int = 10
    paper: Paper | None = None
    appearances: Appearances = field(default_factory=dict)
    contrasts: Contrasts | None = None
    model_measures: Sequence[ModelMeasure] = ()
    variants: Mapping[str, str] = field(default_factory=dict)
    is_reproduction: bool = False
    instruction: str = ""

    @cached_property
    def lives(self) -> dict[str, StoredLife]:
        """A typical lifetime of each condition."""
        return find_typical_lives(self.data)
