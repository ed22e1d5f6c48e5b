"""Experiments by name: the presets of the papers, and experiment files.

A preset is named CONDITION/MAP or CONTROL/MAP, such as `evo+self-taught/B`; a variant is one more layer. Where two papers have a
name, it is the first one's, and PAPER:NAME is that of another; PAPER may be the folder of a user's own.

An experiment file is TOML. Its key `base` names a preset or another experiment file, whose fields it changes. Without `base` it
changes the defaults of its model. Its stem is the name of the experiment unless it gives one.
"""

from __future__ import annotations

import re
import warnings
from pathlib import Path
from typing import Any, Final, NamedTuple

from baldwinlab import papers
from baldwinlab.core.files import EXPERIMENT_FILE, read_text
from baldwinlab.core.suggestions import suggest
from baldwinlab.experiment import (
    BaseExperiment,
    Experiment,
    ExperimentError,
    registry,
    validate,
)
from baldwinlab.experiment.factors import Factors
from baldwinlab.experiment.toml import faults_in, parse_tree
from baldwinlab.papers.paper import KINDS, STANDARD, Paper

__all__ = ["KINDS", "changes", "describe", "factors", "load", "names", "paper"]


def names(kind: str) -> list[str]:
    """The presets of a kind (one of `KINDS`) of all papers, the standard variant first."""
    return list(
        dict.fromkeys(name for one in papers.built_in().values() for name in one.names(kind))
    )


def describe(kind: str, name: str) -> str:
    """What a preset is, in a line."""
    return _having(kind, name).describe(kind, name)


def changes(variant: str) -> dict[str, Any]:
    """The fields that a variant sets, as `Experiment.replace` takes them. Raises ExperimentError for an unknown one."""
    return _having("variants", variant).changes("variants", variant)


def _having(kind: str, name: str) -> Paper:
    return next(
        (one for one in papers.built_in().values() if name in one.names(kind)), papers.load()
    )


MOST_BASES: Final = 20  # files that are based on each other
ALL_NAMES: Final = "`baldwinlab list presets` lists all; an experiment file ends in .toml"


class Loaded(NamedTuple):
    """An experiment, and the one that its author changed: the preset, the base of its file, or None for the defaults."""

    experiment: Any
    origin: BaseExperiment | None = None


def load(experiment: str | Path, variant: str = STANDARD) -> Experiment:
    """An experiment by the name of a preset (`evo+self-taught/B`) or of a model that is a part, or from a TOML file.

    `variant` lays one of the named variants of the paper over it. Raises ExperimentError when there is no such preset, file
    or variant, or when the file's experiment is not valid.
    """
    loaded: Experiment = load_with_origin(experiment, variant).experiment
    return loaded


def load_with_origin(experiment: str | Path, variant: str = STANDARD) -> Loaded:
    """Load as `load` does, and return the origin of the experiment, too."""
    if not is_file(experiment):
        preset = _load_preset(str(experiment), variant)
        return Loaded(preset, preset)
    loaded = _load_file(Path(experiment))
    return loaded._replace(experiment=loaded.experiment.replace(**changes(variant)))


def is_file(experiment: str | Path) -> bool:
    """Return whether what names an experiment is a file and not a preset."""
    return str(experiment).endswith(".toml")


def _load_preset(text: str, variant: str) -> Experiment:
    named, _, name = text.rpartition(":")
    if named:
        return papers.load(named).experiment(name, variant)
    if text in registry.names("model") and text not in registry.BUILT_IN["model"]:
        made: Experiment = validate({"model": text})
        return made
    having = [one for one in papers.built_in().values() if name in one.experiment_names()]
    if not having:
        raise _unknown(name)
    if variant in (STANDARD, *having[0].names("variants")):
        return having[0].experiment(name, variant)
    return having[0].experiment(name).replace(**changes(variant))


