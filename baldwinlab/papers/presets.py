"""Experiments by name: presets of the papers, and experiment files.

The name of a preset is CONDITION/MAP or CONTROL/MAP, such as `evo+self-taught/B`. A variant changes
further settings. If two papers have a preset of the same name, the name selects the preset of the
first paper. PAPER:NAME selects the preset of any paper. PAPER is the name of a built-in paper, or
the folder of a custom paper.

An experiment file is TOML. The key `base` names a preset or another experiment file, and the other
keys change its settings. Without `base`, the file changes the defaults of the model. Without the
key `name`, the name of the experiment is the name of the file.
"""

from __future__ import annotations

import re
import warnings
from itertools import chain
from pathlib import Path
from typing import Any, Final, NamedTuple

from baldwinlab import papers
from baldwinlab.core.files import EXPERIMENT_FILE, read_text
from baldwinlab.core.names import read_stem, suggest
from baldwinlab.experiment import (
    BaseExperiment,
    Experiment,
    ExperimentError,
    registry,
    validate,
)
from baldwinlab.experiment.conditions import Factors
from baldwinlab.experiment.file import find_files
from baldwinlab.experiment.toml import name_source_in_errors, parse_tree
from baldwinlab.papers.paper import PRESET_KINDS, STANDARD_VARIANT, Paper

__all__ = ["PRESET_KINDS", "changes", "describe", "factors", "load", "names", "paper"]


# Maximum number of files in a chain in which each file is the base of the next.
MAX_BASES: Final = 20
LIST_HINT: Final = "`baldwinlab list presets` lists all; an experiment file ends in .toml"


def names(kind: str) -> list[str]:
    """Return the names of the presets of a kind (one of `PRESET_KINDS`), paper by paper."""
    names_by_paper = [paper.names(kind) for paper in papers.built_in().values()]
    # A dict holds each name once, in order.
    return list(dict.fromkeys(chain.from_iterable(names_by_paper)))


def describe(kind: str, name: str) -> str:
    """Return the description of a preset on one line."""
    return _find_paper(kind, name).describe(kind, name)


def changes(variant: str) -> dict[str, Any]:
    """Return the settings that a variant changes, as the arguments of `Experiment.replace`.

    Raises ExperimentError if the variant does not exist.
    """
    return _find_paper("variants", variant).changes("variants", variant)


def _find_paper(kind: str, name: str) -> Paper:
    """Return the first paper that has a preset, or the default paper without such a paper."""
    candidates = papers.built_in().values()
    return next((paper for paper in candidates if name in paper.names(kind)), papers.load())


class LoadedExperiment(NamedTuple):
    """An experiment, and the origin with which the settings of a user are compared."""

    experiment: Any
    # The preset, or the base of the experiment file. None if the file changes the defaults.
    origin: BaseExperiment | None = None


def load(experiment: str | Path, variant: str = STANDARD_VARIANT) -> Experiment:
    """Return an experiment by its name or from a file.

    `experiment`: a preset, such as "evo+self-taught/B" or "PAPER:NAME"; the name of a custom model;
    or a file that ends in .toml.
    """
    loaded: Experiment = load_with_origin(experiment, variant).experiment
    return loaded


def load_with_origin(experiment: str | Path, variant: str = STANDARD_VARIANT) -> LoadedExperiment:
    """Return an experiment and its origin. The arguments are those of `load`."""
    if not is_file(experiment):
        preset = _load_preset(str(experiment), variant)
        return LoadedExperiment(preset, preset)
    loaded = _load_file(Path(experiment))
    return loaded._replace(experiment=loaded.experiment.replace(**changes(variant)))


def is_file(experiment: str | Path) -> bool:
    """Return whether a text is the path of an experiment file, not the name of a preset."""
    return str(experiment).endswith(".toml")


def _load_preset(text: str, variant: str) -> Experiment:
    paper_name, _, name = text.rpartition(":")
    if paper_name:
        return papers.load(paper_name).experiment(name, variant)
    if text in registry.names("model") and text not in registry.BUILT_IN["model"]:
        experiment: Experiment = validate({"model": text})
        return experiment
    candidates = [paper for paper in papers.built_in().values() if name in paper.experiment_names()]
    if not candidates:
        raise _unknown_name_error(name)
    if variant in (STANDARD_VARIANT, *candidates[0].names("variants")):
        return candidates[0].experiment(name, variant)
    return candidates[0].experiment(name).replace(**changes(variant))


