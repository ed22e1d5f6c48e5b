"""Sentences on a sweep. Each states an effect with its test, its interval and its runs."""

from __future__ import annotations

from collections.abc import Iterator
from operator import attrgetter

import numpy as np
import xarray as xr

from baldwinlab.analysis.statistics import fitness
from baldwinlab.analysis.statistics.contrast_table import AGENT_NAMES, SUMMARY_MEASURE
from baldwinlab.analysis.statistics.numbers import format_number, format_p_value, format_signed
from baldwinlab.analysis.statistics.rules import SIGNIFICANCE_LEVEL
from baldwinlab.analysis.sweeps import analysis
from baldwinlab.analysis.sweeps.analysis import Response
from baldwinlab.experiment.outcome import name_outcome_of


def describe_effects(finals: xr.Dataset) -> Iterator[str]:
    """Yield sentences on a sweep whose points are not compared with each other."""
    if analysis.is_sampled(finals):
        yield from _describe_correlations(finals)
    else:
        yield "This report compares no points by a test."


def _describe_correlations(finals: xr.Dataset) -> Iterator[str]:
    correlations = [
        correlation
        for correlation in analysis.compute_correlations(finals)
        if correlation.measure == SUMMARY_MEASURE and correlation.p_holm < SIGNIFICANCE_LEVEL
    ]
    for correlation in correlations:
        yield (
            f"{correlation.field} is correlated with {_name_outcome(finals)}: rank correlation "
            f"{format_signed(correlation.rho)}, corrected p {format_p_value(correlation.p_holm)}, "
            f"{correlation.points} points."
        )
    if not correlations:
        yield (
            f"No field of numbers has a significant rank correlation with {_name_outcome(finals)}."
        )


def _name_outcome(finals: xr.Dataset) -> str:
    return name_outcome_of(fitness.outcome(finals), AGENT_NAMES[SUMMARY_MEASURE])


def describe_ranges(finals: xr.Dataset) -> Iterator[str]:
    """Yield the lowest and the highest mean by each field, with intervals."""
    for field in finals.attrs["fields"]:
        responses = [
            response
            for response in analysis.compute_responses(finals, field, SUMMARY_MEASURE)
            if np.isfinite(response.mean)
        ]
        if len(responses) > 1:
            lowest = min(responses, key=attrgetter("mean"))
            highest = max(responses, key=attrgetter("mean"))
            yield (
                f"By {field}, the mean of {_name_outcome(finals)} is between "
                f"{_format_response(lowest)} and {_format_response(highest)}."
            )


def _format_response(response: Response) -> str:
    interval = ""
    if np.isfinite(response.low):
        interval = f" [{format_number(response.low)}, {format_number(response.high)}]"
    return f"{format_number(response.mean)}{interval} ({response.group})"
