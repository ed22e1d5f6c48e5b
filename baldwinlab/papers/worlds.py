"""The world of a condition: it is derived from the settings, not from a name.

Conditions of a study are compared only in the same world, and `Factors.map` names the world. For
MiniWorld, the world is the table `world`. For another model, it is the settings that the maps of
the built-in papers change. A model without maps has one world.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from functools import cache
from typing import Any

from baldwinlab import papers
from baldwinlab.experiment import BaseExperiment, Experiment
from baldwinlab.experiment.conditions import YOUR_MAP, Factors
from baldwinlab.experiment.file import iterate_file_tables
from baldwinlab.papers.design import join_map
from baldwinlab.papers.paper import Paper


def name_maps(
    experiments: Mapping[str, BaseExperiment], factors: Mapping[str, Factors], paper: str = ""
) -> dict[str, Factors]:
    """Return the factors of conditions, with the name of the map that has the same settings.

    `factors`: the factors from the names of the presets, or of a study of the paper `paper`. A map
    that is not of a built-in paper is "your map", and a further one "your map 2". The maps of a
    custom paper, and those of variants, keep their names.
    """
    named = {name: factors.get(name, Factors()) for name in experiments}
    if paper and paper not in papers.built_in():
        return named
    has_models = len({experiment.model for experiment in experiments.values()}) > 1
    own_maps: dict[str, str] = {}  # Name by world.
    for name, levels in named.items():
        model = experiments[name].model
        is_custom = bool(levels.map) and levels.map not in _list_map_names(model)
        # A paper without maps, and a paper with variants, defines what is compared.
        if levels.variant or is_custom or (paper and not levels.map):
            continue
        map_name = model if has_models else ""
        world = _describe_world(experiments[name])
        if world and levels.map and _find_world(model, levels.map) == world:
            # Most conditions have the map of their preset. The other maps are not loaded for them.
            map_name = levels.map
        elif world:
            number = f" {len(own_maps) + 1}" if own_maps else ""
            known_name = _list_known_maps(model).get(world)
            map_name = known_name or own_maps.setdefault(world, YOUR_MAP + number)
        named[name] = levels._replace(map=map_name)
    return named


def _list_map_names(model: str) -> set[str]:
    """Return the names that the conditions of a model can have for a map of a built-in paper."""
    names = {name for paper, _ in _list_conditions(model) for name in paper.names("maps")}
    return names | {paper.name for paper, _ in _list_conditions(model)}


@cache
def _find_world(model: str, map_name: str) -> str:
    """Return the world of the first built-in paper with a map of this name, "" without one."""
    for paper, conditions in _list_conditions(model):
        if map_name in paper.names("maps"):
            return _describe_world(paper.experiment(join_map(conditions[0], map_name)))
    return ""


@cache
def _list_known_maps(model: str) -> dict[str, str]:
    """Return the names of the maps of all built-in papers of a model, by world.

    The world of a MiniWorld paper without maps has the name of the paper.
    """
    known_maps: dict[str, str] = {}
    for paper, conditions in _list_conditions(model):
        # One condition per map is enough, because a condition does not change the map.
        names = {join_map(conditions[0], name): name for name in paper.names("maps")}
        for name, map_name in (names or dict.fromkeys(conditions, paper.name)).items():
            if world := _describe_world(paper.experiment(name)):
                known_maps.setdefault(world, map_name)
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
