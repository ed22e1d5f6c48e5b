"""The presets of a lab: the presets of all papers, and each custom model with its defaults."""

from __future__ import annotations

from collections.abc import Iterator
from functools import cache
from threading import Lock
from typing import Any

from baldwinlab import papers
from baldwinlab.core.names import suggest
from baldwinlab.experiment import BaseExperiment, Experiment, registry
from baldwinlab.experiment.conditions import Factors
from baldwinlab.lab import Lab, MissingError, Query, read_text
from baldwinlab.papers import presets

# A thread that loads the presets holds this lock, so that two threads do not load them twice.
_LOADING = Lock()


def read_preset(lab: Lab, query: Query) -> dict[str, Any]:
    """Return the settings of a preset."""
    settings: dict[str, Any] = load_preset(read_text(query, "name")).to_dict()
    return settings


def choose_default_preset() -> str:
    """Return the preset that the form shows first: the first paper's main condition and map."""
    paper = papers.load()
    learner = paper.factors()[paper.metadata.emergence].learner
    first_map = paper.names("maps")[0]
    return f"{learner}/{first_map}"


@cache
def _list_paper_presets(names: tuple[str, ...]) -> list[dict[str, Any]]:
    """Return the entries of the papers' presets for the page. Loading the presets takes seconds.

    `names`: the names of all of these presets, as the key of the cache.
    """
    factors_by_name = presets.factors()
    main_condition = papers.load().metadata.emergence
    titles = {
        name: f"{paper.metadata.authors[0]}, {paper.metadata.year}"
        # A name that several papers use keeps the last value, here that of the first paper.
        for paper in reversed(papers.built_in().values())
        for name in paper.experiment_names()
    }
    described = []
    for name in names:
        factors = factors_by_name[name]
        experiment = presets.load(name)
        described.append(
            {
                "name": name,
                "learner": factors.learner,
                "map": factors.map,
                "paper": titles[name],
                "description": "; ".join(_list_descriptions(factors)),
                "learns": experiment.learns,
                "shown": name == main_condition,
                "world": _describe_recording_size(experiment),
            }
        )
    return described


def list_presets() -> list[dict[str, Any]]:
    """Return the presets of all papers, then all custom models with their defaults."""
    custom_models = [
        (name, part) for (kind, name), part in registry.custom_parts().items() if kind == "model"
    ]
    presets_of_models = [
        {
            "name": name,
            "learner": name,
            "map": "",
            "paper": "custom models",
            "description": (part.__doc__ or "").partition("\n")[0],
            "world": None,
        }
        for name, part in custom_models
    ]
    # `baldwinlab lab` loads the presets on another thread. A request then waits for that thread.
    with _LOADING:
        presets_of_papers = _list_paper_presets(tuple(presets.factors()))
    return presets_of_papers + presets_of_models


def _find_learner_kind(learner: str) -> str:
    return "conditions" if learner in presets.names("conditions") else "controls"


def _list_descriptions(factors: Factors) -> Iterator[str]:
    yield presets.describe(_find_learner_kind(factors.learner), factors.learner)
    if factors.map:
        yield presets.describe("maps", factors.map)


def _describe_recording_size(experiment: BaseExperiment) -> dict[str, int] | None:
    """Return the size of the world's recordings, or None if the model has no world."""
    if not isinstance(experiment, Experiment):
        return None
    return {
        "generations": experiment.evolution.generations,
        "agents": experiment.agents_per_world,
        "steps": experiment.lifetime.steps,
    }


def load_preset(name: str) -> Experiment:
    """Return a listed preset. Raise MissingError for another name.

    `presets.load` alone would also read an experiment file of this name.
    """
    preset_names = [preset["name"] for preset in list_presets()]
    if name not in preset_names:
        raise MissingError(f"there is no preset {name!r}{suggest(name, preset_names)}")
    return presets.load(name)
