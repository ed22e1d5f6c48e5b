"""Pages in one HTML file with stored results and recorded lifetimes, which need no engine.

They show studies that a browser cannot simulate, such as those of several species.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any, Final

import numpy as np
import numpy.typing as npt

from baldwinlab._version import __version__
from baldwinlab.api.study import Study
from baldwinlab.core.deferred import xr
from baldwinlab.experiment import BaseExperiment, Experiment
from baldwinlab.lab import single_page
from baldwinlab.lab.notebook_player import make_panel
from baldwinlab.studies.store import StudyStore

# Largest number of lifetimes next to each other.
MAX_PANELS: Final = 3


def render_stored_page(store: StudyStore) -> bytes:
    """Return a page with the fitness of each species, and a lifetime of each condition.

    The lifetimes are those of the first stored run, in its last generation.

    Parameters
    ----------
    store
        The directory of a study.

    Raises
    ------
    StudyError
        The study has no stored run.
    PartError
        A custom part of the study is not loaded.
    """
    store.require_runs()
    study = Study(store)
    stored_runs = {name: store.runs(name) for name in study.conditions}
    conditions = [name for name, runs in stored_runs.items() if runs]
    experiments = [study.experiment(name) for name in conditions]
    replayed = [
        name
        for name, experiment in zip(conditions, experiments, strict=True)
        if isinstance(experiment, Experiment)
    ][:MAX_PANELS]
    panels = [
        make_panel(_replay_last_generation(study, name, min(stored_runs[name])))
        for name in replayed
    ]
    rows = [
        row
        for name, experiment in zip(conditions, experiments, strict=True)
        for row in _summarize(study.data([name]).sel(condition=name), name, experiment)
    ]
    title = study.directory.name
    return single_page.render_page(
        "stored.html",
        single_page.REPLAY_MODULE,
        (*single_page.REPLAY_STYLES, "stored_page.css"),
        title=title,
        note=_describe_limits(conditions, replayed),
        rows=rows,
        replay={"version": __version__, "step": 0, "panels": panels},
    )


def _describe_limits(conditions: Sequence[str], replayed: Sequence[str]) -> str:
    """Return the sentences on what the page leaves out."""
    note = (
        "A browser cannot simulate several species, so this page has the stored results and "
        "recorded lifetimes, and no new runs."
    )
    hidden = [name for name in conditions if name not in replayed]
    return f"{note} Lifetimes of {', '.join(hidden)} are left out." if hidden else note


def _replay_last_generation(study: Study, condition: str, run: int) -> xr.Dataset:
    """Return the trace of the last generation of a stored run."""
    energy = study.data([condition]).sel(condition=condition, run=run)["energy"]
    generation = int(energy.notnull().any("agent").sum()) - 1
    return study.replay(condition, run=run, generation=generation)


def _summarize(
    data: xr.Dataset, condition: str, experiment: BaseExperiment
) -> Iterator[dict[str, Any]]:
    """Yield the row of each species: its mean fitness in the first and in the last generation."""
    energy = data["energy"].transpose("run", "generation", "agent").values
    is_stored = np.isfinite(energy).any(axis=2)
    runs = np.flatnonzero(is_stored.any(axis=1))
    last_generations = is_stored[runs].sum(axis=1) - 1
    first = energy[runs, 0]
    last = energy[runs, last_generations]
    names = [entry.name for entry in experiment.population.species] or ["all agents"]
    species = np.zeros_like(energy)
    if "species" in data:
        species = data["species"].transpose("run", "generation", "agent").values
    for index, name in enumerate(names):
        is_first = species[runs, 0] == index
        is_last = species[runs, last_generations] == index
        yield {
            "condition": condition,
            "species": name,
            "n_runs": len(runs),
            "first": _format_mean(first, is_first),
            "last": _format_mean(last, is_last),
            "n_agents": f"{is_last.sum(axis=1).mean():.4g}",
        }


def _format_mean(values: npt.NDArray[np.float64], is_selected: npt.NDArray[np.bool_]) -> str:
    """Return the mean over the selected agents of each run, then over the runs with such agents."""
    means = [
        run[selected].mean()
        for run, selected in zip(values, is_selected, strict=True)
        if selected.any()
    ]
    return f"{np.mean(means):.4g}" if means else "no agents"