def _unknown(name: str) -> ExperimentError:
    """What to say of a name that no paper has, by the half of it that is wrong."""
    for one in papers.built_in().values():
        if one.lacks_map(name):
            return one.missing_map(name)
    known = factors()
    learner, slash, place = name.rpartition("/")
    maps = sorted({of.map for of in known.values() if of.map and of.learner == learner})
    if slash and maps:
        return ExperimentError(f"there is no map {place!r} of {learner}{suggest(place, maps)}")
    if slash:
        learners = sorted({of.learner for of in known.values() if of.map})
        return ExperimentError(
            f"there is no condition {learner!r}{suggest(learner, learners)}; {ALL_NAMES}"
        )
    return ExperimentError(f"there is no preset {name!r}{suggest(name, known)}; {ALL_NAMES}")


def factors() -> dict[str, Factors]:
    """Learner and map of every preset, by the name that `load` takes and gives it."""
    found: dict[str, Factors] = {}
    for one in papers.built_in().values():
        for name, of in one.factors().items():
            found.setdefault(name, of)
    return found


def _load_file(path: Path, files: tuple[Path, ...] = ()) -> Loaded:
    """Read an experiment file; `files` are the files that are based on it, one on the other."""
    try:
        content = read_text(path, EXPERIMENT_FILE)
    except (OSError, ValueError) as error:
        reason = error.strerror if isinstance(error, OSError) else error
        raise ExperimentError(f"cannot read {path}: {reason}") from None
    tree = {"name": _name_of_file(path), **parse_tree(content, str(path))}
    base = tree.pop("base", None)
    if base is not None:
        origin = _load_base(base, path, (*files, path))
        if tree.get("model", origin.model) != origin.model:
            raise ExperimentError(
                f"{path}: model = {tree['model']!r}: the base {base!r} is of the model {origin.model!r}; "
                "remove model, or choose another base"
            )
        with faults_in(str(path)):
            return Loaded(origin.replace(**tree), origin)
    with faults_in(str(path)):
        made: Experiment = validate(tree)
    if isinstance(made, Experiment) and "food" not in tree.get("world", {}):
        _warn_of_missing_food(made, path)
    return Loaded(made)


def _load_base(base: Any, path: Path, files: tuple[Path, ...]) -> Experiment:
    """Load the base that a file names: a preset, or a file whose path is relative to that file."""
    where = f"{path}: base = {base!r}"
    if not isinstance(base, str):
        raise ExperimentError(f"{where}: must be the name of a preset or of a TOML file")
    if not is_file(base):
        paper, colon, name = base.rpartition(":")
        inside = path.parent / paper
        with faults_in(where):
            return _load_preset(f"{inside}:{name}" if colon and inside.is_dir() else base, STANDARD)
    below = path.parent / base
    if below.resolve() in [file.resolve() for file in files]:
        chain = " -> ".join(str(file) for file in (*files, below))
        raise ExperimentError(f"{where}: the bases form a cycle: {chain}")
    if len(files) > MOST_BASES:
        raise ExperimentError(f"{where}: more than {MOST_BASES} files are based on each other")
    with faults_in(where):
        origin: Experiment = _load_file(below, files).experiment
    return origin


def _name_of_file(path: Path) -> str:
    """Return the stem of a file as a name of a condition."""
    return re.sub(r"^[^A-Za-z0-9]+|[^A-Za-z0-9+_.-]+", "-", path.stem).strip("-") or "experiment"


def _warn_of_missing_food(experiment: Experiment, path: Path) -> None:
    if not experiment.world.food and not experiment.world.features:
        warnings.warn(
            f"{path}: the world has no food, because the file has neither base nor world.food; "
            'start from a preset with base = "evo/A", or write food = [] in [world]',
            UserWarning,
            stacklevel=2,
        )


def paper(variant: str = STANDARD) -> list[Experiment]:
    """The six conditions of the paper that baldwinlab began with."""
    return papers.load().experiments(variant)