def _unknown_name_error(name: str) -> ExperimentError:
    """Return the error for an unknown name, which says whether condition or map is unknown."""
    for candidate in papers.built_in().values():
        if candidate.lacks_map(name):
            return candidate.missing_map_error(name)
    presets = factors()
    learner, slash, map_name = name.rpartition("/")
    maps = sorted(
        {preset.map for preset in presets.values() if preset.map and preset.learner == learner}
    )
    if slash and maps:
        return ExperimentError(
            f"there is no map {map_name!r} of {learner}{suggest(map_name, maps)}"
        )
    if slash:
        learners = sorted({preset.learner for preset in presets.values() if preset.map})
        return ExperimentError(
            f"there is no condition {learner!r}{suggest(learner, learners)}; {LIST_HINT}"
        )
    return ExperimentError(f"there is no preset {name!r}{suggest(name, presets)}; {LIST_HINT}")


def factors() -> dict[str, Factors]:
    """Return the learner and the map of every preset, by the name that `load` accepts."""
    by_name: dict[str, Factors] = {}
    for candidate in papers.built_in().values():
        for name, factors_of_preset in candidate.factors().items():
            by_name.setdefault(name, factors_of_preset)
    return by_name


def _load_file(path: Path, derived_files: tuple[Path, ...] = ()) -> LoadedExperiment:
    """Read an experiment file. `derived_files` have this file as a base, directly or indirectly."""
    try:
        content = read_text(path, EXPERIMENT_FILE)
    except (OSError, ValueError) as error:
        reason = error.strerror if isinstance(error, OSError) else error
        raise ExperimentError(f"cannot read {path}: {reason}") from None
    tree = {"name": _derive_name(path), **parse_tree(content, str(path))}
    # A study has copies of its data files. One of the folders above this file can be a study.
    find_files(tree, path.absolute().parents)
    base = tree.pop("base", None)
    if base is not None:
        origin = _load_base(base, path, (*derived_files, path))
        if tree.get("model", origin.model) != origin.model:
            raise ExperimentError(
                f"{path}: model = {tree['model']!r}: the base {base!r} is of the model "
                f"{origin.model!r}; remove model, or choose another base"
            )
        with name_source_in_errors(str(path)):
            return LoadedExperiment(origin.replace(**tree), origin)
    with name_source_in_errors(str(path)):
        experiment: Experiment = validate(tree)
    if isinstance(experiment, Experiment) and "food" not in tree.get("world", {}):
        _warn_of_missing_food(experiment, path)
    return LoadedExperiment(experiment)


def _load_base(base: Any, path: Path, derived_files: tuple[Path, ...]) -> Experiment:
    """Load the base of the file `path`: a preset, or a file with a path relative to `path`."""
    location = f"{path}: base = {base!r}"
    if not isinstance(base, str):
        raise ExperimentError(f"{location}: must be the name of a preset or of a TOML file")
    if not is_file(base):
        paper_name, colon, name = base.rpartition(":")
        folder = path.parent / paper_name
        is_custom_paper = bool(colon) and folder.is_dir()
        with name_source_in_errors(location):
            return _load_preset(f"{folder}:{name}" if is_custom_paper else base, STANDARD_VARIANT)
    base_path = path.parent / base
    if base_path.resolve() in [file.resolve() for file in derived_files]:
        cycle = " -> ".join(str(file) for file in (*derived_files, base_path))
        raise ExperimentError(f"{location}: the bases form a cycle: {cycle}")
    if len(derived_files) > MAX_BASES:
        raise ExperimentError(f"{location}: more than {MAX_BASES} files are based on each other")
    with name_source_in_errors(location):
        origin: Experiment = _load_file(base_path, derived_files).experiment
    return origin


def _derive_name(path: Path) -> str:
    """Return a valid name of a condition, made from the name of a file."""
    name = re.sub(r"^[^A-Za-z0-9]+|[^A-Za-z0-9+_.-]+", "-", read_stem(path))
    return name.strip("-") or "experiment"


def _warn_of_missing_food(experiment: Experiment, path: Path) -> None:
    if not experiment.world.food and not experiment.world.features:
        warnings.warn(
            f"{path}: the world has no food, because the file has neither base nor world.food; "
            'start from a preset with base = "evo/A", or write food = [] in [world]',
            UserWarning,
            stacklevel=2,
        )


def paper(variant: str = STANDARD_VARIANT) -> list[Experiment]:
    """Return the six conditions of the default paper, le-2019."""
    return papers.load().experiments(variant)
