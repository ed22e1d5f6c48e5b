"""Experiments by name: the presets of the papers, or files of one's own.

A preset is named CONDITION/MAP or CONTROL/MAP, such as `evo+self-taught/B`; a reading is one more layer. Where two papers have a
name, it is the first one's, and PAPER:NAME is that of another; PAPER may be the folder of a user's own.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

from baldwinlab import papers
from baldwinlab.experiment import Experiment, ExperimentError, choices, validate
from baldwinlab.experiment.toml import from_toml
from baldwinlab.factors import Factors
from baldwinlab.papers.paper import KINDS, STANDARD, Paper, nearest

__all__ = ["KINDS", "changes", "describe", "factors", "load", "names", "paper"]


def names(kind: str) -> list[str]:
    """The presets of a kind (one of `KINDS`) of all papers, the standard reading first."""
    return list(dict.fromkeys(name for one in papers.built_in().values() for name in one.names(kind)))


def describe(kind: str, name: str) -> str:
    """What a preset is, in a line."""
    return _having(kind, name).describe(kind, name)


def changes(reading: str) -> dict[str, Any]:
    """The fields that a reading sets, as `Experiment.replace` takes them. Raises ExperimentError for an unknown one."""
    return _having("readings", reading).changes("readings", reading)


def _having(kind: str, name: str) -> Paper:
    return next((one for one in papers.built_in().values() if name in one.names(kind)), papers.load())


def load(experiment: str | Path, reading: str = STANDARD) -> Experiment:
    """An experiment by the name of a preset (`evo+self-taught/B`) or of a model that is a part, or from a TOML file.

    `reading` lays one of the named readings of the paper over it. Raises ExperimentError when there is no such preset, file
    or reading, or when the file's experiment is not valid.
    """
    text = str(experiment)
    if text.endswith(".toml"):
        return _load_file(Path(experiment), reading)
    named, _, name = text.rpartition(":")
    if named:
        return papers.load(named).experiment(name, reading)
    if text in choices.names("model") and text not in choices.BUILT_IN["model"]:
        made: Experiment = validate({"model": text})
        return made
    having = [one for one in papers.built_in().values() if name in one.experiment_names()]
    if not having:
        raise _unknown(name)
    if reading in (STANDARD, *having[0].names("readings")):
        return having[0].experiment(name, reading)
    return having[0].experiment(name).replace(**changes(reading))


def _unknown(name: str) -> ExperimentError:
    """What to say of a name that no paper has, by the half of it that is wrong."""
    known = factors()
    learner, slash, place = name.rpartition("/")
    for half, asked in (("condition", learner), ("map", place)):
        there = sorted({of.learner if half == "condition" else of.map for of in known.values() if of.map})
        if slash and asked not in there:
            return ExperimentError(f"there is no {half} {asked!r}{nearest(asked, there)}; there are {', '.join(there)}")
    near = nearest(name, list(known))
    return ExperimentError(f"there is no preset {name!r}{near}; `baldwinlab presets` lists them; any .toml file is one, too")


def factors() -> dict[str, Factors]:
    """Learner and map of every preset, by the name that `load` takes and gives it."""
    found: dict[str, Factors] = {}
    for one in papers.built_in().values():
        for name, of in one.factors().items():
            found.setdefault(name, of)
    return found


def _load_file(path: Path, reading: str) -> Experiment:
    try:
        content = path.read_text("utf-8")
    except (OSError, UnicodeDecodeError) as error:
        reason = error.strerror if isinstance(error, OSError) else "it is not UTF-8 text"
        raise ExperimentError(f"cannot read {path}: {reason}") from None
    return from_toml(content, where=str(path)).replace(**changes(reading))


def paper(reading: str = STANDARD) -> list[Experiment]:
    """The six conditions of the paper that baldwinlab began with."""
    return papers.load().experiments(reading)
