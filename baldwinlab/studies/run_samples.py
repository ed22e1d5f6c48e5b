"""Samples of the runs of large studies, so that reports and assays need a limited memory."""

from __future__ import annotations

from typing import Final

import numpy as np

from baldwinlab.studies.store import StudyStore

# Maximum number of runs of a condition in a report or an assay.
MAX_SAMPLED_RUNS: Final = 10_000
# A smaller number of runs is never sampled.
MIN_SAMPLED_RUNS: Final = 100
# Maximum size of one variable of the sampled runs of all conditions, in bytes.
MAX_SAMPLED_BYTES: Final = 2**30
_BYTES_PER_VALUE: Final = 4


def sample_runs(study: StudyStore, condition: str) -> list[int]:
    """Return the sorted numbers of the runs of a condition that a report or an assay uses.

    These are all stored runs, or a random sample if they are too many. The sample depends only on
    the stored runs and on the seed of the study.

    Returns at most `MAX_SAMPLED_RUNS` runs, and fewer if one variable of all conditions would have
    more than `MAX_SAMPLED_BYTES`, but at least `MIN_SAMPLED_RUNS` if they are stored.
    """
    runs = study.runs(condition)
    limit = count_sampled_runs(study)
    if len(runs) <= limit:
        return runs
    sample = np.random.default_rng(study.seed).choice(runs, limit, replace=False)
    return sorted(sample.tolist())


def count_sampled_runs(study: StudyStore) -> int:
    """Return the maximum number of runs of a condition in a report or an assay."""
    values_per_run = sum(
        experiment.evolution.generations * experiment.population.size
        for experiment in study.experiments.values()
    )
    limit = MAX_SAMPLED_BYTES // (_BYTES_PER_VALUE * values_per_run)
    return min(MAX_SAMPLED_RUNS, max(MIN_SAMPLED_RUNS, limit))


def describe_sample(study: StudyStore) -> str:
    """Return the sample of a study as a phrase, "" if all runs are used."""
    n_stored = max((len(study.runs(condition)) for condition in study.experiments), default=0)
    limit = count_sampled_runs(study)
    if n_stored <= limit:
        return ""
    return (
        f"a random sample of {limit:,} of the {n_stored:,} stored runs of a condition, drawn with "
        "the seed of the study"
    )


def format_sample_sentence(study: StudyStore) -> str:
    """Return a sentence for a command that evaluates a sample of a study, else ""."""
    sample = describe_sample(study)
    return f"The statistics use {sample}." if sample else ""
