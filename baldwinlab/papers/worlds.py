"""The world of a condition, and the name of its map: both are derived from the settings.

Conditions of a study are compared only in the same world (`Factors.world`), so that a difference
is not one of two maps or models. For MiniWorld, the world is the table `world`. For another model,
it is the model with the settings that the maps of the built-in papers change. `Factors.map` is the
name that tables show: "A", "your map", or "" for a model without maps.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterable, Mapping
from functools import cache
from typing import Any

from baldwinlab import papers
from baldwinlab.experiment import BaseExperiment, Experiment
from baldwinlab.experiment.conditions import YOUR_MAP, Factors
from baldwinlab.experiment.file import iterate_file_tables
from baldwinlab.papers import presets
from baldwinlab.papers.design import join_map
from baldwinlab.papers.paper import Paper


def name_maps(
    experiments: Mapping[str, BaseExperiment], factors: Mapping[str, Factors], paper: str = ""
) -> dict[str, Factors]:
    """Return the factors of conditions, with the world and with the map of the same settings.

    `factors`: the factors from the names of the presets, or of a study of the paper `paper`. A map
    that is not of a built-in paper is "your map", and a further one "your map 2". Custom papers,
    papers without maps, and variants keep their names.
    """
    named = {name: factors.get(name, Factors()) for name in experiments}
    own_maps: dict[str, str] = {}  # Name by world.
    for name, levels in named.items():
        model = experiments[name].model
        settings = _describe_world(experiments[name])
        digest = hashlib.sha256(settings.encode()).hexdigest()[:16]
        named[name] = levels._replace(world=f"{model} {digest}")
        is_named_by_paper = paper and (paper not in papers.built_in() or not levels.map)
        if not settings or levels.variant or is_named_by_paper:
            continue
        # Most conditions have the map of their preset. The other maps are not loaded for them.
        if known_maps := _list_known_maps(model, levels.map):
            number = f" {len(own_maps) + 1}" if own_maps else ""
            map_name = known_maps.get(settings) or _list_known_maps(model).get(settings)
            map_name = map_name or own_maps.setdefault(settings, YOUR_MAP + number)
            named[name] = named[name]._replace(map=map_name)
    return named


def find_factors(experiments: Iterable[BaseExperiment]) -> dict[str, Factors]:
    """Return the factors of experiments by name, from the presets and from the settings."""
    by_name = {experiment.name: experiment for experiment in experiments}
    return name_maps(by_name, presets.factors())


@cache
def _list_known_maps(model: str, map_name: str = "") -> dict[str, str]:
    """Return the names of the maps of built-in papers by world: of all, or only `map_name`.

    The world of a MiniWorld paper without maps has the name of the paper.
    """
    known_maps: dict[str, str] = {}
    for paper, conditions in _list_conditions(model):
        # One condition per map is enough, because a condition does not change the map.
        names = {join_map(conditions[0], name): name for name in paper.names("maps")}
        for name, title in (names or dict.fromkeys(conditions, paper.name)).items():
            if map_name in ("", title):
                known_maps.setdefault(_describe_world(paper.experiment(name)), title)
    return known_maps


@cache
def _list_conditions(model: str) -> list[tuple[Paper, list[str]]]:
    """Return each built-in paper of a model with its conditions of this model."""
    found = []
    for paper in papers.built_in().values():
        models = {
            name: paper.changes("conditions", name).get("model", "miniworld")
            for name in paper.names("conditions")
        }
        if conditions := [name for name in models if models[name] == model]:
            found.append((paper, conditions))
    return found


def _describe_world(experiment: BaseExperiment) -> str:
    """Return the settings of the world as text, by first generation; "" without maps."""
    worlds: dict[int, object] = {}
    for generations, segment in experiment.segments():
        settings = _select_world(segment)
        if settings and settings not in list(worlds.values())[-1:]:
            worlds[generations.start] = settings
    return json.dumps(worlds) if worlds else ""


def _select_world(experiment: BaseExperiment) -> dict[str, Any]:
    """Return the settings of the world, without those in which the learners of a map can differ."""
    tree = experiment.to_dict()
    for _, table in iterate_file_tables(tree):
        table["path"] = ""  # A study has a copy of the file, with the same checksum.
    if isinstance(experiment, Experiment):
        start = tree["world"]["start"] | {"headings": ""}
        world: dict[str, Any] = tree["world"] | {"start": start}
        return world
    paths = _list_map_settings(experiment.model)
    return {f"{table}.{field}": tree[table][field] for table, field in paths}


@cache
def _list_map_settings(model: str) -> list[tuple[str, str]]:
    """Return the table and field of each setting that a map of a built-in paper changes."""
    settings = {
        (table, field)
        for paper, _ in _list_conditions(model)
        for map_name in paper.names("maps")
        for table, fields in paper.changes("maps", map_name).items()
        for field in fields
    }
    return sorted(settings)
